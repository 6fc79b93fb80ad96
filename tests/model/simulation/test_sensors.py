"""Sensors on links against the cantilever of textbooks (Gere and Goodno, Mechanics of Materials,
appendix H) and against the channels that a run has anyway."""

import math

import numpy as np
import pytest

import flexura as fx

L, EI, RHO = 0.4, 0.02 * 1e-9 / 12 * 2e11, 0.157
SENSORS = [
    {"name": "laser", "kind": "deflection", "at_m": 0.25},
    {"name": "end", "kind": "deflection", "at_m": 0.4},
    {"name": "angle", "kind": "slope", "at_m": 0.25},
    {"name": "end-angle", "kind": "slope", "at_m": 0.4},
    {"name": "gauge", "kind": "strain", "at_m": 0.05, "distance_m": 0.0005},
]


def robot(sensors=SENSORS, joint=None, **link):
    strip = {
        "length_m": L,
        "elements": 8,
        "mass_per_length_kg_m": RHO,
        "bending_stiffness_N_m2": EI,
        "sensor": sensors,
        "joint": {"type": "R", "hub_inertia_kg_m2": 1e-3} | (joint or {"locked": True}),
    }
    return fx.Robot.from_dict({"link": [strip | link]})


@pytest.mark.parametrize("link", [{}, {"modes": 4}], ids=["mesh", "modes"])
def test_a_cantilever_shows_its_deflection_slope_and_strain(link):
    """v = F s^2 (3L - s)/(6 EI), theta = F s (2L - s)/(2 EI), kappa = F (L - s)/EI."""
    made, force = robot(**link), 1e-3
    q0 = fx.static(made, tip_force=(0.0, force))
    run = fx.simulate(made, [0.0], q0=q0)
    at = lambda name: float(run[f"sensor/{name}"][0])
    near = 1e-5 if not link else 2e-2
    assert at("laser") == pytest.approx(force * 0.25**2 * (3 * L - 0.25) / (6 * EI), rel=near)
    assert at("angle") == pytest.approx(force * 0.25 * (2 * L - 0.25) / (2 * EI), rel=near)
    assert at("gauge") == pytest.approx(-0.0005 * force * (L - 0.05) / EI, rel=max(near, 1e-4))
    assert at("end") == pytest.approx(float(run["link/1/tip_deflection"][0]), rel=1e-9)
    assert at("end-angle") == pytest.approx(float(run["link/1/tip_slope"][0]), rel=1e-9)
    units = [run.units[f"sensor/{name}"] for name in ("laser", "angle", "gauge")]
    assert units == ["m", "rad", "1"]


@pytest.mark.parametrize("stiffening", [True, False])
def test_an_accelerometer_is_the_second_derivative_of_its_place(stiffening):
    """Tip across its tangent, under a torque: by central differences of tip/x and tip/y."""
    sensor = [{"name": "acc", "kind": "acceleration", "at_m": L}]
    joint = {"type": "R", "hub_inertia_kg_m2": 1e-3, "coulomb_friction_N_m": 1e-3}
    made = robot(sensor, joint, elements=3, damping={"beta_s": 2e-4})
    made = made.replace({"stiffening": stiffening})
    t = np.arange(201) * 2e-4
    run = fx.simulate(made, t, [lambda t: 0.05 * math.sin(30 * t)], rtol=1e-10)
    place = run["tip/x"] + 1j * run["tip/y"]
    second = (place[2:] - 2 * place[1:-1] + place[:-2]) / 2e-4**2
    angle = run["link/1/angle"] + run["link/1/tip_slope"]
    across = (second * np.exp(-1j * angle[1:-1])).imag
    found = run["sensor/acc"]
    assert run.units["sensor/acc"] == "m/s^2"
    assert np.abs(found[1:-1] - across).max() < 5e-3 * np.abs(found).max()


def test_an_accelerometer_on_a_rigid_arm_in_a_prescribed_turn():
    """Across: r phi''; in inverse dynamics too."""
    arm = {
        "length_m": 0.3,
        "mass_kg": 0.2,
        "inertia_kg_m2": 1e-3,
        "sensor": [{"name": "acc", "kind": "acceleration", "at_m": 0.2}],
        "joint": {"type": "R"},
    }
    t = np.linspace(0.0, 1.0, 21)
    run = fx.inverse(fx.Robot.from_dict({"link": [arm]}), t, [fx.signals.harmonic(0.5, 1.0)])
    signal = [fx.signals.harmonic(0.5, 1.0)(x)[2] for x in t]
    assert run["sensor/acc"] == pytest.approx(0.2 * np.array(signal), rel=1e-6, abs=1e-9)


