"""Static equilibrium: the elastic unknowns under gravity and a dead load at the tip, joints
held."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import FlexuraError, InputError, guarded
from ..io import array, number
from ..signals import Loads, LoadsLike, as_loads
from .loads import borne
from .system import RobotLike, System, assemble

STABLE, UNSTABLE = 0, 1  # Balance of model/core/statics_and_modes/equilibrium.hpp


class NoEquilibrium(FlexuraError):
    """No stable static equilibrium: `q` (n,) is the last one on the way, under `share` of gravity
    and load."""

    def __init__(self, text: str, q: np.ndarray, share: float) -> None:
        super().__init__(text)
        self.q, self.share = q, share


@guarded("the static equilibrium")
def static(
    robot: RobotLike,
    joints: ArrayLike | None = None,
    tip_force: ArrayLike = (0.0, 0.0),
    tip_moment: float = 0.0,
    *,
    loads: LoadsLike = None,
    t: float = 0.0,
) -> np.ndarray:
    """The static equilibrium with the joints held: elastic + gravity = J_tip^T load (50).

    The load grows in steps from the straight robot, so that any bending is found: a cantilever
    under a dead transverse force P takes the shape of the elastica for any P L^2 / EI.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        joints: positions (links,) [m or rad]; None: their start.
        tip_force: x and y [N] at the last tip, in the base's axes.
        tip_moment: moment there [N m].
        loads: forces and moments on links (136), as in `flexura.simulate`.
        t: the time whose loads act [s].

    Returns:
        q (n,) in the order of `system.labels`.

    Raises:
        InputError: an argument is not what is expected.
        NoEquilibrium: a link buckles under the load, or none was found.
    """
    system = assemble(robot)
    force = array(tip_force, "tip_force", "expected a finite force (x, y) in newtons", (2,))
    load = np.array([*force, number(tip_moment, "tip_moment")])
    q = joint_positions(system, joints)
    on_links = as_loads(loads, [link.length_m for link in system.robot.links], t, t)
    if not system.exact:
        system = system.fixed(q)
        return _with_loads(system, _dense(system, q, load), load, on_links, t)
    return _with_loads(system, equilibrium(system.equations, q, load), load, on_links, t)


def _with_loads(
    system: System, q: np.ndarray, tip: np.ndarray, loads: Loads, t: float
) -> np.ndarray:
    """The equilibrium under loads on links, from the one without them."""
    if not loads or not loads.values(t).any():
        return q
    if tip.any():
        text = "expected a load at the tip or loads on links, not both: give both as loads"
        raise InputError(text, key="loads", value=len(loads.each))
    found, share, unstable = borne(system, q, loads, t)
    if share == 1.0:
        return found
    if unstable:
        text = f"no stable static equilibrium: beyond {share:.4g} of the loads a link buckles"
    else:
        text = f"no static equilibrium found beyond {share:.4g} of the loads"
    raise NoEquilibrium(text, found, share)


def equilibrium(equations: Any, q: np.ndarray, load: np.ndarray | None = None) -> np.ndarray:
    """The static equilibrium with the joints where they are, under a load at the tip (50).

    Args:
        equations: the robot's equations in the core.
        q: configuration (n,), whose joints stay.
        load: force x, y [N] and moment [N m] (3,); None: none.

    Returns:
        The configuration (n,).

    Raises:
        NoEquilibrium: there is none, or it was not found.
    """
    free = np.zeros(len(equations.first), dtype=np.uint8)
    found, balance, share, _ = equations.equilibrium(q, np.zeros(3) if load is None else load, free)
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


@guarded("the holding forces")
def holding(robot: RobotLike, q: ArrayLike | None = None) -> np.ndarray:
    """The drives that hold the joints at rest (25): elastic forces and gravity in their rows.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        q: configuration (n,); None: the static equilibrium at the start.

    Returns:
        Drives (links,) [N or N m].

    Raises:
        InputError: an argument is not what is expected.
        NoEquilibrium: q is not given and there is no static equilibrium.
    """
    system = assemble(robot)
    at = static(system) if q is None else q
    system, rest = system.fixed(at), np.zeros(system.n)
    return system.forces(at, rest, rest)[system.joint_rows]


def joint_positions(system: System, joints: ArrayLike | None) -> np.ndarray:
    """q (n,) of the straight robot with the joints at `joints` (links,) [m or rad], by default
    their start. Raises InputError."""
    q = system.start()
    if joints is not None:
        rows = system.joint_rows
        q[rows] = array(
            joints, "joints", f"expected {len(rows)} finite joint positions", rows.shape
        )
    return q


def tip_pose(robot: RobotLike, q: ArrayLike) -> np.ndarray:
    """x, y and angle of the last link's tip in the base's axes.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        q: configuration (n,), in the order of `system.labels`.

    Returns:
        x, y [m] and angle [rad] (3,).

    Raises:
        InputError: an argument is not what is expected.
    """
    system = assemble(robot).fixed(q)
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
