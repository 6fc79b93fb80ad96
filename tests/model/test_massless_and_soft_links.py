"""Links without mass and links as soft as silicone: right, or refused with the reason."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

import flexura as fx
from robots import beam, robot

L, EI, HEAD, TURNING = 4.0, 1.024e7, 1e4, 2e4
MASTS = np.array([0.96596103, 4.11089377])


def mast(mass=0.0, **keys):
    """Case m08: a mast that carries a head."""
    link = beam(L, mass, EI, **{"locked": True} | keys)
    return robot(link, payload=HEAD, payload_inertia=TURNING)


def test_case_m08_in_closed_form():
    """Two shapes, of a force and a moment at the tip (Gere, Mechanics of Materials)."""
    K = EI / L**3 * np.array([[12, -6 * L], [-6 * L, 4 * L**2]])
    exact = np.sqrt(eigh(K, np.diag([HEAD, TURNING]), eigvals_only=True)) / (2 * np.pi)
    assert exact == pytest.approx(MASTS, rel=1e-8)
    assert fx.frequencies(mast(elements=4, modes=2)) == pytest.approx(exact, rel=1e-9)
    assert fx.frequencies(mast(elements=1, modes=1)) == pytest.approx(exact[:1], rel=1e-9)


@pytest.mark.parametrize("mass", [1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("elements", [1, 4, 8])
def test_case_m08_with_next_to_no_mass(mass, elements):
    assert fx.frequencies(mast(mass, elements=elements), count=2) == pytest.approx(MASTS, rel=1e-6)


def test_a_massless_mast_under_gravity():
    """The head falls onto its mast: modal superposition of the two shapes."""
    bot = mast(elements=4, modes=2).replace({"gravity_m_s2": [0.0, -1e-3]})
    t = np.linspace(0, 2, 21)
    run = fx.simulate(bot, t, start="straight", rtol=1e-8)
    K = EI / L**3 * np.array([[12, -6 * L], [-6 * L, 4 * L**2]])
    squares, X = eigh(K, np.diag([HEAD, TURNING]))
    load = X.T @ [-HEAD * 1e-3, 0.0]
    w = X @ ((load / squares)[:, None] * (1 - np.cos(np.sqrt(squares)[:, None] * t)))
    assert run["link/1/tip_deflection"] == pytest.approx(w[0], abs=1e-4 * np.abs(w[0]).max())
    assert run.meta["energy_error"] < 1e-6


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, "modes = 2 or fewer"),
        ({"link.1.modes": 3}, "modes = 2 or fewer"),
        ({"link.1.modes": 2, "payload.inertia_kg_m2": 0.0}, "modes = 1 or fewer"),
        ({"link.1.modes": 1, "payload.mass_kg": 0.0, "payload.inertia_kg_m2": 0.0}, "nothing with"),
    ],
)
def test_a_massless_link_that_says_too_little(changes, reason):
    with pytest.raises(fx.InputError, match=reason) as error:
        mast(1.0, elements=4).replace({"link.1.mass_per_length_kg_m": 0.0} | changes)
    assert error.value.key == "link[1].mass_per_length_kg_m"


def test_a_joint_that_moves_nothing_but_a_massless_link():
    """Two modes and a bare joint are three unknowns for the head's two motions."""
    bot = mast(elements=4, modes=2, locked=False)
    with pytest.raises(fx.InputError, match="no inertia of its own"):
        fx.assemble(bot)
    free = bot.replace({"link.1.joint.hub_inertia_kg_m2": 10.0})
    assert len(fx.linearize(free).poles) == 6


def soft(modulus, elements=8, **keys):
    """A level strip of silicone, 100 x 20 x 10 mm."""
    section = {"width_m": 0.02, "height_m": 0.01}
    link = {"length_m": 0.1, "elements": elements, "section": section}
    link |= {"young_modulus_Pa": modulus, "density_kg_m3": 1100.0, "joint": {"type": "R"}}
    return robot(link, **{"gravity": (0.0, -9.81)} | keys)


@pytest.mark.parametrize(
    ("modulus", "tip"),
    [
        (1e6, (0.0985512, -0.0158594)),
        (1e5, (0.0575111, -0.0758347)),
        (3e4, (0.0269682, -0.0899456)),
    ],
)
def test_a_strip_of_silicone_sags(modulus, tip):
    """The heavy elastica by shooting: EI theta'' = w (L - s) cos theta, to 43 times w L^3 / EI."""
    found = fx.tip_pose(soft(modulus), fx.static(soft(modulus)))[:2]
    assert found == pytest.approx(tip, abs=2e-5)
    from scipy.integrate import solve_ivp

    stiffness, weight, long = modulus * 0.02 * 0.01**3 / 12, 1100 * 2e-4 * 9.81, 0.1

    def end(moment, full=False):
        slopes = lambda s, y: [y[1], weight * (long - s) * np.cos(y[0]) / stiffness, *turn(y[0])]
        turn = lambda angle: (np.cos(angle), np.sin(angle))
        done = solve_ivp(slopes, (0, long), [0.0, moment, 0, 0], rtol=1e-10, atol=1e-12)
        return done.y[2:, -1] if full else done.y[1, -1]

    most = -weight * long**2 / stiffness / 2
    root = brentq(end, most, 0.02 * most, xtol=1e-13)
    assert end(root, full=True) == pytest.approx(tip, abs=2e-6)


def test_a_strip_that_its_weight_would_stretch_is_refused():
    with pytest.raises(fx.InputError, match="inextensible") as error:
        soft(1e3)
    assert error.value.key == "link[1].young_modulus_Pa" and "108%" in str(error.value)
    level = soft(1e3, gravity=(0.0, 0.0))  # in the horizontal plane it has nothing to carry
    exact = 1.875104069**2 * np.sqrt(1e3 * 0.01**2 / 12 / 1100) / 0.1**2 / (2 * np.pi)
    assert fx.frequencies(level, count=1) == pytest.approx([exact], rel=1e-5)
    with pytest.raises(fx.InputError, match="between 1000 and 2e12"):
        soft(999.0)
