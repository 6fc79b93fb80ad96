"""`sliding = "nodal"`: the dissertation's own treatment of Pa on a flexible link and of Pb, for comparison.

Pa: the hub sits at (d, w_k) of the link it rides on, with the slope of node k = ceil(d / l_e), which ends the element under it
(table 2.1), and without convective terms. Pb: the mesh is fixed to the link, node k at X_k = k L / n. Nodes ahead of the sleeve,
X_k > L - d, are active, the others at rest on its axis (the time-dependent boundary), so that the link is clamped at X_j, j the
last node at rest: up to l_e behind the sleeve's exit. As d > 0, the last node is active, whatever n.

While k and j stay, the robot is one of fixed structure, a `Piece`, and the ordinary solver takes it: behind a sleeve, a rigid Pb
link with the mass of [0, X_j] and, on a locked joint, the elements beyond. Where one changes, the joints, the elastic unknowns
and their rates stay as they are, as in the dissertation's state vector, but those of a node that enters its sleeve become 0; by
how much the energy jumps is logged. What this costs in accuracy is measured in `model/README.md`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .assembly import assemble
from .beam import link_integrals, shape
from .choice import choose
from .cutting import laws
from .drive import Drive, JointDrive
from .errors import InputError
from .loop import EXPLICIT
from .record import describe, energy_error, limit_event
from .robot import Joint, Link, Robot
from .run import STATIONS, Run
from .signal import Signal
from .system import System

_SAME = 1e-9  # of an element: on the node
_ENERGIES = ("energy/kinetic", "energy/strain", "energy/potential")


@dataclass(frozen=True)
class Piece:
    """A robot of fixed structure in place of one that slides node by node: N joints and n unknowns have m in `system`."""

    whole: System
    system: System
    rows: np.ndarray  # (m,) int: the row of the whole robot's q; -1: the locked joint of a link cut in two
    shift: np.ndarray  # (m,) what a slider on a cut link is closer to that link's origin [m]
    hubs: np.ndarray  # (N,) int: the piece's link with the hub of link i
    ends: np.ndarray  # (N,) int: the piece's link with the tip of link i; another one where link i is cut
    cells: np.ndarray  # (N, 2): the joints' positions while this piece holds

    def part(self, q: np.ndarray) -> np.ndarray:
        """Its unknowns (m,) from the whole robot's q (n,)."""
        return np.where(self.rows >= 0, q[self.rows], 0.0) - self.shift

    def rates(self, qd: np.ndarray) -> np.ndarray:
        """Its velocities (m,) from the whole robot's (n,)."""
        return np.where(self.rows >= 0, qd[self.rows], 0.0)

    def states(self, states: np.ndarray) -> np.ndarray:
        """The whole robot's states (T, 2n) from its own (T, 2m): nodes at rest are 0."""
        n, m = self.whole.n, len(self.rows)
        out, real = np.zeros((len(states), 2 * n)), self.rows >= 0
        out[:, self.rows[real]] = (states[:, :m] + self.shift)[:, real]
        out[:, n + self.rows[real]] = states[:, m:][:, real]
        return out

    def drive(self, drive: Drive | Callable[..., Any]) -> Drive | Callable[..., Any]:
        """The whole robot's drive, acting on the piece."""
        hubs, shift = self.hubs, self.shift[self.system.joint_rows]
        if isinstance(drive, Drive):
            joints = [JointDrive()] * len(shift)
            for hub, joint in zip(hubs, drive.joints, strict=True):
                joints[hub] = replace(joint, motion=_moved(joint.motion, shift[hub]))
            return Drive(tuple(joints))

        def call(t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float) -> np.ndarray:
            given = np.asarray(drive(t, (position + shift)[hubs], velocity[hubs], tip_deflection), dtype=float)
            if given.shape != hubs.shape:
                raise InputError(
                    f"expected {len(hubs)} finite forces from the drive function at t = {t:g} s", key="drive", value=given
                )
            out = np.zeros(len(shift))
            out[hubs] = given
            return out

        return call

    def channels(self, run: Run, states: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, str]]:
        """The whole robot's channels and units from the piece's run and the whole robot's states (T, 2n)."""
        robot = self.whole.robot
        names: dict[str, str] = {}
        bent: dict[str, np.ndarray] = {}
        for i, (hub, row) in enumerate(zip(self.hubs, self.whole.joint_rows, strict=True), 1):
            names |= {f"joint/{i}/{name}": f"joint/{hub + 1}/{name}" for name in ("position", "velocity", "drive")}
            bent[f"joint/{i}/position"] = states[:, row]
        for i, (link, hub, end) in enumerate(zip(robot.links, self.hubs, self.ends, strict=True), 1):
            names |= {f"link/{i}/{name}": f"link/{hub + 1}/{name}" for name in ("x", "y", "angle")}
            if link.flexible:
                line = [f"deflection/{k}" for k in range(STATIONS)]
                names |= {f"link/{i}/{name}": f"link/{end + 1}/{name}" for name in ("tip_deflection", "tip_slope", *line)}
            if hub != end:
                own = states[:, self.whole.chain.first[i - 1] + 1 : self.whole.chain.first[i]]
                values = own @ shape(link.length_m, link.elements, np.linspace(0, link.length_m, STATIONS))
                bent |= {f"link/{i}/deflection/{k}": values[:, k] for k in range(STATIONS)}
        names |= {name: name for name in ("tip/x", "tip/y", *_ENERGIES, "energy/work", "energy/loss")}
        return {a: bent.get(a, run[b]) for a, b in names.items()}, {a: run.units[b] for a, b in names.items()}


