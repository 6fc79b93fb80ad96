"""Robot files: what is refused and in which words, and that reading and writing are each other's
inverse."""

import contextlib
import copy
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.io import is_name
from flexura.robot import renamed

ROOT = Path(__file__).resolve().parents[3]
ROBOTS = sorted((ROOT / "model" / "robots").glob("*.toml"))
MANOEUVRES = sorted((ROOT / "model" / "manoeuvres").glob("*.toml"))

COMPLETE = """
name = "rig (type IV, PaR)"
gravity_m_s2 = [0.0, 0.0]
stiffening = true
sliding = "continuous"

[[link]]
name = "carriage"
length_m = 0.10
elements = 0
mass_kg = 0.60
centre_of_mass_m = 0.05
inertia_kg_m2 = 5.0e-4
[link.joint]
type = "Pa"
angle_rad = 0.0
hub_mass_kg = 0.0
hub_inertia_kg_m2 = 0.0
rotor_mass_kg = 0.0
viscous_friction_N_s_m = 0.0
coulomb_friction_N = 0.0
limits_m = [-0.05, 0.15]

[[link]]
name = "strip"
length_m = 0.30
elements = 4
modes = 3
section = { width_m = 0.020, height_m = 0.001 }
young_modulus_Pa = 2.0e11
density_kg_m3 = 7850.0
damping = { alpha_1_s = 0.0, beta_s = 2.0e-4 }
[link.joint]
type = "R"

[payload]
mass_kg = 0.020
inertia_kg_m2 = 0.0
"""
BASE = tomllib.loads(COMPLETE)
ABSENT = object()


def changed(changes, base=BASE):
    """The tables of the complete robot file with some values put in or, with ABSENT, taken out;
    links counted from 1."""
    data = copy.deepcopy(base)
    for path, value in changes.items():
        *parents, last = path.split(".")
        table = data
        for part in parents:
            table = table[int(part) - 1] if isinstance(table, list) else table.setdefault(part, {})
        if value is ABSENT:
            table.pop(last, None)
        else:
            table[last] = value
    return data


def refused(path):
    """The error of a file that is refused; it is one printable line that begins with the file's
    name."""
    with pytest.raises(fx.InputError) as caught:
        fx.load(path)
    text = str(caught.value)
    assert text.isprintable() and len(text) < 700
    assert text.startswith(f"{path}: ") and caught.value.file == str(path)
    return caught.value


def sections(*entries):
    return [{"at_m": at, "width_m": 0.02, "height_m": height} for at, height in entries]


