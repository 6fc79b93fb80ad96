"""The rig's robot and drives in the native model, with the nominal data of the rig file."""

from __future__ import annotations

from typing import Any

import flexura as fx
from flexura.control import Motor, Output, Stepper
from flexura.errors import InputError

from .axes import MotorAxis, motor_axes
from .description import Rig, RigSetup
from .plant.motor import JointLine, joint_line
from .plant.stepper import MagneticSpring


def with_nominal_drives(robot: fx.Robot, setup: RigSetup) -> tuple[fx.Robot, tuple[Output, ...]]:
    """Add the rig's drives to a robot.

    The joints get the rotors' inertia and the drives' friction. The outputs of a controller are
    motors, with back-EMF and viscous friction as their damping, and steppers with their magnetic
    spring. Backlash, stiction and the motors' inductance are left out.

    Args:
        robot: a robot with the rig's joints.
        setup: the rig.

    Returns:
        The robot with these joints, and the outputs of a controller.

    Raises:
        InputError: a constant of the drives is not in the rig file, or the robot has other joints.
    """
    rig = setup.rig
    if len(robot.links) != rig.joints:
        raise InputError(
            f"expected a robot of {rig.joints} links, as the rig's", key="robot", value=robot.name
        )
    axes = {axis.number: (axis, joint_line(axis)) for axis in motor_axes(rig)}
    outputs: list[Output] = [Motor(line.force_per_V, line.viscous) for _, line in axes.values()]
    if rig.stepper:
        outputs.append(Stepper(MagneticSpring(rig.stepper).on_N_m))
    return with_drives(robot, rig, list(axes.values()), back_emf=False), tuple(outputs)


def with_drives(
    robot: fx.Robot, rig: Rig, lines: list[tuple[MotorAxis, JointLine]], back_emf: bool = True
) -> fx.Robot:
    """The robot with its drives' inertia and friction in the joints.

    Args:
        robot: the robot.
        rig: the rig.
        lines: the joints with motors.
        back_emf: whether a motor's viscous friction and back-EMF are the joint's too.
    """
    data = robot.to_dict()
    for i, link in enumerate(robot.links):  # measured values scale the factors
        if link.damping.by_ratio:
            alpha, beta = robot.rayleigh(i)
            data["link"][i]["damping"] = {"alpha_1_s": alpha, "beta_s": beta}
    joints: list[dict[str, Any]] = [link["joint"] for link in data["link"]]

    def add(joint: dict[str, Any], key: str, more: float) -> None:
        joint[key] = joint.get(key, 0.0) + more

    for axis, line in lines:
        joint = joints[axis.number - 1]
        add(joint, "rotor_inertia_kg_m2" if axis.turns else "rotor_mass_kg", line.inertia)
        force = axis.force_unit.replace(" ", "_")
        add(joint, f"coulomb_friction_{force}", line.coulomb)
        if back_emf:
            viscous = "viscous_friction_N_m_s_rad" if axis.turns else "viscous_friction_N_s_m"
            add(joint, viscous, line.viscous)
    if rig.stepper:
        add(joints[1], "viscous_friction_N_m_s_rad", rig.stepper.damping_N_m_s)
    return fx.Robot.from_dict(data)
