"""Equations of docs/theory/01-kinematics.md, written down with plain NumPy,
against the system's lines and frames."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.polynomial.polynomial import polyfromroots, polyint, polyval

import robots

L, ELEMENTS = 0.6, 6
RNG = np.random.default_rng(1)


def gauss(count):
    """Points and weights on [0, 1]."""
    x, w = leggauss(count)
    return (1 + x) / 2, w / 2


def weights(x, points):
    """Integrals from 0 to x of Lagrange's polynomials through the points, by their roots: (P,)."""
    out = []
    for j, node in enumerate(points):
        others = np.delete(points, j)
        out.append(polyval(x, polyint(polyfromroots(others) / np.prod(node - others))))
    return np.array(out)


def bent(scale=0.6, **keys):
    """A mesh of one flexible link, and a state that bends it: the system, q, q', q''."""
    system = robots.system(robots.beam(L, 0.2, 0.5, ELEMENTS, hub_inertia_kg_m2=1e-3), **keys)
    return system, *(scale * RNG.normal(size=system.n) for _ in range(3))


def element_angle(x, q):
    """The angle against the start of a uniform element at x = s / h; q = (rotation, bubble)."""
    return q[0] * x + q[1] * 6 * x * (1 - x)


def tip_by_points(q):
    """Place and angle of the tip of `bent` at q, element by element."""
    points, _ = gauss(3)
    place, angle, h = 0j, q[0], L / ELEMENTS
    for own in q[1:].reshape(ELEMENTS, 2):
        place += h * weights(1.0, points) @ np.exp(1j * (angle + element_angle(points, own)))
        angle += own[0]
    return place, angle


@pytest.mark.parametrize("kind", ["R", "Pa", "Pb"])
def test_the_hub_of_the_next_link(kind):
    """A hub stands on a bent link as its joint says.

    Equations: 1
    """
    joint = {"start_m": 0.4 * L} if kind == "Pa" else {"start_m": 0.1} if kind == "Pb" else {}
    fixed = {} if kind == "R" else {"angle_rad": 0.3}
    beam = robots.beam(L, 0.2, 0.5, 4, hub_inertia_kg_m2=1e-3)
    system = robots.system(beam, robots.rigid(0.3, 0.2, 0.15, 1e-3, kind, **joint, **fixed))
    q = system.start() + 0.1 * RNG.normal(size=system.n) * np.isin(
        np.arange(system.n), system.elastic_rows
    )
    q[0] = 0.7
    eta = 0.5 if kind == "R" else joint["start_m"]
    q[-1] = eta
    carrier = eta if kind == "Pa" else L
    x, y, angle = system.line(q, 1, [carrier])
    exit_at = 0.3 - eta if kind == "Pb" else 0.0
    found = np.ravel(system.line(q, 2, [exit_at]))
    turned = angle[0] + (eta if kind == "R" else 0.3)
    assert found == pytest.approx([x[0], y[0], turned], abs=1e-13)


def test_the_first_hub_stands_on_the_base():
    """The base is a frame at rest; a first slider moves along its x axis.

    Equations: 1
    """
    system = robots.system(robots.rigid(0.3, 0.2, 0.15, 1e-3, "Pa", start=0.2, angle_rad=0.4))
    assert np.ravel(system.line([0.25], 1, [0.1])) == pytest.approx(
        [0.25 + 0.1 * np.cos(0.4), 0.1 * np.sin(0.4), 0.4]
    )


def test_the_angle_of_the_tangent():
    """The angle is linear in the unknowns, at any place.

    Equations: 2
    """
    system, q, _, _ = bent()
    h = L / ELEMENTS
    for s in (0.0, 0.25 * h, 1.5 * h, 3.9 * h, L):
        k = min(int(s / h), ELEMENTS - 1)
        own = q[1:].reshape(ELEMENTS, 2)
        expected = q[0] + own[:k, 0].sum() + element_angle(s / h - k, own[k])
        assert system.line(q, 1, [s])[2][0] == pytest.approx(expected, abs=1e-13)
        assert expected - q[0] == pytest.approx(system.angles(1, [s])[0] @ q, abs=1e-13)


