"""Identification: its statistics, its parts, and one emulated rig drawn at random that it has to
find."""

from __future__ import annotations

import ast
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from boards import BENCH
from flexlab import rig as rigs
from flexlab.comparison.replay import lead_screw
from flexlab.experiment import excitation
from flexlab.identification import files, motor_friction, output
from flexlab.identification.estimate import Parameter, covariance, estimate
from flexlab.identification.identify_rig import identify, read_nominal
from flexlab.rig.axes import Friction, motor_axes
from flexlab.rig.plant.motor import joint_line
from rigs import excited, ran

FOLDER = Path(files.__file__).parent


def ringing(random: np.random.Generator, kept: float, count: int = 2000) -> np.ndarray:
    """Residuals with e_t = kept e_{t-1} + white, of variance 1."""
    from scipy.signal import lfilter

    white = random.standard_normal(count + 200) * np.sqrt(1 - kept**2)
    return lfilter([1.0], [1.0, -kept], white)[200:]


def test_white_residuals_give_back_the_textbook_covariance():
    random = np.random.default_rng(1)
    J = random.standard_normal((2, 1, 4000))
    wanted = 0.25 * np.linalg.inv(J[:, 0] @ J[:, 0].T)
    np.testing.assert_allclose(
        np.diag(covariance(J, 0.5 * random.standard_normal((1, 4000)), 0)),
        np.diag(wanted),
        rtol=0.08,
    )


def test_what_nothing_depends_on_has_no_interval_and_leaves_the_others_theirs():
    random = np.random.default_rng(2)
    J, r = random.standard_normal((3, 1, 400)), 0.1 * random.standard_normal((1, 400))
    J[1] = 0.0
    found, kept = covariance(J, r, 4), [0, 2]
    np.testing.assert_array_equal(found[np.ix_(kept, kept)], covariance(J[kept], r, 4))
    assert np.isnan(found[1]).all() and np.isnan(found[:, 1]).all()
    J[1] = J[0]
    assert np.isinf(covariance(J, r, 4)).any() or covariance(J, r, 4)[0, 0] > 1e6
    assert np.isnan(covariance(0 * J, r, 4)).all()


@pytest.mark.parametrize("kept", [0.0, 0.9])
def test_intervals_cover_what_they_say_with_residuals_that_hang_together(kept):
    t = np.linspace(0.0, 1.0, 2000)
    course = lambda v: v["size"] * np.exp(-t / v["decay_s"])
    truth = {"size": 2.0, "decay_s": 0.4}
    unknowns = [
        Parameter("size", 1.5, 1e-4, (0.1, 10.0)),
        Parameter("decay_s", 0.3, 1e-4, (0.01, 10.0)),
    ]
    inside, rounds = 0, 150
    for seed in range(rounds):
        measured = course(truth) + ringing(np.random.default_rng(seed), kept)
        found = estimate(lambda v, y=measured: (course(v) - y)[None, :], unknowns, 60)
        inside += sum(
            low <= truth[name] <= high for name in truth for low, high in [found.interval(name)]
        )
    share = inside / (2 * rounds)
    # 95 % with three standard deviations of the count; Newey and West's window of 60 samples
    # underrates a memory of 20 by some
    assert 0.95 - 3 * np.sqrt(0.95 * 0.05 / rounds) - (0.03 if kept else 0.0) <= share <= 1.0


def test_unknowns_that_do_nearly_the_same_are_told_apart():
    t = np.linspace(0.0, 1.0, 500)
    model = lambda v: np.stack([np.sin(300 * t * v["a"] * v["b"]) + 1e-3 * v["b"] * t])
    start = [
        Parameter("a", 1.0001 / 1.02, 1e-5, (0.5, 2.0)),
        Parameter("b", 1.02, 1e-2, (0.5, 2.0)),
    ]
    measured = model({"a": 1.0, "b": 1.0})
    found = estimate(lambda v: 1e3 * (model(v) - measured), start, 0, {"b": {"a": -1.0}})
    assert found.values["a"] == pytest.approx(1.0, rel=1e-4) and found.values["b"] == pytest.approx(
        1.0, rel=1e-4
    )


