"""Inverse kinematics of a robot whose links bend: postures at rest with the tip at a place."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...io import array
from ...system import RobotLike, System, assemble, static
from .tip_output import PLACE, TipPath, output_kind

STEPS = 40  # of Newton's method
CLOSE = 1e-12  # m or rad
LONGEST = 0.3  # m or rad: a step of a joint
BENT = 0.5  # rad: an elbow from which the search begins where it fails from a straight one


def inverse_kinematics(
    robot: RobotLike, tip: ArrayLike, joints: ArrayLike | None = None
) -> np.ndarray:
    """Postures q (n,) or (T, n) in static equilibrium whose tip is at a place (115).

    Links are bent by their weight, so a rigid robot's answer is corrected by their deflection.

    Args:
        robot: a System, a Robot, or the path or name of a robot file, with one or two joints that
            move.
        tip: x and y [m] of a robot with two joints; with one, the polar angle [rad] seen from its
            axis, or the place along its rail [m]. Or rows of these, (T, 2) or (T,).
        joints: (links,), where the search begins [m or rad], by default their start: it decides on
            which side the elbow is. Where nothing is found from a straight elbow, it begins with
            the elbow bent to the left, and then to the right.

    Returns:
        q (n,), or (T, n) for rows.

    Raises:
        InputError: an argument is not what is expected, or the tip cannot be there.
    """
    system = exact_system(robot)
    kind, angle = output_kind(system)
    count = 2 if kind == PLACE else 1
    places = array(tip, "tip", "expected a place of the tip, or rows of places")
    if places.ndim > count or (count == 2 and places.shape[-1:] != (2,)):
        raise InputError(f"expected {count} numbers a place", key="tip", value=places.shape)
    path = TipPath(kind, (), 0.0, 0.0, angle)
    found = postures(system, path, places.reshape(-1, count), static(system, joints))
    return found[0] if places.ndim == count - 1 else found


def exact_system(robot: RobotLike) -> System:
    """The System of a robot on the exact line. Raises InputError for the dissertation's models."""
    system = assemble(robot)
    if not system.exact:
        raise InputError(
            "expected true, and continuous sliding: the dissertation's models have no derivatives",
            key="stiffening",
            value=system.robot.stiffening,
        )
    for i, link in enumerate(system.robot.links, 1):
        if link.joint.transmission is not None:
            raise InputError(
                "expected none: motions that are asked for need drives that act on the hub",
                key=f"link[{i}].joint.transmission",
            )
    return system


def postures(system: System, path: TipPath, places: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Postures (T, n) with the tip at `places` (T, m), one after another from q (n,) on.

    Raises: InputError: none was found for a place.
    """
    out: list[np.ndarray] = []
    for k, place in enumerate(places):
        found = None
        if k > 0 and _near(place, places[k - 1]):
            found = _newton(system, path, place, out[-1])
        else:
            for start in [out[-1]] if out else _starts(system, q):
                found = _approach(system, path, place, start)
                if found is not None:
                    break
        if found is None:
            raise InputError(
                "expected a place within reach, at which the joints can move the tip in every "
                "direction: no posture was found",
                key="tip",
                value=tuple(float(f"{x:.6g}") for x in place),
            )
        out.append(found)
    return np.array(out)


def _starts(system: System, q: np.ndarray) -> list[np.ndarray]:
    """Where a search begins: q (n,), and the same with the last joint turned either way."""
    free = np.flatnonzero(~system.locked)
    out = [q]
    if len(free) == 2 and system.robot.links[free[1]].joint.type == "R":
        for side in (BENT, -BENT):
            turned = q.copy()
            turned[system.joint_rows[free[1]]] += side
            out.append(turned)
    return out


def _near(place: np.ndarray, before: np.ndarray) -> bool:
    return bool(np.abs(place - before).max() < LONGEST / 3)


def _approach(system: System, path: TipPath, place: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """A posture with the tip at a place (m,), on a straight way there from the tip at q (n,); None
    where there is none."""
    zero = np.zeros((1, system.n))
    _, _, _, _, tip, slope = system.equations.force_derivatives(q[None], zero, zero)
    off = path.deviation(tip, slope, place[None])[0][0]
    ways = max(2, int(np.ceil(np.abs(off).max() / (LONGEST / 6))))
    found: np.ndarray | None = q
    for share in np.linspace(0, 1, ways + 1)[1:]:
        if found is not None:
            found = _newton(system, path, place + (1 - share) * off, found)
    return found


def _newton(system: System, path: TipPath, place: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """A posture with the tip at a place (m,), near q (n,); None where there is none."""
    zero, joints = np.zeros((1, system.n)), system.joint_rows
    free = joints[~system.locked]
    rows = np.concatenate([system.elastic_rows, free])
    for _ in range(STEPS):
        force, K, _, _, tip, slope = system.equations.force_derivatives(q[None], zero, zero)
        off, by_q = path.deviation(tip, slope, place[None])
        matrix = np.vstack([K[0][system.elastic_rows], by_q[0]])[:, rows]
        left = np.concatenate([force[0][system.elastic_rows], off[0]])
        size = np.abs(matrix).max(axis=1) + 1e-300
        try:
            step = np.linalg.solve(matrix / size[:, None], left / size)
        except np.linalg.LinAlgError:
            break
        longest = np.abs(step).max(initial=0.0)
        if not np.isfinite(longest):
            break
        q = q.copy()
        q[rows] -= step * min(1.0, LONGEST / max(longest, 1e-300))
        if longest < CLOSE:
            return q
    return None
