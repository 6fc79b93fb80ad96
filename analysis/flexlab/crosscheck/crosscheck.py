"""The cross-check: one robot file in two programs that share nothing else, and the difference."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import flexura as fx
from flexura import twin
from flexura.signals import Manoeuvre

from ..review import write_review
from ..runs.deviation import Deviation
from . import step_error
from .rows import rows

TOLERANCE = 0.01  # of a channel's largest magnitude
STILL = 1e-9  # m or rad: a deviation below counts as none, the channel does not move
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Check:
    """Both runs, their deviations by channel, and what the twin's step adds to them.

    `own_error`: by channel the error of the twin's own step, relative to the channel's largest
    magnitude; empty if it was not estimated. `interrupted`: Ctrl-C ended one of the runs, or the
    estimate of that error.
    """

    simulation: fx.Run
    twin: fx.Run
    rows: list[Deviation]
    tolerance: float
    own_error: Mapping[str, float] = field(default_factory=dict)
    interrupted: bool = False

    def verdict(self, channel: str) -> str:
        """One of "within" and "beyond" the tolerance, and "open".

        A deviation beyond the tolerance is "open" if the twin's own error may explain it: less
        that error it is within the tolerance. Such a deviation says nothing about the native run.
        """
        row = next(row for row in self.rows if row.channel == channel)
        if row.max <= STILL or row.max_relative <= self.tolerance:
            return "within"
        explained = row.max_relative - self.own_error.get(channel, 0.0) <= self.tolerance
        return "open" if explained else "beyond"

    @property
    def failed(self) -> list[str]:
        """Channels beyond the tolerance."""
        return [row.channel for row in self.rows if self.verdict(row.channel) == "beyond"]

    @property
    def open(self) -> list[str]:
        """Channels whose deviation may be the twin's own error."""
        return [row.channel for row in self.rows if self.verdict(row.channel) == "open"]

    @property
    def passed(self) -> bool:
        """Whether both runs came to their end and every channel is within the tolerance."""
        return self.complete and not self.failed and not self.open

    @property
    def complete(self) -> bool:
        """Whether both runs came to their end."""
        return self.simulation.complete and self.twin.complete


def crosscheck(
    robot: fx.Robot,
    manoeuvre: Manoeuvre,
    *,
    beam: str = "ancf",
    rtol: float = 1e-7,
    tolerance: float = TOLERANCE,
    step_s: float | None = None,
    own_error: bool = True,
    internal_forces: bool = False,
    progress: Progress | None = None,
) -> Check:
    """Simulate a robot natively and in Exudyn along the same manoeuvre, and compare.

    The table's channels: joint positions, tip deflections, the tip's position, sensors, and
    internal forces if asked for.

    Args:
        robot: the robot of both.
        manoeuvre: what it does.
        beam: "ancf" or "ge", see `flexura.twin`.
        rtol: relative tolerance of the native solver.
        tolerance: largest deviation allowed, relative to each channel's largest magnitude.
        step_s: Exudyn's step [s]; None: chosen from the robot, and shortened if its own error
            leaves the verdict open.
        own_error: estimate the twin's own error, by one more run of the twin or a few.
        internal_forces: compare reactions, and forces along the flexible links, too.
        progress: called with "native" or "twin" and the finished fraction.
    """
    report = progress or (lambda name, fraction: None)
    native = fx.simulate(
        fx.assemble(robot),
        manoeuvre.t,
        manoeuvre.drive,
        rtol=rtol,
        start=manoeuvre.start,
        loads=manoeuvre.loads,
        payloads=manoeuvre.payloads,
        internal_forces=internal_forces,
        progress=lambda f: report("native", f),
    )
    report("native", 1.0)

    def simulated(step: float | None, begin: float = 0.0, part: float = 1.0) -> fx.Run:
        return twin.simulate(
            robot,
            native.t,
            manoeuvre.drive,
            start=manoeuvre.start,
            loads=manoeuvre.loads,
            payloads=manoeuvre.payloads,
            beam=beam,
            step_s=step,
            internal_forces=internal_forces,
            progress=lambda f: report("twin", begin + part * f),
        )

    other = simulated(step_s, part=0.6 if own_error else 1.0)
    interrupted = native.interrupted or other.interrupted

    def again(step: float) -> fx.Run:
        return simulated(step, 0.6, 0.4).uninterrupted()

    errors: dict[str, float] = {}
    if own_error and other.complete and native.complete:
        try:
            other, errors = step_error.refined(native, other, again, tolerance, fixed=bool(step_s))
        except KeyboardInterrupt:
            interrupted = True
    report("twin", 1.0)
    for run in (native, other):
        run.meta["manoeuvre"] = manoeuvre.name
    return Check(native, other, rows(native, other), tolerance, errors, interrupted)


def save(check: Check, folder: Path) -> Path:
    """Write both runs and their review into `folder`; returns the review's path."""
    check.simulation.save(folder / "simulation")
    check.twin.save(folder / "twin")
    return write_review(folder / "review.rrd", [check.simulation, check.twin])