def at(system: System, q: np.ndarray) -> Piece:
    """The piece at q (n,)."""
    position = np.asarray(q, dtype=float)[system.joint_rows]
    return _piece(system, _nodes(system.robot, position), position)


def simulate(
    solve: Callable[..., Run],
    system: System,
    t: np.ndarray,
    drive: Drive | Callable[..., Any],
    q: np.ndarray,
    qd: np.ndarray,
    rtol: float,
    method: str,
    progress: Callable[[float], None] | None,
) -> Run:
    """`forward.simulate`, which is also `solve`, for a robot that slides node by node: piece after piece.

    Arguments as checked there; a Python `drive` takes four arguments. In q, qd (n,) the nodes of a sleeved link are fixed to it;
    what is given for those at rest is left out. `meta["energy_jumps"]` lists the changes, {t, text, J}, and
    `meta["energy_error"]` leaves them out.
    """
    position = q[system.joint_rows]
    nodes, now = _nodes(system.robot, position), float(t[0])
    rows: list[tuple[Piece, Run, np.ndarray, float]] = []  # with the rows that are outputs, and the jumps so far
    events: list[dict[str, Any]] = []
    jumps: list[dict[str, Any]] = []
    text, jumped, complete = "", 0.0, False

    def report(done: float) -> None:
        if progress is not None:
            progress((now + done * (t[-1] - now) - t[0]) / (t[-1] - t[0]))

    try:
        while not complete:
            piece = _piece(system, nodes, position)
            if method == "auto":
                method = "explicit" if choose(piece.system, t[-1] - t[0], rtol) == EXPLICIT else "implicit"
            times = np.append(now, t[t > now])
            run = solve(
                piece.system, times, piece.drive(drive), piece.part(q), piece.rates(qd), rtol, method=method, progress=report
            )
            if rows:
                jump = float(_total(run)[0] - _total(rows[-1][1])[-1])
                jumped += jump
                jumps.append({"t": now, "text": text, "J": jump})
                events.append({"t": now, "level": "INFO", "text": f"{text}: the energy jumps by {jump:.3g} J"})
            wanted = np.isin(run.t, t)
            wanted[0] = not rows
            rows.append((piece, run, wanted, jumped))
            complete, now = run.complete, float(run.t[-1])
            if complete:
                break
            q, qd = np.split(piece.states(run.states[-1:])[0], 2)  # type: ignore[index]
            position = q[system.joint_rows]
            crossed = _crossed(system, piece, position)
            if crossed is None:
                stop = run.meta["events"][-1]
                if stop["level"] == "ERROR":
                    stop = limit_event(system, _first_outside(system, position), now, position)
                    wanted[-1] = True  # the last good state
                events.append(stop)
                break
            text = _change(system, nodes, *crossed, q, qd)
    except KeyboardInterrupt:
        events.append({"t": now, "level": "WARN", "text": "interrupted"})
    return _joined(
        system, rows, {"complete": complete, "events": events, "energy_jumps": jumps, "rtol": rtol, "method": method}, drive
    )


