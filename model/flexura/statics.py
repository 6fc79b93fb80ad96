"""Static equilibrium: the elastic unknowns under gravity and a dead load at the tip, joints held."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import extended, nodal
from .errors import FlexuraError, InputError
from .observe import observe
from .system import System


def static(
    system: System, joints: Any = None, tip_force: tuple[float, float] = (0.0, 0.0), tip_moment: float = 0.0
) -> np.ndarray:
    """q (n,) with the joints at `joints` (N,) [m or rad] (default: their start) and K q + gravity(q) = J_tip^T (force, moment).

    `tip_force` [N] keeps its direction in the base frame, `tip_moment` [N m]; both act on the last link's tip. A single link
    under a transverse force P bends by P L^3 / (3 EI), the small-deflection value. Raises FlexuraError where no equilibrium is
    found (buckling under a load along the link, or deflections beyond the model).
    """
    q = system.start()
    if joints is not None:
        given = np.asarray(joints, dtype=float)
        if given.shape != system.joint_rows.shape or not np.all(np.isfinite(given)):
            raise InputError(f"expected {len(system.joint_rows)} finite joint positions", key="joints", value=joints)
        q[system.joint_rows] = given
    load = np.array([*tip_force, tip_moment], dtype=float)
    if load.shape != (3,) or not np.all(np.isfinite(load)):
        raise InputError("expected a finite force (x, y) and moment", key="tip_force", value=(tip_force, tip_moment))
    if system.robot.nodal:
        piece = nodal.at(system, q)
        q = static(piece.system, piece.part(q)[piece.system.joint_rows], tip_force, tip_moment)
        return piece.states(np.append(q, np.zeros(len(q)))[None])[0, : system.n]
    rows = system.elastic_rows
    if len(rows) == 0:
        return q

    K, zero = system.modal_stiffness, np.zeros(system.n)
    pick = np.ix_(rows, rows)

    def residual(z: np.ndarray) -> np.ndarray:
        inner = K @ z + system.residual(z, zero)
        return inner - extended.tip_jacobian(system.chain, system._work(), z).T @ load if load.any() else inner

    y = system.to_solver @ q
    scale = np.sqrt(np.diag(system.transform.T @ system.stiffness() @ system.transform)[rows])
    for _ in range(30):
        tangent = system.differences(residual, y)[pick]
        step = np.linalg.solve(tangent, residual(y)[rows])
        y[rows] -= step
        if not np.all(np.isfinite(y)):
            break
        if np.linalg.norm(step * scale) <= 1e-11 * (np.linalg.norm(y[rows] * scale) + 1e-9):
            if np.linalg.eigvalsh((tangent + tangent.T) / 2 / scale / scale[:, None])[0] <= 0:
                break  # an equilibrium, but an unstable one
            return system.transform @ y
    raise FlexuraError("no stable static equilibrium found: a link buckles, or the load bends it past a right angle")


def tip_pose(system: System, q: np.ndarray) -> np.ndarray:
    """x, y [m] and angle [rad] of the last link's tip in the base frame at q (n,)."""
    if system.robot.nodal:
        piece = nodal.at(system, q)
        return tip_pose(piece.system, piece.part(np.asarray(q, dtype=float)))
    links = len(system.robot.links)
    poses, tips, ends, energies = np.zeros((1, links, 3)), np.zeros((1, links, 2)), np.zeros((1, 2)), np.zeros((1, 3))
    state = np.concatenate([system.to_solver @ np.asarray(q, dtype=float), np.zeros(system.n)])[None]
    observe(system.chain, system._work(), state, poses, tips, ends, energies)
    return np.array([ends[0, 0], ends[0, 1], poses[0, -1, 2] + tips[0, -1, 1]])
