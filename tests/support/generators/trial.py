"""What must hold of a generated robot: it is refused in a sentence, or its numbers are right, or
the run says that they are not."""

from __future__ import annotations

import re
import tempfile
import time
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

import flexura as fx
from flexura.signals import constant, harmonic

from .files import manoeuvre
from .robots import MATERIALS, robot

END, TIMES = 0.1, 21  # of a run [s], and its outputs
STEPS = 1500  # the budget of a run
SAME = 1e-3  # how far two methods may be apart
SLOW = 20.0  # s of processor time, beyond which a run must have said something


@dataclass
class Count:
    """How robots ended, what is wrong, and the seeds."""

    robots: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    slowest: tuple[float, str] = (0.0, "")

    def add(self, other: Count) -> Count:
        """Both counts in one."""
        self.robots += other.robots
        self.ends += other.ends
        self.refused += other.refused
        self.wrong += other.wrong
        self.slowest = max(self.slowest, other.slowest)
        return self

    def __str__(self) -> str:
        lines = [f"{self.robots} robots; slowest {self.slowest[0]:.1f} s ({self.slowest[1]})"]
        for name, counts in (("ended", self.ends), ("refused", self.refused)):
            lines += [f"  {name}: {text}: {n}" for text, n in counts.most_common()]
        return "\n".join([*lines, *(f"  WRONG {text}" for text in self.wrong)])


def drive(rng: np.random.Generator, made: fx.Robot) -> fx.Drive | None:
    """Nothing, or constant or harmonic forces that move the joints by some of their reach."""
    if rng.random() < 0.4:
        return None
    forces = []
    for link in made.links:
        reach = link.length_m or 1.0
        mass = _weight(made)
        size = mass * reach * (reach if link.joint.type == "R" else 1.0) * rng.uniform(0, 10)
        wave = harmonic(size, float(rng.uniform(0.5, 20)))
        forces.append(constant(size) if rng.random() < 0.5 else wave)
    return fx.Drive.force(*forces)


def _weight(made: fx.Robot) -> float:
    total = made.payload.mass_kg
    for link in made.links:
        own = link.mass_kg
        spread = None if own is not None else float(np.mean(link.mass_per_length(np.zeros(1))))
        total += link.joint.hub_mass_kg + (own if spread is None else spread * link.length_m)
    return float(total)


def trial(seed: int, odd: bool = False) -> Count:
    """One robot of a seed, judged."""
    return judge(np.random.default_rng([seed, odd]), odd, f"seed {seed}{', odd' if odd else ''}")


def judge(rng: Any, odd: bool, name: str, made: fx.Robot | None = None) -> Count:
    """A robot: built, its frequencies, its motion, all judged.

    Args:
        rng: that draws it, and what acts.
        odd: one of its numbers is off.
        name: of it in the output.
        made: a robot that is there already, which does a generated manoeuvre.
    """
    out, begun = Count(robots=1), time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            _try(rng, odd, out, name) if made is None else _manoeuvre(rng, made, out, name)
    except fx.FlexuraError as error:
        out.refused[kind_of(error)] += 1
        if not str(error).isprintable() or len(str(error)) > 600:
            out.wrong.append(f"{name}: the message {str(error)!r}")
    except Exception:
        last = traceback.format_exc().strip().splitlines()
        out.wrong.append(f"{name}: traceback: {' | '.join(last[-3:])}")
    out.slowest = (time.process_time() - begun, name)
    return out


def _try(rng: Any, odd: bool, out: Count, name: str) -> None:
    tables = robot(rng, odd)
    system = fx.assemble(fx.Robot.from_dict(tables))
    start = None
    try:
        found = fx.frequencies(system, count=3)
        if not (np.isfinite(found).all() and (found >= 0).all() and (np.diff(found) >= 0).all()):
            out.wrong.append(f"{name}: frequencies {found}")
    except fx.NoEquilibrium:
        out.ends["no equilibrium: started straight"] += 1
        start = "straight"
    t = np.linspace(0, END, TIMES)
    _run(out, name, system, t, drive(rng, system.robot), start)


