"""Static equilibrium: the elastic unknowns under gravity and a dead load at the tip, joints
held."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import FlexuraError, InputError
from .system import System, system_of

STABLE, UNSTABLE = 0, 1  # Balance of model/core/statics_and_modes/equilibrium.hpp


class NoEquilibrium(FlexuraError):
    """No stable static equilibrium: `q` (n,) is the last one on the way, under `share` of gravity
    and load."""

    def __init__(self, text: str, q: np.ndarray, share: float) -> None:
        super().__init__(text)
        self.q, self.share = q, share


def static(
    robot: Any,
    joints: Any = None,
    tip_force: tuple[float, float] = (0.0, 0.0),
    tip_moment: float = 0.0,
) -> np.ndarray:
    """The static equilibrium q (n,) with the joints held: elastic + gravity = J_tip^T load (50).

    The load grows in steps from the straight robot, so that any bending is found: a cantilever
    under a dead transverse force P takes the shape of the elastica for any P L^2 / EI.

    Args: robot: a System, a Robot, or a robot file; joints (links,): positions [m or rad], by
    default their start; tip_force:
        x and y [N] at the last tip, in the base's axes; tip_moment [N m] there.

    Returns: q (n,) in the order of `system.labels`.

    Raises: InputError: an argument is not what is expected. NoEquilibrium: a link buckles under the
    load, or none was found.
    """
    system = system_of(robot)
    q, load = held(system, joints), np.array([*tip_force, tip_moment], dtype=float)
    if load.shape != (3,) or not np.all(np.isfinite(load)):
        raise InputError(
            "expected a finite force (x, y) and moment",
            key="tip_force",
            value=(tip_force, tip_moment),
        )
    if not system.exact:
        return _dense(system.fixed(q), q, load)
    free = np.zeros(len(system.joint_rows), dtype=np.uint8)
    found, balance, share, _ = system.equations.equilibrium(q, load, free)
    if balance == STABLE:
        return np.asarray(found)
    if balance == UNSTABLE:
        text = (
            f"no stable static equilibrium: beyond {share:.4g} of gravity and load a link "
            f"buckles or snaps through"
        )
    else:
        text = f"no static equilibrium found beyond {share:.4g} of gravity and load"
    raise NoEquilibrium(text, np.asarray(found), float(share))


def held(system: System, joints: Any) -> np.ndarray:
    """q (n,) of the straight robot with the joints at `joints` (links,) [m or rad], by default
    their start. Raises InputError."""
    q = system.start()
    if joints is not None:
        given = np.asarray(joints, dtype=float)
        if given.shape != system.joint_rows.shape or not np.all(np.isfinite(given)):
            raise InputError(
                f"expected {len(system.joint_rows)} finite joint positions",
                key="joints",
                value=joints,
            )
        q[system.joint_rows] = given
    return q


def tip_pose(robot: Any, q: Any) -> np.ndarray:
    """x, y [m] and angle [rad] of the last link's tip in the base's axes at q (n,)."""
    system = system_of(robot)
    system = system.fixed(q)
    x, y, angle = system.line(q, len(system.robot.links), [system.robot.links[-1].length_m])
    return np.array([x[0], y[0], angle[0]])


def _dense(system: System, q: np.ndarray, load: np.ndarray) -> np.ndarray:
    """The equilibrium of the dissertation's linear model, by Newton's method on the dense
    equations."""
    rows, pick = system.elastic_rows, np.ix_(system.elastic_rows, system.elastic_rows)
    if len(rows) == 0:
        return q

    def balance(z: np.ndarray) -> np.ndarray:
        out = system.assembly.elastic(z) + system.assembly.gravity(z)
        if not load.any():
            return out
        tip = system.assembly.tip(z)
        return out - np.real(tip.velocity.conj() * complex(*load[:2])) - load[2] * tip.turning

    for _ in range(30):
        step = np.linalg.solve(system.tangent(q)[pick], balance(q)[rows])
        q[rows] -= step
        if np.linalg.norm(step) <= 1e-11 * (np.linalg.norm(q[rows]) + 1e-9):
            return q
    raise NoEquilibrium("no static equilibrium found", q, 0.0)
