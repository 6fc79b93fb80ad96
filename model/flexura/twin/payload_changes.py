"""A payload that changes in the twin: one model after the other, with an impact between them.

The rates after the impact come from Exudyn's own mass matrices and the Jacobian of its constraints.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..io import Run, judged
from ..optional import Optional
from ..robot import Robot
from ..signals import PayloadChange
from .build import TwinModel
from .links.ancf import CableLink
from .loads import Actuation

exu = Optional("exudyn")


class End(NamedTuple):
    """Where a model's run ended: displacements and rates of its coordinates, its data (turns of
    joints)."""

    coordinates: np.ndarray
    rates: np.ndarray
    data: np.ndarray


def carrying(robot: Robot, change: PayloadChange, before: Robot | None = None) -> Robot:
    """The robot with another payload, or with what that has in common with the payload `before`."""
    centre = tuple(change.centre_of_mass_m or robot.payload.centre_of_mass_m)
    mass, inertia = change.mass_kg, change.inertia_kg_m2
    if before is not None:
        old = before.payload
        same = tuple(old.centre_of_mass_m) == centre
        mass = min(mass, old.mass_kg) if same else 0.0
        inertia = min(inertia, old.inertia_kg_m2) if same else 0.0
    payload = {"mass_kg": mass, "inertia_kg_m2": inertia, "centre_of_mass_m": centre}
    changes: dict[str, Any] = {f"payload.{key}": value for key, value in payload.items()}
    number = len(robot.links)
    if robot.links[-1].damping.by_ratio:
        alpha, beta = robot.rayleigh(number - 1)
        changes[f"link.{number}.damping"] = {"alpha_1_s": alpha, "beta_s": beta}
    return robot.replace(changes)


def after_impact(kept: TwinModel, after: TwinModel, end: End, settings: Any) -> End:
    """The state after the impact (137): M v+ + C^T p = M_0 v-, C v+ = C v-.

    C has the constraints of the joints, and those of lines that do not stretch: an impact along a
    beam would else stay in waves of stretch at its tip.

    Args:
        kept: the robot with what both payloads have in common.
        after: the robot with the new payload.
        end: the state before it.
        settings: of Exudyn.

    Returns:
        The same place, and the rates after it.
    """
    stays, _ = _matrices(kept, end, settings)
    mass, joints = _matrices(after, end, settings)
    constraints = np.vstack([joints, *_axial(after, end)])
    if np.abs(mass - stays).max() == 0.0:
        return end
    n, count = len(mass), len(constraints)
    whole = np.zeros((n + count, n + count))
    scale = float(np.abs(mass).max())
    whole[:n, :n], whole[:n, n:], whole[n:, :n] = mass, scale * constraints.T, scale * constraints
    right = np.concatenate([stays @ end.rates, scale * constraints @ end.rates])
    return end._replace(rates=np.linalg.lstsq(whole, right, rcond=1e-14)[0][:n])


def _matrices(model: TwinModel, end: End, settings: Any) -> tuple[np.ndarray, np.ndarray]:
    """Exudyn's mass matrix (n, n) and the Jacobian of its constraints (k, n) in a state."""
    put(model, end)
    solver = exu.MainSolverImplicitSecondOrder()
    solver.InitializeSolver(model.mbs, settings)
    solver.ComputeMassMatrix(model.mbs, 1.0)
    mass = np.array(solver.GetSystemMassMatrix())
    solver.ComputeJacobianAE(model.mbs, 1.0, 0.0)
    return mass, np.array(solver.GetSystemJacobian())[len(mass) :, : len(mass)]


def _axial(model: TwinModel, end: End) -> list[np.ndarray]:
    """The rows of `axial_rates` of all flexible links on the rates of the system (k, n)."""
    out, q = [], end.coordinates + model.reference
    for part, index in zip(model.parts, model.index, strict=True):
        if isinstance(part, CableLink):
            own = part.axial_rates(q[index])
            rows = np.zeros((len(own), len(q)))
            rows[:, index] = own
            out.append(rows)
    return out


def put(model: TwinModel, end: End) -> None:
    """Let a model start in a state.

    Args:
        model: the model.
        end: the state.
    """
    data, initial = model.mbs.systemData, exu.ConfigurationType.Initial
    data.SetODE2Coordinates(end.coordinates, initial)
    data.SetODE2Coordinates_t(end.rates, initial)
    if len(end.data):
        data.SetDataCoordinates(end.data, initial)


def later(act: Actuation, begin: float) -> Actuation:
    """A drive whose time counts from `begin` [s]."""
    if begin == 0.0:
        return act
    call, plan = act.call, act.plan
    return replace(
        act,
        call=lambda t, *state: call(t + begin, *state),
        plan=None if plan is None else lambda t: plan(t + begin),
        breaks=None if act.breaks is None else act.breaks - begin,
    )


def in_parts(
    robot: Robot,
    changes: Sequence[PayloadChange],
    t: np.ndarray,
    model_of: Callable[[Robot, float], TwinModel],
    part: Callable[[Robot, float, End | None, np.ndarray], tuple[Run, End]],
    settings: Any,
) -> Run:
    """A run from change to change.

    Args:
        robot: with the payload at the start.
        changes: of the payload, in order of time.
        t: times of the result (T,) [s].
        model_of: the model of a robot whose time 0 is an instant [s].
        part: the run of a robot from an instant [s] and a state on, at times that count from it,
            and where it ends.
        settings: of Exudyn.

    Returns:
        The Run.
    """
    parts, asked, begins = [], [], [0.0, *(change.at_s for change in changes)]
    state: End | None = None
    for k, begin in enumerate(begins):
        last = k == len(changes)
        end = float(t[-1]) if last else changes[k].at_s
        own = t[(t >= begin) & ((t <= end) if last else (t < end))]
        done, left = part(robot, begin, state, (own if last else np.append(own, end)) - begin)
        parts.append(done)
        asked.append(np.arange(len(done.t)) < len(own))
        if last or not done.complete:
            break
        after = carrying(robot, changes[k])
        kept = carrying(robot, changes[k], robot)
        state = after_impact(model_of(kept, end), model_of(after, end), left, settings)
        robot = after
    return parts[0] if len(parts) == 1 else _joined(parts, asked, begins)


def _joined(parts: list[Run], asked: list[np.ndarray], begins: list[float]) -> Run:
    """One Run of several whose times begin at 0, with the rows that are asked for; angles go on
    where they were."""
    first, values = parts[0], {}
    for name in first.channels:
        columns, shift, last = [], 0.0, None
        for run, rows in zip(parts, asked, strict=True):
            if last is not None and first.units[name] == "rad":
                shift = 2 * np.pi * round((last - float(run[name][0])) / (2 * np.pi))
            column = run[name] + shift
            columns.append(column[rows])
            last = float(column[-1])
        values[name] = np.concatenate(columns)
    meta = first.meta | {
        "complete": all(run.complete for run in parts),
        "wall_s": sum(run.meta["wall_s"] for run in parts),
        "steps": sum(run.meta["steps"] for run in parts),
        "events": [
            event | {"t": event["t"] + begin}
            for run, begin in zip(parts, begins, strict=False)  # the last may not be reached
            for event in run.meta["events"]
        ],
    }
    on_clock = [run.t[rows] + begin for run, rows, begin in zip(parts, asked, begins)]
    return judged(Run(np.concatenate(on_clock), values, first.units, meta))