def test_a_doubt_about_the_model_widens_by_the_shift_it_would_cause():
    t = np.linspace(0.0, 1.0, 400)
    model = lambda v: (v["slope"] * t)[None, :]
    unknown = [Parameter("slope", 1.0, 1e-3, (-10.0, 10.0), factor=False)]
    found = estimate(lambda v: model(v) - 2 * t[None, :], unknown, 0)
    assert found.with_model_uncertainty(0.1 * t[None, :]).deviation("slope") == pytest.approx(
        0.1, rel=1e-6
    )


def test_the_carriage_follows_the_nut_behind_its_play():
    t = np.linspace(0.0, 2.0, 4001)
    nut = 1e-3 * np.sin(2 * np.pi * t)
    x = lead_screw.backlash_output(nut, 3e-4)
    assert np.ptp(x[1000:]) == pytest.approx(2e-3 - 3e-4, rel=1e-5)
    assert np.abs(x - nut).max() == pytest.approx(1.5e-4, rel=1e-6)
    still = (
        np.diff(x[1000:]) == 0
    )  # from each turn until the play is crossed: acos(1 - b / a) of the half turn
    assert still.mean() == pytest.approx(np.arccos(1 - 0.3) / np.pi, abs=2e-3)


def test_the_excitation_is_what_the_rig_can_do():
    plan = excitation.plan(BENCH, rigs.configuration(BENCH))
    assert not plan.failed and plan.duration_s <= 10.0
    stiffer = dataclasses.replace(
        BENCH, robot=BENCH.robot.replace({"link.2.young_modulus_Pa": 3e11})
    )
    rates = [excitation.profile(bench)["rate_rad_s"]["value"] for bench in (BENCH, stiffer)]
    assert rates[0] != rates[1]  # its chirp follows the robot's second mode


def test_more_friction_leaves_constant_and_gear_of_the_motor_alone():
    rig = BENCH.rig
    more = rigs.Rig.model_validate(files.with_identified_friction(rig, {1: Friction(1.4, 1.4)}))
    old, new, wanted = (
        joint_line(motor_axes(rig)[0]),
        joint_line(motor_axes(more)[0]),
        joint_line(motor_axes(rig)[0], 1.4),
    )
    assert new.force_per_V == pytest.approx(old.force_per_V, rel=1e-12)
    assert new.coulomb == pytest.approx(1.4 * old.coulomb, rel=1e-12)
    assert new.viscous == pytest.approx(wanted.viscous, rel=1e-12)


def test_nothing_here_looks_at_what_an_emulated_plant_says_of_itself():
    for path in FOLDER.glob("*.py"):
        tree = ast.parse(path.read_text())
        names = {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)} | {
            n.id for n in ast.walk(tree) if isinstance(n, ast.Name)
        }
        assert not names & {"truth", "ranges", "random_true_parameters", "TrueParameters"}, (
            path.name
        )
        read = [
            n
            for n in ast.walk(tree)
            if isinstance(n, ast.Subscript) and isinstance(n.slice, ast.Constant)
        ]
        assert not [n for n in read if n.slice.value in ("truth", "ranges")], path.name


@pytest.fixture(scope="module")
def excitement(tmp_path_factory):
    return excited(3, tmp_path_factory.mktemp("excite"))


def test_friction_is_found_from_one_run(excitement):
    run = excitement.run
    nominal = read_nominal(run)
    found = motor_friction.fit(
        run, nominal.robot, nominal.axes[0], nominal.lines[1], nominal.rig.driver.dead_zone_V
    )
    truth = run.meta["truth"]["joint_1"]
    assert found.values["coulomb"] == pytest.approx(truth["coulomb_N"], rel=0.15)
    assert found.values["viscous"] == pytest.approx(truth["viscous_N_s_m"], rel=0.15)
    assert 0 < found.deviation("coulomb") < 0.05
    assert found.evaluations < 100


def test_what_cannot_be_identified_is_refused(excitement):
    run = excitement.run
    for change, key in (
        ({"channels": run.channels | {"joint/2/pulses": np.zeros(len(run))}}, "joint/2/pulses"),
        (
            {
                "channels": {n: v for n, v in run.channels.items() if n != "link/2/flex_voltage"},
                "units": {n: v for n, v in run.units.items() if n != "link/2/flex_voltage"},
            },
            "RUN",
        ),
        ({"meta": {k: v for k, v in run.meta.items() if k != "rig"}}, "rig"),
    ):
        with pytest.raises(fx.InputError) as error:
            identify(dataclasses.replace(run, **change))
        assert error.value.key == key


