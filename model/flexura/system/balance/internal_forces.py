"""Reactions of joints, and bending moment, shear force, axial force and stress along links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError, guarded
from ...io import array, number, summary
from ...robot import Robot
from ...signals import Loads, LoadsLike, as_loads
from ..statics import static
from ..system import RobotLike, System, assemble
from .cuts import Balance, PointLoad, Reaction


class LinkForces(NamedTuple):
    """Forces in the sections of a link at abscissas `s` [m] from its proximal end, each (S,) (141).

    `bending_moment` [N m]: positive where the link bends to the left. `shear_force` [N]: what the
    part beyond exerts on the part before, across the tangent to the left. `axial_force` [N]:
    positive where it pulls. `stress` [Pa]: bending stress of the outer fibre to the left, positive
    where it is drawn out (146); None: the link has no section with a height. In and behind a sleeve
    all are nan.
    """

    s: np.ndarray
    bending_moment: np.ndarray
    shear_force: np.ndarray
    axial_force: np.ndarray
    stress: np.ndarray | None


class InternalForces:
    """The forces within a robot in one state (139) to (146). Joints and links count from 1."""

    def __init__(self, system: System, balance: Balance) -> None:
        self._system, self._balance = system, balance

    def __repr__(self) -> str:
        return summary.text(*self._summary())

    def _repr_html_(self) -> str:
        return summary.html(*self._summary())

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        robot, rows = self._system.robot, []
        for i in range(1, len(robot.links) + 1):
            force, moment, *_ = self.reaction(i)
            rows.append(
                (
                    f"joint {i}",
                    f"force {force.real:.4g}, {force.imag:.4g} N, moment {moment:.4g} N m",
                )
            )
        rows.append(("sections", "link(NUMBER): bending moment, shear and axial force, stress"))
        return f"InternalForces of {robot.name or 'a robot'}, {robot.structure}", rows

    def reaction(self, joint: int) -> Reaction:
        """What link i-1 exerts on link i at joint i (139), (140).

        Args:
            joint: its number, from 1.

        Returns:
            `force` x + iy [N] in the base's axes; `moment` [N m] about `place` x + iy [m]: of a
            joint R its axis, of Pa the hub, of Pb the sleeve's exit; `axis` [rad]: the angle of
            the line on which Pa or Pb slides.

        Raises:
            InputError: there is no such joint.
        """
        count = len(self._system.robot.links)
        expected = f"expected a joint from 1 to {count}"
        if number(joint, "joint", expected) not in range(1, count + 1):
            raise InputError(expected, key="joint", value=joint)
        return Reaction(*(x.item() for x in self._balance.reaction(joint - 1)))

    def link(self, link: int, s: ArrayLike | None = None) -> LinkForces:
        """The forces in sections of a link (141), (146).

        Args:
            link: its number, from 1.
            s: abscissas from its proximal end (S,) [m]; None: 101 of them from end to end.

        Returns:
            The forces, each (S,). At a lumped mass, a slider or a load they are those before it.

        Raises:
            InputError: there is no such link or place, or a rigid link's mass is not spread.
        """
        robot, places = self._system.robot, self._system.abscissas(link, s)
        own = robot.links[link - 1]
        inner = (places > 0) & (places < own.length_m)
        if not sections_known(robot, link - 1) and inner.any():
            expected = (
                "0 or the link's length: how the mass of a rigid link is spread is not given; "
                "expected mass_per_length_kg_m in place of mass_kg"
            )
            raise InputError(expected, key="s", value=float(places[inner][0]))
        rows = [self._balance.section(link - 1, float(x)) for x in places]
        moment, shear, axial = np.array(rows).reshape(-1, 3).T.copy()
        return LinkForces(places, moment, shear, axial, own.bending_stress(moment, places))


@guarded("the internal forces")
def internal_forces(
    robot: RobotLike,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    qdd: ArrayLike | None = None,
    *,
    tip_force: ArrayLike = (0.0, 0.0),
    tip_moment: float = 0.0,
    loads: LoadsLike = None,
    t: float = 0.0,
) -> InternalForces:
    """The forces within a robot in a state: of its joints, and along its links (139) to (146).

    They are what the masses beyond a cut take against inertia and gravity, less the loads.
    For all times of a simulation: `flexura.simulate(..., internal_forces=True)`.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        q: configuration (n,); None: the static equilibrium under the load, joints at their start.
        qd: its rates (n,); None: at rest.
        qdd: its accelerations (n,); None: none.
        tip_force: x and y [N] at the last tip, in the base's axes.
        tip_moment: moment there [N m].
        loads: forces and moments on links, as in `flexura.simulate`.
        t: the time whose loads act [s].

    Returns:
        The forces, by `reaction(joint)` and `link(link, s)`.

    Raises:
        InputError: an argument is not what is expected, or the robot slides from node to node.
        NoEquilibrium: q is not given and there is no static equilibrium.
    """
    system = assemble(robot)
    check_continuous(system)
    force = array(tip_force, "tip_force", "expected a finite force (x, y) in newtons", (2,))
    moment, t = number(tip_moment, "tip_moment"), number(t, "t")
    at = static(system, None, force, moment, loads=loads, t=t) if q is None else system.check(q)
    rates, more = (
        np.zeros(system.n) if x is None else system.check(x, key)
        for x, key in ((qd, "qd"), (qdd, "qdd"))
    )
    last = len(system.robot.links)
    tip = PointLoad(last - 1, system.robot.links[-1].length_m, complex(*force), float(moment))
    on_links = as_loads(loads, [link.length_m for link in system.robot.links], t, t)
    acting = [tip, *point_loads(on_links, np.array([t]))]
    balance = Balance(system.assembly.structure, at[None], rates[None], more[None], acting)
    return InternalForces(system, balance)


def point_loads(loads: Loads, t: np.ndarray) -> list[PointLoad]:
    """The loads of a run, as the balance takes them (133), (134).

    Args:
        loads: forces and moments on links.
        t: times (T,) [s].

    Returns:
        One PointLoad a load, each with T values.
    """
    if not loads or not len(t):
        return []
    values = np.array([loads.values(float(at)) for at in t])  # (T, L, 3)
    return [
        PointLoad(int(link), float(at), own[:, 0] + 1j * own[:, 1], own[:, 2], bool(turns))
        for (link, at, turns), own in zip(loads.rows, values.transpose(1, 0, 2), strict=True)
    ]


def check_continuous(system: System) -> None:
    """Refuse a robot that slides from node to node, whose cuts have no balance.

    Args:
        system: the robot.

    Raises:
        InputError: it does.
    """
    if system.robot.nodal:
        text = (
            'expected "continuous": sliding from node to node puts hubs beside their line, so that '
            "forces at a cut do not balance"
        )
        raise InputError(text, key="sliding", value="nodal")


def sections_known(robot: Robot, i: int) -> bool:
    """Whether forces are known in every section of a link: a rigid one with a mass must say how it
    is spread.

    Args:
        robot: the robot.
        i: number of the link, from 0.

    Returns:
        True if they are.
    """
    return robot.links[i].flexible or not robot.links[i].mass_kg
