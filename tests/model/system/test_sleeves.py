"""Sleeves and sliders: invariance, the force that pushes a bent link out, momentum, limits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import chains
from flexura.system.assembly import Assembly
from robots import beam, rigid, robot

CARRIAGE = rigid(0.0, 0.5, 0.0, 0.01, "Pa")
KINDS = {
    "uniform": beam(1.0, 1.0, 1.0, 2, "Pb", start=0.6, angle_rad=0.7),
    "taper": beam(1.0, chains.TAPER, chains.TAPER, 2, "Pb", start=0.6, angle_rad=0.7),
    "modes": beam(1.0, chains.TAPER, 1.0, 2, "Pb", start=0.6, angle_rad=0.7, modes=2),
    "kink": beam(1.0, chains.BROKEN, 1.0, 2, "Pb", start=0.6, angle_rad=0.7),
}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_depends_on_the_sleeves_own_velocity(kind):
    """A constant velocity of the carriage under a sleeve changes neither M nor the bias."""
    assembly = Assembly(robot(CARRIAGE, KINDS[kind], payload=0.3, payload_inertia=0.1))
    q, qd = chains.random_state(assembly, np.random.default_rng(1))
    faster, elsewhere = qd.copy(), q.copy()
    faster[0] += 10.0
    elsewhere[0] += 3.0
    bias = assembly.bias(q, qd)
    assert assembly.bias(q, faster) == pytest.approx(bias, abs=1e-13 * np.abs(bias).max())
    assert assembly.mass(elsewhere) == pytest.approx(assembly.mass(q), abs=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_the_carriage_carries_the_whole_mass(kind):
    assembly = Assembly(robot(CARRIAGE, KINDS[kind], payload=0.3))
    q, _ = chains.random_state(assembly, np.random.default_rng(1))
    s, ds = assembly.structure.materials[1].quadrature(0.0, 1.0, 3)
    mass = ds @ assembly.structure.materials[1].mass_per_length(s)
    assert assembly.mass(q)[0, 0] == pytest.approx(0.8 + mass, rel=1e-13)


@pytest.mark.parametrize("kind", ["uniform", "taper", "modes"])
def test_momentum_is_kept_where_nothing_holds_the_carriage(kind):
    """The momentum along the rail is (M qd)_1: its rate at qdd = 0 is row 1 of the bias."""
    assembly = Assembly(robot(CARRIAGE, KINDS[kind], payload=0.3))
    q, qd = chains.random_state(assembly, np.random.default_rng(2))
    rate = chains.slopes(lambda t: assembly.mass(q + t[0] * qd)[0] @ qd, np.zeros(1), 1e-4)[0]
    assert assembly.bias(q, qd)[0] == pytest.approx(rate, rel=1e-9)


def test_a_held_sleeve_is_a_clamped_link_of_the_free_length():
    sleeve = Assembly(robot(beam(1.0, 1.0, 1.0, 4, "Pb", start=0.4, angle_rad=0.7), payload=0.3))
    clamped = Assembly(robot(beam(0.4, 1.0, 1.0, 4), rigid(0.0, 0.3, 0.0, 0.0, "Pa", start=0.4)))
    (piece,) = clamped.structure.links[0]
    V = piece.shapes.coefficients
    own, low, q, qd = (
        slice(1, 9),
        slice(0, 4),
        np.zeros(10),
        np.zeros(10),
    )  # the sum is exact for low modes only
    rng = np.random.default_rng(3)
    q[1:5], qd[1:5] = (rng.normal(size=4) * 0.3 / np.sqrt(piece.K[low]) for _ in range(2))
    q[0], q[-1] = 0.7, 0.4
    y, v = np.append(0.4, V @ q[own]), np.append(0.0, V @ qd[own])
    same = lambda a, b, size: np.abs(a - b[own][low]).max() < size * np.abs(b).max()
    assert same((V.T @ sleeve.mass(y)[1:, 1:] @ V)[low, low], clamped.mass(q)[:, 1:5], 1e-5)
    assert same((V.T @ sleeve.bias(y, v)[1:])[low], clamped.bias(q, qd), 1e-4)
    assert same((V.T @ sleeve.elastic(y)[1:])[low], clamped.elastic(q), 1e-11)


def bent(assembly, d, force):
    """q at rest with the free length held at d under a dead tip force, by Newton's method."""
    q = np.zeros(assembly.n)
    q[0] = d
    residual = lambda x: assembly.elastic(x) - np.real(assembly.tip(x).velocity.conj() * force)
    for _ in range(30):
        (line,) = assembly.structure.states(q, 0 * q)[0].lines
        gamma = d * line.piece.weights * np.real(np.conj(force) * line.e)  # (51)
        S = assembly.stiffness(q)[1:, 1:] + line.piece.B.T @ (gamma[:, None] * line.piece.B)
        step = np.linalg.solve(S, -residual(q)[1:])
        q[1:] += step * min(1.0, 1.0 / np.abs(step).max())
        if np.abs(step).max() < 1e-12:
            return q, residual(q)[0]
    raise AssertionError("Newton's method does not converge")


