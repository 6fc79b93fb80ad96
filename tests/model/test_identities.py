"""What must hold for every robot: identities, symmetries and limits, on random robots in random
states (B12).

Where a number is compared, the other number comes from another form of the same equations, from
finite differences, or from an assembly written here.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given

import flexura as fx
from flexura import signals
from flexura.system.assembly import COULOMB_RATE
from robots import (
    beam,
    bench_arm,
    fast,
    few,
    forces,
    largest_difference,
    rigid,
    robot,
    robots,
    seeds,
    state,
    system,
    turning,
    two_link_arm,
)


def close(a, b, tolerance: float, least: float = 1e-9) -> None:
    """Agreement of two arrays relative to the largest entry, or to `least`."""
    assert np.abs(np.asarray(a) - b).max() <= tolerance * max(
        np.abs(b).max(), np.abs(a).max(), least
    )


def energy(sys: fx.System, name: str, q: np.ndarray, qd: np.ndarray | None = None) -> float:
    return float(fx.simulate(sys, [0.0], q0=q, qd0=qd)[f"energy/{name}"][0])


def gradient(f, x: np.ndarray, step: np.ndarray | float) -> np.ndarray:
    """df/dx by central differences of order 4; `step` (n,) may differ from unknown to unknown."""
    out = []
    for e in np.diag(np.broadcast_to(step, x.shape)):
        size = e.max()
        out.append((8 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12 * size))
    return np.array(out)


def steps(sys: fx.System, size: float) -> np.ndarray:
    """Steps for finite differences that change a slope by about `size`."""
    return size / turning(sys)


def acceleration(sys: fx.System, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """qdd from the assembled matrices; locked joints stay, Coulomb friction as in the kernel."""
    F = np.zeros(sys.n)
    rows = sys.joint_rows
    F[rows] = tau - friction(sys) * np.tanh(qd[rows] / COULOMB_RATE)
    F -= sys.bias(q, qd) + sys.gravity(q) + sys.elastic(q) + sys.damping_at(q) @ qd
    free, out = sys.free_rows, np.zeros(sys.n)
    # scaled, since slopes and deflections of short elements differ much in size
    M = sys.mass(q)[np.ix_(free, free)]
    s = 1 / np.sqrt(np.diag(M))
    out[free] = s * np.linalg.solve(M * s * s[:, None], s * F[free])
    return out


def recursion(sys: fx.System, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """qdd from the core's recursion along the chain."""
    F, rows = np.zeros(sys.n), sys.joint_rows
    F[rows] = tau - friction(sys) * np.tanh(qd[rows] / COULOMB_RATE)
    return sys.accelerations(q, qd, F)


def friction(sys: fx.System) -> np.ndarray:
    """Coulomb friction of the joints (N,) [N or N m]."""
    return np.array([link.joint.coulomb_friction for link in sys.robot.links])


def at_rest_if_locked(sys: fx.System, qd: np.ndarray) -> np.ndarray:
    out = qd.copy()
    out[np.setdiff1d(np.arange(sys.n), sys.free_rows)] = 0.0
    return out


# Mass matrix and energies


@fast
@given(robots(), seeds)
def test_the_mass_matrix_is_symmetric_and_positive_definite(bot, seed):
    sys = fx.assemble(bot)
    M = sys.mass(state(sys, seed)[0])
    assert np.abs(M - M.T).max() < 1e-12 * np.abs(M).max()
    scale = 1 / np.sqrt(np.diag(M))
    assert np.linalg.eigvalsh(M * scale * scale[:, None])[0] > 1e-9


@fast
@given(robots(), seeds)
def test_the_mass_matrix_is_the_hessian_of_the_kinetic_energy(bot, seed):
    """T is quadratic in qd, so that T(a + b) - T(a) - T(b) = a^T M b exactly."""
    sys = fx.assemble(bot)
    q, a = state(sys, seed)
    b = state(sys, seed + 1)[1]
    M = sys.mass(q)
    T = [energy(sys, "kinetic", q, v) for v in (a, b, a + b)]
    assert T[0] == pytest.approx(a @ M @ a / 2, rel=1e-10)
    assert T[2] - T[0] - T[1] == pytest.approx(a @ M @ b, rel=1e-10, abs=1e-10 * (T[0] + T[1]))


