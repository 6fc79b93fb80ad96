"""The rig's robot and drives in the native model, with the nominal data of the rig file."""

from __future__ import annotations

import flexura as fx
from flexura.control import Motor, Output, Stepper
from flexura.errors import InputError

from .description import RigSetup
from .plant.motor import joint_line_of

POLE_PAIRS_PER_STEP = 0.25  # four full steps are one period of the magnetic spring


def with_nominal_drives(robot: fx.Robot, setup: RigSetup) -> tuple[fx.Robot, tuple[Output, ...]]:
    """Add the rig's drives to a robot.

    The joints get the rotors' inertia and the drives' friction. The outputs of a controller are the
    motor, with back-EMF and viscous friction as its damping, and the stepper with its magnetic
    spring. Backlash, stiction and the motor's inductance are left out.

    Args:
        robot: a robot with two links.
        setup: the rig.

    Returns:
        The robot with these joints, and the outputs of a controller.

    Raises:
        InputError: the rig file has no [emulated], or the robot has not two links.
    """
    rig, emulated = setup.rig, setup.rig.emulated
    if emulated is None:
        raise InputError(
            "missing: the rotor's inertia and the rig's friction are there", key="emulated"
        )
    if len(robot.links) != 2:
        raise InputError(
            "expected a robot of two links, as the rig's", key="robot", value=robot.name
        )
    carriage, data = joint_line_of(rig, emulated), robot.to_dict()
    first, second = (link["joint"] for link in data["link"])
    for joint, key, more in (
        (first, "rotor_mass_kg", carriage.reflected_mass_kg),
        (first, "coulomb_friction_N", carriage.coulomb_N),
        (second, "viscous_friction_N_m_s_rad", emulated.stepper.damping_N_m_s),
    ):
        joint[key] = joint.get(key, 0.0) + more
    stiffness = (
        rig.stepper.holding_torque_N_m * rig.stepper.full_steps_per_turn * POLE_PAIRS_PER_STEP
    )
    return fx.Robot.from_dict(data), (
        Motor(carriage.force_N_V, carriage.viscous_N_s_m),
        Stepper(stiffness),
    )
