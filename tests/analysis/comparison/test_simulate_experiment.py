"""The simulation of an experiment. The experiments are the Exudyn twin's, another program."""

import re
from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from experiment_runs import run
from flexlab.comparison.measures import (
    compare,
)
from flexlab.comparison.replay import stepper_relaxation
from flexlab.comparison.replay.simulate_experiment import DRIVEN_BY, simulate_experiment
from flexlab.comparison.replay.smoothing import (
    continue_past_end,
)
from flexlab.rig import load
from flexlab.rig.axes import motor_axes
from flexlab.rig.plant.motor import joint_line
from flexlab.rig.plant.stepper import MagneticSpring
from flexlab.runs.deviation import deviations
from flexura.errors import InputError
from flexura.io import Run
from flexura.signals import JointDrive
from twin_experiments import RIG

# --- the simulation of an experiment


@pytest.mark.parametrize("which", ["forward", "inverse"])
def test_what_was_commanded_gives_what_another_program_found(which, request):
    """The parts' own equations in Exudyn; in the simulation a line, a relaxed sine and 5 ms of the
    drive's samples."""
    measured, moved = request.getfixturevalue(which)
    found = {
        row.channel: row.max_relative for row in deviations(simulate_experiment(measured), moved)
    }
    assert found["joint/1/position"] < 0.005 and found["joint/2/position"] < 0.0015
    assert found["link/2/tip_deflection"] < 0.011


@pytest.mark.parametrize("which", ["forward", "inverse"])
def test_joints_on_their_encoders_bend_the_strip_as_it_was_bent(which, request):
    """The smoothed motion is as far from the samples as these from the truth (RMS), so at most
    twice that from the truth; an encoder step of 2.6 mrad is 0.8 mm at the tip, which bends by 16
    and 32 mm."""
    measured, moved = request.getfixturevalue(which)
    simulated = simulate_experiment(measured, "measured")
    found = {row.channel: (row.max, row.rms) for row in deviations(simulated, moved)}
    step = 2 * np.pi / 2400
    assert found["joint/2/position"][0] < step and found["joint/2/position"][
        1
    ] < 2 * step / np.sqrt(12)
    assert (
        found["link/2/tip_deflection"][0] < 2 * 0.3 * step
        and found["link/2/tip_deflection"][1] < 0.3 * step
    )


def test_a_simulation_stands_on_the_experiments_times_and_names_its_drive(forward):
    measured, _ = forward
    for by in ("commanded", "measured"):
        simulated = simulate_experiment(measured, by)
        np.testing.assert_allclose(simulated.t, measured.t, atol=1e-12)
        assert simulated.meta["driven_by"] == by and "(emulated)" in simulated.meta["simulates"]
        assert np.isfinite(
            simulated["link/2/tip_deflection"]
        ).all()  # dropouts of the experiment are none of the simulation


def test_set_points_are_followed_exactly(inverse):
    measured, _ = inverse
    simulated = simulate_experiment(measured, "reference")
    there = np.isfinite(measured["joint/2/reference"])
    np.testing.assert_allclose(
        simulated["joint/2/position"][there], measured["joint/2/reference"][there], atol=1e-7
    )


def test_the_robot_may_be_another(forward):
    measured, _ = forward
    soft = fx.Robot.from_dict(measured.meta["robot"]).replace({"link.2.young_modulus_Pa": 1e11})
    rows = {
        row.channel: row
        for row in compare(simulate_experiment(measured, robot=soft), measured).differences
    }
    own = {row.channel: row for row in compare(simulate_experiment(measured), measured).differences}
    assert rows["link/2/tip_deflection"].max > 5 * own["link/2/tip_deflection"].max


