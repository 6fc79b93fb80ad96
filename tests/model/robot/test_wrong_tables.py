"""Robot files with wrong gravity, payload, damping or names, and with unknown or missing tables."""

import pytest

from robot_files import ABSENT, BASE, STRIP, check_refused, nan

# what is changed, the key that is named, the value that is shown (None: none to show), words of
# what was expected
VALUES = {
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
    "another word for a key": (
        {STRIP + "damping.zeta": 0.1},
        "link[2].damping.zeta",
        0.1,
        "did you mean ratio?",
    ),
    "the beginning of two keys": (
        {STRIP + "joint.spring": {"stiff": 1.0}},
        "link[2].joint.spring.stiff",
        1.0,
        "did you mean stiffness_N_m_rad or stiffness_N_m?",
    ),
    "an old key beside the new one": (
        {STRIP + "joint.start": 0.1, STRIP + "joint.start_rad": 0.2},
        "link[2].joint.start",
        0.1,
        "did you mean start_rad? It is there too",
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
def test_a_wrong_table_or_key_is_named(tmp_path, changes, key, value, words):
    check_refused(tmp_path, changes, key, value, words)
