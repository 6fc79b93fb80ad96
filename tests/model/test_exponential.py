"""Exponential steps: the propagator of one mode, the basis of the whole robot, and runs against the other methods."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from scipy.linalg import eigh, expm

import flexura as fx
from flexura import basis as modal
from flexura import exponential, past, propagator, signal
from flexura.course import Course
from flexura.forward import initial, to_state
from flexura.lanes import WIDTH, load, store
from flexura.loop import RUNNING
from flexura.past import ORDER
from flexura.propagator import free, moments
from robots import beam, bench_arm, few, rigid, robot, robots, system, two_link_arm

# One mode -------------------------------------------------------------------------------------------------------------------

POWERS = 6


def by_matrix_exponential(x2: float, dd: float) -> tuple[np.ndarray, np.ndarray]:
    """Free motion (2, 2) over a step of 1, and the response (POWERS, 2) to s^m at rest, of x'' + dd x' + x2 x = s^m."""
    free_motion = expm(np.array([[0.0, 1.0], [-x2, -dd]]))
    out = []
    for m in range(POWERS):  # s^m is the last of a chain of integrators
        A = np.zeros((m + 3, m + 3))
        A[0, 1], A[1, 0], A[1, 1], A[1, m + 2] = 1.0, -x2, -dd, 1.0
        for j in range(1, m + 1):
            A[2 + j, 1 + j] = j
        out.append(expm(A)[:2, 2])
    return free_motion, np.array(out)


STIFF = [0.0, 1e-6, 1e-2, 0.5, *np.linspace(7, 12, 21), 30.0, 100.0, 2e3]


@pytest.mark.parametrize("dd", [0.0, 1e-3, 0.5, *np.linspace(2.5, 8, 23), 20.0, 100.0])
def test_a_step_of_one_mode_is_exact(dd):
    """Under-, over- and critically damped, rigid, stiff: every branch of the recurrence, finely where they meet."""
    h = 3e-3
    for x2 in STIFF:
        w2, d2 = x2 / h**2, dd / h
        g, dg = free(w2, d2, h)
        A, B, work = np.zeros(POWERS), np.zeros(POWERS), np.zeros((2, 40))
        moments(w2, d2, h, g, dg, A, B, work)
        motion, response = by_matrix_exponential(x2, dd)
        assert [dg + d2 * g, g / h, -w2 * g * h, dg] == pytest.approx(motion.ravel(), abs=1e-10, rel=1e-10)
        assert A / h**2 == pytest.approx(response[:, 0], abs=1e-12, rel=1e-9)
        assert B / h == pytest.approx(response[:, 1], abs=1e-12, rel=1e-9)


# The basis ------------------------------------------------------------------------------------------------------------------


@few
@given(robots(), st.randoms(use_true_random=False))
def test_the_basis_is_that_of_the_robot(made, random):
    """Phi M Phi^T = 1, Phi K Phi^T = diag(w2), ascending, rows = Phi^-1, w2 LAPACK's; and again from another's basis."""
    sys = fx.assemble(made)
    b, gains = modal.basis(sys.n), np.zeros(len(sys.links))
    to_user = np.linalg.inv(sys.to_solver)
    for _ in range(2):
        q = sys.start()
        for row, link in zip(sys.joint_rows, sys.robot.links, strict=True):
            if link.joint.type == "R" and not link.joint.locked:
                q[row] += random.uniform(-1.5, 1.5)
        w = sys._work()
        w.held[:] = 0
        modal.look(sys.chain, w, b, gains, gains, sys.to_solver @ q, 1.0)
        b.seen[:] = np.inf  # so that the next one is made, poor or not
        M, K = (to_user.T @ A @ to_user for A in (sys.mass(q), sys.stiffness()))
        good = 1e-13 * np.linalg.cond(M)
        phi, rows, found = b.phi[:, : sys.n], b.rows[:, : sys.n], b.w2[: sys.n]
        assert phi @ M @ phi.T == pytest.approx(np.eye(sys.n), abs=good + 1e-12)
        assert phi @ rows == pytest.approx(np.eye(sys.n), abs=good + 1e-12)
        assert found == pytest.approx(np.maximum(eigh(K, M, eigvals_only=True), 0), abs=(good + 1e-9) * found[-1] + 1e-9)


