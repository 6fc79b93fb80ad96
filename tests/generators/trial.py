"""What must hold of a generated robot: it is refused in a sentence, or its numbers are right, or
the run says that they are not."""

from __future__ import annotations

import time
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import flexura as fx
from flexura.signals import constant, harmonic

from .robots import robot

END, TIMES = 0.1, 21  # of a run [s], and its outputs
STEPS = 4000  # the budget of a run
SLOW = 20.0  # s of processor time, beyond which a run must have said something


@dataclass
class Count:
    """How robots ended, what is wrong, and the seeds."""

    robots: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    slowest: tuple[float, int] = (0.0, 0)

    def add(self, other: Count) -> Count:
        """Both counts in one."""
        self.robots += other.robots
        self.ends += other.ends
        self.refused += other.refused
        self.wrong += other.wrong
        self.slowest = max(self.slowest, other.slowest)
        return self

    def __str__(self) -> str:
        lines = [f"{self.robots} robots; slowest {self.slowest[0]:.1f} s (seed {self.slowest[1]})"]
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
    """One robot of a seed: built, its frequencies, its motion, all judged."""
    rng, out = np.random.default_rng([seed, odd]), Count(robots=1)
    begun = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            _try(rng, odd, out, seed)
    except fx.FlexuraError as error:
        out.refused[_kind(error)] += 1
        if not str(error).isprintable() or len(str(error)) > 500:
            out.wrong.append(f"seed {seed}: the message {str(error)!r}")
    except Exception:
        last = traceback.format_exc().strip().splitlines()
        out.wrong.append(f"seed {seed}: traceback: {' | '.join(last[-3:])}")
    took = time.process_time() - begun
    out.slowest = (took, seed)
    return out


def _try(rng: np.random.Generator, odd: bool, out: Count, seed: int) -> None:
    tables = robot(rng, odd)
    system = fx.assemble(fx.Robot.from_dict(tables))
    start = None
    try:
        found = fx.frequencies(system, count=3)
        if not (np.isfinite(found).all() and (found >= 0).all() and (np.diff(found) >= 0).all()):
            out.wrong.append(f"seed {seed}: frequencies {found}")
    except fx.NoEquilibrium:
        out.ends["no equilibrium: started straight"] += 1
        start = "straight"
    t = np.linspace(0, END, TIMES)
    begun = time.process_time()
    run = fx.simulate(system, t, drive(rng, system.robot), start=start, max_steps=STEPS)
    took = time.process_time() - begun
    out.wrong += [f"seed {seed}: {text}" for text in faults_of(run, took)]
    out.ends[end_of(run)] += 1


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


def _kind(error: Any) -> str:
    key = getattr(error, "key", "")
    text = getattr(error, "expected", "") or str(error)
    return f"{type(error).__name__} {''.join(c for c in key if not c.isdigit())}: {text[:60]}"


def trials(first: int, count: int, odd: bool = False) -> Count:
    """Robots of the seeds from `first` on."""
    total = Count()
    for seed in range(first, first + count):
        total.add(trial(seed, odd))
    return total
