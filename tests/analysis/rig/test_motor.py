"""The motor and the lead screw against their data sheet."""

import dataclasses
import math

import pytest

from flexlab.rig.emulation import TrueParameters
from flexlab.rig.plant.mechanics import STEP_S
from flexlab.rig.plant.motor import DCMotor, back_driven_efficiency, joint_line
from flexlab.rig.plant.plant import rig_plant
from plants import AXIS, BENCH, DATA, QUIET, SAME, run


@pytest.mark.parametrize("part", [0.0, 0.25, 0.5, 0.9])
def test_the_motor_is_on_the_line_of_its_data_sheet(part):
    """n = n0 (1 - M / M_stall), I = I0 + (I_stall - I0) M / M_stall, the gear's losses in it."""
    motor, sheet = DCMotor(DATA), BENCH.rig.motor
    load = part * sheet.stall_torque_N_m
    for _ in range(2000):
        motor.advance(5e-4, sheet.rated_voltage_V, load)
    assert motor.speed_rad_s * 30 / math.pi == pytest.approx(
        sheet.no_load_speed_rpm * (1 - part), rel=1e-3
    )
    expected = sheet.no_load_current_A + part * (sheet.stall_current_A - sheet.no_load_current_A)
    assert motor.current_A == pytest.approx(expected, rel=1e-3)


def test_the_blocked_motor_takes_its_stall_current_with_the_coil_s_time_constant():
    motor = DCMotor(dataclasses.replace(DATA, inertia_kg_m2=1e6))
    motor.advance(1e-3, 12.0)
    assert motor.current_A == pytest.approx(
        7.0 * (1 - math.exp(-1e-3 * DATA.resistance_ohm / DATA.inductance_H)), rel=1e-6
    )
    for _ in range(20):
        motor.advance(1e-3, 12.0)
    assert motor.current_A == pytest.approx(7.0, rel=1e-6)


def test_the_motor_starts_at_its_voltage_and_the_friction_of_the_truth_moves_it():
    starts = BENCH.rig.motor.starts_at_V
    for factor in (1.0, 1.3):
        for volts, turns in ((0.98 * factor * starts, False), (1.03 * factor * starts, True)):
            motor = DCMotor(DATA, friction=factor)
            for _ in range(100):
                motor.advance(1e-3, volts)
            assert (motor.angle_rad != 0) == turns


def test_a_motor_without_voltage_coasts_and_a_shorted_one_brakes():
    turned = []
    for volts in (None, 0.0):
        motor = DCMotor(DATA)
        motor.speed_rad_s = 50.0
        for _ in range(2000):
            motor.advance(1e-3, volts)
        assert motor.speed_rad_s == 0.0
        turned.append(motor.angle_rad)
    assert turned[0] == pytest.approx(
        0.5 * 50.0**2 * DATA.inertia_kg_m2 / DATA.friction_N_m, rel=0.01
    )  # J w^2 / 2 = T phi
    assert turned[1] < 0.5 * turned[0]


@pytest.mark.parametrize("efficiency", [0.6, 0.9])
def test_a_load_costs_the_motor_more_than_it_gives_back(efficiency):
    """Lifting takes the current (T_f + M / eta) / K, lowering (-T_f + M eta') / K; a self-locking
    screw turns for no load."""
    load = 0.02
    currents = []
    for volts in (6.0, -6.0):
        motor = DCMotor(DATA, screw_efficiency=efficiency)
        for _ in range(2000):
            motor.advance(5e-4, volts, load)
        currents.append(motor.current_A)
    gear = DATA.gear_efficiency
    both = (
        load
        * (
            1 / (gear * efficiency)
            + back_driven_efficiency(gear) * back_driven_efficiency(efficiency)
        )
        / DATA.constant_N_m_A
    )
    assert currents[0] + currents[1] == pytest.approx(both, rel=2e-3)
    assert back_driven_efficiency(0.5) == 0.0 and back_driven_efficiency(1.0) == 1.0
    locked = DCMotor(DATA, screw_efficiency=0.5)
    locked.advance(0.1, None, 100.0)
    assert locked.angle_rad == 0.0


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_the_carriage_lags_by_the_play(factor):
    """Slowly up and down: the carriage minus the nut differs, between the ways, by the play and
    twice the nut's give F / k."""
    emulated = BENCH.rig.carriage
    plant = rig_plant(BENCH, truth=TrueParameters(backlash=factor), **QUIET)
    _, carriage, nut, _, _ = run(plant, 4.0, lambda t: (0.25 if t < 2.0 else -0.25, 0))
    up, down = (carriage - nut)[round(1.75 / STEP_S)], (carriage - nut)[round(3.75 / STEP_S)]
    force = emulated.coulomb_friction_N + emulated.viscous_friction_N_s_m * 0.015
    expected = factor * emulated.backlash_m + 2 * force / emulated.contact_stiffness_N_m
    assert down - up == pytest.approx(expected, rel=0.02)
    assert nut[round(1.9 / STEP_S)] - nut[0] > 0.02  # it did move


def test_the_line_of_joint_1_is_what_the_plant_does():
    """Steady speed at a voltage, by force = viscous v + coulomb, with the bridge's dead zone
    beside."""
    line = joint_line(AXIS)
    plant = rig_plant(BENCH, truth=SAME, **QUIET)
    _, _, nut, _, _ = run(plant, 1.0, lambda t: (0.5, 0))
    speed = (nut[-1] - nut[-401]) / (400 * STEP_S)
    volts = 6.0 - BENCH.rig.driver.dead_zone_V
    assert speed == pytest.approx(
        (line.force_per_V * volts - line.coulomb) / line.viscous, rel=2e-3
    )
