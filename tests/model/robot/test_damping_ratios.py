"""Damping of links by the ratios of their own clamped modes."""

import math

import numpy as np
import pytest

import flexura as fx
from flexura.population import rows

PAYLOAD = {"mass_kg": 0.02, "inertia_kg_m2": 1e-6, "centre_of_mass_m": [0.01, 0.004]}


def robot(damping, payload=None, **link):
    strip = {
        "length_m": 0.4,
        "elements": 6,
        "section": {"width_m": 0.02, "height_m": 0.001},
        "young_modulus_Pa": 2e11,
        "density_kg_m3": 7850.0,
        "damping": damping,
        "joint": {"type": "R", "locked": True, "hub_inertia_kg_m2": 1e-3},
    }
    return fx.Robot.from_dict({"link": [strip | link], "payload": payload or {}})


def modal_ratios(robot, count):
    """Of the clamped robot: phi^T D phi / (2 omega) of mass-normalised modes."""
    from scipy.linalg import eigh

    system = fx.assemble(robot)
    q = np.zeros(system.n)
    M, K, D = (f(q)[1:, 1:] for f in (system.mass, system.stiffness, system.damping_at))
    lam, V = eigh(M, K)
    V = V[:, ::-1] / np.sqrt(lam[::-1])
    omega = 1 / np.sqrt(lam[::-1])
    return (np.einsum("ik,ij,jk->k", V, D, V) / (2 * omega))[:count]


def test_clamped_frequencies_are_those_of_the_textbook():
    """Blevins, table 8-1: cos(x) cosh(x) = -1."""
    made = robot({"ratio": 0.01})
    link = made.links[0]
    roots = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    EI, rho = 2e11 * 0.02 * 1e-9 / 12, 7850 * 0.02 * 1e-3
    omega = (roots / 0.4) ** 2 * math.sqrt(EI / rho)
    assert made.rayleigh(0) == (0.0, pytest.approx(0.02 / omega[0], rel=1e-7))
    two = robot({"ratios": [0.01, 0.02]}).rayleigh(0)
    pairs = two[0] + two[1] * omega[:2] ** 2
    assert pairs / (2 * omega[:2]) == pytest.approx([0.01, 0.02], rel=1e-5)
    assert link.damping.by_ratio


BODIES = {
    "bare": {},
    "payload": {"payload": PAYLOAD},
    "lumped masses": {
        "mass": [
            {"at_m": 0.15, "mass_kg": 0.03, "inertia_kg_m2": 2e-6},
            {"at_m": 0.4, "mass_kg": 0.01},
        ]
    },
    "taper": {
        "section": [
            {"at_m": 0.0, "shape": "round", "diameter_m": 0.004},
            {"at_m": 0.4, "shape": "round", "diameter_m": 0.002},
        ]
    },
}


@pytest.mark.parametrize("bodies", BODIES.values(), ids=BODIES)
def test_a_mesh_has_the_ratios_that_were_asked_for(bodies):
    one = robot({"ratio": 0.005}, elements=12, **bodies)
    assert modal_ratios(one, 1) == pytest.approx([0.005], rel=1e-4)
    two = robot({"ratios": [0.005, 0.01]}, elements=12, **bodies)
    assert modal_ratios(two, 2) == pytest.approx([0.005, 0.01], rel=1e-3)


def test_a_link_of_two_modes_has_both_ratios():
    made = robot({"ratios": [0.01, 0.008]}, payload=PAYLOAD, modes=2)
    assert modal_ratios(made, 2) == pytest.approx([0.01, 0.008], rel=1e-5)


def test_the_ratio_is_seen_as_a_logarithmic_decrement():
    """delta = 2 pi zeta / sqrt(1 - zeta^2) from period to period."""
    zeta = 0.02
    made = robot({"ratio": zeta}, modes=1)
    omega = 2 * math.pi * fx.frequencies(made)[0]
    period = 2 * math.pi / (omega * math.sqrt(1 - zeta**2))
    q0 = fx.static(made, tip_force=(0.0, 1e-3))
    run = fx.simulate(made, np.arange(9) * period, q0=q0, rtol=1e-8)
    tip = run["link/1/tip_deflection"]
    decrement = np.log(tip[:-1] / tip[1:])
    assert decrement == pytest.approx(2 * math.pi * zeta / math.sqrt(1 - zeta**2), rel=1e-3)


REFUSED = {
    "a ratio and beta": ({"ratio": 0.01, "beta_s": 1e-4}, "ratio", "one of alpha_1_s and beta_s"),
    "a ratio and ratios": ({"ratio": 0.01, "ratios": [0.01, 0.02]}, "ratios", "one of"),
    "a ratio above 1": ({"ratio": 1.5}, "ratio", "between 1e-12 and 0.99"),
    "no ratio": ({"ratio": 0.0}, "ratio", "between 1e-12 and 0.99"),
    "three ratios": ({"ratios": [0.01, 0.01, 0.01]}, "ratios", "two numbers above 0"),
    "a negative ratio": ({"ratios": [0.01, -0.01]}, "ratios", "two numbers above 0"),
    "ratios too far apart": ({"ratios": [0.01, 0.5]}, "ratios", "a second ratio from"),
}


@pytest.mark.parametrize(("damping", "key", "words"), REFUSED.values(), ids=REFUSED)
def test_wrong_ratios_are_refused(damping, key, words):
    with pytest.raises(fx.InputError) as refused:
        robot(damping)
    assert refused.value.key.startswith(f"link[1].damping.{key}")
    assert words in refused.value.expected


def test_a_rigid_link_has_no_damping_ratio():
    rigid = {"length_m": 0.1, "mass_kg": 1.0, "damping": {"ratio": 0.01}, "joint": {"type": "R"}}
    with pytest.raises(fx.InputError, match="a rigid link has no modes"):
        fx.Robot.from_dict({"link": [rigid]})


def test_ratios_follow_what_a_population_varies(tmp_path):
    made = robot({"ratio": 0.005})
    assert rows.varied(made, {"payload.mass_kg": np.array([0.0, 0.1])}, 2) is None
    heavy = made.replace({"payload.mass_kg": 0.1})
    assert heavy.rayleigh(0)[1] > made.rayleigh(0)[1]
    fx.save(heavy, tmp_path / "heavy.toml")
    assert fx.load(tmp_path / "heavy.toml") == heavy
