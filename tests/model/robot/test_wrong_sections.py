"""Robot files with wrong sections, or wrong masses and stiffnesses along a link."""

import pytest

from robot_files import ABSENT, BY_NUMBER, STRIP, check_refused


def sections(*entries):
    return [{"at_m": at, "width_m": 0.02, "height_m": height} for at, height in entries]


# what is changed, the key that is named, the value that is shown (None: none to show), words of
# what was expected
VALUES = {
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
}


@pytest.mark.parametrize("changes, key, value, words", VALUES.values(), ids=VALUES)
def test_a_wrong_section_is_named(tmp_path, changes, key, value, words):
    check_refused(tmp_path, changes, key, value, words)
