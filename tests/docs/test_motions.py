"""Equations of docs/theory/13-motions.md, written down with plain NumPy, against what computes
them."""

import numpy as np
import pytest

import flexura as fx
import robots
from flexura import control
from flexura.signals import paths
from flexura.simulation.trajectory.collocation import POINTS, Mesh
from flexura.simulation.trajectory.inverse_motion import TipProblem, mesh_between
from flexura.simulation.trajectory.nearest_motion import nearest_motion
from flexura.simulation.trajectory.plant_motion import LOOKS, PERIODS, Plant, answer
from flexura.simulation.trajectory.tip_output import tip_path
from flexura.simulation.trajectory.variation import stage_times, variation
from flexura.simulation.trajectory.zero_dynamics import zero_dynamics


def arm(beta=2e-3):
    return robots.system(
        robots.beam(0.6, 0.2355, 0.5, 3, hub_inertia_kg_m2=2e-3, damping={"beta_s": beta}),
        payload=0.05,
    )


def test_an_equation_holds_at_the_points_of_gauss():
    """Polynomials that satisfy an equation at the points of Gauss.

    Equations: 113
    """
    mesh = Mesh(np.array([0.0, 0.1, 0.25, 0.4]))
    g = np.polynomial.legendre.leggauss(POINTS)[0]
    h = np.diff(mesh.nodes)
    points = mesh.nodes[:-1, None] + h[:, None] * (1 + g) / 2
    assert mesh.t == pytest.approx(points.ravel())
    # q'' + 4 q = 0 with q(0) = 0 and q(0.4) = sin 0.8: 2 c_b unknowns fewer than equations by two
    one = np.ones((len(mesh.t), 1, 1))
    band = mesh.band([4 * one, 0 * one, one], mesh.ends[0, :1], mesh.ends[0, 1:])
    right = np.zeros(mesh.count)
    right[-1] = np.sin(0.8)
    t = np.linspace(0.0, 0.4, 9)
    assert mesh.at(t, band.solve(right)[:, None])[0][:, 0] == pytest.approx(np.sin(2 * t), abs=1e-9)


def test_zeros_make_the_pencil_singular():
    """The zeros of the motion with the tip at rest.

    Equations: 114
    """
    system = arm()
    q, zero = system.start(), np.zeros((1, system.n))
    _, K, G, M, _, tip = system.equations.force_derivatives(q[None], zero, zero)
    K, G, M, g = K[0], G[0], M[0], tip[0][1:]
    e, j = system.elastic_rows, system.joint_rows
    zeros = zero_dynamics(M, G, K, g, e, j).zeros
    N = np.zeros((system.n, len(e)))
    N[e] = np.eye(len(e))
    N[j] = -np.linalg.solve(g[:, j], g[:, e])
    A, B, C = (x[e] @ N for x in (M, G, K))
    for s in zeros[:4]:
        pencil = s * s * A + s * B + C
        values = np.linalg.svd(pencil / np.abs(pencil).max(axis=1)[:, None], compute_uv=False)
        assert values[-1] < 1e-9 * values[0]


def test_a_posture_balances_and_reaches():
    """A posture under gravity.

    Equations: 115
    """
    heavy = robots.system(
        robots.beam(0.3, 0.3, 0.8, 2), robots.beam(0.3, 0.3, 0.8, 2), gravity=(0.0, -9.81)
    )
    q = fx.inverse_kinematics(heavy, (0.35, 0.2), joints=[0.1, 0.8])
    balance = heavy.elastic(q) + heavy.gravity(q)
    assert np.abs(balance[heavy.elastic_rows]).max() < 1e-10
    assert fx.tip_pose(heavy, q)[:2] == pytest.approx([0.35, 0.2], abs=1e-12)


