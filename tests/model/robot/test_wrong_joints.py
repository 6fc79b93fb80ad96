"""Robot files with wrong joints: types, limits, starts, friction."""

import pytest

from robot_files import ABSENT, CART, STRIP, check_refused, inf, nan

# what is changed, the key that is named, the value that is shown (None: none to show), words of
# what was expected
VALUES = {
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
}


@pytest.mark.parametrize("changes, key, value, words", VALUES.values(), ids=VALUES)
def test_a_wrong_joint_is_named(tmp_path, changes, key, value, words):
    check_refused(tmp_path, changes, key, value, words)