@pytest.fixture(scope="module")
def found(excitement):
    run = excitement.run
    return identify(
        dataclasses.replace(
            run, meta={k: v for k, v in run.meta.items() if k not in ("truth", "seed")}
        )
    )


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_random_rig_is_found_from_one_run(excitement, found, tmp_path):
    """The issue's figures: stiffness 2 %, damping 10 %, payload 3 %, friction 15 %."""
    truth = excitement.run.meta["truth"]
    for name, least in (
        ("stiffness", 0.02),
        ("damping", 0.10),
        ("payload", 0.03),
        ("sensor_gain", 0.05),
    ):
        true = truth["factors"][name.replace("sensor", "flex")]
        assert found.strip.values[name] == pytest.approx(true, rel=least), name
    joint = truth["joint_1"]
    assert found.joints[1].values["coulomb"] == pytest.approx(joint["coulomb_N"], rel=0.15)
    play = found.nominal.axes[0].guide.backlash * found.strip.values["backlash"]
    assert play == pytest.approx(joint["backlash_m"], abs=5e-5)
    (robot, rig), missing = files.save(found, excitement.run, tmp_path / "robot.toml")
    assert missing == []
    assert fx.load(robot).payload.mass_kg == files.robot(found).payload.mass_kg
    assert rigs.configuration(rigs.load(rig))
    told = json.loads(json.dumps(output.numbers(found, excitement.run)))
    assert all(p["low"] <= p["value"] <= p["high"] for p in told["parameters"])
    assert told["at_bounds"] == []
    elsewhere = fx.Run(
        excitement.run.t,
        excitement.run.channels,
        excitement.run.units,
        excitement.run.meta | {"rig_file": "/lab/firmware/rig.toml"},
    )
    nominal = found.nominal
    own = nominal.rig.model_copy(update={"manoeuvre": "../manoeuvres/own.toml"})
    there = dataclasses.replace(found, nominal=dataclasses.replace(nominal, rig=own))
    (alone,), (missing,) = files.save(there, elsewhere, tmp_path / "b" / "robot.toml")
    assert fx.load(alone) == fx.load(robot) and [p.name for p in alone.parent.iterdir()] == [
        "robot.toml"
    ]
    assert "robot-rig.toml is not written" in missing and "/lab" in missing


def with_truth(found, truth):
    """An identification that found what the emulated plant has."""
    strip = found.strip.values | {
        name: truth["factors"][name] for name in ("stiffness", "damping", "payload", "backlash")
    }
    strip["sensor_gain"] = truth["factors"]["flex_gain"]
    joint = found.joints[1].values | {"coulomb": truth["joint_1"]["coulomb_N"]}
    return dataclasses.replace(
        found,
        strip=dataclasses.replace(found.strip, values=strip),
        joints={1: dataclasses.replace(found.joints[1], values=joint)},
    )


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("experiment", ["forward", "inverse"])
def test_what_was_found_predicts_other_experiments(found, experiment, tmp_path):
    """The issue's figures: joint variables 1.5 %, tip displacement 4 %, response time 5 %, the
    largest deviation of the peak.

    Joint 2 and the tip are judged by what the plant truly did: a count of its encoder is 1 % of the
    forward run's stroke, and the flex sensor's noise alone is 15 % of the inverse run's largest
    deflection.
    """
    other, seen = ran(experiment, 3, tmp_path)
    before, after = output.check(found, other)
    carriage_, simulated = after.differences[0], after.simulation
    tip, angle = seen.along(other)
    off = lambda y, name: np.nanmax(np.abs(y - simulated[name])) / np.nanmax(np.abs(y))
    figures = {
        "joint 1": carriage_.max_relative,
        "joint 2": off(angle, "joint/2/position"),
        "tip": off(tip, "link/2/tip_deflection"),
        "response": after.worst_response,
    }
    print(
        experiment,
        {k: round(100 * v, 2) for k, v in figures.items()},
        "by the files",
        before.differences[0].max_relative,
    )
    for name, most in (("joint 1", 0.015), ("joint 2", 0.015), ("tip", 0.04), ("response", 0.05)):
        assert figures[name] < most, figures
    by_truth = output.check(with_truth(found, other.meta["truth"]), other)[1].differences[0]
    assert carriage_.channel == by_truth.channel == "joint/1/position"
    assert carriage_.max_relative < 1.1 * by_truth.max_relative