def test_the_elastic_rows_balance_and_the_tip_is_on_its_path():
    """What the inverse motion satisfies.

    Equations: 116
    """
    system = arm()
    path = tip_path(system, np.array([0.0, 0.6]), lambda t: paths.smooth_rise(t / 0.6))
    problem = TipProblem(system, path)
    start = problem.rest(0.0, system.start())
    end = problem.rest(0.6, problem.along(np.linspace(0, 0.6, 9), start.q)[-1])
    mesh = mesh_between(-0.3, 0.9, path.breaks, 0.03)
    found = problem.solve(mesh, problem.slow(mesh, start.q), start, end)
    q, v, a = mesh.here(found.coefficients)
    force = np.array([system.forces(*x) for x in zip(q, v, a, strict=True)])
    assert np.abs(force[:, system.elastic_rows]).max() < 1e-8 * np.abs(force).max()
    tips = np.array([fx.tip_pose(system, x)[:2] for x in q])
    assert np.arctan2(*tips.T[::-1]) == pytest.approx(path.at(mesh.t)[:, 0], abs=1e-9)
    for rest, rows, k in ((start, start.zeros.decaying, 0), (end, end.zeros.growing, -1)):
        at = mesh.at(mesh.nodes[[k]], found.coefficients)
        e = system.elastic_rows
        state = np.concatenate([(at[0][0] - rest.q)[e], at[1][0][e]])
        size = np.abs(rows).max(axis=1)
        assert np.abs(rows @ state / size).max() < 1e-9


def test_the_way_has_four_derivatives_of_zero_at_its_ends():
    """A path from rest to rest.

    Equations: 117
    """
    u = np.polynomial.Polynomial([0] * 5 + [126, -420, 540, -315, 70])
    x = np.linspace(0, 1, 11)
    assert paths.smooth_rise(x) == pytest.approx(u(x), abs=1e-14)
    for k in range(1, 5):
        assert u.deriv(k)(np.array([0.0, 1.0])) == pytest.approx([0.0, 0.0], abs=1e-9)
    x, y = paths.line((0.1, 0.2), (0.4, 0.1), 2.0)
    assert [x(1.0)[0], y(0.5)[0]] == pytest.approx([0.25, 0.2 - 0.1 * u(0.25)], abs=1e-10)


def test_the_variation_of_a_motion_is_the_difference_of_two():
    """The derivative of a motion by a number.

    Equations: 118
    """
    system, nodes = arm(), np.linspace(0.0, 0.3, 61)
    t = stage_times(nodes)
    push = lambda size: [lambda s: 0.2 * np.sin(20 * s) + size * np.cos(9 * s)]
    run = fx.simulate(system, np.append(0.0, t), push(0.0), rtol=1e-11)
    n = system.n
    q, v = np.ascontiguousarray(run.states[1:, :n]), np.ascontiguousarray(run.states[1:, n:])
    force = np.zeros((len(t), n))
    force[:, 0] = 0.2 * np.sin(20 * t)
    a = np.array([system.accelerations(*x) for x in zip(q, v, force, strict=True)])
    along = variation(system, nodes, q, v, a, system.free_rows)
    f = np.zeros((len(t), n, 1))
    f[:, 0, 0] = np.cos(9 * t)
    places, _ = along.integrate(f)
    h = 1e-4
    up, down = (fx.simulate(system, np.append(0.0, t), push(s * h), rtol=1e-11) for s in (1, -1))
    slope = (up.states[1:, :n] - down.states[1:, :n]) / (2 * h)
    assert places[:, :, 0] == pytest.approx(slope, abs=2e-4 * np.abs(slope).max())


def test_the_nearest_motion_is_the_exact_one_where_there_is_one():
    """The nearest motion.

    Equations: 119
    """
    system = arm()
    path = tip_path(system, np.array([0.0, 0.6]), lambda t: 0.5 * paths.smooth_rise(t / 0.6))
    mesh = mesh_between(-0.35, 1.2, path.breaks, 0.03)
    found = nearest_motion(system, path, mesh, system.start())
    t = np.linspace(-0.35, 0.8, 200)
    run = fx.inverse(system, t, found.signals, rtol=1e-8)
    off = np.arctan2(run["tip/y"], run["tip/x"]) - path.at(t)[:, 0]
    assert np.abs(off).max() < 1e-5


def test_damping_ratios():
    """Damping of modes.

    Equations: 120
    """
    system = arm()
    found = fx.modes(system, count=3)
    D = system.damping_at(found.q)
    for k, x in enumerate(found.shapes.T):
        zeta = x @ D @ x / (2 * 2 * np.pi * found.frequencies_Hz[k])
        assert found.damping_ratios[k] == pytest.approx(zeta, rel=1e-12)