nan, inf = float("nan"), float("inf")
STRIP, CART = "link.2.", "link.1."
BY_NUMBER = {STRIP + key: ABSENT for key in ("section", "young_modulus_Pa", "density_kg_m3")} | {
    STRIP + "mass_per_length_kg_m": 0.157,
    STRIP + "bending_stiffness_N_m2": 0.3333,
}

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
    "no section": (
        {STRIP + "section": ABSENT},
        "link[2].section",
        None,
        "missing: a table { width_m, height_m }",
    ),
    "nothing but a length": (
        {STRIP + key: ABSENT for key in ("section", "young_modulus_Pa", "density_kg_m3")},
        "link[2].section",
        None,
        "missing: a flexible link needs section, young_modulus_Pa",
    ),
    "a height in millimetres": (
        {STRIP + "section.height_m": 1.0},
        "link[2].section.height_m",
        1.0,
        "not millimetres?",
    ),
    "a width in millimetres": (
        {STRIP + "section.width_m": 20.0},
        "link[2].section.width_m",
        20.0,
        "between 1e-7 and 10",
    ),
    "a section without a width": (
        {STRIP + "section": {"height_m": 1e-3}},
        "link[2].section.width_m",
        None,
        "missing: expected the section's width",
    ),
    "a section with a place": (
        {STRIP + "section.at_m": 0.0},
        "link[2].section.at_m",
        0.0,
        "none: sections with a place stand in a list",
    ),
    "a section as a number": (
        {STRIP + "section": 0.02},
        "link[2].section",
        0.02,
        "a table { width_m, height_m } or a list",
    ),
    "a section as text": (
        {STRIP + "section": "thin"},
        "link[2].section",
        "thin",
        "a table { width_m, height_m } or a list",
    ),
    "an empty list of sections": (
        {STRIP + "section": []},
        "link[2].section",
        [],
        "at least two entries",
    ),
    "one section in a list": (
        {STRIP + "section": sections((0.0, 1e-3))},
        "link[2].section",
        [0.0],
        "at least two entries",
    ),
    "sections out of order": (
        {STRIP + "section": sections((0.0, 1e-3), (0.2, 1e-3), (0.1, 1e-3), (0.3, 1e-3))},
        "link[2].section",
        [0.0, 0.2, 0.1, 0.3],
        "ascending order",
    ),
    "two sections at one place": (
        {STRIP + "section": sections((0.0, 1e-3), (0.1, 1e-3), (0.1, 2e-3), (0.3, 1e-3))},
        "link[2].section",
        [0.0, 0.1, 0.1, 0.3],
        "ascending order",
    ),
    "sections not from 0": (
        {STRIP + "section": sections((0.1, 1e-3), (0.3, 1e-3))},
        "link[2].section",
        [0.1, 0.3],
        "from at_m = 0 to the link's length, 0.3",
    ),
    "sections not to the end": (
        {STRIP + "section": sections((0.0, 1e-3), (0.2, 1e-3))},
        "link[2].section",
        [0.0, 0.2],
        "to the link's length",
    ),
    "a negative height in a list": (
        {STRIP + "section": sections((0.0, 1e-3), (0.3, -1e-3))},
        "link[2].section[2].height_m",
        -1e-3,
        "between 1e-7 and 10",
    ),
    "a list's height in millimetres": (
        {STRIP + "section": sections((0.0, 1e-3), (0.3, 1.0))},
        "link[2].section[2].height_m",
        1.0,
        "not millimetres?",
    ),
    "a misspelt key in a list": (
        {
            STRIP + "section": sections((0.0, 1e-3))
            + [{"at": 0.3, "width_m": 0.02, "height_m": 1e-3}]
        },
        "link[2].section[2].at",
        0.3,
        "did you mean at_m?",
    ),
    "a number among sections": (
        {STRIP + "section": [*sections((0.0, 1e-3)), 5]},
        "link[2].section[2]",
        5,
        "a list of { at_m, width_m, height_m }",
    ),
    "a section and a mass per length": (
        {STRIP + "mass_per_length_kg_m": 0.157},
        "link[2].mass_per_length_kg_m",
        0.157,
        "not some of each",
    ),
    "a section and a stiffness": (
        {STRIP + "bending_stiffness_N_m2": 0.33},
        "link[2].bending_stiffness_N_m2",
        0.33,
        "not some of each",
    ),
    "a mass per length alone": (
        BY_NUMBER | {STRIP + "bending_stiffness_N_m2": ABSENT},
        "link[2].bending_stiffness_N_m2",
        None,
        "missing: bending stiffness",
    ),
    "a stiffness alone": (
        BY_NUMBER | {STRIP + "mass_per_length_kg_m": ABSENT},
        "link[2].mass_per_length_kg_m",
        None,
        "missing: mass per length",
    ),
    "a negative mass per length": (
        BY_NUMBER | {STRIP + "mass_per_length_kg_m": -1.0},
        "link[2].mass_per_length_kg_m",
        -1.0,
        "a number 0 or between 1e-12 and 1e6 or a list",
    ),
    "a mass per length as text": (
        BY_NUMBER | {STRIP + "mass_per_length_kg_m": "1"},
        "link[2].mass_per_length_kg_m",
        "1",
        "a number 0 or between 1e-12 and 1e6 or a list",
    ),
    "a mass per length as a truth value": (
        BY_NUMBER | {STRIP + "mass_per_length_kg_m": True},
        "link[2].mass_per_length_kg_m",
        True,
        "kg/m",
    ),
    "a stiffness as a table": (
        BY_NUMBER | {STRIP + "bending_stiffness_N_m2": {"at_m": 0.0}},
        "link[2].bending_stiffness_N_m2",
        {"at_m": 0.0},
        "or a list",
    ),
    "a negative stiffness in a list": (
        BY_NUMBER
        | {
            STRIP + "bending_stiffness_N_m2": [
                {"at_m": 0.0, "value": 1.0},
                {"at_m": 0.3, "value": -1.0},
            ]
        },
        "link[2].bending_stiffness_N_m2[2].value",
        -1.0,
        "a number above 0",
    ),
    "a list's misspelt value": (
        BY_NUMBER
        | {
            STRIP + "bending_stiffness_N_m2": [
                {"at_m": 0.0, "value": 1.0},
                {"at_m": 0.3, "valeu": 1.0},
            ]
        },
        "link[2].bending_stiffness_N_m2[2].valeu",
        1.0,
        "did you mean value?",
    ),
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
    "no joint": (
        {STRIP + "joint": ABSENT},
        "link[2].joint",
        None,
        "missing: expected a table [link.joint]",
    ),
    "an empty joint": (
        {STRIP + "joint": {}},
        "link[2].joint.type",
        None,
        "missing: expected the joint type",
    ),
    "a joint as text": ({STRIP + "joint": "R"}, "link[2].joint", "R", "a table [link.joint]"),
    "a joint as a list": (
        {STRIP + "joint": [{"type": "R"}]},
        "link[2].joint",
        [{"type": "R"}],
        "a table [link.joint]",
    ),
    "an unknown joint": (
        {STRIP + "joint.type": "P"},
        "link[2].joint.type",
        "P",
        '"R", "Pa" or "Pb"',
    ),
    "a joint in small letters": (
        {STRIP + "joint.type": "r"},
        "link[2].joint.type",
        "r",
        '"R", "Pa" or "Pb"',
    ),
    "a joint as a number": (
        {STRIP + "joint.type": 1},
        "link[2].joint.type",
        1,
        '"R", "Pa" or "Pb"',
    ),
    "a rotary joint with a fixed angle": (
        {STRIP + "joint.angle_rad": 0.5},
        "link[2].joint.angle_rad",
        0.5,
        "a joint R turns; use start_rad",
    ),
    "an angle in degrees": (
        {CART + "joint.angle_rad": 90.0},
        "link[1].joint.angle_rad",
        90.0,
        "in radians",
    ),
    "a negative hub mass": (
        {STRIP + "joint.hub_mass_kg": -1.0},
        "link[2].joint.hub_mass_kg",
        -1.0,
        "0 or between 1e-15 and 1e9",
    ),
    "a hub inertia as text": (
        {STRIP + "joint.hub_inertia_kg_m2": "1"},
        "link[2].joint.hub_inertia_kg_m2",
        "1",
        "kg m^2",
    ),
    "a negative rotor inertia": (
        {STRIP + "joint.rotor_inertia_kg_m2": -1},
        "link[2].joint.rotor_inertia_kg_m2",
        -1,
        "reflected to a joint R in kg m^2",
    ),
    "negative friction": (
        {STRIP + "joint.viscous_friction_N_m_s_rad": -1.0},
        "link[2].joint.viscous_friction_N_m_s_rad",
        -1.0,
        "viscous friction of a joint R in N m s/rad",
    ),
    "negative dry friction": (
        {STRIP + "joint.coulomb_friction_N_m": -1.0},
        "link[2].joint.coulomb_friction_N_m",
        -1.0,
        "Coulomb friction of a joint R in N m",
    ),
    "limits in the wrong order": (
        {CART + "joint.limits_m": [0.15, -0.05]},
        "link[1].joint.limits_m",
        [0.15, -0.05],
        "the lower limit first",
    ),
    "limits at one place": (
        {CART + "joint.limits_m": [0.0, 0.0]},
        "link[1].joint.limits_m",
        [0.0, 0.0],
        "a higher upper limit",
    ),
    "a Pb without its free length": (
        {CART + "joint.type": "Pb", CART + "joint.limits_m": ABSENT, CART + "joint.start_m": -0.01},
        "link[1].joint.start_m",
        -0.01,
        "the free length at the start, between 0 and 0.1 m, the ends of link 1",
    ),
    "a flexible Pb that is all inside": (
        {STRIP + "joint.type": "Pb"},
        "link[2].joint.start_m",
        0.0,
        "between 0.006 and 0.3 m, the ends of link 2",
    ),
    "a Pb with limits beyond its link": (
        {
            STRIP + "joint.type": "Pb",
            STRIP + "joint.start_m": 0.2,
            STRIP + "joint.limits_m": [0.1, 0.31],
        },
        "link[2].joint.limits_m",
        [0.1, 0.31],
        "limits between 0.006 and 0.3 m, the ends of link 2",
    ),
    "a Pa that starts beyond its link": (
        {STRIP + "joint.type": "Pa", STRIP + "joint.start_m": 0.11},
        "link[2].joint.start_m",
        0.11,
        "between 0 and 0.1 m, the ends of link 1",
    ),
    "a Pa on a link without length": (
        {CART + "length_m": 0.0, STRIP + "joint.type": "Pa"},
        "link[1].length_m",
        0.0,
        "a length above 0: link 2 slides on this link",
    ),
    "a Pa behind a sleeve": (
        {
            CART + "joint.type": "Pb",
            CART + "joint.limits_m": ABSENT,
            CART + "joint.start_m": 0.04,
            STRIP + "joint.type": "Pa",
            STRIP + "joint.start_m": 0.05,
        },
        "link[2].joint.start_m",
        0.05,
        "ahead of the sleeve of link 1, at 0.06 m or more",
    ),
    "limits beside the start": (
        {CART + "joint.limits_m": [0.05, 0.15]},
        "link[1].joint.limits_m",
        [0.05, 0.15],
        "contain the start position, 0",
    ),
    "a start beside the limits": (
        {CART + "joint.start_m": 0.3},
        "link[1].joint.limits_m",
        [-0.05, 0.15],
        "contain the start position, 0.3",
    ),
    "one limit": (
        {CART + "joint.limits_m": [0.05]},
        "link[1].joint.limits_m[2]",
        None,
        "missing: expected two numbers",
    ),
    "three limits": (
        {CART + "joint.limits_m": [0.05, 0.1, 0.2]},
        "link[1].joint.limits_m",
        [0.05, 0.1, 0.2],
        "two numbers",
    ),
    "limits as a number": (
        {CART + "joint.limits_m": 0.1},
        "link[1].joint.limits_m",
        0.1,
        "two numbers",
    ),
    "an endless limit": (
        {CART + "joint.limits_m": [-inf, 0.1]},
        "link[1].joint.limits_m[1]",
        -inf,
        "two numbers",
    ),
    "a start that is no number": (
        {CART + "joint.start_m": nan},
        "link[1].joint.start_m",
        nan,
        "a finite number",
    ),
    "a lock as a number": (
        {CART + "joint.locked": 1},
        "link[1].joint.locked",
        1,
        "true (the joint is clamped",
    ),
    "gravity in space": (
        {"gravity_m_s2": [0.0, 0.0, -9.81]},
        "gravity_m_s2",
        [0.0, 0.0, -9.81],
        "two numbers [x, y] in m/s^2",
    ),
    "gravity as a number": (
        {"gravity_m_s2": -9.81},
        "gravity_m_s2",
        -9.81,
        "two numbers [x, y] in m/s^2",
    ),
    "gravity as texts": (
        {"gravity_m_s2": ["0", "-9.81"]},
        "gravity_m_s2[1]",
        "0",
        "two numbers [x, y] in m/s^2",
    ),
    "gravity as truth values": (
        {"gravity_m_s2": [False, True]},
        "gravity_m_s2[1]",
        False,
        "two numbers [x, y] in m/s^2",
    ),
    "gravity that is no number": (
        {"gravity_m_s2": [0.0, nan]},
        "gravity_m_s2[2]",
        nan,
        "two numbers [x, y] in m/s^2",
    ),
    "a payload as a number": (
        {"payload": 3.0},
        "payload",
        3.0,
        "a table { mass_kg, inertia_kg_m2, centre_of_mass_m }",
    ),
    "a payload as a list of tables": (
        {"payload": [{"mass_kg": 1.0}]},
        "payload",
        [{"mass_kg": 1.0}],
        "a table",
    ),
    "a negative payload": (
        {"payload.mass_kg": -1.0},
        "payload.mass_kg",
        -1.0,
        "mass in kilograms, 0 or between 1e-15 and 1e9",
    ),
    "negative damping": (
        {STRIP + "damping.beta_s": -1.0},
        "link[2].damping.beta_s",
        -1.0,
        "0 or between 1e-15 and 10",
    ),
    "damping in milliseconds": (
        {STRIP + "damping.beta_s": 20.0},
        "link[2].damping.beta_s",
        20.0,
        "in seconds",
    ),
    "damping as a number": (
        {STRIP + "damping": 0.1},
        "link[2].damping",
        0.1,
        "a table { alpha_1_s, beta_s }",
    ),
    "an unknown way of sliding": (
        {"sliding": "node"},
        "sliding",
        "node",
        '"continuous" or "nodal"',
    ),
    "stiffening as a number": ({"stiffening": 1}, "stiffening", 1, "true, or false"),
    "stiffening as text": ({"stiffening": "yes"}, "stiffening", "yes", "true, or false"),
    "a number as name": ({"name": 5}, "name", 5, "one line of at most 200"),
    "an endless name": (
        {"name": "x" * 201},
        "name",
        "x" * 201,
        "one line of at most 200 characters",
    ),
    "no links": ({"link": ABSENT}, "link", None, "missing: expected 1 to 256 tables [[link]]"),
    "an empty list of links": ({"link": []}, "link", [], "1 to 256 tables [[link]]"),
    "one table of links": (
        {"link": {"length_m": 1.0}},
        "link",
        {"length_m": 1.0},
        "1 to 256 tables [[link]]",
    ),
    "links as text": ({"link": "two"}, "link", "two", "1 to 256 tables [[link]]"),
    "numbers as links": ({"link": [1.0]}, "link[1]", 1.0, "tables [[link]]"),
    "300 links": ({"link": [BASE["link"][0]] * 300}, "link", 300, "1 to 256 tables [[link]]"),
    "an unknown key": (
        {"colour": "red"},
        "colour",
        "red",
        "an unknown key; known here: name, gravity_m_s2",
    ),
    "a key without its unit": (
        {"gravity": [0.0, 0.0]},
        "gravity",
        [0.0, 0.0],
        "did you mean gravity_m_s2?",
    ),
    "a key with letters swapped": (
        {STRIP + "lenght_m": 0.3},
        "link[2].lenght_m",
        0.3,
        "an unknown key; did you mean length_m?",
    ),
    "a misspelt key in the place of the right one": (
        {STRIP + "lenght_m": 0.3, STRIP + "length_m": ABSENT},
        "link[2].lenght_m",
        0.3,
        "did you mean length_m?",
    ),
    "a misspelt key of a joint": (
        {STRIP + "joint.tpye": "R"},
        "link[2].joint.tpye",
        "R",
        "did you mean type?",
    ),
    "a misspelt key of a section": (
        {STRIP + "section.heigth_m": 0.1},
        "link[2].section.heigth_m",
        0.1,
        "did you mean height_m?",
    ),
    "a misspelt key of the damping": (
        {STRIP + "damping.alpha": 0.1},
        "link[2].damping.alpha",
        0.1,
        "did you mean alpha_1_s?",
    ),
    "a misspelt key of the payload": (
        {"payload.mass": 1.0},
        "payload.mass",
        1.0,
        "did you mean mass_kg?",
    ),
    "a joint beside the links": (
        {"joint": {"type": "R"}},
        "joint",
        {"type": "R"},
        "an unknown key",
    ),
    "a key that is empty": ({"": 1}, '""', 1, "an unknown key"),
}


