"""Which method a simulation takes, and how long its steps may be: both from the robot's spectrum at the start."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from . import exponential, loop
from .chain import SLIDER, Chain
from .system import System

# |z| of y' = z y up to which a method is stable, with about 10 % to spare for a spectrum that moves with the robot: DOP853 5.97
# on the imaginary axis, 6.39 on the real one; Ralston's 1.73, 2.51; Cash and Karp's grows by 2e-4 a step at 1.0i
_STABLE = {loop.EXPLICIT: 5.3, loop.PAIR_3: 1.55, loop.PAIR_5: 1.0, loop.IMPLICIT: np.inf, exponential.EXPONENTIAL: np.inf}


def quickest(system: System, duration: float, rtol: float, gains: np.ndarray) -> int:
    """Exponential steps wherever the robot's modes stay much the same from step to step, which under a slider that moves along a
    flexible link they do not, where their order does not fall behind the explicit method's, and where no strong damper couples
    the modes; else as `choose`. `gains` (N, 2): of position and rate in the drives."""
    if not keeps_modes(system.chain, rtol):
        return choose(system, duration, rtol)
    # coupling by damping is integrated like a force; extrapolating it is stable for about rate h < 1/35
    if not uncoupled(system.chain, gains) and 35 * _coupling(system, gains) > _implicit(system, rtol):
        return choose(system, duration, rtol)
    return exponential.EXPONENTIAL


def keeps_modes(c: Chain, rtol: float) -> bool:
    """The first two of these conditions, the same for all robots of a topology (fields of c with a leading axis (B,), or not)."""
    kind, locked, elements = (field.reshape(-1, c.kind.shape[-1])[0] for field in (c.kind, c.locked, c.elements))
    rides = (kind[1:] == SLIDER) & (locked[1:] == 0) & (elements[:-1] > 0)
    return bool((elements > 0).any() and not rides.any() and rtol >= 1e-9)


def uncoupled(c: Chain, gains: np.ndarray) -> np.ndarray:
    """Is there nothing by which damping could couple a robot's modes: no gains (..., N, 2), no viscous friction, and one beta in
    all flexible links? For one robot, or for each of many, (B,)."""
    bends = c.elements.reshape(-1, c.kind.shape[-1])[0] > 0
    alpha, beta = c.alpha[..., bends], c.beta[..., bends]
    alike = (alpha == 0.0).all(axis=-1) & (beta == beta[..., :1]).all(axis=-1)
    return np.asarray(alike & ~gains.any(axis=(-2, -1)) & ~c.viscous.any(axis=-1))


def _coupling(system: System, gains: np.ndarray) -> float:
    """The rate [1/s] at which dampers couple the modes at the start: the norm of what Phi^T D Phi has off its diagonal."""
    K, D, rows = system.stiffness(), system.damping.copy(), system.joint_rows
    K[rows, rows] += gains[:, 0]
    D[rows, rows] += gains[:, 1]
    free = np.ix_(system.free_rows, system.free_rows)
    _, phi = eigh(K[free], system.mass(system.start())[free])
    modal = phi.T @ D[free] @ phi
    return float(np.linalg.norm(modal - np.diag(np.diag(modal)), 2))


def longest_step(system: System, method: int = loop.EXPLICIT) -> float:
    """A method's longest stable step [s]. Beyond, an explicit method's error estimate alone would let the fastest modes grow for
    a few steps at a time, far above the tolerance."""
    stable = _STABLE[method]
    return stable if stable == np.inf else stable / max(system.spectrum[-1], _damped(system), 1e-300)


def choose(system: System, duration: float, rtol: float, rate_Hz: float = 0.0) -> int:
    """The cheaper method by a count of passes: explicit steps follow the fastest mode, implicit ones the slow modes and the
    tolerance; under a controller of `rate_Hz` every tick is a step at least."""
    spectrum, elastic = system.spectrum, _elastic(system)
    if rate_Hz > 0.0:
        slow = elastic[0] if len(elastic) else 1e-3
        steps = {  # passes of a step, and its length by the tolerance along the slowest mode
            loop.PAIR_3: (3, (100 * rtol) ** (1 / 3) / slow),
            loop.PAIR_5: (6, (4000 * rtol) ** (1 / 5) / slow),
            loop.EXPLICIT: (13, np.inf),
            loop.IMPLICIT: (12, (rtol ** (1 / 4)) / (0.02 * slow)),
        }
        ticks = lambda k: np.ceil(1 / rate_Hz / min(longest_step(system, k), steps[k][1]))
        return min(steps, key=lambda k: steps[k][0] * ticks(k))
    if len(elastic) == 0:
        return loop.EXPLICIT
    slow = elastic[min(2, len(elastic) - 1)]
    # the factors are counts of passes per radian, measured on the rig and on its undamped benchmark
    explicit = duration * max(2.4 * spectrum[-1], 2 * _damped(system), 0.8 * slow * rtol ** (-1 / 8))
    implicit = duration * _implicit(system, rtol)
    return loop.EXPLICIT if explicit <= implicit else loop.IMPLICIT


def _elastic(system: System) -> np.ndarray:
    """The frequencies at which links bend, ascending [rad/s]."""
    return system.spectrum[system.spectrum > 1e-3 * max(system.spectrum[-1], 1e-300)]


def _implicit(system: System, rtol: float) -> float:
    """Implicit passes a second."""
    elastic = _elastic(system)
    return float(0.2 * elastic[min(2, len(elastic) - 1)] * rtol ** (-1 / 4))


def _damped(system: System) -> float:
    """The fastest decay rate [1/s], about beta omega^2."""
    return max(link.damping.beta_s for link in system.robot.links) * system.spectrum[-1] ** 2
