"""The variables of an FMU: the channels of a Run, and which of them are inputs and start values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...robot import Robot
from ...simulation.recorder import channel_units, recorded_channels
from ...system import System

ACCOUNTS = ("energy/work", "energy/loss", "energy/numerical_loss")


SHOWN = ("deflection", "slope", "strain")


@dataclass(frozen=True)
class Variable:
    """A variable of the model description.

    Attributes:
        name: the channel's, or "rtol".
        reference: by which the library knows it, as `References` of model/fmi counts.
        unit: of the channel; "" for none.
        causality: "input", "output" or "parameter".
        start: the value before the simulation, which may be set; None: it is computed.
        text: what it is.
    """

    name: str
    reference: int
    unit: str
    causality: str
    start: float | None = None
    text: str = ""


@dataclass(frozen=True)
class LinkSensor:
    """A sensor as the library reads it: `weights` (n,) of the unknowns for a slope or a strain,
    None for a deflection, of a place `at_m` of a link (from 0)."""

    name: str
    unit: str
    link: int
    at_m: float
    weights: np.ndarray | None


def variables(system: System, q: np.ndarray, rtol: float) -> list[Variable]:
    """The variables of a robot's FMU but for the time, in the order of the channels of a Run.

    Inputs are the drives of the joints that are not locked. Start values are the positions and
    velocities of the joints; behind a transmission those of its motor.

    Args:
        system: the robot.
        q: configuration at the start (n,).
        rtol: the tolerance that the parameter `rtol` begins with.

    Returns:
        The variables.
    """
    robot, links = system.robot, len(system.robot.links)
    seen = recorded_channels(robot)
    first = 2 + 5 * links
    after = {name: first + k for k, name in enumerate([*seen, *ACCOUNTS])}
    kinds = ("position", "velocity", "drive", "motor_position", "motor_velocity")
    hubs = system.hub_positions(q[None, :])[0]
    out = []
    for name, unit in channel_units(robot).items():
        parts = name.split("/")
        if parts[0] != "joint":
            out.append(Variable(name, after[name], unit, "output"))
            continue
        i, kind = int(parts[1]) - 1, parts[2]
        reference = 1 + links * kinds.index(kind) + i
        out += _of_joint(robot, i, kind, Variable(name, reference, unit, "output"), hubs[i])
    for k, sensor in enumerate(sensors(system)):
        out.append(Variable(sensor.name, first + len(after) + k, sensor.unit, "output"))
    text = "relative tolerance of the integration"
    out.append(Variable("rtol", 1 + 5 * links, "", "parameter", rtol, text))
    return out


def _of_joint(robot: Robot, i: int, kind: str, plain: Variable, hub: float) -> list[Variable]:
    """The variable of a joint's channel, or none: the drive of a locked joint."""
    joint = robot.links[i].joint
    name, reference, unit = plain.name, plain.reference, plain.unit
    if kind == "drive":
        text = "force" if unit == "N" else "torque"
        made = Variable(name, reference, unit, "input", 0.0, f"{text} of the drive")
        return [] if joint.locked else [made]
    moved = "motor_" if joint.transmission is not None else ""
    if kind == f"{moved}position":
        at = joint.start if moved else float(hub)
        return [Variable(name, reference, unit, "output", at, "start value: position at the start")]
    if kind == f"{moved}velocity" and not joint.locked:
        return [Variable(name, reference, unit, "output", 0.0, "start value: speed at the start")]
    return [plain]


def sensors(system: System) -> list[LinkSensor]:
    """The sensors of a robot that an FMU shows: those of the line's shape. Accelerations and
    internal forces depend on what acts at the same instant."""
    structure, out = system.assembly.structure, []
    for i, link in enumerate(system.robot.links):
        for sensor in link.sensor:
            if sensor.kind not in SHOWN:
                continue
            weights = None
            if sensor.kind != "deflection":
                weights, left = np.zeros(system.n), sensor.at_m
                pieces = list(zip(structure.links[i], structure.own[i], strict=True))
                for k, (piece, own) in enumerate(pieces):
                    last = left <= piece.length or k + 1 == len(pieces)
                    xi = np.array([min(left / piece.length, 1.0) if last else 1.0])
                    if sensor.kind == "slope":
                        weights[own] = piece.shapes(xi)[0]
                    elif last:
                        far = sensor.distance_m or 0.0
                        weights[own] = -far * piece.shapes(xi, 1)[0] / piece.length
                    if last:
                        break
                    left -= piece.length
            out.append(LinkSensor(f"sensor/{sensor.name}", sensor.unit, i, sensor.at_m, weights))
    return out


def fmu_lacks(robot: Robot) -> list[str]:
    """Channels of a Run of a robot that its FMU lacks: drives of locked joints, accelerations,
    internal forces.

    Args:
        robot: the robot.

    Returns:
        Their names.
    """
    kinds = [sensor for link in robot.links for sensor in link.sensor]
    locked = [f"joint/{i}/drive" for i, link in enumerate(robot.links, 1) if link.joint.locked]
    return locked + [f"sensor/{s.name}" for s in kinds if s.kind not in SHOWN]
