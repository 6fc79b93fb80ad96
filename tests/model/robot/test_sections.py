"""Cross-sections of links against tables of mechanics: Gere and Goodno, Mechanics of Materials,
appendix E (circle, circular tube, rectangle) and the parallel-axis theorem for box and I."""

import math

import numpy as np
import pytest

import flexura as fx
from flexura.population import rows

E, RHO = 7.0e10, 2700.0
MM = 1e-3


def robot(section, length=0.5, **link):
    strip = {
        "length_m": length,
        "elements": 4,
        "section": section,
        "young_modulus_Pa": E,
        "density_kg_m3": RHO,
        "joint": {"type": "R", "hub_inertia_kg_m2": 1e-3},
    }
    return fx.Robot.from_dict({"link": [strip | link]})


def i_by_steiner(b, h, f, w):
    """A web and two flanges, each about its own centre and shifted."""
    web = w * (h - 2 * f) ** 3 / 12
    return web + 2 * (b * f**3 / 12 + b * f * ((h - f) / 2) ** 2)


def box_by_steiner(b, h, t):
    """Two webs and two flanges."""
    return i_by_steiner(b, h, t, 2 * t)


SECTIONS = {
    "rectangle": (
        {"width_m": 20 * MM, "height_m": 2 * MM},
        40 * MM**2,
        20 * 8 / 12 * MM**4,
    ),
    "round": ({"shape": "round", "diameter_m": 6 * MM}, 9 * math.pi * MM**2, math.pi / 4 * 81e-12),
    "tube": (
        {"shape": "tube", "outer_diameter_m": 10 * MM, "wall_m": 1 * MM},
        math.pi * (25 - 16) * MM**2,
        math.pi / 4 * (625 - 256) * MM**4,
    ),
    "box": (
        {"shape": "box", "width_m": 20 * MM, "height_m": 10 * MM, "wall_m": 1 * MM},
        (20 * 10 - 18 * 8) * MM**2,
        box_by_steiner(20 * MM, 10 * MM, 1 * MM),
    ),
    "I": (
        {"shape": "I", "width_m": 12 * MM, "height_m": 20 * MM, "flange_m": 2 * MM, "web_m": MM},
        (2 * 12 * 2 + 16 * 1) * MM**2,
        i_by_steiner(12 * MM, 20 * MM, 2 * MM, MM),
    ),
    "general": ({"area_m2": 5e-5, "second_moment_m4": 1.7e-11}, 5e-5, 1.7e-11),
}


@pytest.mark.parametrize(("section", "area", "moment"), SECTIONS.values(), ids=SECTIONS)
def test_areas_and_second_moments_are_those_of_the_tables(section, area, moment):
    link = robot(section).links[0]
    assert link.mass_per_length(0.1) == pytest.approx(RHO * area, rel=1e-13)
    assert link.bending_stiffness(0.1) == pytest.approx(E * moment, rel=1e-13)
    assert link.axial_stiffness(0.1) == pytest.approx(E * area, rel=1e-13)


@pytest.mark.parametrize(("section", "area", "moment"), SECTIONS.values(), ids=SECTIONS)
def test_a_clamped_beam_has_its_textbook_frequency(section, area, moment):
    """Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1: lambda_1 = 1.87510407."""
    found = fx.frequencies(robot(section, elements=12))[0]
    root = math.sqrt(E * moment / (RHO * area))
    assert found == pytest.approx(1.8751040687**2 / (2 * math.pi * 0.5**2) * root, rel=1e-6)


@pytest.mark.parametrize("name", ["round", "tube", "box", "I", "general"])
def test_a_taper_is_linear_in_its_dimensions_and_exact_in_the_material(name):
    from flexura.link.section import material

    first = SECTIONS[name][0]
    second = {k: v if k == "shape" else 0.7 * v for k, v in first.items()}
    middle = {k: v if k == "shape" else 0.85 * v for k, v in first.items()}
    link = robot([first | {"at_m": 0.0}, second | {"at_m": 0.5}]).links[0]
    halfway = robot(middle).links[0]
    made, x = material(link), np.linspace(0.0, 0.5, 11)
    assert link.bending_stiffness(np.array([0.25]))[0] == pytest.approx(
        float(halfway.bending_stiffness(0.1)), rel=1e-12
    )
    assert made.mass_per_length(x) == pytest.approx(link.mass_per_length(x), rel=1e-12)
    assert made.bending_stiffness(x) == pytest.approx(link.bending_stiffness(x), rel=1e-12)