@pytest.mark.parametrize("pulse", [0.02, 0.2])
@pytest.mark.parametrize("prescribed", [False, True])
def test_the_relaxed_field_is_the_sine(pulse, prescribed):
    """Against the same torque as a Python function in the native solver; 0.2 rad at once lose
    steps. A carriage that nothing drives hardly moves; one that is told to stand goes by its force
    where steps are lost."""
    bench = load(RIG)
    spring = MagneticSpring(bench.rig.stepper)
    robot = bench.robot.replace(
        {"link.1.joint.viscous_friction": 1e3, "link.2.joint.viscous_friction": 2e-3}
    )
    system = fx.assemble(robot)
    t = np.linspace(0, 0.5, 101)
    pulses = continue_past_end(t, pulse * np.minimum(t / 0.02, 1.0))
    zero = fx.signals.constant(0.0)
    stands = JointDrive(force=zero, motion=zero, prescribed=True) if prescribed else zero
    found = stepper_relaxation.simulate_with_stepper(
        (system, system.start()), t, stands, pulses, spring, 1e-6
    )
    exact = fx.simulate(
        system, t, lambda at, q, qd, tip: [0.0, spring.torque(pulses(at)[0], float(q[1]), on=True)]
    )
    lost = abs(exact["joint/2/position"][-1] - pulse) > 0.03
    assert lost == (pulse > 0.1)
    assert (found.meta["relaxation_rounds"] is None) == lost
    tolerance = 1e-6 if lost else 1e-2 if prescribed else 2e-3
    for name in ("joint/2/position", "link/2/tip_deflection"):
        np.testing.assert_allclose(
            found[name], exact[name], atol=tolerance * np.abs(exact[name]).max()
        )


def test_a_constant_voltage_ends_at_the_lines_speed():
    """v = (a u - f) / b of `rig.plant.motor.joint_line`."""
    bench = load(RIG)
    line, dead = joint_line(motor_axes(bench.rig)[0]), bench.rig.driver.dead_zone_V
    t = np.arange(201) / 200.0
    still = np.zeros(len(t))
    measured = run(t, joint__1__position=still, joint__2__position=still, joint__2__pulses=still)
    channels, units = (
        measured.channels | {"joint/1/voltage": still + 6.0},
        measured.units | {"joint/1/voltage": "V"},
    )
    meta = {
        "robot": bench.robot.to_dict(),
        "rig": bench.rig.model_dump(mode="json"),
        "source": "experiment",
    }
    simulated = simulate_experiment(Run(t, channels, units, meta))
    speed = (line.force_per_V * (6.0 - dead) - line.coulomb) / line.viscous
    assert simulated["joint/1/velocity"][-1] == pytest.approx(speed, rel=1e-4)


# --- what is wrong is named


@pytest.mark.parametrize(
    "by, changes, words",
    [
        ("guess", {}, "by = 'guess': expected one of commanded, reference, measured"),
        ("commanded", {"rig": None}, "rig: missing: the run has no rig file"),
        ("commanded", {"rig": {"name": 3}}, "expected the rig file's tables"),
        ("measured", {"robot": None}, "robot: missing: the run has no robot file"),
        ("reference", {"experiment": "step"}, "no joint can follow the set-points of a step"),
    ],
)
def test_what_an_experiment_lacks_is_named(by, changes, words, forward):
    with pytest.raises(InputError, match=re.escape(words)):
        simulate_experiment(replace(forward[0], meta=forward[0].meta | changes), by)


@pytest.mark.parametrize("by", DRIVEN_BY)
def test_a_run_without_the_channels_is_named(by):
    with pytest.raises(InputError, match=f"by = '{by}': expected an experiment with joint/1/"):
        simulate_experiment(run([0, 1], tip__x=[0, 1]), by)


def test_a_rig_without_its_friction_is_told_what_is_missing(forward):
    """A real rig needs no [emulated]; its friction and play have tables of their own."""
    rig = forward[0].meta["rig"] | {"emulated": None}
    simulate_experiment(replace(forward[0], meta=forward[0].meta | {"rig": rig}))
    rig = rig | {"carriage": None}
    with pytest.raises(InputError, match=r"carriage: missing"):
        simulate_experiment(replace(forward[0], meta=forward[0].meta | {"rig": rig}))
