"""Inverse kinematics of a robot whose links bend: postures at rest with the tip at a place."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlexuraError, InputError
from ...io import array
from ...system import RobotLike, System, assemble, static
from .tip_output import PLACE, TipPath, output_kind

STEPS = 40  # of Newton's method
CLOSE = 1e-12  # m or rad
STRETCHED = 0.01  # rad: an elbow's angle
ELBOW = 0.5  # rad
LONGEST = 0.3  # m or rad: a step of a joint


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
            which side the elbow is. An arm that is stretched there begins with its elbow bent to
            the left.

    Returns:
        q (n,), or (T, n) for rows.

    Raises:
        InputError: an argument is not what is expected.
        FlexuraError: no posture was found: the tip cannot be there.
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
    """Postures (T, n) with the tip at `places` (T, m), one after another from q (n,) on."""
    out, before = [], None
    for place in places:
        if before is None:
            q = _first(system, path, place, q)
        elif not _near(place, before):
            q = _approach(system, path, place, q)
        else:
            q = _newton(system, path, place, place, q)
        before = place
        out.append(q)
    return np.array(out)


def _first(system: System, path: TipPath, place: np.ndarray, q: np.ndarray) -> np.ndarray:
    """A posture with the tip at a place (m,), from q (n,) on, or, if the arm is stretched there and
    cannot move its tip towards the place, from q with the elbow bent to the left."""
    try:
        return _approach(system, path, place, q)
    except FlexuraError:
        rows = [
            i
            for i, x in zip(system.joint_rows, system.robot.links, strict=True)
            if x.joint.type == "R" and not x.joint.locked
        ]
        if len(rows) < 2 or abs(np.sin(q[rows[-1]])) > STRETCHED:
            raise
        joints = q.copy()
        joints[rows[-1]] += ELBOW
        return _approach(system, path, place, static(system, joints[system.joint_rows]))


def _near(place: np.ndarray, before: np.ndarray) -> bool:
    return bool(np.abs(place - before).max() < LONGEST / 3)


def _approach(system: System, path: TipPath, place: np.ndarray, q: np.ndarray) -> np.ndarray:
    """A posture with the tip at a place (m,), on a straight way there from the tip at q (n,)."""
    zero = np.zeros((1, system.n))
    _, _, _, _, tip, slope = system.equations.force_derivatives(q[None], zero, zero)
    off = path.deviation(tip, slope, place[None])[0][0]
    ways = max(2, int(np.ceil(np.abs(off).max() / (LONGEST / 6))))
    for share in np.linspace(0, 1, ways + 1)[1:]:
        q = _newton(system, path, place + (1 - share) * off, place, q)
    return q


def _newton(
    system: System, path: TipPath, place: np.ndarray, end: np.ndarray, q: np.ndarray
) -> np.ndarray:
    """A posture with the tip at a place (m,), which is on the way to `end` (m,), from q (n,) on."""
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
    where, here = (", ".join(f"{x:.6g}" for x in xs) for xs in (end, place))
    way = "" if here == where else f"; the straight way there ends before {here}"
    raise FlexuraError(
        f"no posture found with the tip at {where}: it is out of reach, or the joints cannot move "
        f"it in every direction there{way}"
    )
