"""The stepper: its magnetic spring, lost steps, no current."""

import dataclasses
import math

import numpy as np
import pytest

from flexlab.board.emulator.emulated import Outputs
from flexlab.rig.plant.mechanics import STEP_S
from flexlab.rig.plant.plant import rig_plant
from plants import BENCH, QUIET, SAME, run, vibration


def heavy(inertia):
    """The bench with a flywheel on joint 2 and a stiff, light strip."""
    changes = {
        "link.2.joint.hub_inertia_kg_m2": inertia,
        "link.2.section": {"width_m": 0.02, "height_m": 0.004},
        "link.2.density_kg_m3": 800.0,
        "payload.mass_kg": 0.0,
    }
    return dataclasses.replace(BENCH, robot=BENCH.robot.replace(changes))


def test_the_stepper_swings_about_its_step_with_its_magnetic_spring():
    """omega^2 = (N T_h + 4 N T_d) / J for small swings about a full step."""
    bench = heavy(0.02)
    plant = rig_plant(bench, truth=SAME, stepper__damping_N_m_s=0.0, **QUIET)
    stepper, strip = bench.rig.stepper, bench.robot.links[1]
    command = stepper.microsteps  # one full step
    t, _, _, joint, _ = run(plant, 1.5, lambda t: (0, command * min(1.0, t / 0.2)))
    mass = float(strip.mass_per_length(np.zeros(1))[0]) * strip.length_m
    inertia = 0.02 + strip.joint.rotor_inertia + mass * strip.length_m**2 / 3
    n = stepper.full_steps_per_turn / 4
    expected = math.sqrt(
        n * (stepper.holding_torque_N_m + 4 * bench.rig.stepper.detent_torque_N_m) / inertia
    )
    swing = joint[t > 0.25]
    assert np.ptp(swing) < 0.01
    frequency, _ = vibration(t[t > 0.25], swing, expected / (2 * math.pi))
    assert 2 * math.pi * frequency == pytest.approx(expected, rel=0.01)


def test_an_overloaded_stepper_loses_steps_by_fours_and_a_spared_one_none():
    bench = heavy(0.02)
    steps = 832  # 13 x 4 full steps: a rotor that stays behind rests in a minimum of its spring
    after = {}

    def smooth(s):
        return round(steps * min(1.0, s) ** 2 * (3 - 2 * min(1.0, s)))

    for ramp in (
        2.0,
        0.1,
    ):  # 2.4 rad/s^2 at most is 0.05 N m; 20 times as fast is beyond the holding torque
        plant = rig_plant(bench, truth=SAME, stepper__damping_N_m_s=0.05, **QUIET)
        _, _, _, joint, _ = run(plant, ramp + 3.0, lambda t, ramp=ramp: (0, smooth(t / ramp)))
        after[ramp] = (steps * plant.stepper.field.rad_per_step - joint[-1]) / (
            4 * math.radians(1.8)
        )
    assert after[2.0] == pytest.approx(0.0, abs=0.01)
    assert abs(after[0.1]) > 0.9 and after[0.1] == pytest.approx(round(after[0.1]), abs=0.02)


def test_a_stepper_without_current_lets_the_joint_go():
    plant = rig_plant(BENCH, truth=SAME, start=(0.0, 0.01), stepper__detent_torque_N_m=0.0, **QUIET)
    out = Outputs(stepper_on=False)
    plant.mechanics.hold(1, 1.0, 0.0)
    plant.mechanics.step(0.0, 0.3)
    for _ in range(2000):
        plant.advance(STEP_S, out)
    assert abs(plant.positions[1] - 0.01) > 0.001
