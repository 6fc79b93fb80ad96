"""The dissertation's linear line in NumPy: closed forms, the exact line at small bending, and how a
run goes on and ends."""

from __future__ import annotations

import _thread

import numpy as np
import pytest

import chains
import flexura as fx
from flexura import signals
from flexura.control.sampled import Sampled
from flexura.simulation import dense
from flexura.simulation.problem import initial_value_problem
from flexura.simulation.recorder import record
from flexura.system.assembly import Assembly
from robots import beam, bench_arm, largest_difference, rigid, system

PLACES = ["joint/1/position", "tip/x", "tip/y", "link/1/tip_deflection"]


def short_arm(stiffening: bool = False, **keys) -> fx.System:
    """Two elements and a payload: few unknowns."""
    joint = {"hub_inertia_kg_m2": 2e-3} | keys
    return system(beam(0.6, 0.2355, 0.5, 2, **joint), payload=0.05, stiffening=stiffening)


@pytest.mark.parametrize("name", chains.SMALL)
def test_the_assembly_shows_what_the_core_shows(name):
    exact = fx.assemble(chains.SMALL[name])
    q, qd = chains.random_state(exact.assembly, np.random.default_rng(5), 0.5)
    mine = exact.assembly.observe(q, qd, 9)
    assert mine == pytest.approx(
        exact.equations.observe(q[None], qd[None], 9)[0], abs=1e-12 * np.abs(mine).max()
    )


@pytest.mark.parametrize("name", ["R, kink", "R, Pa on all shapes", "R, Pb, Pa"])
def test_one_sweep_gives_all_terms(name):
    assembly = Assembly(chains.SMALL[name], True)
    q, qd = chains.random_state(assembly, np.random.default_rng(6))
    terms = assembly.terms(q, qd)
    near = lambda x: pytest.approx(x, abs=1e-12 * np.abs(x).max())
    assert terms.mass == near(assembly.mass(q)) and terms.elastic == near(assembly.elastic(q))
    assert terms.forces == near(
        assembly.bias(q, qd) + assembly.gravity(q)
    ) and terms.damping == near(assembly.damping(q))