def test_a_tapered_round_bends_as_its_integral_says():
    """Tip of a cone under a force: F L^3/(3 E I_0) d_0/d_1, I_0 at the clamped end (Roark's
    Formulas for Stress and Strain, tapered beams; here by its integral)."""
    d0, d1, L, force = 8 * MM, 4 * MM, 0.5, 0.02
    cone = robot(
        [
            {"shape": "round", "diameter_m": d0, "at_m": 0.0},
            {"shape": "round", "diameter_m": d1, "at_m": L},
        ],
        elements=16,
        joint={"type": "R", "locked": True, "hub_inertia_kg_m2": 1e-3},
    )
    system = fx.assemble(cone)
    q = fx.static(cone, tip_force=(0.0, force))
    _, y, _ = system.line(q, 1, np.array([L]))
    x, w = np.polynomial.legendre.leggauss(20)
    s = L / 2 * (x + 1)
    exact = force * np.sum(L / 2 * w * (L - s) ** 2 / cone.links[0].bending_stiffness(s))
    assert exact == pytest.approx(force * L**3 / (3 * E * math.pi * d0**4 / 64) * d0 / d1, rel=1e-9)
    assert y[0] == pytest.approx(exact, rel=1e-5)


REFUSED = {
    "a rectangle with a diameter": (
        {"width_m": 0.02, "height_m": 0.001, "diameter_m": 0.01},
        "link[1].section.diameter_m",
        'none: a section of shape "rectangle" has width_m, height_m',
    ),
    "an area with a width": (
        {"area_m2": 1e-5, "second_moment_m4": 1e-11, "width_m": 0.02},
        "link[1].section.width_m",
        "none: a section by its area has area_m2",
    ),
    "an area alone": (
        {"area_m2": 1e-5},
        "link[1].section.second_moment_m4",
        "missing: expected the second moment",
    ),
    "a tube without a wall": (
        {"shape": "tube", "outer_diameter_m": 0.01},
        "link[1].section.wall_m",
        "missing: expected the wall",
    ),
    "a wall that fills its tube": (
        {"shape": "tube", "outer_diameter_m": 0.01, "wall_m": 0.005},
        "link[1].section.wall_m",
        "less than half of outer_diameter_m, 0.005",
    ),
    "flanges that fill an I": (
        {"shape": "I", "width_m": 0.01, "height_m": 0.01, "flange_m": 0.006, "web_m": 0.001},
        "link[1].section.flange_m",
        "less than half of height_m",
    ),
    "an unknown shape": ({"shape": "T"}, "link[1].section.shape", '"round", "tube", "box" or "I"'),
    "a diameter in millimetres": (
        {"shape": "round", "diameter_m": 6.0},
        "link[1].section.diameter_m",
        "a diameter below the link's length, 0.5",
    ),
    "a negative diameter": (
        {"shape": "round", "diameter_m": -0.006},
        "link[1].section.diameter_m",
        "between 1e-7 and 10",
    ),
    "two shapes along one link": (
        [
            {"at_m": 0.0, "shape": "round", "diameter_m": 0.006},
            {"at_m": 0.5, "width_m": 0.006, "height_m": 0.006},
        ],
        "link[1].section[2].shape",
        "the shape of the first entry, round",
    ),
}


@pytest.mark.parametrize(("section", "key", "words"), REFUSED.values(), ids=REFUSED)
def test_mixed_and_impossible_sections_are_refused(section, key, words):
    with pytest.raises(fx.InputError) as refused:
        robot(section)
    assert refused.value.key == key and words in refused.value.expected


def test_sections_come_back_from_their_file(tmp_path):
    for name, (section, _, _) in SECTIONS.items():
        made = robot(section)
        fx.save(made, tmp_path / f"{name}.toml")
        assert fx.load(tmp_path / f"{name}.toml") == made


@pytest.mark.parametrize("name", SECTIONS)
def test_a_population_varies_the_material_around_any_section(name):
    base, moduli = robot(SECTIONS[name][0]), np.array([6e10, 7.1e10])
    together = rows.varied(base, {"link.1.young_modulus_Pa": moduli}, len(moduli))
    assert together is not None
    for k, modulus in enumerate(moduli):
        alone = rows.one(base.replace({"link.1.young_modulus_Pa": float(modulus)}))
        assert together.of([k]).contents(0) == alone.contents(0)