@pytest.mark.parametrize("changes, key, value, words", VALUES.values(), ids=VALUES)
def test_a_wrong_value_is_named_with_its_key_and_what_was_expected(
    tmp_path, changes, key, value, words
):
    path = tmp_path / "wrong.toml"
    path.write_text(tomli_w.dumps(changed(changes)))
    error = refused(path)
    text = str(error)
    shown = repr(value)
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    assert error.key == key and words in error.expected
    assert text.startswith(f"{path}: {key}: " if value is None else f"{path}: {key} = {shown}: ")
    assert any(word in text for word in ("expected", "missing", "unknown key"))


DEEP = 100_000
FILES = {
    "an empty file": (b"", "link: missing"),
    "blanks": (b"  \n\n# nothing\n", "link: missing"),
    "binary rubbish": (bytes(range(256)) * 10, "not a text (byte 128 is not UTF-8)"),
    "a program": (b"\x7fELF\x02\x01\x01\x00\x00", "not valid TOML"),
    "UTF-16": (COMPLETE.encode("utf-16"), "not a text (byte 0 is not UTF-8)"),
    "Latin-1": ('name = "Röhre"'.encode("latin-1"), "not a text (byte 9 is not UTF-8)"),
    "JSON": (b'{"name": "rig"}', "not valid TOML"),
    "a broken value": (b"name = ", "not valid TOML"),
    "a broken table": (b"[[link]\nlength_m = 1\n", "not valid TOML"),
    "an unclosed text": (b'name = "rig\n', "not valid TOML"),
    "a key given twice": (b'name = "a"\nname = "b"\n', "not valid TOML"),
    "a list that is a number": (b"link = 3\n[[link]]\n", "not valid TOML"),
    "an impossible date": (b"name = 1979-13-01\n", "not valid TOML"),
    "11 MB": (b"#" * 11_000_000, "more than 10 MB"),
    "deep lists": (b"x = " + b"[" * DEEP + b"]" * DEEP, "nested too deeply"),
    "deep tables": (b"x = " + b"{a = " * DEEP + b"1" + b"}" * DEEP, "nested too deeply"),
    "deep keys": (b"x" + b".a" * DEEP + b" = 1", "nested too deeply"),
    "deep headers": (b"[x" + b" . a" * DEEP + b"]", "nested too deeply"),
    "a number of 5000 digits": (b"x = 1" + b"0" * 5000, "not valid TOML"),
    "a hexadecimal number of 5000 digits": (
        COMPLETE.replace("0.30", "0x" + "f" * 5000).encode(),
        "link[2].length_m = (a very long int)",
    ),
    "a key with a line end": (
        ('"a\\nb\\u2028" = 1\n' + COMPLETE).encode(),
        "a\\nb\\u2028 = 1: an unknown key",
    ),
    "a key of a million letters": (
        ("a" * 10**6 + " = 1\n" + COMPLETE).encode(),
        "aaa... = 1: an unknown key",
    ),
    "a date as a value": (
        COMPLETE.replace("0.30", "1979-05-27").encode(),
        "link[2].length_m = datetime.date(1979, 5, 27)",
    ),
    "several wrong values": (
        COMPLETE.replace("0.30", "-1").replace("7850.0", "1").encode(),
        "(and 1 more wrong value)",
    ),
}