def test_a_frequency_response():
    """Response at a frequency.

    Equations: 121
    """
    system, f = arm(), 3.0
    found = fx.frequency_response(system, "joint/1/drive", "tip/y", [f])
    lin, w = fx.linearize(system), 2 * np.pi * f
    c = lin.outlook[lin.outputs.index("tip/y")]
    H = c @ np.linalg.solve(lin.K + 1j * w * lin.G - w * w * lin.M, lin.E[:, 0])
    assert found.values[0] == pytest.approx(H, rel=1e-7)


def test_what_is_asked_of_the_drives_at_the_end():
    """Constraints of the linear program.

    Equations: 122
    """
    system = arm()
    plant = Plant(system, system.start(), fx.static(system, [0.5]), np.ones(1), 1e-3)
    omega, into = plant.modes
    assert omega[0] == 0.0
    assert omega[1:4] / (2 * np.pi) == pytest.approx(
        fx.frequencies(system, plant.end, "free")[1:4], rel=1e-9
    )
    u = np.zeros((21, 1))
    u[5] = 0.1
    found = answer(plant, u, 0.4, np.array([0]))
    du = np.zeros_like(u)
    du[9] = 1e-3
    up, down = (answer(plant, u + s * du, 0.4, np.array([0])).end for s in (1, -1))
    slope = (up - down) / 2e-3
    longer = answer(plant, u, 0.4 * (1 + 1e-4), np.array([0])).end
    shorter = answer(plant, u, 0.4 * (1 - 1e-4), np.array([0])).end
    n = system.n
    for part in (slice(0, n), slice(n, 2 * n)):
        asked = into[:3] @ found.slope[part][:, 9]
        assert asked == pytest.approx(into[:3] @ slope[part], rel=1e-3, abs=1e-4)
        by_time = into[:3] @ (longer - shorter)[part] / 8e-5
        assert into[:3] @ found.slope[part][:, -1] == pytest.approx(by_time, rel=1e-3, abs=1e-4)
    # what the motion linearised at the end says of the tip later, against a run
    away = np.concatenate([plant.end + 1e-4 * plant.shape(1), np.zeros(n)])
    later = plant.later @ (away - np.concatenate([plant.end, np.zeros(n)]))
    t = np.linspace(0, PERIODS * 2 * np.pi / omega[1], LOOKS)
    run = fx.simulate(system, t, None, away[:n], rtol=1e-9)
    assert later == pytest.approx(run["link/1/tip_deflection"], abs=1e-2 * np.abs(later).max())


STEP_S = 0.008


def splines(t, begin, end, every=0.08):
    """Columns of cubic B-splines, written as fourth differences of truncated powers; the last one
    stays."""
    cube = lambda u: np.maximum(u, 0.0) ** 3 / 6
    count = round((end - begin) / every)
    one = lambda u: cube(u) - 4 * cube(u - 1) + 6 * cube(u - 2) - 4 * cube(u - 3) + cube(u - 4)
    each = [one((t - begin) / every - k) for k in range(count + 100)]
    return np.column_stack([*each[:count], np.sum(each[count:], axis=0)])


def softer(factor):
    """An arm on a hub, and what changes of its motion do to its tip across."""
    made = robots.system(
        robots.beam(0.4, 0.157, factor * 0.33, 2, hub_inertia_kg_m2=0.03, damping={"beta_s": 2e-4}),
        payload=0.02,
    )
    t = STEP_S * np.arange(150)
    basis = splines(t, 0.1, 0.5)
    moved = control.motion_response(made, t, np.zeros((len(t), 1)), [basis])
    return t, moved[:, 1:]


def test_a_change_is_the_least_of_what_all_robots_lack():
    """The law of learning as one least-squares problem, and trials on the softer robot.

    Equations: 123
    """
    (t, stiff), (_, soft) = softer(1.0), softer(0.94)
    share = np.exp(-np.maximum(t - 0.6, 0.0) / 0.3)
    law = control.LearningLaw(np.array([stiff, soft]), (stiff.shape[2],), share)
    u = np.clip((t - 0.2) / 0.3, 0, 1)
    error = (0.02 * np.sin(np.pi * u) + 0.003 * u)[:, None]
    A = np.concatenate([share[:, None] * stiff[:, 0], share[:, None] * soft[:, 0]])
    rho = np.sqrt(1e-3 * (A**2).sum(axis=0).max())
    n = A.shape[1]
    whole = np.concatenate([A, rho * np.eye(n), rho * np.diff(np.eye(n), 2, axis=0)])
    right = np.concatenate([share * error[:, 0], share * error[:, 0], np.zeros(2 * n - 2)])
    assert law.update(error) == pytest.approx(np.linalg.lstsq(whole, right)[0], abs=1e-8)
    sizes = []
    for _ in range(4):
        sizes.append(np.linalg.norm(share * error[:, 0]))
        error = error - soft @ law.update(error)
    assert sizes[1] < 0.2 * sizes[0] and sizes[3] < sizes[1]
    with pytest.raises(fx.InputError, match="move the outputs"):
        control.LearningLaw(0 * law.responses, law.counts, share).update(error)