def test_the_place_is_the_integral_of_the_tangent():
    """A fine sum over the tangents leads to the tip; the error falls with the elements.

    Equations: 3
    """
    errors = []
    for elements in (4, 8, 16):
        system = robots.system(robots.beam(L, 0.2, 0.5, elements, hub_inertia_kg_m2=1e-3))
        q, h = np.zeros(system.n), L / elements
        q[0] = 0.3
        q[1::2] = 2.0 * np.diff(
            np.sin(2.0 * np.linspace(0, 1, elements + 1))
        )  # the angle 2 sin(2 s / L) at the nodes
        x, w = gauss(20)
        place = 0j
        for k in range(elements):
            angle = q[0] + q[1 : 1 + 2 * k : 2].sum() + q[1 + 2 * k] * x
            place += h * w @ np.exp(1j * angle)
        found = system.line(q, 1, [L])
        errors.append(abs(found[0][0] + 1j * found[1][0] - place))
    assert errors[-1] < 1e-9
    assert errors[0] / errors[1] > 30 and errors[1] / errors[2] > 30  # of order 6 at nodes


def test_the_place_by_quadrature():
    """Lagrange's polynomials, integrated, weigh the tangents at the Gauss points.

    Equations: 4
    """
    system, q, _, _ = bent(1.0)
    place, angle = tip_by_points(q)
    found = np.ravel(system.line(q, 1, [L]))
    assert found == pytest.approx([place.real, place.imag, angle], abs=1e-13)
    points, _ = gauss(3)
    h, inside = L / ELEMENTS, 0.37
    start = np.exp(1j * (q[0] + element_angle(points, q[1:3])))
    inner = h * weights(inside, points) @ start
    assert np.ravel(system.line(q, 1, [inside * h]))[:2] == pytest.approx(
        [inner.real, inner.imag], abs=1e-14
    )


def test_velocity_and_acceleration_of_a_point():
    """The tip of a bent link that turns and bends.

    Equations: 5
    """
    system, q, qd, qdd = bent(1.0)
    points, _ = gauss(3)
    angle, rate, second = q[0], qd[0], qdd[0]
    velocity = acceleration = 0j
    h, w = L / ELEMENTS, L / ELEMENTS * weights(1.0, points)
    for k in range(ELEMENTS):
        own = slice(1 + 2 * k, 3 + 2 * k)
        e = np.exp(1j * (angle + element_angle(points, q[own])))
        spin, more = rate + element_angle(points, qd[own]), second + element_angle(points, qdd[own])
        velocity += w @ (1j * e * spin)
        acceleration += w @ (1j * e * more - e * spin**2)
        angle, rate, second = angle + q[1 + 2 * k], rate + qd[1 + 2 * k], second + qdd[1 + 2 * k]
    tip = system.assembly.tip(q, qd)
    assert h > 0 and tip.velocity @ qd == pytest.approx(velocity, abs=1e-12)
    assert tip.velocity @ qdd + tip.rest == pytest.approx(acceleration, abs=1e-11)


def test_the_tip_deflection():
    """The tip's distance from the hub's tangent, and its angle to it, as a run shows them.

    Equations: 6
    """
    system, q, qd, _ = bent(1.0)
    place, angle = tip_by_points(q)
    across = np.imag(np.exp(-1j * q[0]) * place)
    assert system.places(q)[0] == pytest.approx([across], abs=1e-13)
    row = system.observe(q[None], qd[None])[0]  # x, y, angle, tip deflection, tip slope, ...
    assert row[3:5] == pytest.approx([across, angle - q[0]], abs=1e-13)


def test_the_linear_line():
    """The dissertation's line: place, velocity and acceleration of its tip.

    Equations: 7
    """
    system, q, qd, qdd = bent(0.3, stiffening=False)
    points, w = gauss(3)
    t, spin, more = np.exp(1j * q[0]), qd[0], qdd[0]
    place = velocity = acceleration = 0j
    start = np.zeros(3)  # of the angle against the hub, its rate and its second derivative
    for k in range(ELEMENTS):
        own = [
            element_angle(points, x[1 + 2 * k : 3 + 2 * k]) + s for x, s in zip((q, qd, qdd), start)
        ]
        e = t * (1 + 1j * own[0])
        rates = 1j * spin * e + 1j * t * own[1]
        seconds = 1j * more * e + 1j * t * own[2] - spin**2 * e - 2 * spin * own[1] * t
        place, velocity = place + L / ELEMENTS * w @ e, velocity + L / ELEMENTS * w @ rates
        acceleration += L / ELEMENTS * w @ seconds
        start += [x[1 + 2 * k] for x in (q, qd, qdd)]
    tip = system.assembly.tip(q, qd)
    assert tip.place == pytest.approx(place, abs=1e-14)
    assert tip.velocity @ qd == pytest.approx(velocity, abs=1e-13)
    assert tip.velocity @ qdd + tip.rest == pytest.approx(acceleration, abs=1e-13)
