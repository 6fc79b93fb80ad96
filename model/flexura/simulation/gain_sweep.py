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
from ..system import System
from .start import consistent_start

PER_JOINT, OF_STRIP = len(JOINT), len(STRIP)


@dataclass(frozen=True)
class GainSweep:
    """Runs of one robot from rest under the same references; `joints` N, `method` how they are
    integrated."""

    joints: int
    runs: Any  # core.Trials

    @property
    def method(self) -> str:
        """The method of integration."""
        return str(self.runs.method)

    def run(
        self,
        gains: np.ndarray,
        weights: np.ndarray | None = None,
        limits: np.ndarray | None = None,
        threads: int = 1,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Figures (B, 6 N + 4), those of each joint, then the strip's, and what fraction of the
        time each run reached (B,).

        Args: gains (B, N, 20): rows of `Controller.gains`; prices (2, 6 N + 4): those of the
        figures and what is free of each;
            limits (B,), inf for none, which an abandoned row's cost would exceed by a billionth or
            more; threads: how many work.

        Returns: Of an abandoned row the figures are lower bounds, 0 where it has none, and of one
        that failed NaN.
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
) -> GainSweep:
    """What rows of gains are run with, from rest as `simulate` starts: under gravity in static
    equilibrium. Samples lie on ticks.

    Raises: InputError: the robot is not on the exact line, or the controller is one of other
    joints.
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
    references = np.array(
        [[j.reference(at)[0] if isinstance(j, PID) else 0.0 for at in t] for j in controller.joints]
    )
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
        consistent_start(system, float(t[0]), controller, None, None)[0],
        references,
        rtol,
        method,
    )
    return GainSweep(len(controller.joints), runs)