def _nodes(robot: Robot, position: np.ndarray) -> np.ndarray:
    """(N,) int, with the joints at `position`: the last node at rest behind a sleeve, the node that a slider takes; else 0."""
    out = np.zeros(len(position), dtype=np.int64)
    for i, link in enumerate(robot.links):
        if _cut(link):
            out[i] = np.clip(np.floor(link.elements * (1 - position[i] / link.length_m) + _SAME), 0, link.elements - 1)
        elif robot.rides(i):
            under = robot.links[i - 1]
            first = out[i - 1] + 1 if _cut(under) else 1
            out[i] = np.clip(np.ceil(under.elements * position[i] / under.length_m - _SAME), first, under.elements)
    return out


def _cut(link: Link) -> bool:
    return link.joint.type == "Pb" and link.flexible


def _place(link: Link, node: int) -> float:
    return link.length_m * int(node) / link.elements


def _cells(system: System, nodes: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Between which positions (N, 2) the joints have these nodes; a position just beyond, on its way in, is inside."""
    out = system.limits.copy()
    for i, link in enumerate(system.robot.links):
        if _cut(link):
            cell = (link.length_m - _place(link, nodes[i] + 1), link.length_m - _place(link, nodes[i]))
        elif system.robot.rides(i):
            cell = (_place(system.robot.links[i - 1], nodes[i] - 1), _place(system.robot.links[i - 1], nodes[i]))
        else:
            continue
        out[i] = min(max(out[i, 0], cell[0]), position[i]), max(min(out[i, 1], cell[1]), position[i])
    return out


def _piece(whole: System, nodes: np.ndarray, position: np.ndarray) -> Piece:
    robot, first, cells = whole.robot, whole.chain.first, _cells(whole, nodes, position)
    links: list[Link] = []
    rows, shift, hubs, ends, node = [], [], [], [], []
    behind = 0.0  # where the flexible link before this one begins, on that link
    for i, link in enumerate(robot.links):
        own = behind if robot.rides(i) else 0.0
        limits = (cells[i, 0] - own, cells[i, 1] - own)
        joint = link.joint.model_copy(update={"limits": limits, "start": float(position[i] - own)})
        node.append(nodes[i] - (nodes[i - 1] if own > 0.0 else 0) if robot.rides(i) else 0)
        hubs.append(len(links))
        rows.append([first[i]])
        shift.append([own])
        skipped, behind = 0, 0.0
        if _cut(link):
            skipped, behind = 2 * nodes[i], _place(link, nodes[i])
            links.append(_inside(link, behind, joint))
            links.append(_beyond(link, behind, int(nodes[i])))
            node.append(0)
            rows.append([-1])
            shift.append([-behind])
        else:
            links.append(link.model_copy(update={"joint": joint}))
        ends.append(len(links) - 1)
        elastic = range(first[i] + 1 + skipped, first[i + 1])
        rows.append(list(elastic))
        shift.append([0.0] * len(elastic))
    system = assemble(robot.model_copy(update={"link": links, "sliding": "continuous"}))
    system = replace(system, chain=system.chain._replace(node=np.array(node, dtype=np.int64)))
    flat = lambda parts, kind: np.array([x for part in parts for x in part], dtype=kind)
    return Piece(whole, system, flat(rows, np.int64), flat(shift, float), np.array(hubs), np.array(ends), cells)


def _inside(link: Link, length: float, joint: Joint) -> Link:
    """The part [0, length] of a link as a rigid one that slides through the sleeve, as long as the whole."""
    mass, centre, inertia = 0.0, 0.0, 0.0
    if length > 0.0:
        rigid = {"length_m": length, "elements": 0, "joint": Joint(type="R")}
        info = link_integrals(link.model_copy(update=rigid | laws(link, 0.0, length)))
        mass, centre = info.mass, info.s1 / info.mass
        inertia = max(info.inertia - mass * centre**2, 0.0)
    return Link(length_m=link.length_m, mass_kg=mass, centre_of_mass_m=centre, inertia_kg_m2=inertia, joint=joint)


def _beyond(link: Link, start: float, node: int) -> Link:
    """The elements of a link after `node`, at `start`, on a joint locked there."""
    joint = Joint(type="Pa", locked=True, start=start)
    size = {"length_m": link.length_m - start, "elements": link.elements - node, "joint": joint}
    return link.model_copy(update=size | laws(link, start, link.length_m))


def _moved(motion: Signal | None, by: float) -> Signal | None:
    if motion is None or by == 0.0:
        return motion
    segments = motion.segments.copy()
    segments[:, 1] -= by
    return Signal(segments, motion.spec)


def _total(run: Run) -> np.ndarray:
    return sum((run[name] for name in _ENERGIES), np.zeros(len(run)))


def _crossed(system: System, piece: Piece, position: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Which joints (N,) left their cells downwards and upwards; None where one left the robot's own limits, or none did."""
    low, high = position < piece.cells[:, 0], position > piece.cells[:, 1]
    ended = (low & (piece.cells[:, 0] <= system.limits[:, 0])) | (high & (piece.cells[:, 1] >= system.limits[:, 1]))
    return (low, high) if (low | high).any() and not ended.any() else None


def _first_outside(system: System, position: np.ndarray) -> int:
    """The joint (from 0) that stopped the run: beyond its limits, or else the slider closest to its link's sleeve."""
    outside = np.flatnonzero((position < system.limits[:, 0]) | (position > system.limits[:, 1]))
    if len(outside):
        return int(outside[0])
    links = system.robot.links
    gaps = {
        i: position[i] + position[i - 1] - links[i - 1].length_m
        for i in range(1, len(links))
        if links[i].joint.type == "Pa" and links[i - 1].joint.type == "Pb"
    }
    return min(gaps, key=lambda i: gaps[i])


def _change(system: System, nodes: np.ndarray, low: np.ndarray, high: np.ndarray, q: np.ndarray, qd: np.ndarray) -> str:
    """Count `nodes` on for the joints that left their cells, and put to rest those that entered a sleeve; says what happened."""
    said = []
    for i, link in enumerate(system.robot.links):
        step = int(high[i]) - int(low[i])
        if step and _cut(link):
            nodes[i] -= step
            if step > 0:
                said.append(f"node {nodes[i] + 1} of link {i + 1} left its sleeve")
            else:
                own = system.chain.first[i] + 2 * nodes[i] + np.array([-1, 0])
                q[own], qd[own] = 0.0, 0.0
                said.append(f"node {nodes[i]} of link {i + 1} entered its sleeve")
        elif system.robot.rides(i):
            nodes[i] += step
            if step:
                said.append(f"joint {i + 1} (Pa) went on to node {nodes[i]} of link {i}")
            if _cut(system.robot.links[i - 1]):
                nodes[i] = max(nodes[i], nodes[i - 1] + 1)
    return ", ".join(said)


def _joined(system: System, rows: list[tuple[Piece, Run, np.ndarray, float]], meta: dict[str, Any], drive: Any) -> Run:
    """The pieces' runs as one of the whole robot."""
    carried = {"energy/work": 0.0, "energy/loss": 0.0}
    columns: dict[str, list[np.ndarray]] = {}
    times, states, jumped, counts = [], [], [], dict.fromkeys(("steps", "rejected", "evaluations", "wall_s"), 0)
    units: dict[str, str] = {}
    for piece, run, wanted, jump in rows:
        assert run.states is not None
        whole = piece.states(run.states)
        channels, units = piece.channels(run, whole)
        for name, before in carried.items():
            channels[name] = channels[name] + before
            carried[name] = channels[name][-1]
        for name, values in channels.items():
            columns.setdefault(name, []).append(values[wanted])
        times.append(run.t[wanted])
        states.append(whole[wanted])
        jumped.append(np.full(wanted.sum(), jump))
        for name in counts:
            counts[name] += run.meta.get(name, 0)
    joined = {name: np.concatenate(values) for name, values in columns.items()}
    energies = np.column_stack([joined[name] for name in _ENERGIES])
    work = np.column_stack([joined[name] for name in carried])
    error = energy_error(energies, work, np.concatenate(jumped))
    how = [j.spec() for j in drive.joints] if isinstance(drive, Drive) else "Python function"
    about = describe(system, error) | counts | {"drive": how} | meta
    return Run(np.concatenate(times), joined, units, about, np.concatenate(states))
