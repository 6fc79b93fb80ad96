"""What happens where a payload is taken up or let go (134), (135)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..robot import Payload
from ..signals import PayloadChange
from .kinematics import translate
from .system import System, assemble


class Impact(NamedTuple):
    """A change of the payload at an instant.

    qd: rates after it (n,). lost: kinetic energy that the impact takes [J] (135). gone: kinetic
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
    """The rates after the payload has changed (134), and the energy that goes (135).

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
    """What a body at a payload's centre adds to M(q) (22), (109): (n, n)."""
    frame = system.assembly.tip(q)
    if any(payload.centre_of_mass_m):
        frame = translate(frame, complex(*payload.centre_of_mass_m), [], np.zeros(system.n))
    columns = frame.velocity
    return np.asarray(
        mass * np.real(np.outer(columns.conj(), columns))
        + inertia * np.outer(frame.turning, frame.turning)
    )
