"""Equations of docs/theory/08-joints.md, written down with plain NumPy,
against drives, signals and runs."""

import numpy as np
import pytest

import flexura as fx
import robots
from flexura.signals import Signal, cycloid, harmonic, polynomial, step
from flexura.simulation import rigid_feedforward, shoot_by_bisection

M, C, J, G = 0.8, 0.2, 0.01, 9.81  # of a rigid pendulum
VISCOUS, COULOMB, V0 = 0.05, 0.3, 1e-3


def slider(mass=0.5, **joint):
    """A body on a rail."""
    return robots.system(robots.rigid(0.1, mass, 0.05, 0.0, "Pa", **joint))


def pendulum(**joint):
    keys = {"viscous_friction": VISCOUS, "coulomb_friction": COULOMB} | joint
    return robots.system(robots.rigid(0.4, M, C, J, **keys), gravity=(0.0, -G))


def test_coulomb_friction():
    """The force, and a body that it slows down.

    Equations: 57
    """
    system = slider(coulomb_friction=COULOMB)
    for rate in (-2.0, -4e-4, 0.0, 1e-3, 0.5):
        assert system.assembly.coulomb(np.array([rate])) == pytest.approx(
            [COULOMB * np.tanh(rate / V0)]
        )
        assert system.equations.loss(np.zeros(1), np.array([rate])) == pytest.approx(
            COULOMB * np.tanh(rate / V0) * rate
        )
    t = np.linspace(0, 0.01, 21)
    run = fx.simulate(system, t, None, [0.0], [4e-3], rtol=1e-9)
    exact = V0 * np.arcsinh(
        np.sinh(4e-3 / V0) * np.exp(-COULOMB * t / (0.5 * V0))
    )  # m v' = -f tanh(v / v0)
    assert run["joint/1/velocity"] == pytest.approx(exact, abs=1e-9)


def test_a_drive_with_gains():
    """The force of a drive, called and in a run.

    Equations: 58
    """
    force, motion = harmonic(0.3, 2.0), cycloid(0.2, 1.0)
    drive = fx.Drive((fx.JointDrive(force, motion, kp=40.0, kd=3.0),))
    tau = lambda t, q, v: force(t)[0] + 40 * (motion(t)[0] - q) + 3 * (motion(t)[1] - v)
    assert drive(0.4, [0.1], [-0.2])[0] == pytest.approx(tau(0.4, 0.1, -0.2))
    run = fx.simulate(slider(), np.linspace(0, 1, 11), drive)
    places, rates = run["joint/1/position"], run["joint/1/velocity"]
    expected = [tau(t, q, v) for t, q, v in zip(run.t, places, rates)]
    assert run["joint/1/drive"] == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_a_prescribed_motion():
    """The drive of a pendulum that follows a motion exactly.

    Equations: 59
    """
    motion, t = cycloid(0.9, 1.0), np.linspace(0, 1, 21)
    run = fx.inverse(pendulum(), t, motion)
    r, rd, rdd = np.array([motion(x) for x in t]).T
    tau = (J + M * C**2) * rdd + M * G * C * np.cos(r) + VISCOUS * rd + COULOMB * np.tanh(rd / V0)
    assert run["joint/1/position"] == pytest.approx(r, abs=1e-12)
    assert run["joint/1/drive"] == pytest.approx(tau, rel=1e-9, abs=1e-9)


def test_a_signal():
    """Two segments with all powers and a wave, and two of the kinds made of them.

    Equations: 60
    """
    rows = np.array(
        [[0.0, 1, -2, 3, 0.5, -0.1, 0.2, 0.7, 5.0, 0.3], [1.0, 2, 0, 1, 0, 0, 0, 0.1, 3.0, -0.2]]
    )
    signal = Signal(rows)
    for t in (0.0, 0.4, 0.99, 1.0, 2.5):
        t0, *c, A, w, phi = rows[int(t >= 1)]
        s = t - t0
        y = sum(x * s**k for k, x in enumerate(c)) + A * np.sin(w * s + phi)
        rate = sum(k * x * s ** (k - 1) for k, x in enumerate(c) if k) + A * w * np.cos(w * s + phi)
        second = sum(
            k * (k - 1) * x * s ** (k - 2) for k, x in enumerate(c) if k > 1
        ) - A * w**2 * np.sin(w * s + phi)
        assert signal(t) == pytest.approx((y, rate, second))
    assert harmonic(0.3, 2.0, 0.1, 0.05)(0.3)[0] == pytest.approx(
        0.05 + 0.3 * np.cos(2 * np.pi * 2 * 0.3 + 0.1)
    )
    x = 0.4
    assert polynomial(2.0, 1.0)(x)[0] == pytest.approx(2 * (10 * x**3 - 15 * x**4 + 6 * x**5))


def test_a_cycloid():
    """The motion and its acceleration.

    Equations: 61
    """
    a, b, T = 0.1, 0.7, 1.6
    signal = cycloid(b, T, a)
    for t in (0.0, 0.3, 1.1, 1.6):
        y, _, ydd = signal(t)
        assert y == pytest.approx(a + (b - a) * (t / T - np.sin(2 * np.pi * t / T) / (2 * np.pi)))
        assert ydd == pytest.approx(
            (b - a) * 2 * np.pi / T**2 * np.sin(2 * np.pi * t / T) if t < T else 0.0, abs=1e-12
        )


