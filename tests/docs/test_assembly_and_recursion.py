"""Equations of docs/theory/05-extended-assembly.md and 06-recursion.md, written down with plain
NumPy, against system and core."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.polynomial.polynomial import polyfromroots, polyint, polyval

import robots
from core_steps import steps

L1, L2, RHO, EI = 0.5, 0.4, 0.3, 0.8
RNG = np.random.default_rng(5)
G = 0.7 - 9.81j
BETA, FRICTION = 2e-3, 0.2


def chain(**keys):
    """Two flexible links of two elements and of one: q = [joint, 4 of its own, joint, 2]."""
    first = robots.beam(
        L1, RHO, EI, 2, hub_inertia_kg_m2=0.01, damping={"beta_s": BETA}, viscous_friction=FRICTION
    )
    second = robots.beam(
        L2, RHO, EI, 1, hub_mass_kg=0.2, hub_inertia_kg_m2=0.005, rotor_inertia=0.003
    )
    return robots.system(first, second, payload=0.1, payload_inertia=1e-3, **keys)


def state(n, scale=0.5):
    return [scale * RNG.normal(size=n) for _ in range(3)]


def masses(system):
    """Mass points as (mass, link, abscissa), and turning lumps as (inertia, link, abscissa)."""
    x, w = leggauss(5)
    points, lumps = [], [(0.01, 1, 0.0), (0.005, 2, 0.0), (1e-3, 2, L2)]
    for link, length, elements in ((1, L1, 2), (2, L2, 1)):
        h = length / elements
        points += [
            (RHO * h * b / 2, link, h * (k + (1 + a) / 2))
            for k in range(elements)
            for a, b in zip(x, w)
        ]
    return [*points, (0.2, 2, 0.0), (0.1, 2, L2)], lumps


def places(system, q):
    """Places of the mass points (complex) and angles of the lumps."""
    points, lumps = masses(system)
    at = [[system.line(q, i, [s]) for _, i, s in group] for group in (points, lumps)]
    return np.array([x[0] + 1j * y[0] for x, y, _ in at[0]]), np.array([a[0] for _, _, a in at[1]])


def along(system, q, direction, h=1e-3):
    """First and second derivatives of places and angles along a direction, of fourth order."""
    at = [places(system, q + k * h * direction) for k in (-2, -1, 0, 1, 2)]
    out = []
    for values in zip(*at):
        a, b, c, d, e = values
        out.append(
            ((8 * (d - b) - (e - a)) / (12 * h), (16 * (b + d) - a - e - 30 * c) / (12 * h * h))
        )
    return out


def test_columns_mass_matrix_bias_and_gravity():
    """The sums over mass points, whose columns are differences of places.

    Equations: 39, 40, 41, 42
    """
    system = chain(gravity=(G.real, G.imag))
    q, qd, _ = state(system.n)
    both = [along(system, q, e) for e in np.eye(system.n)]
    J, turning = (np.column_stack([column[k][0] for column in both]) for k in (0, 1))
    tip = system.assembly.tip(q, qd)
    (rate, rest), (spin, more) = along(system, q, qd)
    assert tip.velocity == pytest.approx(J[-1], abs=1e-8)
    assert tip.velocity @ qd == pytest.approx(
        rate[-1], abs=1e-7
    ) and tip.turning @ qd == pytest.approx(spin[-1], abs=1e-8)
    assert tip.rest == pytest.approx(rest[-1], abs=1e-4) and tip.rest_turning == pytest.approx(
        more[-1], abs=1e-4
    )
    mu, I = (np.array([row[0] for row in group]) for group in masses(system))
    rotors = np.zeros(system.n)
    rotors[5] = 0.003
    M = (
        np.real(J.conj().T @ (mu[:, None] * J))
        + turning.T @ (I[:, None] * turning)
        + np.diag(rotors)
    )
    assert system.mass(q) == pytest.approx(M, rel=1e-7, abs=1e-9)
    assert system.equations.mass(q) == pytest.approx(M, rel=1e-7, abs=1e-9)
    h = np.real(J.conj().T @ (mu * rest)) + turning.T @ (I * more)
    assert system.bias(q, qd) == pytest.approx(h, rel=1e-4, abs=1e-5)
    assert system.gravity(q) == pytest.approx(-np.real(J.conj().T @ mu * G), rel=1e-7, abs=1e-8)


def test_elastic_forces():
    """Of a mesh, and of a uniform link in a sleeve, whose stiffness falls with its free length.

    Equations: 43
    """
    system = chain()
    q = state(system.n)[0]
    K = np.array([0, *(2 * [EI / (L1 / 2), 12 * EI / (L1 / 2)]), 0, EI / L2, 12 * EI / L2])
    assert system.elastic(q) == pytest.approx(K * q, rel=1e-12)
    sleeve = robots.system(robots.beam(L1, RHO, EI, 2, "Pb", start=0.3))
    q = state(sleeve.n)[0]
    q[0] = 0.3
    x, w = leggauss(5)
    slopes = 2 * np.polynomial.legendre.legvander(x, 3)  # of the shapes by xi
    unit = slopes.T @ ((w / 2)[:, None] * slopes)
    expected = np.append(-0.5 * EI / 0.3**2 * q[1:] @ unit @ q[1:], EI / 0.3 * unit @ q[1:])
    assert sleeve.elastic(q) == pytest.approx(expected, rel=1e-11)


class Piece:
    """An element: its points, constants, and the unknowns q in the robot's."""

    def __init__(
        self,
        h,
        own,
        joint=None,
        hub=(0.0, 0.0),
        payload=(0.0, 0.0),
        rotor=0.0,
        beta=0.0,
        friction=0.0,
    ):
        x = (1 + leggauss(3)[0]) / 2
        powers = [
            polyint(polyfromroots(np.delete(x, j)) / np.prod(x[j] - np.delete(x, j)))
            for j in range(3)
        ]
        y, dy = leggauss(10)
        w = h * np.column_stack([polyval((1 + y) / 2, p) for p in powers])
        dm = RHO * h * dy / 2
        self.w = h * np.array([polyval(1.0, p) for p in powers])
        self.B = np.column_stack([x, 6 * x * (1 - x)])
        self.K, self.beta, self.own, self.joint, self.rotor, self.friction = (
            EI / h * np.array([1, 12]),
            beta,
            own,
            joint,
            rotor,
            friction,
        )
        self.hub, self.payload = hub, payload
        self.m, self.s = RHO * h + payload[0], dm @ w + payload[0] * self.w
        self.W = w.T @ (dm[:, None] * w) + payload[0] * np.outer(self.w, self.w)

    def look(self, phi, omega, q, qd):
        """X, J, beta, H, k at its hub's angle and rate; gives those of the next hub."""
        q, qd = q[self.own], qd[self.own]
        turn = np.column_stack([np.ones(3), self.B])
        e, spin = np.exp(1j * (phi + self.B @ q)), omega + self.B @ qd
        columns = self.w @ (
            1j * e[:, None] * turn
        )  # of the tip's place by the angle and the unknowns
        rest = self.w @ (-e * spin**2)
        self.X = np.array([[1, 0, columns[0].real], [0, 1, columns[0].imag], [0, 0, 1]])
        self.J = np.array([columns[1:].real, columns[1:].imag, [1, 0]])
        self.rest = np.array([rest.real, rest.imag, 0.0])
        products = self.W * np.real(np.conj(e)[:, None] * e)
        first = self.s @ (1j * e[:, None] * turn)
        H = np.zeros((5, 5))
        H[0, 0] = H[1, 1] = self.m + self.hub[0]
        H[2:, 2:] = turn.T @ products @ turn
        H[0, 2:], H[1, 2:], H[2:, 0], H[2:, 1] = first.real, first.imag, first.real, first.imag
        H[2, 2] += self.hub[1]
        tip = np.array([1.0, 1.0, 0.0])
        H[2:, 2:] += self.payload[1] * np.outer(tip, tip)
        push = self.s @ (-e * spin**2)
        sideways = self.W * np.real(np.conj(1j * e)[:, None] * e)
        k = np.concatenate([[push.real, push.imag], turn.T @ sideways @ (-(spin**2))])
        k[3:] += self.K * q + self.beta * self.K * qd
        self.H, self.k = H, k
        return phi + q[0], omega + qd[0]


