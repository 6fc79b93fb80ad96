"""Forces and moments on links as generalised forces, the static equilibrium under them, and the
impact where a payload is taken up: docs/theory/14-loads.md."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..robot import Payload
from ..signals import Loads, PayloadChange
from .kinematics import translate
from .system import System, assemble, jacobian

LEAST = 1e-5  # of the loads: how closely the share that is borne is found
MOST = 30  # Newton steps for one share of the loads
CLOSE, ENOUGH = 1e-11, 1e-7  # of the unknowns: a last Newton step, and one that shrinks no more


def load_forces(system: System, q: np.ndarray, loads: Loads, t: np.ndarray) -> np.ndarray:
    """The generalised forces of loads in states (135).

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
    """The loads that act at a time, in the base's axes (134).

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
    """The elastic unknowns in equilibrium under gravity and loads with the joints held (136).

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


class Impact(NamedTuple):
    """A change of the payload at an instant.

    qd: rates after it (n,). lost: kinetic energy that the impact takes [J] (138). gone: kinetic
    energy of what is let go [J].
    """

    qd: np.ndarray
    lost: float
    gone: float


def with_payload(system: System, change: PayloadChange) -> System:
    """The same robot with another payload. Its unknowns and its damping stay.

    Args:
        system: the robot.
        change: the payload from an instant on.

    Returns:
        The System.

    Raises:
        InputError: a value that a robot file refuses; a last link in its own modes, which depend on
            the payload.
    """
    robot, number = system.robot, len(system.robot.links)
    last = robot.links[-1]
    if last.flexible and last.modes is not None:
        text = (
            f"expected elements without modes: the modes of link {number} are those with the "
            f"payload at the start"
        )
        raise InputError(text, key=f"link[{number}].modes", value=last.modes)
    centre = change.centre_of_mass_m or robot.payload.centre_of_mass_m
    changes = {
        "payload.mass_kg": change.mass_kg,
        "payload.inertia_kg_m2": change.inertia_kg_m2,
        "payload.centre_of_mass_m": centre,
    }
    if last.damping.by_ratio:
        alpha, beta = robot.rayleigh(number - 1)
        changes[f"link.{number}.damping"] = {"alpha_1_s": alpha, "beta_s": beta}
    return assemble(robot.replace(changes))


def impact(
    before: System, after: System, q: np.ndarray, qd: np.ndarray, given: np.ndarray
) -> Impact:
    """The rates after the payload has changed (137), and the energy that goes (138).

    What both payloads have in common, mass and inertia with the same centre, stays. The rest of the
    old one is let go with its velocity. The rest of the new one was at rest.

    Args:
        before: the robot with the old payload, of fixed structure.
        after: with the new one.
        q: configuration (n,).
        qd: its rates (n,).
        given: rows whose rates are given: joints with a motion.

    Returns:
        The Impact.
    """
    old, new = before.robot.payload, after.robot.payload
    same = old.centre_of_mass_m == new.centre_of_mass_m
    stays = (
        (min(old.mass_kg, new.mass_kg), min(old.inertia_kg_m2, new.inertia_kg_m2))
        if same
        else (0.0, 0.0)
    )
    left = _inertia(before, q, old, old.mass_kg - stays[0], old.inertia_kg_m2 - stays[1])
    taken = _inertia(before, q, new, new.mass_kg - stays[0], new.inertia_kg_m2 - stays[1])
    kept = before.mass(q) - left
    out, free = qd.copy(), np.setdiff1d(before.free_rows, given)
    if taken.any():
        held = np.setdiff1d(np.arange(before.n), free)
        M = kept + taken
        push = kept[free] @ qd - M[np.ix_(free, held)] @ qd[held]
        out[free] = np.linalg.solve(M[np.ix_(free, free)], push)
    change = qd - out
    lost = 0.5 * float(change @ kept @ change + out @ taken @ out)
    return Impact(out, lost, 0.5 * float(qd @ left @ qd))


def _inertia(
    system: System, q: np.ndarray, payload: Payload, mass: float, inertia: float
) -> np.ndarray:
    """What a body at a payload's centre adds to M(q) (22), (111): (n, n)."""
    frame = system.assembly.tip(q)
    if any(payload.centre_of_mass_m):
        frame = translate(frame, complex(*payload.centre_of_mass_m), [], np.zeros(system.n))
    columns = frame.velocity
    return np.asarray(
        mass * np.real(np.outer(columns.conj(), columns))
        + inertia * np.outer(frame.turning, frame.turning)
    )
