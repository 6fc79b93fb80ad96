"""Angles of more than a turn are said in turns and degrees, wherever they are given."""

import logging

import numpy as np
import pytest

import flexura as fx
from flexura.io.quantities import turns
from flexura.signals import cycloid, step, table

T = np.linspace(0.0, 0.1, 11)
ARM = fx.load("single-r")


@pytest.fixture
def said(caplog, monkeypatch):
    """What the logger says from now on."""
    monkeypatch.setattr(logging.getLogger("flexura"), "propagate", True)
    turns._say.cache_clear()
    return lambda: [record.getMessage() for record in caplog.records]


def with_joint(**joint):
    tables = ARM.to_dict()
    tables["link"][0]["joint"] |= joint
    return fx.Robot.from_dict(tables)


FIFTY = "50 rad are 7.96 turns, 2865 degrees"
GIVEN = {
    "start": (lambda a: with_joint(start_rad=a), "link[1].joint.start_rad"),
    "limits": (lambda a: with_joint(limits_rad=[-1, a]), "link[1].joint.limits_rad"),
    "rest of a spring": (
        lambda a: with_joint(spring={"stiffness_N_m_rad": 1.0, "rest_rad": a}),
        "link[1].joint.spring.rest_rad",
    ),
    "old key": (lambda a: with_joint(start=a), "link[1].joint.start_rad"),
    "replace": (lambda a: ARM.replace({"joint.1.start_rad": a}), "link[1].joint.start_rad"),
    "prescribed": (
        lambda a: fx.simulate(ARM, T, fx.Drive.prescribed(cycloid(a, 0.1))),
        "motion of joint 1",
    ),
    "set-point": (
        lambda a: fx.simulate(ARM, T, fx.Drive.pd([step(a)], kp=1e-3, kd=0.0)),
        "motion of joint 1",
    ),
    "population": (
        lambda a: fx.simulate(
            fx.Batch.vary(ARM, {"payload.mass_kg": [0.0, 0.1]}),
            T,
            fx.Drive.prescribed(cycloid(a, 0.1)),
        ),
        "motion of joint 1",
    ),
    "path": (
        lambda a: fx.invert(ARM, np.linspace(0.0, 20.0, 401), cycloid(a, 20.0)),
        "polar angle of the tip",
    ),
}


@pytest.mark.parametrize(("give", "key"), GIVEN.values(), ids=GIVEN)
def test_more_than_a_turn_is_said_once(give, key, said):
    give(50.0)
    assert said().count(f"{key}: {FIFTY}") == 1


@pytest.mark.parametrize(("give", "key"), GIVEN.values(), ids=GIVEN)
def test_a_turn_is_not(give, key, said):
    give(2 * np.pi)
    assert not [line for line in said() if "turns" in line]


def test_places_are_no_angles(said):
    rail = {"length_m": 0.5, "mass_kg": 1.0, "inertia_kg_m2": 1.0}
    joint = {"type": "Pa", "start_m": 9.0, "limits_m": [-50.0, 50.0]}
    robot = fx.Robot.from_dict({"link": [rail | {"joint": joint}]})
    fx.simulate(robot, T, fx.Drive.prescribed(table(T, 9.0 + 5.0 * T)))
    assert said() == []
