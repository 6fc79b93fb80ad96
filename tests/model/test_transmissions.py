"""A rotor behind a transmission: two masses in closed form, case m02, controllers, energies."""

import numpy as np
import pytest

import beams
import flexura as fx
from beams import Beam
from flexura import signals
from flexura.control import PID, Controller, Force, lqr
from robots import beam, rigid, robot

ROTOR, SPRING, LOAD = 0.3, 40.0, 0.8


def geared(table, rotor=ROTOR, stiffness=SPRING, damping=0.0, **joint):
    between = {"stiffness_N_m_rad": stiffness, "damping_N_m_s_rad": damping, "gear_ratio": 50.0}
    own = {"rotor_inertia_kg_m2": rotor, "transmission": between}
    return table | {"joint": table["joint"] | own | joint}


def two_masses(damping=0.0, **joint):
    return robot(geared(rigid(0.0, 0.0, 0.0, LOAD), damping=damping, **joint))


def test_two_masses_on_a_spring():
    """Spong, Modeling and Control of Elastic Joint Robots (1987): rotor and load swing against each
    other at sqrt(k (1/J + 1/I)), the load alone at sqrt(k/I) while the rotor is held."""
    bot = two_masses()
    held, free = np.sqrt([SPRING / LOAD, SPRING * (1 / LOAD + 1 / ROTOR)]) / (2 * np.pi)
    assert fx.frequencies(bot) == pytest.approx([held], rel=1e-12)
    assert fx.frequencies(bot, joints="free") == pytest.approx([0.0, free], rel=1e-12)
    lin = fx.linearize(bot)
    zeros = lin.zeros("joint/1/drive", "joint/1/motor_position")
    assert np.abs(zeros.imag) == pytest.approx([np.sqrt(SPRING / LOAD)] * 2)
    assert len(lin.zeros("joint/1/drive", "joint/1/position")) == 0
    assert fx.assemble(bot).labels == ("joint/1 [rad]", "link/1/windup [rad]")


def test_two_masses_under_a_torque():
    """The load lags by tau / k I/(I + J) (1 - cos w t), with a damper it settles there."""
    torque, t = 2.0, np.linspace(0, 1, 101)
    run = fx.simulate(two_masses(), t, [torque], rtol=1e-10)
    w = np.sqrt(SPRING * (1 / LOAD + 1 / ROTOR))
    lag = torque / SPRING * LOAD / (LOAD + ROTOR)
    windup = run["joint/1/position"] - run["joint/1/motor_position"]
    assert windup == pytest.approx(-lag * (1 - np.cos(w * t)), abs=1e-8)
    both = LOAD * run["joint/1/velocity"] + ROTOR * run["joint/1/motor_velocity"]
    assert both == pytest.approx(torque * t, abs=1e-7)
    assert run["energy/work"] == pytest.approx(torque * run["joint/1/motor_position"], abs=1e-8)
    assert run["energy/strain"] == pytest.approx(SPRING / 2 * windup**2, abs=1e-8)
    damped = fx.simulate(two_masses(damping=5.0), t, [torque], rtol=1e-9)
    assert damped.meta["energy_error"] < 1e-7 and damped["energy/loss"][-1] > 1e-3
    late = damped["joint/1/position"][-1] - damped["joint/1/motor_position"][-1]
    assert late == pytest.approx(-lag, rel=1e-4)


def m02(elements=32, payload=0.0):
    link = geared(beam(0.7, 4.0, 0.6, elements), rotor=1.0, stiffness=100.0)
    return robot(link, payload=payload)


def test_case_m02():
    bot, line = m02(), Beam(0.7, 4.0, 0.6)
    held, free = [0.4349034, 2.7267879, 7.6382326], [0.5217294, 2.7414550, 7.6431820]
    assert fx.frequencies(bot, count=3) == pytest.approx(held, rel=1e-5)
    assert fx.frequencies(bot, joints="free", count=4)[1:] == pytest.approx(free, rel=1e-5)
    assert beams.frequencies(line, lambda w: 100.0, [], 12.0) == pytest.approx(held, rel=1e-7)
    rotor = lambda w: -100.0 * w**2 / (100.0 - w**2)
    assert beams.frequencies(line, rotor, [], 12.0) == pytest.approx(free, rel=1e-7)


def test_the_zeros_of_the_rotor_are_the_poles_of_the_arm_with_the_rotor_held():
    bot = m02(4)
    zeros = fx.linearize(bot).zeros("joint/1/drive", "joint/1/motor_position")
    held = 2 * np.pi * fx.frequencies(bot)
    assert np.sort(np.abs(zeros))[::2] == pytest.approx(held, rel=1e-6)


def test_a_stiff_transmission_is_none():
    arm, t = beam(0.5, 0.2, 1.0, 3, hub_inertia_kg_m2=0.05), np.linspace(0, 0.5, 26)
    plain = fx.simulate(robot(arm | {"joint": arm["joint"] | {"rotor_inertia": 0.1}}), t, [0.2])
    for method in ("auto", "implicit"):
        run = fx.simulate(robot(geared(arm, 0.1, 1e6)), t, [0.2], method=method)
        for name in ("joint/1/position", "tip/x", "tip/y", "link/1/tip_deflection"):
            assert np.abs(run[name] - plain[name]).max() < 2e-5