@few
@given(st.integers(1, ORDER), st.lists(st.floats(0.05, 4.0), min_size=ORDER, max_size=ORDER), st.integers(1, ORDER))
def test_the_polynomials_of_a_step_are_those_through_its_values(k, apart, used):
    """Lagrange's are 1 at their own node and 0 at the others, GAP's 1 at the end, ERROR's the same but for the oldest node, and
    their sum is 1; a value that is not there has none, whatever its place in the memory held before."""
    p, used = past.past(4), min(used, k)
    p.node[:], p.poly[:] = -np.pi, np.nan
    p.node[:k] = np.append(0.0, -np.cumsum(apart))[:k]
    _polynomials_of(p, used)
    at = lambda j, s: np.polyval(p.poly[0, ::-1, j], s)
    nodes = p.node[:used]
    size = np.abs(p.poly[0][:, : past.ERROR + 1]).sum() * 1e-13 * (1 + np.abs(nodes).max()) ** used
    assert np.array([at(j, nodes) for j in range(used)]) == pytest.approx(np.eye(used), abs=size)
    assert at(past.GAP, np.append(nodes, 1.0)) == pytest.approx(np.append(np.zeros(used), 1.0), abs=size)
    assert at(past.ERROR, np.append(nodes[:-1], 1.0)) == pytest.approx(np.zeros(used), abs=size)
    assert p.poly[0, used, past.ERROR] == pytest.approx(p.poly[0, used, past.GAP], rel=1e-12)
    assert (p.poly[0, :, used:ORDER] == 0.0).all()


@njit
def _polynomials_of(p, used):
    past._polynomials(p, 0, used)


@njit
def _waves(x, sine, cosine):
    for k in range(0, len(x), WIDTH):
        s, c = propagator.waves(load(x, k))
        store(sine, k, s)
        store(cosine, k, c)


def test_waves_are_the_librarys_sine_and_cosine():
    """From 0 to 1e5 and back, near multiples of pi / 2 too: the error is that of rounding x and a few last digits."""
    x = np.concatenate([np.linspace(-1e5, 1e5, 4000), np.linspace(-7, 7, 4000), np.arange(-2000, 2000) * (np.pi / 2)])
    found = np.zeros((2, len(x)))
    _waves(x, *found)
    assert np.abs(found - [np.sin(x), np.cos(x)]).max() < 5e-16


# Runs -----------------------------------------------------------------------------------------------------------------------


def largest(a: fx.Run, b: fx.Run) -> float:
    """The largest difference of positions and deflections, relative to each one's range or 0.1 mm, 0.1 mrad."""
    names = [name for name in a if name.endswith(("position", "tip_deflection"))]
    return max(np.abs(a[name] - b[name]).max() / max(np.ptp(b[name]), 1e-4) for name in names)


CASES = {
    "the bench arm": bench_arm(4),
    "two links": fx.assemble(two_link_arm(3)),
    "a sleeve": system(beam(0.4, 0.157, 0.3333, 4, "Pb", start=0.25, damping={"beta_s": 1e-4}), payload=0.02),
    "a carriage with a damped strip": system(
        rigid(0.1, 0.6, 0.05, 5e-4, "Pa", viscous_friction=3.0),
        beam(0.3, 0.157, 0.3333, 4, hub_inertia_kg_m2=1e-5, damping={"beta_s": 2e-4, "alpha_1_s": 0.3}),
        payload=0.02, payload_inertia=1e-5, gravity=(0.0, -9.81),
    ),
    "dry friction": system(rigid(0.2, 0.5, 0.1, 2e-3, coulomb_friction=0.01), beam(0.3, 0.157, 0.3333, 4), payload=0.02),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("rtol", "most"), [(1e-4, 3e-3), (1e-7, 1e-5)])
def test_a_run_is_that_of_the_implicit_and_explicit_methods(name, rtol, most):
    sys, t = CASES[name], np.linspace(0, 0.6, 61)
    push = [signal.bang_bang(0.02 if link.joint.type == "R" else 0.2, 0.4, 0.04) for link in sys.robot.links]
    drive = fx.Drive.force(*push)
    exact = fx.simulate(sys, t, drive, rtol=1e-10, method="explicit")
    run = fx.simulate(sys, t, drive, rtol=rtol, method="exponential")
    assert largest(run, exact) < most
    assert run.meta["energy_error"] < 100 * most