@few
@given(robots(max_links=3), seeds)
def test_bias_forces_follow_from_the_mass_matrix(bot, seed):
    """Lagrange: bias(q, qd) - bias(q, 0) = dM/dt qd - 1/2 d(qd^T M qd)/dq; bias(q, 0) is the strain
    energy's part beyond K."""
    sys = fx.assemble(bot)
    q, qd = state(sys, seed)
    h = 1e-3
    rate = (
        (
            8 * (sys.mass(q + h * qd) - sys.mass(q - h * qd))
            - (sys.mass(q + 2 * h * qd) - sys.mass(q - 2 * h * qd))
        )
        @ qd
        / (12 * h)
    )
    slope = gradient(lambda z: qd @ sys.mass(z) @ qd / 2, q, steps(sys, 5e-4))
    close(
        (sys.bias(q, qd) - sys.bias(q, 0 * q)) / turning(sys),
        (rate - slope) / turning(sys),
        1e-7,
        least=1e-3,
    )


@few
@given(robots(max_links=3), seeds)
def test_gravity_and_stiffness_are_gradients_of_the_energies(bot, seed):
    """gravity = dV/dq; K q + bias(q, 0) = dU/dq, and K is the Hessian of U at 0."""
    sys = fx.assemble(bot)
    q, _ = state(sys, seed)
    h = steps(sys, 2e-3)
    scale = np.abs(sys.gravity(q)).max()
    got = gradient(lambda z: energy(sys, "potential", z), q, h)
    assert np.abs(got - sys.gravity(q)).max() <= 1e-7 * max(scale, 1e-12)
    close(gradient(lambda z: energy(sys, "strain", z), q, h) * h, sys.elastic(q) * h, 1e-6)
    z = sys.start()
    z[sys.elastic_rows] = 1e-4 * q[sys.elastic_rows]  # so small that only K is left
    bent = z - sys.start()
    assert energy(sys, "strain", z) == pytest.approx(bent @ sys.stiffness() @ bent / 2, rel=1e-6)


# Forward and inverse dynamics


@fast
@given(robots(coulomb=True, locked=True), seeds)
def test_the_recursion_solves_the_assembled_equations(bot, seed):
    """accelerate, of cost O(N), against M^-1 (F - bias - D qd - K q - gravity), to the digits that
    solving with M leaves."""
    sys = fx.assemble(bot)
    q, qd = state(sys, seed)
    qd = at_rest_if_locked(sys, qd)
    tau = forces(sys, seed)
    size = turning(sys)
    M, scale = sys.mass(q), 1 / np.sqrt(np.diag(sys.mass(q)))
    lost = np.finfo(float).eps * np.linalg.cond(scale[:, None] * M * scale)
    close(recursion(sys, q, qd, tau) * size, acceleration(sys, q, qd, tau) * size, max(1e-8, lost))


@fast
@given(robots(), seeds)
def test_inverse_dynamics_returns_the_forces_that_were_applied(bot, seed):
    """forces(q, qd, accelerations under tau) = tau in the joints' rows and 0 elsewhere."""
    sys = fx.assemble(bot)
    q, qd = state(sys, seed)
    tau = forces(sys, seed)
    qdd = recursion(sys, q, qd, tau)
    got = sys.forces(q, qd, qdd)
    expected = np.zeros(sys.n)
    expected[sys.joint_rows] = tau
    scale = (
        np.abs(sys.mass(q)) @ np.abs(qdd)
        + np.abs(sys.elastic(q))
        + np.abs(sys.bias(q, qd))
        + np.abs(sys.gravity(q))
    )
    assert (np.abs(got - expected) < 1e-11 * (1 + scale)).all()


@fast
@given(robots(stiffening=False, modes=False, gravity=False, sliding=False), seeds)
def test_the_extended_assembly_is_the_dissertations(bot, seed):
    """M_ij = int m J^T J dx of each element by four Gauss points, J = dr/dq through the chain of
    homogeneous transforms, scattered over all unknowns; hubs, rotors and the payload added
    (dissertation, 2.3 and 2.4)."""
    sys = fx.assemble(bot)
    q, _ = state(sys, seed)
    T = nodal(sys)
    close(sys.mass(q), T.T @ by_elements(bot, T @ q) @ T, 1e-9)


def nodal(sys: fx.System) -> np.ndarray:
    """Joints, and deflection and slope at each node, from the unknowns of each element: (n, n), for
    the linear line."""
    T = np.eye(sys.n)
    for i, link in enumerate(sys.robot.links):
        own, n = sys.link_rows(i), link.elements
        if len(own):
            angle = sys.angles(i + 1, np.linspace(0, link.length_m, 2 * n + 1))
            T[own[1::2]] = angle[2::2]
            T[own[0::2]] = np.cumsum(
                (angle[0:-1:2] + 4 * angle[1::2] + angle[2::2]) * link.length_m / n / 6, axis=0
            )
    return T


