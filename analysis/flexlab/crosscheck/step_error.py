"""The error of the twin's own step, from runs with steps of two lengths.

Exudyn's generalised-alpha method is of second order: y(h) = y + c h^2. Two runs with steps h and
r h give the error of the finer one, |y(r h) - y(h)| / (r^2 - 1) (Richardson).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import flexura as fx
from flexura.errors import OutOfMemory

from .rows import rows, values

ORDER = 2
PART = 0.25  # of the tolerance: how small a refined step makes the twin's own error
SHORTEST = 1 / 16  # of a step, in one refinement
REFINEMENTS = 2
BUDGET_S = 60.0  # a refinement that would take longer is left out


def refined(
    native: fx.Run,
    twin: fx.Run,
    simulated: Callable[[float], fx.Run],
    tolerance: float,
    *,
    fixed: bool,
) -> tuple[fx.Run, dict[str, float]]:
    """The twin's run and its own error by channel, relative to the native run's largest magnitude.

    If the deviation of a channel is beyond `tolerance`, and the twin's own error is not small
    beside that, the twin is simulated with a shorter step, unless its step is `fixed`.

    Args:
        native: the native run.
        twin: the twin's run.
        simulated: gives the twin's run for a step [s].
        tolerance: of the deviation, relative.
        fixed: the user gave the step.
    """
    other = _other(twin, simulated)
    if other is None:
        return twin, {}
    fine, coarse = sorted((twin, other), key=_step)
    if fixed:
        errors = estimate(native, fine, coarse)
        if fine is not twin:  # the error of a run with the longer step
            ratio = (_step(coarse) / _step(fine)) ** ORDER
            errors = {name: ratio * error for name, error in errors.items()}
        return twin, errors
    errors = estimate(native, fine, coarse)
    for _ in range(REFINEMENTS):
        worst = max(_undecided(native, fine, errors, tolerance), default=0.0)
        if worst <= PART * tolerance:
            break
        share = max(math.sqrt(PART * tolerance / worst), SHORTEST)
        if fine.meta["wall_s"] / share > BUDGET_S:
            break
        try:
            finer = simulated(share * _step(fine))
        except OutOfMemory:
            raise
        except fx.FlexuraError:
            break
        if not finer.complete or _step(finer) >= 0.9 * _step(fine):
            break
        fine, coarse = finer, fine
        errors = estimate(native, fine, coarse)
    return fine, errors


def estimate(native: fx.Run, fine: fx.Run, coarse: fx.Run) -> dict[str, float]:
    """The error of the finer run by channel, relative to the native run's largest magnitude."""
    weight = 1 / ((_step(coarse) / _step(fine)) ** ORDER - 1)
    errors = {}
    for row in rows(native, fine):
        change = values(fine, coarse, row.channel)
        size = float(np.abs(change).max(initial=0.0))
        errors[row.channel] = weight * size / row.peak if row.peak > 0 else 0.0
    return errors


def _undecided(
    native: fx.Run, fine: fx.Run, errors: dict[str, float], tolerance: float
) -> list[float]:
    """The twin's own errors of channels that deviate by more than the tolerance."""
    return [errors[row.channel] for row in rows(native, fine) if row.max_relative > tolerance]


def _other(twin: fx.Run, simulated: Callable[[float], fx.Run]) -> fx.Run | None:
    """A run with a step twice as long, or half as long if that one is impossible."""
    for factor in (2.0, 0.5):
        try:
            run = simulated(factor * _step(twin))
        except OutOfMemory:
            raise
        except fx.FlexuraError:
            continue
        if run.complete and not 0.7 < _step(run) / _step(twin) < 1.4:
            return run
    return None


def _step(run: fx.Run) -> float:
    return float(run.meta["step_s"])
