"""The rig's robot and drives as the native model has them under a controller: nominal figures of
the rig file."""

from __future__ import annotations

import flexura as fx
from flexura.control import Motor, Output, Stepper
from flexura.errors import InputError

from .description import Bench
from .plant.motor import line

POLE_PAIRS_PER_STEP = 0.25  # four full steps are one period of the magnetic spring


def driven(robot: fx.Robot, bench: Bench) -> tuple[fx.Robot, tuple[Output, ...]]:
    """The robot with the rotors' inertia and the friction that the rig's drives put into its
    joints, and the outputs of a controller: motor (back-EMF and viscous friction in its damping)
    and stepper with its magnetic spring.

    The nut's play, stiction, and the motor's inductance are left out. Raises InputError for a rig
    file without [emulated], where rotor and friction stand, and for a robot that is not the rig's
    kind.
    """
    rig, more = bench.rig, bench.rig.emulated
    if more is None:
        raise InputError(
            "missing: the rotor's inertia and the rig's friction are there", key="emulated"
        )
    if len(robot.links) != 2:
        raise InputError(
            "expected a robot of two links, as the rig's", key="robot", value=robot.name
        )
    carriage, data = line(rig, more), robot.to_dict()
    first, second = (link["joint"] for link in data["link"])
    first["rotor_mass_kg"] = first.get("rotor_mass_kg", 0.0) + carriage.reflected_mass_kg
    first["coulomb_friction_N"] = first.get("coulomb_friction_N", 0.0) + carriage.coulomb_N
    friction = "viscous_friction_N_m_s_rad"
    second[friction] = second.get(friction, 0.0) + more.stepper.damping_N_m_s
    stiffness = (
        rig.stepper.holding_torque_N_m * rig.stepper.full_steps_per_turn * POLE_PAIRS_PER_STEP
    )
    return fx.Robot.from_dict(data), (
        Motor(carriage.force_N_V, carriage.viscous_N_s_m),
        Stepper(stiffness),
    )