def test_a_mesh_as_one_piece_is_the_chain_of_its_elements():
    table = beam(1.0, chains.BROKEN, chains.BROKEN, 3, **chains.HUB)
    one, many = (
        Assembly(system(table, **chains.LOAD).robot, True),
        Assembly(system(table, **chains.LOAD).robot, False),
    )
    linear = type(many.structure)(many.robot, many.structure.links, True)
    assert (
        len(one.structure.links[0]) == 1
        and len(many.structure.links[0]) == 3
        and one.labels == many.labels
    )
    q, qd = chains.random_state(many, np.random.default_rng(7))
    a, b = one, Assembly(linear)
    assert a.mass(q) == pytest.approx(b.mass(q), rel=1e-11, abs=1e-13)
    assert a.forces(q, qd, q) == pytest.approx(b.forces(q, qd, q), rel=1e-11, abs=1e-11)
    assert a.observe(q, qd, 9) == pytest.approx(b.observe(q, qd, 9), rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("name", ["R", "R, Pa on modes"])
def test_on_an_exact_robot_it_is_the_core(name):
    """The same equations, another program: motion, drives, work, losses."""
    exact = fx.assemble(chains.SMALL[name])
    t, drive = (
        np.linspace(0, 0.02, 5),
        fx.Drive.force(*[signals.harmonic(0.3, 2.0)] * len(exact.robot.links)),
    )
    problem = initial_value_problem(exact, t, drive, None, None, 1e-6, "explicit")
    a = record(exact, dense.solve(problem))
    b = fx.simulate(exact, t, drive, rtol=1e-8, method="explicit")
    assert list(a) == list(b)
    for name in a:
        assert a[name] == pytest.approx(b[name], abs=1e-6 * max(np.abs(b[name]).max(), 1e-3)), name


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_mode_of_a_clamped_link_is_a_cosine(method):
    """Without stiffening and with the joint locked the equations are linear: q = q0 cos(omega
    t)."""
    arm = short_arm(locked=True)
    found = fx.modes(arm)
    shape, omega = 1e-2 * found.shapes[:, 0], 2 * np.pi * found.frequencies_Hz[0]
    t = np.linspace(0, 2 * np.pi / omega, 9)
    run = fx.simulate(arm, t, q0=shape, rtol=1e-6, method=method)
    expected = np.outer(np.cos(omega * t), shape)
    assert run.states[:, : arm.n] == pytest.approx(expected, abs=2e-5 * np.abs(shape).max())
    assert run.meta["energy_error"] < 1e-5 and run.meta["method"] == method


def test_damping_takes_what_it_should_from_a_mode():
    """D = beta K: the mode's ratio is beta omega / 2."""
    arm = system(
        beam(0.6, 0.2355, 0.5, 2, damping={"beta_s": 5e-3}, locked=True),
        payload=0.05,
        stiffening=False,
    )
    found = fx.modes(arm)
    omega = 2 * np.pi * found.frequencies_Hz[0]
    zeta = 5e-3 * omega / 2
    t = np.linspace(0, 0.3, 7)
    run = fx.simulate(arm, t, q0=1e-2 * found.shapes[:, 0], rtol=1e-6)
    damped = omega * np.sqrt(1 - zeta**2)
    y = np.exp(-zeta * omega * t) * (
        np.cos(damped * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(damped * t)
    )
    tip = run["link/1/tip_deflection"]
    assert tip == pytest.approx(tip[0] * y, abs=2e-5 * tip[0])
    assert run["energy/loss"][-1] > 0 and run.meta["energy_error"] < 1e-5


def test_at_small_bending_the_linear_line_is_the_exact_one():
    """The difference falls with the square of the motion."""
    t, worst = np.linspace(0, 0.1, 6), []
    for torque in (0.01, 0.02):
        drive = fx.Drive.force(signals.harmonic(torque, 5.0))
        a, b = (fx.simulate(short_arm(kind), t, drive, rtol=1e-7) for kind in (False, True))
        worst.append(
            largest_difference(a, b, ["joint/1/position", "tip/y", "link/1/tip_deflection"])
        )
    assert worst[0] < 1e-3 and worst[1] == pytest.approx(4 * worst[0], rel=0.2)


@pytest.mark.parametrize("speed", [2.0, 4.0])
def test_rotation_softens_the_linear_line(speed):
    """w^2 = w0^2 - Omega^2, benchmark B3: in the time domain too."""
    rest = 2 * np.pi * fx.frequencies(short_arm(locked=True))[0]
    arm, rates = short_arm(), np.zeros(5)
    rates[0] = speed
    omega = 2 * np.pi * fx.frequencies(arm, q=np.zeros(5), qd=rates)[0]
    assert omega == pytest.approx(np.sqrt(rest**2 - speed**2), rel=1e-6)
    q0 = 1e-4 * fx.modes(arm).shapes[:, 0]
    spin = fx.Drive.prescribed(signals.Signal(np.array([[0, 0, speed, 0, 0, 0, 0, 0, 0, 0]])))
    run = fx.simulate(arm, [0.0, 2 * np.pi / omega], spin, q0, rtol=1e-6)
    assert run["link/1/tip_deflection"][-1] == pytest.approx(
        run["link/1/tip_deflection"][0], rel=1e-4
    )


@pytest.mark.slow
def test_the_linear_line_needs_the_torque_of_the_dissertations_form():
    """B7, last row, two to three digits of agreement between codes: cycloid to a right angle in 1
    s."""
    t = np.linspace(0.0, 1.0, 101)
    torque = fx.inverse(
        bench_arm(4, stiffening=False), t, signals.cycloid(np.pi / 2, 1.0), rtol=1e-5
    )["joint/1/drive"]
    for at, value in {0.50: 0.4078, 0.60: 0.0216, 0.75: -0.8425, 0.90: -0.9733}.items():
        assert np.interp(at, t, torque) == pytest.approx(value, abs=0.01), at


# Drives and ends


def test_replayed_drives_return_the_motion():
    arm, motion, t = (
        short_arm(viscous_friction=0.1, coulomb_friction=0.01),
        signals.cycloid(0.3, 0.1),
        np.linspace(0, 0.1, 51),
    )
    run = fx.inverse(arm, t, motion, rtol=1e-6)
    assert run["joint/1/position"] == pytest.approx([motion(s)[0] for s in t], abs=1e-14)
    again = fx.simulate(arm, t, fx.Drive.force(signals.table(t, run["joint/1/drive"])), rtol=1e-6)
    assert largest_difference(again, run, PLACES) < 1e-3
    assert run.meta["energy_error"] < 1e-5 and run["energy/loss"][-1] > 0


def test_a_sampled_function_is_called_once_a_tick():
    ticks = []

    def law(t, position, velocity, tip_deflection):
        ticks.append(t)
        return [0.5 * (0.1 - position[0]) - 0.01 * velocity[0]]

    t = np.linspace(0, 0.02, 5)
    a = fx.simulate(short_arm(), t, Sampled(law, 200.0), rtol=1e-6)
    assert ticks == pytest.approx([0.0, 0.005, 0.01, 0.015, 0.02], abs=1e-12)
    assert a.complete and a.meta["drive"] == {"function": "law", "rate_Hz": 200.0}
    b = fx.simulate(short_arm(), t, fx.Drive.pd([signals.constant(0.1)], [0.5], [0.01]), rtol=1e-6)
    assert largest_difference(a, b, ["joint/1/position"]) < 0.2


def test_a_function_and_a_drive_agree():
    arm, t = short_arm(), np.linspace(0, 0.02, 5)
    a = fx.simulate(arm, t, lambda s, x, v, y: [0.5 * (0.1 - x[0]) - 0.01 * v[0]], rtol=1e-10)
    b = fx.simulate(arm, t, fx.Drive.pd([signals.constant(0.1)], [0.5], [0.01]), rtol=1e-10)
    assert largest_difference(a, b) < 1e-9 and a.meta["drive"] == "Python function"


def test_a_controller_is_refused():
    with pytest.raises(fx.InputError, match=r"stiffening = true"):
        fx.simulate(
            short_arm(), [0.0, 0.1], fx.Controller((fx.PID(signals.constant(0.1), kp=1.0),))
        )


def test_a_limit_ends_a_run_at_its_instant():
    arm = system(rigid(0.3, 0.2, 0.15, 1e-3, "Pa", limits=[-0.1, 0.1]), stiffening=False)
    run = fx.simulate(arm, np.linspace(0, 2, 21), fx.Drive.force(signals.constant(0.1)))
    assert not run.complete and run.t[-1] == pytest.approx(np.sqrt(0.4), rel=1e-6)
    assert (
        run.meta["events"][-1]["text"].startswith("joint 1 left its limits, -0.1 to 0.1 m")
        and len(run.t) == 8
    )


def test_a_step_in_the_drive_is_a_step():
    """Constant acceleration from 0.5 s on: the jump is met, not stepped over."""
    cart = system(rigid(0.3, 0.2, 0.15, 1e-3, "Pa"), stiffening=False)
    run = fx.simulate(cart, [0.0, 0.5, 1.0], fx.Drive.force(signals.step(0.2, 0.5)), rtol=1e-9)
    assert (
        run["joint/1/position"] == pytest.approx([0.0, 0.0, 0.125], abs=1e-10)
        and run.meta["steps"] < 100
    )


def test_ctrl_c_keeps_what_was_finished():
    t = np.linspace(0, 5, 5001)
    stop = lambda done: _thread.interrupt_main() if done > 0.002 else None
    run = fx.simulate(
        short_arm(), t, fx.Drive.force(signals.harmonic(0.1, 2.0)), method="explicit", progress=stop
    )
    assert not run.complete and run.meta["events"][-1]["text"] == "interrupted"
    assert 1 <= len(run.t) < len(t) and np.array_equal(run.t, t[: len(run.t)])


def test_accelerations_are_those_of_the_linear_equations():
    arm = short_arm()
    q, qd = chains.random_state(arm.assembly, np.random.default_rng(8), 0.3)
    force = np.array([0.3, 0, 0, 0, 0])
    assert arm.forces(q, qd, arm.accelerations(q, qd, force)) == pytest.approx(force, abs=1e-10)
