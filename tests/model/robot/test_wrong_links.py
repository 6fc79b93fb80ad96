"""Robot files with wrong numbers of a link: lengths, material, elements, modes, masses."""

import pytest

from robot_files import ABSENT, CART, STRIP, check_refused, inf, nan

# what is changed, the key that is named, the value that is shown (None: none to show), words of
# what was expected
VALUES = {
    "a negative length": (
        {STRIP + "length_m": -0.3},
        "link[2].length_m",
        -0.3,
        "0 or between 1e-5 and 1000",
    ),
    "no length for a flexible link": (
        {STRIP + "length_m": 0.0},
        "link[2].length_m",
        0.0,
        "above 0 for a flexible link",
    ),
    "a length beyond all robots": (
        {STRIP + "length_m": 2e3},
        "link[2].length_m",
        2e3,
        "and 1000",
    ),
    "a length that is no number": (
        {STRIP + "length_m": nan},
        "link[2].length_m",
        nan,
        "length in metres",
    ),
    "an endless length": ({STRIP + "length_m": inf}, "link[2].length_m", inf, "length in metres"),
    "a length as text": (
        {STRIP + "length_m": "0.3"},
        "link[2].length_m",
        "0.3",
        "length in metres",
    ),
    "a length as a truth value": (
        {STRIP + "length_m": True},
        "link[2].length_m",
        True,
        "length in metres",
    ),
    "a length as a list": (
        {STRIP + "length_m": [0.3]},
        "link[2].length_m",
        [0.3],
        "length in metres",
    ),
    "no length": (
        {STRIP + "length_m": ABSENT},
        "link[2].length_m",
        None,
        "missing: expected the link's length",
    ),
    "a modulus in GPa": (
        {STRIP + "young_modulus_Pa": 200.0},
        "link[2].young_modulus_Pa",
        200.0,
        "in pascals",
    ),
    "a modulus in whole GPa": (
        {STRIP + "young_modulus_Pa": 200},
        "link[2].young_modulus_Pa",
        200,
        "2.0e11, not 200",
    ),
    "a modulus beyond diamond": (
        {STRIP + "young_modulus_Pa": 2e14},
        "link[2].young_modulus_Pa",
        2e14,
        "between 1000 and 2e12",
    ),
    "no modulus": (
        {STRIP + "young_modulus_Pa": ABSENT},
        "link[2].young_modulus_Pa",
        None,
        "missing",
    ),
    "a density in g/cm3": (
        {STRIP + "density_kg_m3": 7.85},
        "link[2].density_kg_m3",
        7.85,
        "kg/m^3, between 10 and 25000",
    ),
    "a negative density": (
        {STRIP + "density_kg_m3": -7850.0},
        "link[2].density_kg_m3",
        -7850.0,
        "density in kg/m^3",
    ),
    "a density that is no number": (
        {STRIP + "density_kg_m3": nan},
        "link[2].density_kg_m3",
        nan,
        "density in kg/m^3",
    ),
    "no density": ({STRIP + "density_kg_m3": ABSENT}, "link[2].density_kg_m3", None, "missing"),
    "a billion elements": (
        {STRIP + "elements": 10**9},
        "link[2].elements",
        10**9,
        "a whole number from 0 (rigid) to 200",
    ),
    "more elements than any number": (
        {STRIP + "elements": 10**30},
        "link[2].elements",
        10**30,
        "a whole number",
    ),
    "negative elements": (
        {STRIP + "elements": -1},
        "link[2].elements",
        -1,
        "a whole number from 0",
    ),
    "half an element": ({STRIP + "elements": 4.5}, "link[2].elements", 4.5, "a whole number"),
    "elements as a number with a point": (
        {STRIP + "elements": 4.0},
        "link[2].elements",
        4.0,
        "a whole number",
    ),
    "elements as text": (
        {STRIP + "elements": "four"},
        "link[2].elements",
        "four",
        "a whole number",
    ),
    "elements as a truth value": (
        {STRIP + "elements": True},
        "link[2].elements",
        True,
        "a whole number",
    ),
    "more modes than unknowns": (
        {STRIP + "modes": 9},
        "link[2].modes",
        9,
        "at most 8, twice the number of elements",
    ),
    "no modes at all": ({STRIP + "modes": 0}, "link[2].modes", 0, "a whole number of 1 or more"),
    "modes of a rigid link": ({CART + "modes": 3}, "link[1].modes", 3, "absent for a rigid link"),
    "a flexible link with a mass": (
        {STRIP + "mass_kg": 0.1},
        "link[2].mass_kg",
        0.1,
        "absent for a flexible link",
    ),
    "a flexible link with a centre of mass": (
        {STRIP + "centre_of_mass_m": 0.1},
        "link[2].centre_of_mass_m",
        0.1,
        "absent for a flexible link",
    ),
    "a rigid link without a mass": (
        {CART + "mass_kg": ABSENT},
        "link[1].mass_kg",
        None,
        "missing: a rigid link's mass",
    ),
    "a rigid link with two masses": (
        {CART + "mass_per_length_kg_m": 1.0},
        "link[1].mass_kg",
        0.6,
        "either mass_kg, or",
    ),
    "a rigid link with a modulus": (
        {CART + "young_modulus_Pa": 2e11},
        "link[1].young_modulus_Pa",
        2e11,
        "absent for a rigid link",
    ),
    "a negative mass": (
        {CART + "mass_kg": -0.6},
        "link[1].mass_kg",
        -0.6,
        "mass in kilograms, 0 or between 1e-15 and 1e9",
    ),
    "a negative inertia": (
        {CART + "inertia_kg_m2": -1.0},
        "link[1].inertia_kg_m2",
        -1.0,
        "0 or between 1e-24 and 1e13",
    ),
    "a centre of mass in space": (
        {CART + "centre_of_mass_m": [0.05, 0.0, 0.0]},
        "link[1].centre_of_mass_m",
        [0.05, 0.0, 0.0],
        "centre of mass",
    ),
}


@pytest.mark.parametrize("changes, key, value, words", VALUES.values(), ids=VALUES)
def test_a_wrong_link_is_named(tmp_path, changes, key, value, words):
    check_refused(tmp_path, changes, key, value, words)
