"""The cross-check: one robot file in two programs that share nothing else, and the difference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import flexura as fx
from flexura import twin
from flexura.signals import Manoeuvre

from ..review import write_review
from ..runs.deviation import Deviation, deviations

TOLERANCE = 0.01  # of a channel's largest magnitude


@dataclass(frozen=True)
class Check:
    """Both runs and their deviations; `passed` where no channel deviates by more than `tolerance`
    of its largest magnitude."""

    simulation: fx.Run
    twin: fx.Run
    rows: list[Deviation]
    tolerance: float

    @property
    def failed(self) -> list[str]:
        """Channels beyond the tolerance. A deviation below 1e-9 m or rad counts as none: the
        channel does not move."""
        return [
            row.channel
            for row in self.rows
            if row.max > 1e-9 and not row.max_relative <= self.tolerance
        ]

    @property
    def passed(self) -> bool:
        return self.complete and not self.failed

    @property
    def complete(self) -> bool:
        return self.simulation.complete and self.twin.complete


Progress = Callable[[str, float], None]


def crosscheck(
    robot: fx.Robot,
    manoeuvre: Manoeuvre,
    *,
    beam: str = "ancf",
    rtol: float = 1e-7,
    tolerance: float = TOLERANCE,
    step_s: float | None = None,
    progress: Progress | None = None,
) -> Check:
    """Simulate a robot natively and in Exudyn along the same manoeuvre, and compare.

    `beam`: "ancf" or "ge", `step_s`: Exudyn's step, see `flexura.twin`. `progress` is called with
    "native" or "twin" and the finished fraction. The table's channels: joint positions, tip
    deflections, the tip's position.
    """
    if manoeuvre.drive.follows.any():
        raise fx.InputError(
            "expected a force, or gains on the motion: the twin has no prescribed joints",
            key="prescribed",
            value=True,
        )
    report = progress or (lambda name, fraction: None)
    native = fx.simulate(
        fx.assemble(robot),
        manoeuvre.t,
        manoeuvre.drive,
        rtol=rtol,
        progress=lambda f: report("native", f),
    )
    report("native", 1.0)
    other = twin.simulate(
        robot,
        native.t,
        manoeuvre.drive,
        beam=beam,
        step_s=step_s,
        progress=lambda f: report("twin", f),
    )
    report("twin", 1.0)
    for run in (native, other):
        run.meta["manoeuvre"] = manoeuvre.name
    return Check(native, other, deviations(native, other), tolerance)


def save(check: Check, folder: Path) -> Path:
    """Write both runs and their review into `folder`; returns the review's path."""
    check.simulation.save(folder / "simulation")
    check.twin.save(folder / "twin")
    return write_review(folder / "review.rrd", [check.simulation, check.twin])