def pieces():
    return [
        Piece(L1 / 2, slice(1, 3), 0, hub=(0.0, 0.01), beta=BETA, friction=FRICTION),
        Piece(L1 / 2, slice(3, 5), beta=BETA),
        Piece(L2, slice(6, 8), 5, hub=(0.2, 0.005), payload=(0.1, 1e-3), rotor=0.003),
    ]


def swept(q, qd):
    """The pieces after the outward sweep."""
    made, phi, omega = pieces(), 0.0, 0.0
    for piece in made:
        if piece.joint is not None:
            phi, omega = phi + q[piece.joint], omega + qd[piece.joint]
        phi, omega = piece.look(phi, omega, q, qd)
    return made


def test_the_recursion():
    """Three sweeps over the pieces give the core's accelerations.

    Equations: 44, 45, 46, 47
    """
    system = chain(gravity=(G.real, G.imag))
    q, qd, force = state(system.n)
    made, sigma = swept(q, qd), np.array([0.0, 0.0, 1.0])
    A, b = np.zeros((3, 3)), np.zeros(3)
    for piece in reversed(made):
        both = np.hstack([piece.X, piece.J])
        H, k = piece.H + both.T @ A @ both, piece.k + both.T @ (A @ piece.rest + b)
        k[3:] -= force[piece.own]
        piece.solve = np.linalg.inv(H[3:, 3:]), H[3:, :3], k[3:]
        A = H[:3, :3] - H[:3, 3:] @ piece.solve[0] @ H[3:, :3]
        b = k[:3] - H[:3, 3:] @ piece.solve[0] @ k[3:]
        piece.wrench = A, b
        if piece.joint is not None:
            piece.F = force[piece.joint] - piece.friction * qd[piece.joint]
            piece.pivot = sigma @ A @ sigma + piece.rotor
            A, b = (
                A - np.outer(A @ sigma, sigma @ A) / piece.pivot,
                b + A @ sigma * (piece.F - sigma @ b) / piece.pivot,
            )
    u, a = np.array([-G.real, -G.imag, 0.0]), np.zeros(system.n)
    for piece in made:
        if piece.joint is not None:
            A, b = piece.wrench
            a[piece.joint] = (piece.F - sigma @ b - sigma @ A @ u) / piece.pivot
            u = u + sigma * a[piece.joint]
        inverse, rows, k = piece.solve
        a[piece.own] = -inverse @ (k + rows @ u)
        u = piece.X @ u + piece.J @ a[piece.own] + piece.rest
    assert system.accelerations(q, qd, force) == pytest.approx(a, rel=1e-9, abs=1e-9)


