"""Benchmarks RPa and PbR: sliding joints on flexible links, all unknowns, the native solver beside the twin.

Both programs follow one manoeuvre, and each is compared with itself on the same mesh, converged in time: its error is that of its
steps. Each has the fewest steps that keep it below 1e-3 of the largest deflection: Exudyn the longest step that divides the
output step, the native solver the largest of a row of tolerances. The twin's hubs have one length, so that one run is enough for
it; the second run that takes their length out of its answer would take as long again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

import flexura as fx
from flexura import twin
from flexura.drive import Manoeuvre

from .manoeuvres import modest
from .sidebyside import Case, Result, native

FOLDER = Path(__file__).resolve().parents[2] / "model" / "robots"
MOVES_S = 0.4  # and as long again at rest


@dataclass(frozen=True)
class Choice:
    """How a robot is run: the twin's elements a link, hub length [m] and step [s]; the native tolerance and method."""

    elements: int
    hub_length_m: float
    step_s: float
    rtol: float
    method: str


CHOICES = {
    "type-2-rpa": Choice(8, 0.03, 4e-3 / 26, 3e-6, "auto"),
    "type-7-pbr": Choice(4, 0.10, 4e-3 / 30, 4e-4, "auto"),
}
ASKED, FINER = 50.0, 3


@cache
def work(name: str) -> tuple[fx.System, Manoeuvre]:
    """The robot and what it does."""
    system = fx.assemble(fx.load(FOLDER / f"{name}.toml"))
    return system, modest(system, MOVES_S)


def exudyn(name: str, finer: int = 1) -> Result:
    """The twin's run, or one with so many times the steps."""
    system, manoeuvre = work(name)
    chosen = CHOICES[name]
    run = twin.simulate(
        system.robot, manoeuvre.t, manoeuvre.drive, elements=chosen.elements, hub_length_m=chosen.hub_length_m,
        step_s=chosen.step_s / finer,
    )  # fmt: skip
    return Result(run.meta["wall_s"], np.array([run[f"link/{i}/tip_deflection"] for i in (1, 2)]))


def cases(name: str) -> list[Case]:
    """The twin and the native solver, each beside its own converged run."""
    system, manoeuvre = work(name)
    chosen = CHOICES[name]
    ours = partial(native, system, manoeuvre.t, manoeuvre.drive)
    return [
        Case("Exudyn twin", lambda: exudyn(name), lambda: exudyn(name, FINER).deflections, repeats=2),
        Case("native", partial(ours, chosen.rtol, chosen.method), cache(lambda: ours(1e-8).deflections), ASKED),
    ]
