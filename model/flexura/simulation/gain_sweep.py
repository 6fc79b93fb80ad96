"""One robot under many controllers, in the core: each row of gains is a run, of which only its
figures are kept.

Nothing of Python runs between two rows, and a call leaves Python's lock. What a row gives does not
depend on the others, nor on the number of threads. Several threads of the caller's may use one
`GainSweep` at the same time.

A row may have a limit to its cost, sum_k price_k max(0, figure_k - free_k) with prices on
overshoot, ITAE, effort and vibration: it is abandoned as soon as it is certain to cost more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import core
from ..control import JOINT, PID, STRIP, Controller
from ..errors import InputError
from ..signals import LoadsLike, as_loads, evaluate_many
from ..system import System
from .start import consistent_start

PER_JOINT, OF_STRIP = len(JOINT), len(STRIP)


@dataclass(frozen=True)
class GainSweep:
    """Runs of one robot from rest under the same references; `joints` N."""

    joints: int
    runs: Any  # core.GainSweep

    def run(
        self,
        gains: np.ndarray,
        weights: np.ndarray | None = None,
        limits: np.ndarray | None = None,
        threads: int = 1,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Simulate rows of gains.

        Args:
            gains: rows of `Controller.gains` (B, N, 23).
            weights: of the metrics, and what is free of each (2, 6 N + 4); None: no row is
                abandoned.
            limits: of the rows' costs (B,), inf for none. An abandoned row's cost would exceed its
                limit by a billionth or more.
            threads: how many work.

        Returns:
            Metrics (B, 6 N + 4), those of each joint, then the strip's; and what fraction of the
            time each run reached (B,). Metrics of an abandoned row are lower bounds, 0 where there
            is none. Those of one that failed are NaN.
        """
        rows = np.ascontiguousarray(gains, dtype=float)
        free = (
            np.zeros((2, PER_JOINT * self.joints + OF_STRIP))
            if weights is None
            else np.ascontiguousarray(weights, dtype=float)
        )
        most = (
            np.full(len(rows), np.inf)
            if limits is None
            else np.ascontiguousarray(limits, dtype=float)
        )
        metrics, reached = self.runs.run(free, rows, most, threads)
        return np.asarray(metrics), np.asarray(reached)


def prepare_gain_sweep(
    system: System,
    controller: Controller,
    duration_s: float,
    output_step_s: float,
    rtol: float,
    method: str = "auto",
    start: str | None = None,
    loads: LoadsLike = None,
) -> GainSweep:
    """Prepare the runs of many rows of gains on one robot.

    They begin at rest as `simulate` does: under gravity in static equilibrium. Samples lie on
    ticks.

    Args:
        system: the robot.
        controller: its references, outputs and rate.
        duration_s: of a run [s].
        output_step_s: between two samples [s].
        rtol: as in `flexura.simulate`.
        method: as in `flexura.simulate`.
        start: as in `flexura.simulate`.
        loads: as in `flexura.simulate`.

    Returns:
        The GainSweep.

    Raises:
        InputError: the robot is not on the exact line, or the controller is one of other joints.
    """
    if not system.exact:
        raise InputError(
            'expected a robot with stiffening = true and sliding = "continuous"', key="sliding"
        )
    if len(controller.joints) != len(system.robot.links):
        expected = f"expected {len(system.robot.links)} joint drives, one a joint"
        raise InputError(expected, key="drive", value=len(controller.joints))
    rate = controller.rate_Hz
    every = max(1, round(output_step_s * rate))
    t = np.arange(0, round(duration_s * rate) + 1, every) / rate
    controller = controller.within(float(t[0]), float(t[-1]))
    references = np.zeros((len(controller.joints), len(t)))
    for followed, joint in zip(references, controller.joints, strict=True):
        if isinstance(joint, PID):
            followed[:] = evaluate_many(joint.reference.segments, t)[0]
    lengths = [link.length_m for link in system.robot.links]
    on_links = as_loads(loads, lengths, float(t[0]), float(t[-1]))
    segments, ranges, gains, follows, _ = controller.core_drives()
    index = np.column_stack([ranges, follows]).astype(np.int64)
    runs = core.GainSweep(
        system.equations,
        controller.sampler(system),
        segments,
        index,
        gains,
        np.ascontiguousarray(system.limits),
        t,
        consistent_start(system, float(t[0]), controller, None, None, start, on_links)[0],
        references,
        rtol,
        method,
        on_links.packed() if on_links else None,
    )
    return GainSweep(len(controller.joints), runs)