def chain():
    """Two flexible links behind transmissions, under gravity."""
    first = geared(beam(0.5, 0.4, 3.0, 2, hub_radius_m=0.04), 0.05, 60.0, 0.02)
    second = geared(beam(0.4, 0.2, 1.0, 2, hub_mass_kg=0.2, hub_inertia_kg_m2=1e-3), 0.02, 30.0)
    return robot(first, second, gravity=(0.0, -9.81), payload=0.1)


@pytest.mark.parametrize("method", ["explicit", "implicit", "exponential"])
def test_energy_is_kept(method):
    run = fx.simulate(chain(), np.linspace(0, 0.4, 21), [3.0, 0.5], rtol=1e-7, method=method)
    assert run.complete and run.meta["energy_error"] < 1e-5


def test_a_static_start_winds_the_transmissions_up():
    bot = chain()
    q, system = fx.static(bot), fx.assemble(bot)
    for i, stiffness in ((0, 60.0), (1, 30.0)):
        hold = system.forces(q, 0 * q, 0 * q)[system.joint_rows[i]]
        assert hold == pytest.approx(-stiffness * q[system.windup_rows[i]], rel=1e-9)
        assert q[system.joint_rows[i]] == 0.0


def test_inverse_dynamics_move_the_rotors():
    bot, t = chain(), np.linspace(0, 0.6, 61)
    motion = [signals.cycloid(0.6, 0.6), signals.cycloid(-0.4, 0.6)]
    asked = fx.inverse(bot, t, motion, rtol=1e-8)
    for i, signal in enumerate(motion, 1):
        assert asked[f"joint/{i}/motor_position"] == pytest.approx([signal(x)[0] for x in t])
    done = fx.simulate(bot, t, [asked[f"joint/{i}/drive"] for i in (1, 2)], rtol=1e-8)
    for i in (1, 2):
        name = f"joint/{i}/motor_position"
        assert np.abs(done[name] - asked[name]).max() < 2e-3


def test_a_controller_measures_the_motor():
    bot, goal = m02(4), 0.2
    pid = PID(signals.constant(goal), Force(), limit=50.0, kp=60.0, kd=30.0)
    seen = []

    def law(t, position, velocity, deflection):
        seen.append(position[0])
        return [60.0 * (goal - position[0]) - 30.0 * velocity[0]]

    t = np.linspace(0, 1, 21)
    run = fx.simulate(bot, t, fx.Sampled(law, 200.0))
    assert seen[:200:10] == pytest.approx(run["joint/1/motor_position"][:-1], abs=1e-4)
    core = fx.simulate(bot, t, Controller([pid], 200.0))
    assert core["joint/1/motor_position"][-1] == pytest.approx(goal, abs=0.05)
    quiet, design = lqr(bot, Controller([pid], 200.0), [50.0], position=0.05, deflection=0.05)
    assert design.outputs[0] == "joint/1/motor_position"
    assert np.abs(design.poles).max() < 1
    settled_picture = fx.simulate(bot, np.linspace(0, 12, 61), quiet)
    assert settled_picture["joint/1/position"][-5:] == pytest.approx([goal] * 5, abs=0.01)


def test_a_population_is_its_robots():
    bot, t = chain(), np.linspace(0, 0.2, 5)
    key, values = "link.1.joint.transmission.stiffness_N_m_rad", [40.0, 80.0]
    names = ["joint/1/position", "joint/1/motor_position", "joint/2/motor_velocity", "tip/y"]
    made = fx.simulate(fx.Batch.vary(bot, {key: values}), t, channels=names)
    for k, value in enumerate(values):
        run = fx.simulate(bot.replace({key: value}), t)
        for name in names:
            assert made[name][k] == pytest.approx(run[name], abs=1e-5)


@pytest.mark.parametrize(
    ("type", "joint", "key"),
    [
        ("R", {"transmission": {"stiffness_N_m_rad": 1.0}}, "rotor_inertia_kg_m2"),
        ("R", {"transmission": {"stiffness_N_m_rad": 0.0}}, "transmission.stiffness_N_m_rad"),
        ("Pa", {"transmission": {"stiffness_N_m_rad": 1.0}}, "transmission"),
        ("Pa", {"hub_radius_m": 0.1}, "hub_radius_m"),
        ("R", {"spring": {"stiffness_N_m": 1.0}}, "spring.stiffness_N_m"),
        ("Pb", {"spring": {"rest_rad": 1.0}, "start_m": 0.1}, "spring.rest_rad"),
        ("R", {"spring": {"stiffness_N_m_rad": -1.0}}, "spring.stiffness_N_m_rad"),
    ],
)
def test_what_is_refused(type, joint, key):
    with pytest.raises(fx.InputError) as error:
        robot(rigid(0.2, 1.0, 0.1, 0.0, type) | {"joint": {"type": type} | joint})
    assert error.value.key == f"link[1].joint.{key}"


def test_a_transmission_with_nothing_beyond_is_refused():
    with pytest.raises(fx.InputError, match="beyond the transmission"):
        fx.assemble(robot(geared(rigid(0.0, 0.0, 0.0, 0.0))))


def test_a_file_keeps_them():
    bot = chain().replace({"link.1.joint.spring.stiffness_N_m_rad": 3.0})
    assert fx.Robot.from_dict(bot.to_dict()) == bot
