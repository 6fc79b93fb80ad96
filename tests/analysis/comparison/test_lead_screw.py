"""Joint 1 by its voltage: friction, the line of the motor, play."""

import dataclasses

import numpy as np
import pytest

import flexura as fx
from boards import BENCH
from flexlab.comparison.replay import lead_screw
from flexlab.rig.axes import motor_axes
from flexlab.rig.plant.motor import DCMotor, JointLine, joint_line, motor_data

LINE = JointLine(
    force_per_V=50.0,
    viscous=4e3,
    coulomb=36.0,
    inertia=120.0,
    static=56.0,
    guide=4.0,
    efficiency=0.5,
    back_driven=0.0,
)


def pushed(force, play_m=0.0, seconds=0.6, line=LINE):
    t = np.arange(round(seconds / lead_screw.STEP_S)) * lead_screw.STEP_S
    return t, *lead_screw.nut_and_carriage(t, force, line, line.moved(0.5), play_m, 0.0)


def test_static_friction_holds_the_nut_until_its_force():
    for newtons, moves in ((55.9, False), (-55.9, False), (56.1, True), (-56.1, True)):
        _, nut, speed, carriage = pushed(fx.signals.constant(newtons))
        assert (nut[-1] != 0.0) == (speed[-1] != 0.0) == moves
        np.testing.assert_array_equal(nut, carriage)  # without play


def test_the_nut_runs_and_coasts_as_the_line_says():
    """v = v_1 (1 - exp(-c t / m)), v_1 = (F - f) / c; from v_0 it coasts  m v_0 / c - (f m / c^2)
    ln(1 + c v_0 / f)."""
    t, nut, speed, _ = pushed(fx.signals.piecewise([0.0, 0.3], [236.0, 0.0]))
    c, m, f = LINE.viscous, 121.0, LINE.coulomb
    until = np.searchsorted(t, 0.3 - 1e-9)
    np.testing.assert_allclose(
        speed[:until], 0.05 * (1 - np.exp(-c / m * t[:until])), rtol=1e-9, atol=1e-15
    )
    v = speed[until]
    assert nut[-1] - nut[until] == pytest.approx(
        m * v / c - f * m / c**2 * np.log(1 + c * v / f), rel=1e-9
    )
    assert speed[-1] == 0.0


def test_the_line_is_the_motor_with_its_inductance_and_what_it_carries():
    """A carriage of 2 kg on the screw counts 7.2 kg, and the late current takes 3.7 of 131 kg."""
    (axis,) = motor_axes(BENCH.rig)
    line, guide, r, mass = joint_line(axis, delayed=True), axis.guide, axis.transmission, 2.0
    data = motor_data(axis)
    motor = DCMotor(data, axis.efficiency, axis.screw_coulomb_N_m, axis.screw_viscous_N_m_s)
    volts = lambda t: 4.0 + 1.0 * np.sin(15 * t)
    step, count, speeds, before = lead_screw.STEP_S / 5, 4000, [0.0], 0.0
    for k in range(5 * count):
        v = r * motor.speed_rad_s
        load = guide.coulomb + guide.viscous * v + mass * (v - before) / step
        before = v
        motor.advance(step, volts((k + 0.5) * step), r * load)
        speeds.append(r * motor.speed_rad_s)
    t = np.arange(count) * lead_screw.STEP_S
    late = t - data.inductance_H / data.resistance_ohm
    force = fx.signals.piecewise(t, line.force_per_V * volts(late + 0.5 * lead_screw.STEP_S))
    _, speed, _ = lead_screw.nut_and_carriage(t, force, line, line.moved(mass), 0.0, 0.0)
    off = speed - np.array(speeds)[:-1:5]
    moves = t > 0.4  # ten time constants after the start, whose step is quicker than L / R
    assert np.abs(off[moves]).max() < 3e-4 * np.ptp(speed[moves])


def test_the_nut_crosses_its_play_without_the_rail_and_then_takes_the_carriage_along():
    b = 3e-4
    t, nut, speed, carriage = pushed(fx.signals.constant(236.0), b)
    free = np.abs(nut) < b / 2
    c, m = LINE.viscous, 121.0
    np.testing.assert_allclose(
        speed[free], (236.0 - 32.0) / c * (1 - np.exp(-c / m * t[free])), rtol=1e-9, atol=1e-15
    )
    assert not carriage[free].any() and free.sum() > 20
    np.testing.assert_allclose(carriage[~free], nut[~free] - b / 2, atol=1e-15)
    assert speed[-1] == pytest.approx((236.0 - 36.0) / c, rel=1e-6)
    held_by_rail = dataclasses.replace(LINE, static=50.0, coulomb=50.0, guide=40.0)
    _, nut, _, carriage = pushed(fx.signals.constant(45.0), b, seconds=2.0, line=held_by_rail)
    assert nut[-1] == nut[-2] and 0.0 < carriage[-1] < b / 2  # the flank soon stops it
    assert carriage[-1] == pytest.approx(nut[-1] - b / 2)