def test_sensors_of_forces_are_those_of_the_cut():
    """In a run and in inverse dynamics; a rigid link has them at its ends, or with its mass
    spread."""
    section = {"width_m": 0.02, "height_m": 0.001}
    kinds = ("bending_moment", "shear_force", "axial_force", "stress")
    sensors = [{"name": kind, "kind": kind, "at_m": 0.1} for kind in kinds]
    sensors.append({"name": "near", "kind": "stress", "at_m": 0.1, "distance_m": -0.0002})
    strip = {"length_m": L, "elements": 4, "young_modulus_Pa": 2e11, "density_kg_m3": 7850.0}
    arm = {"length_m": 0.2, "mass_kg": 0.2, "joint": {"type": "R"}}
    arm["sensor"] = [{"name": "root", "kind": "bending_moment", "at_m": 0.0}]
    strip |= {"section": section, "sensor": sensors, "joint": {"type": "R"}}
    made = fx.Robot.from_dict({"link": [arm, strip], "gravity_m_s2": [0.0, -9.81]})
    run = fx.inverse(made, [0.0, 0.1], [fx.signals.harmonic(0.5, 1.0), 0.0], internal_forces=True)
    units = [run.units[f"sensor/{kind}"] for kind in (*kinds, "near")]
    assert units == ["N m", "N", "N", "Pa", "Pa"]
    assert run["sensor/root"] == pytest.approx(-run["joint/1/reaction_moment"], rel=1e-12)
    assert run["link/2/bending_moment/2"] == pytest.approx(run["sensor/bending_moment"], rel=1e-12)
    assert run["link/2/stress/2"] == pytest.approx(run["sensor/stress"], rel=1e-12)
    stress = -run["sensor/bending_moment"] * 6 / (0.02 * 0.001**2)
    assert run["sensor/stress"] == pytest.approx(stress, rel=1e-9)
    assert run["sensor/near"] == pytest.approx(-0.4 * stress, rel=1e-9)
    assert "link/1/bending_moment/0" not in run
    alone = fx.inverse(made, [0.0, 0.1], [fx.signals.harmonic(0.5, 1.0), 0.0])
    assert alone["sensor/axial_force"] == pytest.approx(run["sensor/axial_force"], rel=1e-12)
    assert "joint/1/reaction_x" not in alone


FORCES_REFUSED = {
    "a stress without section": ({}, {"kind": "stress"}, "section"),
    "a section by its values": (
        {"section": {"area_m2": 2e-5, "second_moment_m4": 2e-12}},
        {"kind": "stress"},
        "sensor[1].distance_m",
    ),
    "a moment at a distance": ({}, {"kind": "bending_moment", "distance_m": 0.1}, "sensor[1]."),
    "in a sleeve": ({"joint": {"type": "Pb", "start_m": 0.2}}, {"kind": "shear_force"}, "sensor["),
    "within a lumped rigid link": (
        {"elements": 0, "mass_kg": 0.1},
        {"kind": "axial_force"},
        "sensor[1].at_m",
    ),
}


@pytest.mark.parametrize(("link", "sensor", "key"), FORCES_REFUSED.values(), ids=FORCES_REFUSED)
def test_forces_that_are_not_known_are_refused(link, sensor, key):
    by_section = {"young_modulus_Pa": 2e11, "density_kg_m3": 7850.0} if "section" in link else {}
    by_number = {"mass_per_length_kg_m": RHO, "bending_stiffness_N_m2": EI}
    own = by_section or ({} if "mass_kg" in link else by_number)
    table = {"length_m": L, "elements": 4, "joint": {"type": "R"}} | own | link
    table["sensor"] = [{"name": "s", "at_m": 0.1} | sensor]
    with pytest.raises(fx.InputError) as refused:
        fx.Robot.from_dict({"link": [table]})
    assert refused.value.key.startswith(f"link[1].{key}")


REFUSED = {
    "beyond the link": ({"kind": "slope", "at_m": 0.5}, "at_m", "at most its length, 0.4"),
    "a strain without distance": ({"kind": "strain", "at_m": 0.1}, "distance_m", "missing"),
    "a slope with distance": (
        {"kind": "slope", "at_m": 0.1, "distance_m": 0.1},
        "distance_m",
        "none: a slope",
    ),
    "an unknown kind": ({"kind": "force", "at_m": 0.1}, "kind", '"deflection", "slope"'),
    "a name with a slash": ({"name": "a/b", "kind": "slope", "at_m": 0.1}, "name", "letters"),
}


@pytest.mark.parametrize(("sensor", "key", "words"), REFUSED.values(), ids=REFUSED)
def test_wrong_sensors_are_refused(sensor, key, words):
    with pytest.raises(fx.InputError) as refused:
        robot([{"name": "s"} | sensor])
    assert refused.value.key == f"link[1].sensor[1].{key}" and words in refused.value.expected


def test_two_sensors_of_one_name_are_refused():
    with pytest.raises(fx.InputError, match="another name for each sensor"):
        robot([SENSORS[0], SENSORS[0]])