@pytest.mark.parametrize(
    "force, d, published", [(1, 0.5, 0.242104), (1, 1.0, 0.704522), (5, 1.0, 4.950723)]
)
def test_the_force_that_pushes_a_bent_link_out(force, d, published):
    """M0^2 / (2 EI), M0 at the exit: force times the tip's distance along the sleeve."""
    assembly = Assembly(robot(beam(2.0, 1.0, 0.5, 8, "Pb", start=d)))
    q, row = bent(assembly, d, 1j * force)
    moment = force * assembly.tip(q).place.real
    assert -row == pytest.approx(moment**2 / (2 * 0.5), rel=1e-9)
    assert -row == pytest.approx(published, abs=6e-7)


def test_a_bent_link_that_pushes_itself_out_keeps_its_energy():
    assembly = Assembly(
        robot(
            beam(
                2.0,
                [{"at_m": 0.0, "value": 0.3}, {"at_m": 2.0, "value": 0.1}],
                0.5,
                1,
                "Pb",
                start=0.6,
            )
        )
    )
    n = assembly.n
    q0, _ = bent(assembly, 0.6, 1.5j)

    def rates(t, z):
        q, qd = z[:n], z[n:]
        return np.append(
            qd, np.linalg.solve(assembly.mass(q), -assembly.bias(q, qd) - assembly.elastic(q))
        )

    z = solve_ivp(
        rates, (0, 0.03), np.append(q0, np.zeros(n)), method="DOP853", rtol=1e-9, atol=1e-12
    ).y
    energy = [sum(assembly.energies(y[:n], y[n:])) for y in z.T[:: max(1, z.shape[1] // 8)]]
    assert z[0, -1] > 0.6001  # it moves
    assert np.ptp(energy) < 1e-8 * energy[0]


def test_a_rigid_rod_in_a_turning_sleeve():
    """Mass and bias of a bead problem: r' = d' t + w x n about the joint, centre at d - L + c."""
    m, c, J, L, d, w, u = 1.3, 0.4, 0.07, 1.0, 0.7, 1.1, -0.6
    assembly = Assembly(robot(rigid(0.0, 0.0, 0.0, 0.2), rigid(L, m, c, J, "Pb", start=d)))
    x = d - L + c
    assert assembly.mass(np.array([0.3, d])) == pytest.approx(
        np.diag([0.2 + J + m * x**2, m]), rel=1e-13
    )
    assert assembly.bias(np.array([0.3, d]), np.array([w, u])) == pytest.approx(
        [2 * m * x * u * w, -m * x * w**2], rel=1e-13
    )


def test_a_straight_stiff_link_in_a_sleeve_moves_like_a_rigid_one():
    flexible = Assembly(
        robot(chains.ARM, beam(1.0, 1.3, 1.0, 2, "Pb", start=0.7, angle_rad=0.4), payload=0.2)
    )
    stiff = Assembly(
        robot(
            chains.ARM, rigid(1.0, 1.3, 0.5, 1.3 / 12, "Pb", start=0.7, angle_rad=0.4), payload=0.2
        )
    )
    q, qd = np.array([0.3, 0.7, 0, 0, 0, 0]), np.array([1.1, -0.6, 0, 0, 0, 0])
    assert flexible.mass(q)[:2, :2] == pytest.approx(stiff.mass(q[:2]), rel=1e-12)
    assert flexible.bias(q, qd)[:2] == pytest.approx(stiff.bias(q[:2], qd[:2]), rel=1e-12)


def test_a_slider_held_at_the_tip_stands_where_a_joint_at_the_tip_does():
    at_tip = Assembly(robot(beam(1.0, 1.0, 1.0, 4, modes=4), rigid(0.5, 1.0, 0.2, 0.1)))
    slides = Assembly(
        robot(beam(1.0, 1.0, 1.0, 4, modes=4), rigid(0.5, 1.0, 0.2, 0.1, "Pa", start=1.0))
    )
    q, qd = chains.random_state(at_tip, np.random.default_rng(4))
    q[-1], qd[-1] = 0.0, 0.0
    p, v = np.append(q[:-1], 1.0), np.append(qd[:-1], 0.0)
    assert slides.mass(p)[:-1, :-1] == pytest.approx(at_tip.mass(q)[:-1, :-1], rel=1e-11, abs=1e-12)
    assert slides.bias(p, v)[:-1] == pytest.approx(at_tip.bias(q, qd)[:-1], rel=1e-10, abs=1e-11)