def run_under(output, volts, t, **gains):
    law = fx.PID(fx.signals.constant(0.0), output, feedforward=fx.signals.constant(volts), **gains)
    return fx.simulate(slider(), t, fx.Controller((law,), rate_Hz=100.0), rtol=1e-9)


def test_a_motor():
    """A motor under a constant voltage: its force, and the speed that it comes to.

    Equations: 62
    """
    kt, ke, R, i, friction, u = 0.02, 0.02, 1.5, 300.0, 2.0, 3.0
    k, D = kt * i / R, kt * ke * i**2 / R + friction
    t = np.linspace(0, 0.5, 26)
    run = run_under(fx.Motor(k, D), u, t)
    rate = k * u / D * (1 - np.exp(-D * t / 0.5))
    assert run["joint/1/velocity"] == pytest.approx(rate, abs=1e-7)
    assert run["joint/1/drive"][1:] == pytest.approx((k * u - D * rate)[1:], abs=1e-5)


def test_a_stepper():
    """A magnetic spring between pulses of a constant rate and the joint.

    Equations: 63
    """
    K, D, u = 80.0, 2.0, 0.4
    t = np.linspace(0, 0.5, 26)
    run = run_under(fx.Stepper(K, D), u, t)
    assert run["joint/1/pulses"] == pytest.approx(u * t, abs=1e-12)
    tau = K * (u * t - run["joint/1/position"]) + D * (u - run["joint/1/velocity"])
    assert run["joint/1/drive"][1:-1] == pytest.approx(tau[1:-1], rel=1e-7, abs=1e-9)
    held = run_under(fx.Stepper(), u, t)  # the rate rises evenly over the first tick
    assert held["joint/1/position"][1:] == pytest.approx(u * (t[1:] - 0.005), abs=1e-12)


def test_the_stop_at_a_limit():
    """A body under a constant force ends its run at the limit, at the right instant.

    Equations: 64
    """
    system = slider(limits=[-0.1, 0.2])
    assert system.limits.tolist() == [[-0.1, 0.2]]
    run = fx.simulate(
        system,
        np.linspace(0, 2, 41),
        fx.Drive.force(fx.signals.constant(-0.3)),
        [0.05],
        [0.4],
        rtol=1e-11,
    )
    a = -0.3 / 0.5
    roots = np.roots(
        [a / 2, 0.4, 0.05 + 0.1 + 1e-9]
    )  # the lower limit; the upper one is not reached
    end = roots[roots > 0].min()
    assert 0.05 + 0.4**2 / (2 * 0.6) < 0.2 and not run.complete
    assert run.t[-1] == pytest.approx(end, abs=1e-12)
    assert run["joint/1/position"][-1] == pytest.approx(-0.1 - 1e-9, abs=1e-12)
    ends = robots.system(
        robots.beam(0.5, 0.1, 1.0, 4),
        robots.rigid(0.1, 0.1, 0.05, 0.0, "Pa", start=0.2, limits=[0.1, 0.5]),
    )
    assert ends.limits[1].tolist() == [0.1, 0.5]


def test_drives_of_the_rigid_robot():
    """The drives of a rigid arm, whatever bends.

    Equations: 65
    """

    motion, t = polynomial(0.6, 1.0), np.linspace(0, 1, 11)
    beam = robots.beam(0.5, 0.3, 2.0, 4, viscous_friction=VISCOUS, coulomb_friction=COULOMB)
    run = rigid_feedforward(robots.system(beam, gravity=(0.0, -G)), t, [motion])
    r, rd, rdd = np.array([motion(x) for x in t]).T
    tau = (
        0.3 * 0.5**3 / 3 * rdd
        + 0.3 * 0.5**2 / 2 * G * np.cos(r)
        + COULOMB * np.tanh(rd / V0)
        + VISCOUS * rd
    )
    assert run["joint/1/drive"] == pytest.approx(tau, abs=2e-5)


def test_drives_shoot_by_bisection():
    """Position and rate at the end of each step, weighed as the equation says.

    Equations: 66
    """

    motion, t = polynomial(0.6, 1.0), np.linspace(0, 0.2, 21)
    run = shoot_by_bisection(
        robots.system(robots.beam(0.5, 0.3, 40.0, 1, hub_inertia_kg_m2=0.05)), t, [motion]
    )
    r, rd, _ = np.array([motion(x) for x in t]).T
    e = (run["joint/1/position"] - r) + 0.01 * (run["joint/1/velocity"] - rd)
    assert np.abs(e[1:]).max() < 1e-10
    assert np.abs(run["joint/1/position"] - r).max() > 1e-9  # neither of the two is zero


def test_a_step_is_a_segment():
    """A step's value from its instant on.

    Equations: 60
    """
    assert [step(0.3, 0.5)(t)[0] for t in (0.0, 0.499, 0.5, 2.0)] == [0.0, 0.0, 0.3, 0.3]