def _manoeuvre(rng: Any, made: fx.Robot, out: Count, name: str) -> None:
    """A generated manoeuvre, at most 200 outputs of it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "manoeuvre.toml"
        path.write_text(tomli_w.dumps(manoeuvre(rng, len(made.links))))
        asked = fx.load_manoeuvre(path, len(made.links))
    _run(out, name, fx.assemble(made), asked.t[:200], asked.drive, asked.start)


def _run(out: Count, name: str, system: fx.System, t: Any, acting: Any, start: Any) -> None:
    begun = time.process_time()
    run = fx.simulate(system, t, acting, start=start, max_steps=STEPS)
    took = time.process_time() - begun
    out.wrong += [f"{name}: {text}" for text in faults_of(run, took)]
    out.ends[end_of(run)] += 1


def by_two_methods(seed: int) -> Count:
    """The motion by "auto" and by another method: channels apart by no more than SAME of the
    largest deflection and a thousandth of the tip's path, where both get to the end."""
    rng, out = np.random.default_rng([seed, 7]), Count(robots=1)
    try:
        system = fx.assemble(fx.Robot.from_dict(robot(rng) | {"stiffening": True}))
        acting, t = drive(rng, system.robot), np.linspace(0, END, TIMES)
        keys = {"start": "straight", "max_steps": 5 * STEPS}
        one = fx.simulate(system, t, acting, **keys)
        other = "implicit" if one.meta["method"] != "implicit" else "explicit"
        two = fx.simulate(system, t, acting, method=other, rtol=1e-8, **keys)
    except fx.FlexuraError as error:
        out.refused[kind_of(error)] += 1
        return out
    if not (one.complete and two.complete):
        out.ends["not both to the end"] += 1
        return out
    path = max(np.ptp(two["tip/x"]), np.ptp(two["tip/y"]))
    bent = [np.abs(two[n]).max() for n in two if n.endswith("tip_deflection")]
    scale = max([1e-3 * path, *bent, 1e-12])
    apart = max(np.abs(one[n] - two[n]).max() for n in ("tip/x", "tip/y")) / scale
    out.ends["both to the end"] += 1
    if not apart <= SAME:
        methods = f"{one.meta['method']}, {other}"
        out.wrong.append(f"seed {seed}: {methods} are {apart:.1e} apart")
    return out


def by_twin(seed: int) -> Count:
    """A short motion of one generated flexible link on a joint R, here and in Exudyn."""
    from flexura.twin import simulate as simulate_twin

    rng, out = np.random.default_rng([seed, 8]), Count(robots=1)
    length, height = float(10 ** rng.uniform(-1.5, 0.5)), 0.0
    height = length / float(10 ** rng.uniform(1.3, 2.3))
    modulus, density = MATERIALS[rng.integers(len(MATERIALS) - 1)]
    section = {"width_m": 5 * height, "height_m": height}
    mass = density * 5 * height**2 * length
    link = {
        "length_m": length,
        "elements": 4,
        "section": section,
        "young_modulus_Pa": modulus,
        "density_kg_m3": density,
        "joint": {"type": "R", "hub_inertia_kg_m2": 0.1 * mass * length**2},
    }
    made = fx.Robot.from_dict({"link": [link], "payload": {"mass_kg": mass * rng.uniform(0, 2)}})
    period = 1 / float(fx.frequencies(made, count=1)[0])
    t = np.linspace(0, 4 * period, 81)
    torque = 0.3 * mass * length**2 * 0.02 / period**2
    acting = fx.Drive.force(harmonic(torque, 0.3 / period))
    run, twin = fx.simulate(made, t, acting), simulate_twin(made, t, acting)
    bent = np.abs(run["link/1/tip_deflection"]).max()
    apart = np.abs(run["link/1/tip_deflection"] - twin["link/1/tip_deflection"]).max() / bent
    out.ends["twin"] += 1
    out.wrong += [f"seed {seed}: {text}" for text in faults_of(run, 0.0)]
    if not apart < 0.01:
        out.wrong.append(f"seed {seed}: the twin's deflection is {apart:.1%} off")
    return out


def end_of(run: fx.Run) -> str:
    """In a few words."""
    names = [event["name"] for event in run.meta["events"] if event["name"] != "still"]
    return ("complete" if run.complete else "incomplete") + "".join(f", {n}" for n in names)


def faults_of(run: fx.Run, took: float) -> list[str]:
    """What a run says falsely of itself."""
    names = {event["name"]: event["level"] for event in run.meta["events"]}
    finite = all(np.isfinite(values).all() for values in run.channels.values())
    error, wrong = run.meta["energy_error"], []
    if not finite and (run.complete or "not_finite" not in names):
        wrong.append("NaN without a word")
    if not error <= 1e-3 and "balance" not in names:
        wrong.append(f"balance {error:.1e} without a word")
    if not error <= 1e-2 and names.get("balance") not in ("WARN", "ERROR"):
        wrong.append(f"balance {error:.1e} without a warning")
    if not error <= 0.1 and run.complete:
        wrong.append(f"balance {error:.1e} and complete")
    if not run.complete and not names:
        wrong.append("incomplete without a word")
    if took > SLOW and not names:
        wrong.append(f"{took:.0f} s without a word")
    return wrong


def kind_of(error: Any) -> str:
    """What was refused and why, without the robot's own numbers."""
    key = getattr(error, "key", "")
    text = getattr(error, "expected", "") or str(error)
    bare = re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", text)
    return f"{type(error).__name__} {''.join(c for c in key if not c.isdigit())}: {bare[:60]}"


def trials(first: int, count: int, odd: bool = False) -> Count:
    """Robots of the seeds from `first` on."""
    total = Count()
    for seed in range(first, first + count):
        total.add(trial(seed, odd))
    return total