@few
@given(robots(), st.sampled_from([1e-4, 1e-6]))
def test_a_random_robot_moves_as_it_does_explicitly(made, rtol):
    sys, t = fx.assemble(made), np.linspace(0, 0.05, 11)
    drive = fx.Drive.force(*[signal.bang_bang(0.01, 0.04, 0.01)] * len(sys.links))
    exact, run = (
        fx.simulate(sys, t, drive, rtol=tolerance, method=method)
        for tolerance, method in ((1e-10, "explicit"), (rtol, "exponential"))
    )
    assert run.complete == exact.complete
    if run.complete:
        assert largest(run, exact) < 1000 * rtol


def test_prescribed_joints_take_the_same_forces():
    sys, t = fx.assemble(two_link_arm(3)), np.linspace(0.004, 0.8, 81)
    motion = [signal.cycloid(0.6, 0.6), signal.cycloid(-0.8, 0.7)]
    a, b = (fx.inverse(sys, t, motion, rtol=1e-8, method=method) for method in ("explicit", "exponential"))
    for i in (1, 2):
        drive = a[f"joint/{i}/drive"]
        assert b[f"joint/{i}/drive"] == pytest.approx(drive, abs=1e-6 * np.abs(drive).max())


def test_steps_do_not_follow_the_frequencies():
    """Ten times stiffer: frequencies three times higher, deflections ten times smaller, hardly more steps."""
    drive, t = fx.Drive.force(signal.polynomial(0.0, 0.02)), np.linspace(0, 2, 41)
    count = [
        fx.simulate(
            system(beam(0.6, 0.2355, EI, 6, hub_inertia_kg_m2=2e-2), payload=0.05), t, drive, rtol=1e-5, method="exponential"
        ).meta["steps"]
        for EI in (5.0, 500.0)
    ]
    assert count[1] < 1.3 * count[0] and count[0] < 150


def test_equilibrium_under_gravity_is_kept():
    """Massless hubs make the mass matrix ill-conditioned; the state still keeps its digits."""
    hang = fx.assemble(robot(beam(0.5, 0.2, 1.0, 3, start=-np.pi / 2), beam(0.3, 0.2, 1.0, 2), gravity=(0.0, -9.81)))
    run = fx.simulate(hang, [0.0, 1.0], q0=fx.static(hang), rtol=1e-8, method="exponential")
    assert np.abs(run.states[-1] - run.states[0]).max() < 1e-9 and run.meta["steps"] < 300


def test_the_basis_is_made_again_where_the_robot_has_changed():
    """Two heavy links, the second turning right round: the modes at its start are not those at half a turn."""
    sys = system(beam(0.5, 0.5, 20.0, 3), beam(0.5, 0.5, 20.0, 3, hub_mass_kg=0.5), payload=0.3)
    t, motion = np.linspace(0, 1.0, 11), [signal.constant(0.0), signal.cycloid(np.pi, 1.0)]
    drive = fx.Drive.prescribed(*motion)
    course = Course(sys, t, drive, to_state(sys, *initial(sys, 0.0, drive, None, None)), exponential.EXPONENTIAL)
    course.advance(1e-5, 1)
    first = course._modes[0].w2.copy()
    while course.advance(1e-5, 100) == RUNNING:
        pass
    assert np.abs(course._modes[0].w2 / np.maximum(first, 1.0) - 1).max() > 0.05
    exact = fx.simulate(sys, t, drive, rtol=1e-9, method="explicit")
    assert largest(fx.simulate(sys, t, drive, rtol=1e-5, method="exponential"), exact) < 1e-4


def test_a_run_that_gets_stuck_goes_on_with_another_method():
    """Handed over in the middle, as where exponential steps give way: the state, the breaks and the outputs go on."""
    sys, t = CASES["a carriage with a damped strip"], np.linspace(0, 0.6, 61)
    drive = fx.Drive.force(signal.bang_bang(0.2, 0.4, 0.04), signal.bang_bang(0.02, 0.4, 0.04))
    course = Course(sys, t, drive, to_state(sys, *initial(sys, 0.0, drive, None, None)), exponential.EXPONENTIAL)
    assert course.advance(1e-8, 40) == RUNNING
    course._give_way(1e-8)
    while course.advance(1e-8, 400) == RUNNING:
        pass
    exact = fx.simulate(sys, t, drive, rtol=1e-10, method="explicit")
    rows = sys.joint_rows
    for i, row in enumerate(rows, 1):
        wanted = exact[f"joint/{i}/position"]
        assert course.out[:, row] == pytest.approx(wanted, abs=1e-5 * np.ptp(wanted))
