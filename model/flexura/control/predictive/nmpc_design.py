"""Nonlinear model predictive control of a robot's drives, as a sampled controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...io import number, tick_rate, whole
from ...signals import SignalLike
from ...system import RobotLike, StateSpace, System, assemble, frequencies, linearize
from ..linear_quadratic.gaussian_design import Weights, deviation_rows, driven_joints
from ..linear_quadratic.lqg_design import limits as limits_of
from ..linear_quadratic.lqg_design import motions, noise_of
from ..linear_quadratic.measurements import Measurements
from ..linear_quadratic.riccati import deviations, discretised, riccati
from ..sampled import Sampled
from .nmpc_law import NonlinearPredictive, Problem
from .prediction import Prediction

PERIODS = 1.1  # of the first mode, which are looked ahead
FEWEST, MOST = 2, 200  # intervals
PRICE = 1e7  # of the square of what breaks a limit of speed or deflection, as a share of it


def nmpc(
    robot: RobotLike,
    references: SignalLike | Sequence[SignalLike],
    effort: ArrayLike,
    rate_Hz: float = 500.0,
    *,
    intervals: int = 24,
    horizon_s: float | None = None,
    spread: int = 1,
    measure: Sequence[str] | None = None,
    limit: ArrayLike | None = None,
    speed_limit: ArrayLike | None = None,
    deflection_limit: float | None = None,
    follow: str = "tips",
    position: ArrayLike = 1.0,
    deflection: float = 1.0,
    damping: float = 0.0,
    disturbance: ArrayLike = 1.0,
    noise: ArrayLike | Mapping[str, float] = 1e-4,
    q: ArrayLike | None = None,
) -> Sampled:
    """A sampled controller that minimises the cost of the motion ahead on the nonlinear model, one
    step of Newton's method a tick (131), (132).

    The state is Kalman's estimate (76) on the same model, from the robot's own sensors. Beyond the
    horizon the cost is that of a linear regulator. The references are known ahead. Coulomb friction
    is left out of the prediction. It needs daqp, of the extra "mpc".

    Args:
        robot: a System, a Robot, or the path or name of a robot file. A robot with few modes makes
            a fast controller.
        references: a Signal or a number for each joint [m or rad]; None is good for a locked one.
        effort: of each free joint (m,), that counts as much as the deviations below [N or N m].
        rate_Hz: ticks a second.
        intervals: ahead, in which the forces are held; the first is a tick, the others are longer
            and longer.
        horizon_s: what is looked ahead [s]; None: 1.1 periods of the first mode with locked joints.
        spread: ticks over which the linearisation of the intervals is spread.
        measure: as in `flexura.lqg`.
        limit: of the forces, a number or one a joint [N or N m]; None: there is none.
        speed_limit: of the joints, a number or one a joint [m/s or rad/s]; None: there is none.
        deflection_limit: of every tip [m]; None: there is none.
        follow: what follows the references, "tips" or "joints", as in `flexura.lqg`.
        position: deviation of each free joint (m,) or of all [m or rad].
        deflection: of the tips [m].
        damping: time by which the rate of a deflection is weighted [s].
        disturbance: as in `flexura.lqg`.
        noise: as in `flexura.lqg`.
        q: configuration (n,) of measurements and end cost; None: the static one at the start.

    Returns:
        The controller for `flexura.simulate`; its `function` is a NonlinearPredictive.

    Raises:
        InputError: an argument is not what is expected.
        Missing: daqp is not installed.
    """
    system = assemble(robot)
    if not system.exact:
        expected = 'expected a robot with stiffening = true and sliding = "continuous"'
        raise InputError(expected, key="robot", value=system.robot.name)
    rate = tick_rate(rate_Hz)
    N = whole(intervals, "intervals", FEWEST)
    if N > MOST:
        expected = f"expected from {FEWEST} to {MOST} intervals"
        raise InputError(expected, key="intervals", value=intervals)
    linear = linearize(system, q)
    if not linear.inputs:
        raise InputError("expected a joint that is free to move", key="link.joint.locked")
    horizon = _horizon(system, horizon_s)
    if horizon < N / rate:
        expected = f"expected intervals of a tick or more: a horizon of {N / rate:g} s or more"
        raise InputError(expected, key="horizon_s", value=horizon)
    h = growing(1 / rate, horizon, N)
    measured = Measurements(system, measure)
    given = Weights(
        effort, position, deflection, damping, disturbance, noise_of(noise, measured.names), follow
    )
    driven = list(driven_joints(linear))
    rows, bound = _bounds(system, linear, speed_limit, deflection_limit)
    problem = _problem(
        system,
        linear,
        measured,
        given,
        (1 / rate, h),
        (rows, bound),
        whole(spread, "spread", 1),
    )
    problem = problem | {"limit": limits_of(limit, system)[driven]}
    law = NonlinearPredictive(
        Prediction(system, driven),
        Problem(**problem),
        measured,
        measured.derivatives(linear),
        motions(references, system),
        driven,
        linear.q,
    )
    return Sampled(law, rate)


def _horizon(system: System, given: float | None) -> float:
    """The time ahead [s]. Raises InputError."""
    if given is None:
        found = frequencies(system, count=1)
        if not len(found):
            expected = "missing: a robot without flexible links has no period to look ahead"
            raise InputError(expected, key="horizon_s", value="None")
        return PERIODS / float(found[0])
    if not number(given, "horizon_s") > 0:
        raise InputError("expected a time above 0 in seconds", key="horizon_s", value=given)
    return float(given)


def growing(first: float, whole: float, count: int) -> np.ndarray:
    """Lengths (count,) that grow by one factor from `first` to a sum of `whole`, at least
    first x count [s]."""
    low, high = 1.0, 10.0
    for _ in range(60):
        factor = (low + high) / 2
        if first * np.sum(factor ** np.arange(count)) < whole:
            low = factor
        else:
            high = factor
    return np.asarray(first * low ** np.arange(count))


def _bounds(
    system: System, linear: StateSpace, speed: Any, deflection: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Rows (r, 2m) of the limited speeds and deflections, and their limits (r,) in which the rows
    are measured."""
    rows, bounds = [np.zeros((0, linear.A.shape[0]))], [np.zeros(0)]
    driven = list(driven_joints(linear))
    if speed is not None:
        found = deviations(speed, len(system.robot.links), "speed_limit")
        hubs = linear.C[[linear.outputs.index(f"joint/{i + 1}/position") for i in driven]]
        rows.append(np.roll(hubs, len(linear.M), axis=1))
        bounds.append(found[driven])
    if deflection is not None:
        bent = [k for k, name in enumerate(linear.outputs) if name.endswith("tip_deflection")]
        rows.append(linear.C[bent])
        bounds.append(np.full(len(bent), deviations(deflection, 1, "deflection_limit")[0]))
    limits = np.concatenate(bounds)
    return np.concatenate(rows) / limits[:, None], np.ones(len(limits))


def _problem(
    system: System,
    linear: StateSpace,
    measured: Measurements,
    given: Weights,
    times: tuple[float, np.ndarray],
    bounds: tuple[np.ndarray, np.ndarray],
    spread: int,
) -> dict[str, Any]:
    """The fields of `Problem` but the limit of the forces."""
    T, h = times
    m = len(linear.inputs)
    W = deviation_rows(linear, given, system)
    effort = deviations(given.effort, m, "effort")
    F, G = discretised(linear.A, linear.B, float(h[-1]))
    end = riccati(F, G, h[-1] * W.T @ W, h[-1] * np.diag(1 / effort**2), "effort")
    process = np.diag(deviations(given.disturbance, m, "disturbance") ** 2)
    C = measured.derivatives(linear)
    V = np.diag(deviations(given.noise, len(C), "noise") ** 2)
    F, G = discretised(linear.A, linear.B, T)
    return {
        "T": T,
        "h": h,
        "weights": W,
        "effort": effort,
        "end": end,
        "rows": bounds[0],
        "bound": bounds[1],
        "process": process,
        "noise": V,
        "covariance": riccati(F.T, C.T, G @ process @ G.T, V, "noise"),
        "spread": spread,
        "price": PRICE,
    }