def by_elements(bot: fx.Robot, q: np.ndarray) -> np.ndarray:
    """M(q) of the linear model: positions of mass points, directions of rotary inertias,
    differentiated with complex steps."""
    n = len(q)
    first = np.cumsum([0] + [1 + 2 * link.elements for link in bot.links])
    weights, M = [], np.zeros((n, n))
    s, gauss = np.polynomial.legendre.leggauss(4)
    for i, link in enumerate(bot.links):
        if link.flexible:
            h = link.length_m / link.elements
            # properties are linear between given places: split elements there, so that Gauss points
            # stay exact
            ends = np.unique(
                np.round([*np.linspace(0, link.length_m, link.elements + 1), *link.breaks()], 12)
            )
            for a, b in itertools.pairwise(ends):
                for p, w in zip(s, gauss):
                    x = (a + b) / 2 + p * (b - a) / 2
                    element = min(int((a + b) / 2 / h), link.elements - 1)
                    weights.append(
                        (w * (b - a) / 2 * float(link.mass_per_length(x)), i, x, element)
                    )
        else:
            weights.append((link.mass_kg, i, link.centre_of_mass_m, -1))
        weights.append((link.joint.hub_mass_kg, i, 0.0, 0))
    last = len(bot.links) - 1
    weights.append(
        (bot.payload.mass_kg, last, bot.links[last].length_m, bot.links[last].elements - 1)
    )

    def places(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All mass points (k, 2), and the angles of hubs, links and payload."""
        H, frames, angles, angle, end = (
            np.eye(3, dtype=complex),
            [],
            [],
            0,
            np.zeros(2, dtype=complex),
        )
        for i, link in enumerate(bot.links):
            before = bot.links[i - 1] if i else None
            eta = z[first[i]]
            turn = eta if link.joint.type == "R" else link.joint.angle_rad
            along = eta if link.joint.type == "Pa" else (before.length_m if before else 0.0)
            psi = end[1] + turn
            c, d = np.cos(psi), np.sin(psi)
            H = H @ np.array([[c, -d, along], [d, c, end[0]], [0, 0, 1]])
            angle = angle + psi
            frames.append(H)
            angles.append(angle)
            end = z[first[i + 1] - 2 : first[i + 1]] if link.flexible else np.zeros(2)
        angles.append(angle + end[1])
        points = []
        for _, i, x, element in weights:
            w = 0.0
            if bot.links[i].flexible:
                l = bot.links[i].length_m / bot.links[i].elements
                u = np.concatenate([np.zeros(2), z[first[i] + 1 : first[i + 1]]])[
                    2 * element : 2 * element + 4
                ]
                r = x / l - element
                w = u @ np.array(
                    [
                        1 - 3 * r**2 + 2 * r**3,
                        l * (r - 2 * r**2 + r**3),
                        3 * r**2 - 2 * r**3,
                        l * (r**3 - r**2),
                    ]
                )
            points.append((frames[i] @ np.array([x, w, 1.0]))[:2])
        return np.array(points), np.array(angles)

    slopes = [places(q + 1e-30j * e) for e in np.eye(n)]
    J = np.array([p.imag for p, _ in slopes]) / 1e-30  # (n, k, 2)
    A = np.array([a.imag for _, a in slopes]) / 1e-30  # (n, N + 1)
    masses = np.array([w for w, *_ in weights])
    M += np.einsum("akx,k,bkx->ab", J, masses, J)
    for i, link in enumerate(bot.links):
        inertia = link.joint.hub_inertia_kg_m2 + (0.0 if link.flexible else link.inertia_kg_m2)
        M += inertia * np.outer(A[:, i], A[:, i])
        M[first[i], first[i]] += link.joint.rotor_inertia
    return M + bot.payload.inertia_kg_m2 * np.outer(A[:, -1], A[:, -1])


@pytest.mark.parametrize("stiffening", [True, False])
def test_a_payloads_inertia_turns_with_the_tip_only(stiffening):
    """A payload without mass turns at the rate of the tip's angle: T = J (qd + d theta(L)/dt)^2/2
    beyond the bare link's."""
    J = 0.02
    bare, loaded = (
        system(beam(0.5, 0.2, 1.0, 2), payload_inertia=j, stiffening=stiffening) for j in (0.0, J)
    )
    q, qd = state(bare, 5, slope=0.3)
    rate = qd[0] + bare.angles(1, 0.5)[0] @ qd
    extra = energy(loaded, "kinetic", q, qd) - energy(bare, "kinetic", q, qd)
    assert extra == pytest.approx(J * rate**2 / 2, rel=1e-9)


# Energy along a motion


def drives(sys: fx.System, seed: int) -> fx.Drive:
    """A smooth force or torque in every joint, 1 at most."""
    random = np.random.default_rng(seed + 2)
    return fx.Drive.force(
        *(
            signals.harmonic(random.uniform(-1, 1) * 0.3, random.uniform(0.5, 3), 1.0)
            for _ in sys.robot.links
        )
    )


def small_state(sys: fx.System, seed: int) -> dict[str, np.ndarray]:
    q, qd = state(sys, seed, slope=0.03, rate=0.5)
    return {"q0": q, "qd0": qd}


@few
@given(robots(max_links=4, stiffening=True), seeds)
def test_energy_changes_by_the_work_of_the_drives_less_the_losses(bot, seed):
    """To 1e-8 of the largest energy (B12) at rtol 1e-11, since work and losses do not choose the
    steps."""
    sys = fx.assemble(bot)
    run = fx.simulate(
        sys,
        [0.0, 0.05, 0.1],
        drives(sys, seed),
        **small_state(sys, seed),
        rtol=1e-11,
        method="explicit",
    )
    assert run.meta["energy_error"] < 1e-8


@few
@given(robots(max_links=3, modes=False, stiffening=True), seeds)
def test_energy_is_balanced_by_the_implicit_method_too(bot, seed):
    sys = fx.assemble(bot)
    run = fx.simulate(
        sys,
        [0.0, 0.025, 0.05],
        drives(sys, seed),
        **small_state(sys, seed),
        rtol=1e-11,
        method="implicit",
    )
    assert run.meta["energy_error"] < 1e-8


@pytest.mark.parametrize("second", [{}, {"locked": True}], ids=["free", "locked"])
def test_round_off_does_not_feed_energy_into_a_fine_link_that_carries_bodies(second):
    """A flexible link with two rigid ones on it, the first free or fixed: at rtol 1e-11 the balance
    is kept to 1e-9."""
    body = {"hub_inertia_kg_m2": 1e-3, "start": -1.0}
    arm = system(
        beam(0.2, 0.1, 0.5, 6, **body),
        rigid(0.2, 0.1, 0.0, 1e-3, **body, **second),
        rigid(0.2, 0.1, 0.0, 1e-3, **body),
    )
    run = fx.simulate(arm, [0.0, 0.05], **small_state(arm, 0), rtol=1e-11, method="explicit")
    assert run.meta["energy_error"] < 1e-9


# Limits and symmetries


def stiffer(bot: fx.Robot, factor: float) -> fx.Robot:
    data = bot.to_dict()
    for link in data["link"]:
        if link.get("elements"):
            value = link["bending_stiffness_N_m2"]
            many = isinstance(value, list)
            link["bending_stiffness_N_m2"] = (
                [v | {"value": v["value"] * factor} for v in value] if many else value * factor
            )
            link["damping"] = {
                "beta_s": 1e-4
            }  # else the steps follow the ringing that a sudden load starts
    return fx.Robot.from_dict(data)


def stiff(bot: fx.Robot) -> fx.Robot:
    """The same robot with rigid links."""
    data = bot.to_dict()
    for link in data["link"]:
        for key in ("elements", "modes", "bending_stiffness_N_m2", "damping"):
            link.pop(key, None)
    return fx.Robot.from_dict(data)


@few
@given(robots(max_links=4, locked=True, stiffening=True), seeds)
def test_a_very_stiff_robot_moves_like_a_rigid_one(bot, seed):
    """EI x 1e6, implicit, against links without elements, until one of them reaches a limit."""
    hard, solid = fx.assemble(stiffer(bot, 1e6)), fx.assemble(stiff(bot))
    t = np.linspace(0, 0.5, 11)
    q, qd = hard.start(), np.zeros(hard.n)
    rates = 0.5 * forces(hard, seed) * ~solid.locked
    qd[hard.joint_rows] = rates
    a = fx.simulate(hard, t, drives(hard, seed), q, qd, rtol=1e-6, method="implicit")
    b = fx.simulate(solid, t, drives(solid, seed), qd0=rates, rtol=1e-9)
    rows = min(np.count_nonzero(np.isin(run.t, t)) for run in (a, b))
    assert rows > 1
    for i in range(1, len(bot.links) + 1):
        ours, theirs = (run[f"joint/{i}/position"][:rows] for run in (a, b))
        assert np.abs(ours - theirs).max() < 1e-4 * max(np.abs(theirs).max(), 0.1)


@few
@given(robots(max_links=4, gravity=False, stiffening=True, first="R"), seeds)
def test_without_gravity_the_base_may_be_turned(bot, seed):
    sys, angle = fx.assemble(bot), 0.8
    t, small = np.linspace(0, 0.1, 6), small_state(sys, seed)
    turned = {"q0": small["q0"] + angle * np.eye(sys.n)[0], "qd0": small["qd0"]}
    a, b = (
        fx.simulate(sys, t, drives(sys, seed), **s, rtol=1e-9, method="explicit")
        for s in (small, turned)
    )
    c, s = np.cos(angle), np.sin(angle)
    close(b["tip/x"], c * a["tip/x"] - s * a["tip/y"], 1e-8)
    close(b["tip/y"], s * a["tip/x"] + c * a["tip/y"], 1e-8)
    close(b["joint/1/position"] - angle, a["joint/1/position"], 1e-8)


@few
@given(robots(max_links=4, coulomb=True, stiffening=True), seeds)
def test_a_mirrored_robot_moves_mirrored(bot, seed):
    """y -> -y: angles, torques, deflections and gravity's y change sign; sliders and their forces
    do not."""
    data = bot.to_dict()
    data["gravity_m_s2"] = [bot.gravity_m_s2[0], -bot.gravity_m_s2[1]]
    for link in data["link"]:
        turns = link["joint"]["type"] == "R"
        if turns:
            link["joint"]["start_rad"] = -link["joint"].get("start_rad", 0.0)
        else:
            link["joint"]["angle_rad"] = -link["joint"].get("angle_rad", 0.0)
    sys, other = fx.assemble(bot), fx.assemble(fx.Robot.from_dict(data))
    sign = -np.ones(sys.n)
    sign[sys.joint_rows] = [-1.0 if link.joint.type == "R" else 1.0 for link in bot.links]
    small, tau = small_state(sys, seed), 0.2 * forces(sys, seed)
    flip = [-1.0 if link.joint.type == "R" else 1.0 for link in bot.links]
    t = np.linspace(0, 0.1, 6)
    a = fx.simulate(
        sys,
        t,
        fx.Drive.force(*(signals.constant(f) for f in tau)),
        **small,
        rtol=1e-9,
        method="explicit",
    )
    b = fx.simulate(
        other,
        t,
        fx.Drive.force(*(signals.constant(f) for f in tau * flip)),
        small["q0"] * sign,
        small["qd0"] * sign,
        rtol=1e-9,
        method="explicit",
    )
    close(b["tip/x"], a["tip/x"], 1e-8)
    close(b["tip/y"], -a["tip/y"], 1e-8)
    close(b.states, a.states * np.tile(sign, 2), 1e-8)


def whole_and_halves(elements: int, stiffness: float = 0.5) -> tuple[fx.System, fx.System]:
    whole = beam(0.6, 0.2355, stiffness, elements, hub_inertia_kg_m2=2e-3)
    first, second = (
        beam(0.3, 0.2355, stiffness, elements // 2, hub_inertia_kg_m2=2e-3),
        beam(0.3, 0.2355, stiffness, elements // 2, locked=True),
    )
    return system(whole, payload=0.05), system(first, second, payload=0.05)


def test_a_locked_joint_between_two_halves_of_a_link_changes_no_frequency():
    """Small motions: the same Hermite cubics, in one frame or in two."""
    one, two = whole_and_halves(8)
    for joints in ("locked", "free"):
        a, b = fx.frequencies(one, joints=joints), fx.frequencies(two, joints=joints)
        assert b == pytest.approx(a, rel=1e-8, abs=1e-7)


def test_a_locked_joint_between_two_halves_of_a_link_changes_nothing():
    """The same line in one frame or in two, at any bending: statics to round-off, a motion to its
    tolerance."""
    one, two = whole_and_halves(8)
    a, b = (fx.tip_pose(s, fx.static(s, tip_force=(0.0, 2.0))) for s in (one, two))
    assert b == pytest.approx(a, rel=1e-10) and a[2] > 0.5
    t, drive = np.linspace(0, 1, 51), signals.bang_bang(0.2, 1.0, rise_s=0.05)
    a, b = (
        fx.simulate(s, t, fx.Drive.force(drive, *[None] * (len(s.robot.links) - 1)), rtol=1e-10)
        for s in (one, two)
    )
    assert largest_difference(a, b, ["joint/1/position", "tip/x", "tip/y"]) < 1e-7


# A link's own modes


def moved_at_joint_two(modes: int | None) -> fx.Run:
    sys = fx.assemble(two_link_arm(12) if modes is None else two_link_arm(4, modes=modes))
    drive = fx.Drive.force(None, signals.bang_bang(0.1, 1.0, rise_s=0.1))
    return fx.simulate(sys, np.linspace(0, 1.5, 76), drive, rtol=1e-10, method="explicit")


def test_modes_converge_to_the_link():
    """Three modes and the two static shapes of the tip are within 2e-3 of a fine mesh; all of them
    are the link."""
    names = [f"joint/{i}/position" for i in (1, 2)] + [f"link/{i}/tip_deflection" for i in (1, 2)]
    mesh = moved_at_joint_two(None)
    error = {}
    for modes in (1, 2, 3, 8):
        run = moved_at_joint_two(modes)
        error[modes] = max(np.abs(run[c] - mesh[c]).max() / np.abs(mesh[c]).max() for c in names)
    assert error[8] < 1e-4
    assert error[3] < 2e-3
    assert error[8] < error[3] < error[2] < error[1]


# Linearisation


@few
@given(robots(max_links=3, friction=False, gravity=False, stiffening=True), seeds)
def test_frequencies_are_those_of_the_linearised_accelerations(bot, seed):
    """-d qdd/dq at rest, by differences of the kernel's recursion."""
    sys = fx.assemble(bot)
    q = sys.start()
    free = sys.free_rows
    none = np.zeros(len(bot.links))
    size = 1e-5 / turning(sys)  # steps that turn a link by about 1e-5 rad
    columns = []
    for e in np.diag(size)[free]:
        a, b = (recursion(sys, q + z, 0 * q, none) for z in (e, -e))
        columns.append(((b - a) / size)[free] / 2)
    columns = np.array(columns)
    squares = np.sort(np.linalg.eigvals(columns.T).real)
    found = (2 * np.pi * fx.frequencies(sys, q, joints="free")) ** 2
    # a full mesh has very stiff modes, whose round-off the slow ones share
    assert np.abs(found - squares).max() < 1e-6 * max(1.0, squares[-1])
    slow = squares > 1e-5 * squares[-1]
    assert found[slow] == pytest.approx(squares[slow], rel=1e-5)


def test_small_free_vibration_has_the_linearised_frequency():
    """Ten periods after release in one mode the link is back: the phase error is the
    frequency's."""
    arm = system(beam(0.6, 0.2355, 0.5, 4, locked=True, modes=4), payload=0.05)
    period = 1 / fx.frequencies(arm)[:3]
    for k, T in enumerate(period):
        q, small = np.zeros(arm.n), 1e-6
        q[1 + k] = small
        run = fx.simulate(arm, [0.0, 10 * T], q0=q, rtol=1e-12, method="explicit")
        assert run.states[-1, 1 + k] == pytest.approx(small, rel=1e-9)
        phase = run.states[-1, arm.n + 1 + k] / (small * 2 * np.pi / T)
        assert abs(phase) / (20 * np.pi) < 1e-7


# For long, and at rest


def test_a_bench_arm_keeps_its_energy_for_long():
    """Five seconds of free vibration, undamped: no drift beyond a hundred times the tolerance."""
    arm = bench_arm()
    q = fx.static(arm, tip_force=(0.0, 0.2))
    for method, rtol in (("explicit", 1e-10), ("implicit", 1e-8)):
        assert (
            fx.simulate(arm, np.linspace(0, 5, 6), q0=q, rtol=rtol, method=method).meta[
                "energy_error"
            ]
            < 100 * rtol
        )


def test_a_robot_that_hangs_still_stays_still():
    """Static equilibrium under gravity of hanging links is a fixed point of the motion."""
    hang = robot(
        beam(0.5, 0.2, 1.0, 3, start=-np.pi / 2),
        rigid(0.3, 0.4, 0.1, 1e-3),
        beam(0.3, 0.2, 1.0, 2),
        payload=0.1,
        gravity=(0.0, -9.81),
    )
    sys = fx.assemble(hang)
    run = fx.simulate(sys, [0.0, 1.0], q0=fx.static(sys), rtol=1e-8)
    assert np.abs(run.states[-1] - run.states[0]).max() < 1e-9
