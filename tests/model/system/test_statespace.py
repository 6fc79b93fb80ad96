"""The linearised robot: against the nonlinear one, against natural frequencies, and its zeros
against those of a beam."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

import flexura as fx
from flexura.signals import constant
from robots import (
    beam,
    bench_arm,
    fast,
    few,
    rigid,
    robots,
    seeds,
    state,
    system,
    turning,
    two_link_arm,
)

SAGGING = {"gravity": (0.0, -9.81), "payload": 0.1}


def unit_link(elements: int, **keys) -> fx.System:
    return system(beam(1.0, 1.0, 1.0, elements, **keys))


def elbow(**keys) -> fx.System:
    """Two flexible links, the second at an angle to the first."""
    return fx.assemble(two_link_arm(2).replace({"link.2.joint.start": 1.0} | keys))


# Against the nonlinear robot


@fast
@given(robots(max_links=3), seeds)
def test_the_matrices_are_the_tangents_of_the_forces(robot, seed):
    """forces(q + e dq, e dqd, e dqdd) = hold + e (M dqdd + G dqd + K dq) + O(e^2): half of e leaves
    a quarter of the rest."""
    sys = fx.assemble(robot)
    try:
        lin = fx.linearize(sys)
    except fx.FlexuraError:  # gravity buckles a link
        return
    dq, dqd = state(sys, seed, 0.02)
    dqdd, _ = state(sys, seed + 1)
    for d in (dq, dqd, dqdd):
        d[np.setdiff1d(np.arange(sys.n), sys.free_rows)] = 0.0
    rows, size_of = sys.free_rows, turning(sys)[sys.free_rows]
    change = lin.M @ dqdd[rows] + lin.G @ dqd[rows] + lin.K @ dq[rows]
    rest = []
    for e in (1e-2, 5e-3, 0.0):
        found = (
            sys.forces(lin.q + e * dq, e * dqd, e * dqdd)[rows]
            - sys.forces(lin.q, 0 * dq, 0 * dq)[rows]
        )
        rest.append(np.linalg.norm((found - e * change) / size_of))
    size = np.linalg.norm(change / size_of)
    assert rest[0] < 0.05 * size and rest[1] < 0.3 * rest[0] + 1e-7 * size and rest[2] == 0


@pytest.mark.parametrize("gravity", [False, True])
def test_a_step_of_the_linear_model_is_a_small_motion_of_the_robot(gravity):
    """Drives a little off those that hold it, two links, damped: what differs falls with the square
    of the step."""
    keys = {"gravity_m_s2": [0.0, -1.0], "link.1.joint.start": 0.3} if gravity else {}
    sys = elbow(**keys, **{"link.1.damping": {"beta_s": 1e-3}, "link.2.damping": {"beta_s": 1e-3}})
    lin = fx.linearize(sys)
    assert (np.abs(lin.hold).max() > 0.1) == gravity
    t, push = np.linspace(0.0, 0.5, 26), np.array([0.02, -0.01])
    size = len(lin.A)
    whole = np.block([[lin.A, lin.B @ push[:, None]], [np.zeros((1, size + 1))]])
    wanted = np.array([lin.C @ expm(whole * s)[:size, -1] for s in t])
    off = []
    for e in (1.0, 0.5):
        drive = fx.Drive.force(*(constant(h + e * p) for h, p in zip(lin.hold, push)))
        run = fx.simulate(sys, t, drive, q0=lin.q, rtol=1e-10)
        found = np.array([run[name] - run[name][0] for name in lin.outputs]).T / e
        off.append(np.abs(found - wanted).max(axis=0) / np.abs(wanted).max())
    assert off[0].max() < 0.05 and np.all((off[1] < 0.55 * off[0]) | (off[1] < 1e-4))


def test_a_disturbed_rotation_is_that_of_the_linear_model():
    """An elbow that turns at 1 rad/s, its second joint held by a constant torque, let go a little
    off its steady shape."""
    sys = elbow()
    qd = np.zeros(sys.n)
    qd[0] = 1.0
    lin = fx.linearize(sys, qd=qd)
    assert lin.hold[0] == pytest.approx(0.0, abs=1e-12) and lin.hold[1] > 0.01
    x0 = np.zeros(len(lin.A))
    x0[0], x0[sys.joint_rows[1]] = 1e-3, -2e-3
    t = np.linspace(0.0, 0.5, 11)
    names = ("joint/2/position", "link/1/tip_deflection", "link/2/tip_deflection")
    wanted = np.array(
        [lin.C[[lin.outputs.index(n) for n in names]] @ expm(lin.A * s) @ x0 for s in t]
    )
    drive = fx.Drive.force(*(constant(h) for h in lin.hold))
    still = fx.simulate(sys, t, drive, q0=lin.q, qd0=qd, rtol=1e-11)
    moved = fx.simulate(sys, t, drive, q0=lin.q + x0[: sys.n], qd0=qd, rtol=1e-11)
    assert max(np.abs(still[n] - still[n][0]).max() for n in names) < 1e-8
    for k, name in enumerate(names):
        assert moved[name] - still[name] == pytest.approx(
            wanted[:, k], abs=5e-3 * np.abs(wanted[:, k]).max()
        ), name


# Poles


@few
@given(robots(max_links=4))
def test_eigenvalues_are_the_natural_frequencies(robot):
    sys = fx.assemble(robot)
    try:
        known = {joints: fx.frequencies(sys, joints=joints) for joints in ("locked", "free")}
    except fx.FlexuraError:
        return
    for joints, frequencies in known.items():
        lin = fx.linearize(sys, joints=joints)
        squares = eigh(lin.K, lin.M, eigvals_only=True) if len(lin.M) else np.zeros(0)
        found = np.sqrt(np.maximum(squares, 0)) / (2 * np.pi)
        assert found == pytest.approx(
            frequencies, rel=1e-6, abs=1e-6 * max(frequencies, default=1.0)
        )
        assert len(lin.inputs) == (joints == "free") * (len(sys.free_rows) - len(sys.elastic_rows))


def test_poles_of_a_damped_link_have_its_damping():
    """s = -alpha w^2.../2: zeta = (alpha/w + beta w)/2 for every mode of a clamped link."""
    sys = unit_link(4, locked=True, damping={"alpha_1_s": 0.3, "beta_s": 1e-3})
    lin, w = fx.linearize(sys), 2 * np.pi * fx.frequencies(sys)
    assert lin.inputs == () and lin.B.shape == (2 * sys.n - 2, 0)
    delta = (0.3 + 1e-3 * w**2) / 2
    wanted = np.concatenate(
        [-delta + np.sqrt(delta**2 - w**2 + 0j), -delta - np.sqrt(delta**2 - w**2 + 0j)]
    )
    by_imaginary = lambda s: s[
        np.lexsort((s.real, s.imag))
    ]  # real parts of conjugates may differ by round-off
    assert by_imaginary(lin.poles) == pytest.approx(by_imaginary(wanted), rel=1e-6)


@pytest.mark.parametrize("speed", [2.0, 6.0])
def test_a_rotation_stiffens_the_link(speed):
    """Benchmark B3 through `linearize`, joints locked to the rotation; and a steady rotation needs
    no torque."""
    sys = unit_link(8)
    qd = np.zeros(sys.n)
    qd[0] = speed
    lin = fx.linearize(sys, qd=qd, joints="locked")
    found = np.sort(lin.poles.imag[lin.poles.imag > 0])
    assert found == pytest.approx(2 * np.pi * fx.frequencies(sys, qd=qd), rel=1e-9)
    assert found[0] == pytest.approx({2.0: 3.62180, 6.0: 4.26323}[speed], rel=1e-4)
    assert lin.hold == pytest.approx(0, abs=1e-12)


def test_the_state_space_form_has_the_poles_and_the_transfer_function():
    lin = fx.linearize(elbow(**{"link.1.damping": {"beta_s": 1e-3}}))
    size = len(lin.A)
    assert (lin.A.shape, lin.B.shape, lin.C.shape, lin.D.shape) == (
        (size, size),
        (size, 2),
        (6, size),
        (6, 2),
    )
    slow = lin.poles[np.abs(lin.poles) > 1e-3][:8]
    assert np.abs(np.linalg.eigvals(lin.A)[:, None] - slow).min(axis=0) == pytest.approx(
        0, abs=1e-5
    )
    s = 3.0 + 20.0j
    assert lin.transfer(s) == pytest.approx(
        lin.C @ np.linalg.solve(s * np.eye(size) - lin.A, lin.B) + lin.D, rel=1e-8
    )
    assert lin.outputs == (
        "joint/1/position",
        "joint/2/position",
        "link/1/tip_deflection",
        "link/2/tip_deflection",
        "tip/x",
        "tip/y",
    )
    assert lin.inputs == ("joint/1/drive", "joint/2/drive") and len(lin.states) == size
    assert lin.states[0] == "joint/1 [rad]" and lin.states[size // 2] == "rate of joint/1 [rad/s]"
    assert lin.units["joint/1/drive"] == "N m" and lin.units["tip/x"] == "m"


# Zeros


def test_zeros_of_hub_torque_to_tip_are_real_and_of_both_signs():
    """A pinned-free beam: sin x + sinh x = 0 at x = y (1 + i), tan y = -tanh y, so s = +-2 y^2
    sqrt(EI/rhoA)/L^2."""
    y = [
        brentq(
            lambda y: np.sin(y) * np.cosh(y) + np.cos(y) * np.sinh(y), k * np.pi - 1.0, k * np.pi
        )
        for k in (1, 2, 3)
    ]
    exact = np.repeat(2 * np.square(y), 2)
    errors = []
    for elements in (8, 16):
        found = fx.linearize(unit_link(elements)).zeros("joint/1/drive", "tip/y")[:6]
        assert np.abs(found.imag).max() == 0 and np.array_equal(
            np.sort(np.sign(found.real)), [-1, -1, -1, 1, 1, 1]
        )
        errors.append(np.abs(np.abs(found) / exact - 1))
    assert errors[1].max() < 5e-4 and errors[1][:2].max() < 2e-6
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


@pytest.mark.parametrize("make", [bench_arm, lambda: unit_link(8)])
def test_collocated_zeros_are_the_clamped_frequencies(make):
    sys = make()
    zeros = fx.linearize(sys).zeros("joint/1/drive", "joint/1/position")
    assert zeros.real == pytest.approx(0, abs=1e-6 * np.abs(zeros).max())
    assert np.sort(zeros.imag[zeros.imag > 0]) == pytest.approx(
        2 * np.pi * fx.frequencies(sys), rel=1e-7
    )


@few
@given(robots(max_links=3, gravity=False))
def test_the_transfer_function_vanishes_at_every_zero(robot):
    """Next to a zero of multiplicity one, |H| falls with the distance to it."""
    lin = fx.linearize(fx.assemble(robot))
    for drive in lin.inputs:
        own = drive.replace("drive", "position")
        i, j = lin.outputs.index(own), lin.inputs.index(drive)
        for zero in lin.zeros(drive, own):
            near = [abs(z - zero) for z in (*lin.zeros(drive, own), *lin.poles)]
            if sorted(near)[1] < 0.05 * abs(zero) or abs(zero) <= 1e-3 * abs(lin.poles[-1]):
                continue  # a multiple zero, or one beside a pole
            values = [abs(lin.transfer(zero * (1 + e))[i, j]) for e in (1e-2, 1e-3)]
            assert values[1] < 0.2 * values[0]


def test_a_drive_that_does_not_reach_an_output_is_named():
    """A straight link along the rail of its cart: to first order its drive turns nothing."""
    sys = system(rigid(0.1, 0.6, 0.05, 5e-4, "Pa"), beam(0.3, 0.157, 0.3333, 3))
    with pytest.raises(fx.InputError, match="an output that joint/1/drive moves"):
        fx.linearize(sys).zeros("joint/1/drive", "joint/2/position")


def test_wrong_arguments_are_named():
    sys = elbow()
    lin = fx.linearize(sys)
    bent, rates = sys.start(), np.zeros(sys.n)
    bent[1], rates[sys.joint_rows[1]] = 0.01, 1.0
    elastic = np.zeros(sys.n)
    elastic[1] = 1.0
    heavy = fx.assemble(two_link_arm(2).replace({"gravity_m_s2": [0.0, -0.1]}))
    turning = np.zeros(sys.n)
    turning[0] = 1.0
    for make, words in (
        (lambda: fx.linearize(sys, joints="half"), "joints = 'half'"),
        (lambda: fx.linearize(sys, q=bent), "q: expected an equilibrium"),
        (lambda: fx.linearize(sys, qd=rates), "qd: expected a steady motion"),
        (lambda: fx.linearize(sys, qd=elastic), "qd: expected rates of joints only"),
        (lambda: fx.linearize(heavy, qd=turning), "qd: expected a steady motion"),
        (lambda: fx.linearize(sys, q=[0.0]), "expected an array of shape"),
        (
            lambda: lin.zeros("joint/3/drive", "tip/x"),
            "drive = 'joint/3/drive': expected one of joint/1/drive",
        ),
        (lambda: lin.zeros("joint/1/drive", "tip/z"), "output = 'tip/z': expected one of"),
    ):
        with pytest.raises(fx.InputError, match=words.replace("/", "/")):
            make()


def test_a_sagging_robot_is_held_by_its_static_drives():
    """hold of one flexible pendulum arm, horizontal: the moment of its weight about the joint at
    the bent shape."""
    sys = system(beam(0.6, 0.2355, 8.0, 8), **SAGGING)
    lin = fx.linearize(sys)
    run = fx.simulate(sys, [0.0, 0.2], fx.Drive.force(constant(lin.hold[0])), q0=lin.q, rtol=1e-8)
    assert np.abs(run["joint/1/position"]).max() < 1e-7
    assert lin.hold[0] == pytest.approx(9.81 * (0.1 * 0.6 + 0.2355 * 0.18), rel=0.02)
