"""Forces and moments on links as generalised forces (130) to (132), and the static equilibrium
under them (133)."""

from __future__ import annotations

import numpy as np

from ..signals import Loads
from .system import System, jacobian

LEAST = 1e-5  # of the loads: how closely the share that is borne is found
MOST = 30  # Newton steps for one share of the loads
CLOSE, ENOUGH = 1e-11, 1e-7  # of the unknowns: a last Newton step, and one that shrinks no more


def load_forces(system: System, q: np.ndarray, loads: Loads, t: np.ndarray) -> np.ndarray:
    """The generalised forces of loads in states (132).

    Args:
        system: the robot.
        q: configurations (T, n).
        loads: forces and moments on links.
        t: times (T,) [s].

    Returns:
        Generalised forces (T, n).
    """
    if not loads or not len(t):
        return np.zeros_like(q)
    values = np.array([loads.values(float(at)) for at in t])
    if system.exact:
        rows = np.ascontiguousarray(values.reshape(len(t), -1))
        return np.asarray(system.equations.loads(np.ascontiguousarray(q), loads.rows, rows))
    return np.array(
        [system.fixed(at).assembly.loads(at, loads.rows, now) for at, now in zip(q, values)]
    )


def acting_loads(system: System, q: np.ndarray, loads: Loads, t: float) -> np.ndarray:
    """The loads that act at a time, in the base's axes (131).

    Args:
        system: the robot.
        q: configuration (n,).
        loads: forces and moments on links.
        t: time [s].

    Returns:
        Forces x, y [N] and moments [N m], (L, 3). `loads.rows` says on which link and where.
    """
    out = loads.values(t)
    for row, (link, at, turns) in zip(out, loads.rows, strict=True):
        if turns:
            angle = float(system.fixed(q).line(q, int(link) + 1, [at])[2][0])
            force = complex(row[0], row[1]) * np.exp(1j * angle)
            row[:2] = force.real, force.imag
    return out


def borne(system: System, q: np.ndarray, loads: Loads, t: float) -> tuple[np.ndarray, float, bool]:
    """The elastic unknowns in equilibrium under gravity and loads with the joints held (133).

    The loads grow in steps from the equilibrium without them.

    Args:
        system: the robot, of fixed structure.
        q: the equilibrium without the loads (n,).
        loads: forces and moments on links.
        t: the time whose loads act [s].

    Returns:
        The configuration (n,); the share of the loads that it bears, 1 if all; whether the
            equilibrium was lost because it is no longer stable.
    """
    rows, values = system.elastic_rows, loads.values(t)
    conservative = not any(
        load.frame == "link" and values[k, :2].any() for k, load in enumerate(loads.each)
    )
    share, increase, unstable = 0.0, 1.0, False
    here, before, before_share = q.copy(), q.copy(), 0.0
    while share < 1.0 and len(rows):
        aim = min(share + increase, 1.0)
        guess = here.copy()
        if share > before_share:  # on along the line through the last two
            guess += (here - before) * ((aim - share) / (share - before_share))
        found, unstable = _newton(system, guess, loads.rows, aim * values, conservative)
        if found is None:
            increase = 0.5 * (aim - share)
            if increase < LEAST:
                return here, share, unstable
            continue
        before, before_share, here, share = here, share, found, aim
        increase *= 2.0
    return here, 1.0, False


def _newton(
    system: System, q: np.ndarray, rows: np.ndarray, values: np.ndarray, conservative: bool
) -> tuple[np.ndarray | None, bool]:
    """Newton's method for the equilibrium under loads of these values (L, 3) from q (n,): the
    configuration or None, and whether a balance was found that is not stable."""
    own, last = system.elastic_rows, np.inf

    def pushed(z: np.ndarray) -> np.ndarray:
        at = q.copy()
        at[own] = z
        if system.exact:
            return np.asarray(system.equations.loads(at[None], rows, values.reshape(1, -1)))[0, own]
        return system.assembly.loads(at, rows, values)[own]

    q = q.copy()
    for _ in range(MOST):
        left = (system.elastic(q) + system.gravity(q))[own] - pushed(q[own])
        slope = jacobian(pushed, q[own], np.full(len(own), 1e-6))
        tangent = system.tangent(q)[np.ix_(own, own)] - slope
        try:
            step = np.linalg.solve(tangent, left)
        except np.linalg.LinAlgError:
            return None, True
        size, scale = float(np.abs(step).max()), float(np.abs(q[own]).max()) + 1e-9
        if not size < 10.0 * max(last, 1.0):
            return None, False
        q[own] -= step
        if size <= CLOSE * scale or (size <= ENOUGH * scale and size >= 0.5 * last):
            if conservative and np.linalg.eigvalsh(0.5 * (tangent + tangent.T))[0] <= 0.0:
                return None, True
            return q, False
        last = size
    return None, False