def test_the_mass_matrix_by_composite_bodies():
    """Each unknown's wrench, carried to the base, meets the columns on its way.

    Equations: 48
    """
    system = chain()
    q, qd, _ = state(system.n)
    M, sigma, A, wrenches = (
        np.zeros((system.n, system.n)),
        np.array([0.0, 0.0, 1.0]),
        np.zeros((3, 3)),
        {},
    )
    for piece in reversed(swept(q, 0 * qd)):
        both = np.hstack([piece.X, piece.J])
        H = piece.H + both.T @ A @ both
        own = range(piece.own.start, piece.own.stop)
        for l, w in wrenches.items():
            M[own, l] = piece.J.T @ w
            wrenches[l] = piece.X.T @ w
        M[np.ix_(own, own)] = H[3:, 3:]
        wrenches |= {l: H[:3, 3 + i] for i, l in enumerate(own)}
        A = H[:3, :3]
        if piece.joint is not None:
            for l, w in wrenches.items():
                M[piece.joint, l] = sigma @ w
            M[piece.joint, piece.joint] = sigma @ A @ sigma + piece.rotor
            wrenches[piece.joint] = A @ sigma
    M = np.triu(M) + np.triu(M, 1).T
    assert system.equations.mass(q) == pytest.approx(M, rel=1e-11, abs=1e-13)


def test_an_implicit_stage():
    """One step of TR-BDF2 on a clamped link that hardly bends; stiffness and damping are implicit.

    Equations: 49
    """
    beam = robots.beam(L1, RHO, EI, 1, locked=True, damping={"beta_s": 0.05})
    system = robots.system(beam, payload=0.1)
    q, qd = np.array([0.0, 1e-6, -2e-7]), np.array([0.0, 3e-5, 1e-5])
    t, y, v = steps(system, "implicit-2", q, qd, 1.0, 0.1, 1, first=2e-3)[1][:3]
    M, K = system.mass(0 * q)[1:, 1:], np.diag([EI / L1, 12 * EI / L1])
    D, gamma, w = 0.05 * K, 1 - 1 / np.sqrt(2), np.sqrt(2) / 4
    places, rates, seconds = [q[1:]], [qd[1:]], [-np.linalg.solve(M, K @ q[1:] + D @ qd[1:])]
    for row in ([gamma], [w, w]):
        v_star = qd[1:] + t * sum(a * x for a, x in zip(row, seconds))
        q_star = q[1:] + t * sum(a * x for a, x in zip(row, rates)) + gamma * t * v_star
        gq, gv = (gamma * t) ** 2, gamma * t
        a = np.linalg.solve(M + gq * K + gv * D, -K @ q_star - D @ v_star)
        seconds.append(a)
        places.append(q_star + gq * a)
        rates.append(v_star + gv * a)
    assert t == pytest.approx(2e-3)
    assert y[1:] == pytest.approx(places[-1], rel=1e-8) and v[1:] == pytest.approx(
        rates[-1], rel=1e-8
    )