@pytest.mark.parametrize("content, words", FILES.values(), ids=FILES)
def test_a_file_that_is_no_robot_file_is_named(tmp_path, content, words):
    path = tmp_path / "wrong.toml"
    path.write_bytes(content)
    assert words in str(refused(path))


def test_what_is_not_a_file_is_named(tmp_path):
    assert "a directory: expected the path of a TOML file" in str(refused(tmp_path))
    assert "no such file: expected the path of a TOML file" in str(
        refused(tmp_path / "absent.toml")
    )
    (tmp_path / "a.toml").write_text("")
    assert "cannot be read" in str(refused(tmp_path / "a.toml" / "b.toml"))
    with pytest.raises(fx.InputError, match="cannot be read"):
        fx.load("a\0b")


def test_a_line_end_in_the_files_name_does_not_break_the_line(tmp_path):
    with pytest.raises(fx.InputError) as caught:
        fx.load(tmp_path / "a\nb.toml")
    assert str(caught.value).isprintable() and "a\\nb.toml: no such file" in str(caught.value)


def test_the_error_carries_what_it_says(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(COMPLETE.replace("7850.0", "7.85"))
    error = refused(path)
    assert (error.file, error.key, error.value) == (str(path), "link[2].density_kg_m3", 7.85)
    assert isinstance(error, fx.FlexuraError)


# --- what is accepted


def test_a_file_with_every_key_loads(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(COMPLETE)
    robot = fx.load(path)
    assert robot.structure == "PaR" and robot.name == "rig (type IV, PaR)"
    carriage, strip = robot.links
    assert (
        carriage.flexible,
        carriage.mass_kg,
        carriage.centre_of_mass_m,
        carriage.inertia_kg_m2,
    ) == (False, 0.6, 0.05, 5e-4)
    assert carriage.joint.limits == (-0.05, 0.15)
    assert (strip.elements, strip.modes, strip.section.height_m, strip.damping.beta_s) == (
        4,
        3,
        0.001,
        2e-4,
    )
    assert (robot.payload.mass_kg, robot.gravity_m_s2, robot.stiffening, robot.sliding) == (
        0.02,
        (0.0, 0.0),
        True,
        "continuous",
    )
    assert np.allclose(strip.mass_per_length([0.0, 0.3]), 7850 * 0.02 * 0.001)
    assert np.allclose(strip.bending_stiffness(0.1), 2e11 * 0.02 * 0.001**3 / 12)
    assert np.allclose(strip.axial_stiffness(0.1), 2e11 * 0.02 * 0.001)


EVERY_KEY = {
    "name": "x",
    "gravity_m_s2": [0.0, -9.81],
    "stiffening": False,
    "sliding": "nodal",
    "link.1.name": "x",
    "link.1.length_m": 0.0,
    "link.1.elements": 0,
    "link.1.mass_kg": 0.0,
    "link.1.centre_of_mass_m": -0.01,
    "link.1.inertia_kg_m2": 0.0,
    "link.1.joint.angle_rad": 1.5,
    "link.1.joint.hub_mass_kg": 0.1,
    "link.1.joint.hub_inertia_kg_m2": 0.1,
    "link.1.joint.rotor_mass_kg": 0.1,
    "link.1.joint.viscous_friction_N_s_m": 0.1,
    "link.1.joint.coulomb_friction_N": 0.1,
    "link.1.joint.limits_m": [-1, 1],
    "link.1.joint.start_m": 0.01,
    "link.1.joint.locked": True,
    "link.2.elements": 200,
    "link.2.modes": 8,
    "link.2.section": [
        {"at_m": 0.0, "width_m": 0.02, "height_m": 0.002},
        {"at_m": 0.3, "width_m": 0.01, "height_m": 0.001},
    ],
    "link.2.young_modulus_Pa": 7e10,
    "link.2.density_kg_m3": 2700,
    "link.2.damping": {"alpha_1_s": 0.1},
    "payload.mass_kg": 0.5,
    "payload.inertia_kg_m2": 0.1,
}


@pytest.mark.parametrize("path", EVERY_KEY)
def test_every_key_is_read_written_and_replaced(path, tmp_path):
    robot = fx.Robot.from_dict(changed({path: EVERY_KEY[path]}))
    assert robot == fx.Robot.from_dict(BASE).replace({path: EVERY_KEY[path]})
    value = robot
    for part in path.split("."):
        value = value[int(part) - 1] if isinstance(value, list) else getattr(value, part)
    plain = value.model_dump(exclude_defaults=True) if hasattr(value, "model_dump") else value
    plain = (
        [v.model_dump(exclude_none=True) for v in value]
        if isinstance(value, list)
        else list(value)
        if isinstance(value, tuple)
        else plain
    )
    assert plain == EVERY_KEY[path]
    fx.save(robot, tmp_path / "robot.toml")
    assert fx.load(tmp_path / "robot.toml") == robot


def test_a_link_may_be_given_by_numbers_or_by_lists_of_numbers():
    robot = fx.Robot.from_dict(changed(BY_NUMBER))
    taper = [{"at_m": 0.0, "value": 0.3}, {"at_m": 0.1, "value": 0.1}, {"at_m": 0.3, "value": 0.2}]
    lists = fx.Robot.from_dict(changed(BY_NUMBER | {STRIP + "mass_per_length_kg_m": taper}))
    assert (
        robot.links[1].mass_per_length(0.2) == 0.157 and robot.links[1].axial_stiffness(0.2) is None
    )
    assert np.allclose(lists.links[1].mass_per_length([0.05, 0.1, 0.2]), [0.2, 0.1, 0.15])
    assert lists.links[1].breaks() == [0.0, 0.1, 0.3]


def test_a_rigid_link_may_have_its_mass_from_a_section_and_a_density():
    spread = {
        "section": {"width_m": 0.02, "height_m": 0.01},
        "density_kg_m3": 2700.0,
        "mass_kg": ABSENT,
    }
    changes = {CART + key: value for key, value in spread.items()}
    changes |= {CART + "centre_of_mass_m": ABSENT, CART + "inertia_kg_m2": ABSENT}
    link = fx.Robot.from_dict(changed(changes)).links[0]
    assert not link.flexible and np.isclose(link.mass_per_length(0.05), 0.02 * 0.01 * 2700)


def test_whole_numbers_stand_for_numbers_and_a_byte_order_mark_is_skipped(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_bytes(
        b"\xef\xbb\xbf" + COMPLETE.replace("7850.0", "7850").replace("\n", "\r\n").encode()
    )
    assert fx.load(path) == fx.Robot.from_dict(BASE)


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_the_robots_that_come_along_load_and_assemble(path, tmp_path):
    robot = fx.load(path)
    system = fx.assemble(robot)
    assert robot.name and system.n >= len(robot.links)
    assert np.linalg.eigvalsh(system.mass(system.start())).min() > 0
    fx.save(robot, tmp_path / "again.toml")
    assert fx.load(tmp_path / "again.toml") == robot


@pytest.mark.parametrize("path", MANOEUVRES, ids=lambda path: path.stem)
def test_the_manoeuvres_that_come_along_load_for_a_robot_that_comes_along(path):
    joints = len(tomllib.loads(path.read_text())["joint"])
    fitting = [
        robot
        for robot in ROBOTS
        if path.stem.startswith(robot.stem) or robot.stem.startswith(path.stem)
    ]
    fitting = [robot for robot in fitting if len(fx.load(robot).links) == joints]
    for robot in fitting or [r for r in ROBOTS if len(fx.load(r).links) == joints]:
        manoeuvre = fx.load_manoeuvre(path, len(fx.load(robot).links))
        assert manoeuvre.name and manoeuvre.t[-1] == manoeuvre.duration_s
        break
    else:
        pytest.fail(f"no robot with {joints} joints")


# --- frozen, replaced, round


def test_a_robot_is_frozen():
    robot = fx.Robot.from_dict(BASE)
    with pytest.raises(Exception, match="frozen"):
        robot.name = "another"
    with pytest.raises(Exception, match="frozen"):
        robot.links[1].length_m = 1.0
    with pytest.raises(Exception, match="frozen"):
        robot.payload.mass_kg = 1.0


def test_replacing_leaves_the_robot_as_it_was_and_checks_the_new_one():
    robot = fx.Robot.from_dict(BASE)
    heavier = robot.replace(
        {"payload.mass_kg": 0.1, "link.2.length_m": 0.4, "link.2.section.height_m": 0.002}
    )
    assert robot == fx.Robot.from_dict(BASE)
    assert (
        heavier.payload.mass_kg,
        heavier.links[1].length_m,
        heavier.links[1].section.height_m,
    ) == (0.1, 0.4, 0.002)
    assert heavier.replace({"link.2.modes": None}).links[1].modes is None
    with pytest.raises(fx.InputError, match=r"payload\.mass_kg = -1"):
        robot.replace({"payload.mass_kg": -1.0})
    with pytest.raises(fx.InputError, match="did you mean length_m"):
        robot.replace({"link.2.lenght_m": 1.0})


@pytest.mark.parametrize(
    "path",
    [
        "link.0.length_m",
        "link.3.length_m",
        "link.-1.length_m",
        "link.x.length_m",
        "link.0",
        "link.9" + "9" * 30,
    ],
)
def test_replacing_counts_links_from_1(path):
    with pytest.raises(fx.InputError, match="expected a number from 1 to 2") as caught:
        fx.Robot.from_dict(BASE).replace({path: 0.1})
    assert caught.value.key == path


def test_replacing_in_a_list_without_entries_is_refused():
    with pytest.raises(fx.InputError, match="there are no entries to count") as caught:
        fx.Robot.from_dict(BASE).replace({"link.2.mass.1.mass_kg": 0.1})
    assert caught.value.key == "link.2.mass.1.mass_kg"


@pytest.mark.parametrize("path", ["name.x", "link.2.name.x", "payload.mass_kg.x"])
def test_replacing_inside_a_value_is_refused(path):
    with pytest.raises(fx.InputError, match="isn't a table"):
        fx.Robot.from_dict(BASE).replace({path: 0.1})


def number(low, high, **options):
    return st.floats(low, high, allow_nan=False, **options)


def zero_or(low, high):
    return st.one_of(st.just(0.0), number(low, high))


def optional(**keys):
    return st.fixed_dictionaries({}, optional=keys)


@st.composite
def joints(draw):
    joint = draw(
        optional(
            hub_mass_kg=zero_or(1e-9, 100),
            hub_inertia_kg_m2=zero_or(1e-9, 100),
            rotor_inertia=zero_or(1e-9, 100),
            viscous_friction=zero_or(1e-9, 100),
            coulomb_friction=zero_or(1e-9, 100),
            locked=st.booleans(),
        )
    )
    joint["type"] = draw(st.sampled_from(["R", "Pa", "Pb"]))
    if joint["type"] != "R":
        joint["angle_rad"] = draw(number(-7, 7))
    return joint


@st.composite
def chains(draw):
    """Links whose joints start, and have their limits, on what they slide along."""
    chain = draw(st.lists(links(), min_size=1, max_size=5))
    for i, link in enumerate(chain):
        joint, (low, high) = link["joint"], (-1e4, 1e4)
        if i and joint["type"] == "Pa":
            before = chain[i - 1]
            low, high = 0.0, before["length_m"]
            if before["joint"]["type"] == "Pb":
                low = high - before["joint"]["start"]
            if high == 0:
                joint["type"], (low, high) = "R", (-1e4, 1e4)
                joint.pop("angle_rad")
        elif joint["type"] == "Pb":
            high = link["length_m"]
            low = 0.02 * high if link.get("elements") else 0.0
        if draw(st.booleans()) or joint["type"] != "R":
            start = low + (high - low) * draw(st.floats(0.25, 0.75))
            joint["start"] = start
            if draw(st.booleans()) and low < high:
                joint["limits"] = [(low + start) / 2, (start + high) / 2]
    return renamed({"link": chain})[0]["link"]


@st.composite
def along(draw, length, entry):
    """A list of entries with at_m from 0 to the length."""
    inner = draw(st.lists(st.floats(0.01, 0.99), max_size=4, unique=True))
    return [
        {"at_m": at} | draw(entry)
        for at in [0.0, *(length * part for part in sorted(inner)), length]
    ]


@st.composite
def links(draw):
    link = {"name": draw(st.text(max_size=20).filter(is_name)), "joint": draw(joints())}
    link["length_m"] = length = draw(number(1e-3, 1000))
    section = st.fixed_dictionaries({"width_m": number(1e-6, 10), "height_m": number(1e-7, 9e-4)})
    value = st.fixed_dictionaries({"value": number(1e-9, 1e6)})
    if draw(st.booleans()):
        link |= {
            "elements": 0,
            "length_m": draw(st.sampled_from([0.0, length])),
            "mass_kg": draw(zero_or(1e-9, 1e3)),
        }
        return link | draw(
            optional(centre_of_mass_m=number(-10, 10), inertia_kg_m2=zero_or(1e-9, 10))
        )
    link["elements"] = draw(st.integers(1, 200))
    if draw(st.booleans()):
        link["modes"] = draw(st.integers(1, min(14, 2 * link["elements"])))
    if draw(st.booleans()):
        link["section"] = draw(st.one_of(section, along(length, section)))
        link |= {
            "young_modulus_Pa": draw(number(1e3, 2e12)),
            "density_kg_m3": draw(number(10, 25000)),
        }
    else:
        for key in ("mass_per_length_kg_m", "bending_stiffness_N_m2"):
            link[key] = draw(st.one_of(number(1e-9, 1e6), along(length, value)))
    return link | draw(
        st.fixed_dictionaries(
            {},
            optional={"damping": optional(alpha_1_s=zero_or(1e-9, 1e6), beta_s=zero_or(1e-9, 10))},
        )
    )


def whole_meshes(tables):
    """What slides node by node keeps all nodes."""
    if tables.get("sliding") == "nodal":
        for link in tables["link"]:
            link.pop("modes", None)
    return tables


def suited(tables):
    """The robot, unless the weight that a link carries would stretch it."""
    try:
        return fx.Robot.from_dict(tables)
    except fx.InputError as error:
        if "inextensible" not in str(error):
            raise
        reject()


robots = (
    st.fixed_dictionaries(
        {"link": chains()},
        optional={
            "name": st.text(max_size=50).filter(is_name),
            "gravity_m_s2": st.lists(number(-1e3, 1e3), min_size=2, max_size=2),
            "stiffening": st.booleans(),
            "sliding": st.sampled_from(["continuous", "nodal"]),
            "payload": optional(mass_kg=zero_or(1e-9, 1e3), inertia_kg_m2=zero_or(1e-9, 1e3)),
        },
    )
    .map(whole_meshes)
    .map(suited)
)


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(robots)
def test_a_robot_is_read_back_as_it_was_written(tmp_path_factory, robot):
    path = tmp_path_factory.getbasetemp() / "round.toml"
    fx.save(robot, path)
    assert fx.load(path) == robot
    assert fx.Robot.from_dict(robot.to_dict()) == robot
    assert fx.Robot.from_dict(robot.model_dump(mode="json")) == robot
    assert robot.replace({}) == robot


def loads_or_is_refused(path):
    try:
        fx.load(path)
    except fx.InputError as error:
        assert str(error).isprintable() and str(error).startswith(str(path))


@settings(max_examples=250, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.lists(
        st.tuples(st.integers(0, len(COMPLETE)), st.integers(0, 12), st.binary(max_size=4)),
        min_size=1,
        max_size=3,
    )
)
def test_bytes_changed_anywhere_never_raise_anything_else(tmp_path_factory, edits):
    """Each edit replaces some bytes at a place by others."""
    raw = COMPLETE.encode()
    for place, length, new in edits:
        raw = raw[:place] + new + raw[place + length :]
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(raw)
    loads_or_is_refused(path)


anything = st.recursive(
    st.one_of(
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(max_size=5),
        st.dates(),
        st.times(),
        st.datetimes(),
    ),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=5,
)


def places(table, prefix=""):
    """Dotted paths of all tables and values, links counted from 1."""
    found = []
    for key, value in table.items() if isinstance(table, dict) else enumerate(table, 1):
        found.append(f"{prefix}{key}")
        if isinstance(value, dict) or (
            isinstance(value, list) and value and isinstance(value[0], dict)
        ):
            found += places(value, f"{prefix}{key}.")
    return found


@settings(max_examples=250, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.sampled_from([p for p in places(BASE) if not p.split(".")[-1].isdigit()]), anything)
def test_a_value_of_any_type_anywhere_never_raises_anything_else(tmp_path_factory, place, value):
    path = tmp_path_factory.getbasetemp() / "values.toml"
    with contextlib.suppress(UnicodeEncodeError):
        path.write_text(tomli_w.dumps(changed({place: value})))
    loads_or_is_refused(path)


@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.sampled_from(COMPLETE.splitlines()), st.sampled_from(COMPLETE.splitlines()))
def test_lines_in_another_order_never_raise_anything_else(tmp_path_factory, first, second):
    path = tmp_path_factory.getbasetemp() / "lines.toml"
    path.write_text(COMPLETE.replace(first, "\0").replace(second, first).replace("\0", second))
    loads_or_is_refused(path)


def test_saving_writes_the_whole_file_or_leaves_the_old_one(tmp_path, monkeypatch):
    robot, path = fx.Robot.from_dict(BASE), tmp_path / "new" / "robot.toml"
    fx.save(robot, path)
    before = path.read_bytes()

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(fx.InputError, match="disk full"):
        fx.save(robot.replace({"name": "another"}), path)
    assert path.read_bytes() == before and [p.name for p in path.parent.iterdir()] == ["robot.toml"]