def test_the_response_along_a_motion_is_the_difference_of_two_runs():
    """Two flexible links on a wide motion; one joint follows, the other one is on a spring.

    Equations: 124
    """
    made = robots.system(
        robots.beam(0.3, 0.3, 0.8, 1, hub_inertia_kg_m2=0.01, damping={"beta_s": 1e-3}),
        robots.beam(0.3, 0.2, 0.4, 1, hub_inertia_kg_m2=0.01, damping={"beta_s": 1e-3}),
        payload=0.02,
    )
    t = STEP_S * np.arange(126)
    way = fx.signals.polynomial(0.4, 0.8, at_s=0.1)
    joints = np.array([[way(x)[0], -0.7 * way(x)[0]] for x in t])
    bump = splines(t, 0.3, 0.38)[:, :1]
    tip = lambda run: np.column_stack([run["tip/x"], run["tip/y"]])

    def held(size):
        return tip(
            fx.inverse(made, t, joints + size * np.column_stack([bump, 0 * bump]), rtol=1e-9)
        )

    found = control.motion_response(made, t, joints, [bump, bump])
    exact = (held(1e-3) - held(-1e-3)) / 2e-3
    # the links bend on the way, which the response leaves out
    assert np.abs(found[:, :, 0] - exact).max() < 0.05 * np.abs(exact).max()

    asked = [fx.signals.table(t, joints[:, 1] + s * bump[:, 0]) for s in (1e-3, -1e-3)]
    spring, runs = 20.0, []
    free = robots.system(
        robots.beam(0.3, 0.2, 0.4, 1, hub_inertia_kg_m2=0.01, damping={"beta_s": 1e-3}),
        payload=0.02,
    )
    for one in asked:
        force = lambda at, q, v, w, one=one: [spring * (one(at)[0] - q[0])]
        runs.append(tip(fx.simulate(free, t, force, rtol=1e-9)))
    exact = (runs[0] - runs[1]) / 2e-3
    found = control.motion_response(free, t, joints[:, 1:], [bump], [control.JointSpring(spring)])[
        :, :, 0
    ]
    assert np.abs(found - exact).max() < 0.05 * np.abs(exact).max()
    with pytest.raises(fx.InputError, match="changes of each joint"):
        control.motion_response(made, t, joints, [bump])


def test_a_reference_gives_its_voltage():
    """The controller's law, forwards, at the reference that its inverse found.

    Equations: 125
    """
    loop = control.JointLoop(0.4, kp=60.0, ki=120.0, kd=0.2, kv=1.4, kc=0.3)
    h = 1e-4
    t = h * np.arange(8001)
    u = np.clip(t / 0.6, 0, 1)
    x = 0.5 * u**3 * (10 - 15 * u + 6 * u**2)
    volts = 1.5 * np.gradient(x, h) + 0.4 * np.sin(np.pi * u) ** 2
    side = np.sin(np.pi * u) ** 2
    r = loop.reference(h, x, volts, side)
    error = r - x
    given = 60 * error + 120 * h * np.cumsum(error) + 0.2 * np.gradient(error, h)
    given += 1.4 * np.gradient(r, h) + 0.3 * side
    assert given == pytest.approx(volts, abs=5e-3)


def test_the_guard_sees_the_worst_robot():
    """What is left of an error, robot by robot.

    Equations: 126
    """
    responses = np.random.default_rng(1).standard_normal((3, 20, 2, 4))
    error, c = np.ones((20, 2)), np.array([0.1, 0.0, -0.2, 0.3])
    law = control.LearningLaw(responses, (4,), np.ones(20))
    found = law.predicted(error, c)
    for size, Y in zip(found, responses, strict=True):
        left = [np.hypot(*(one - rows @ c)) for one, rows in zip(error, Y, strict=True)]
        assert size == pytest.approx(max(left))
