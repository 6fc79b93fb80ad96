"""Rigs of one joint and of two motors, other sensors, steppers without an encoder: the same binary,
emulated, from the rig file to the run and to what is identified from it."""

import dataclasses

import numpy as np
import pytest
from pydantic import ValidationError

import flexura as fx
from experiments import elf
from flexlab import rig as rigs
from flexlab.board.emulator.emulated import EmulatedBoard
from flexlab.comparison.measures import compare
from flexlab.comparison.replay.simulate_experiment import simulate_experiment
from flexlab.experiment import excitation, plan
from flexlab.experiment.run_experiment import Hooks, OpenBoard, conduct
from flexlab.identification.identify_rig import identify
from flexlab.recordings.strip_sensor import sensor_of
from flexlab.rig.nominal_robot import with_nominal_drives
from flexlab.rig.plant.motor import joint_line
from flexlab.rig.plant.plant import rig_plant
from flexura.errors import InputError
from flexura.signals import polynomial


def bench(name, **tables):
    """A shipped rig; `tables` take the place of its own, None leaves one out."""
    setup = rigs.load(name)
    data = setup.rig.model_dump(exclude_none=True)
    for key, value in tables.items():
        if value is None:
            data.pop(key, None)
        else:
            data[key] = value
    return dataclasses.replace(setup, rig=rigs.Rig.model_validate(data))


def ran(setup, asked, folder, seed=1):
    plant = rig_plant(setup, seed)
    opened = OpenBoard(EmulatedBoard(elf(), plant), seed, dict(plant.truth), plant)
    try:
        done = conduct(setup, asked, opened, folder, sensor_of(setup), Hooks())
    finally:
        opened.board.close()
    assert done.ended.complete, done.ended.text
    return done.run


def as_the_files_say(setup):
    """The plant without the factors by which the emulated one differs from its rig file."""
    same = setup.rig.emulated.model_copy(update={"truth": rigs.TrueParameters()})
    return dataclasses.replace(setup, rig=setup.rig.model_copy(update={"emulated": same}))


def settings(setup):
    return rigs.configuration(setup)


@pytest.mark.parametrize("name", ["rig-r", "rig-rr"])
def test_it_can_do_what_it_is_built_for(name):
    setup = rigs.load(name)
    assert [check.what for check in rigs.check_capability(setup) if not check.passed] == []
    assert not excitation.plan(setup, settings(setup)).failed


@pytest.mark.parametrize("name, link", [("rig-r", 1), ("rig-rr", 2)])
def test_a_motion_is_tracked_and_compares_as_the_rig_of_type_iv_does(name, link, tmp_path):
    """With the plant as its files say: joints within 1.5 %, the tip within noise and drift."""
    setup = as_the_files_say(rigs.load(name))
    run = ran(setup, plan.inverse(setup, settings(setup)), tmp_path / "run")
    joints = range(1, setup.rig.joints + 1)
    for n in joints:
        off = np.nanmax(np.abs(run[f"joint/{n}/reference"] - run[f"joint/{n}/position"]))
        assert off < 0.05 * np.ptp(run[f"joint/{n}/position"]), n
        assert run.units[f"joint/{n}/position"] == "rad" and f"joint/{n}/voltage" in run
    assert f"link/{link}/tip_deflection" in run and "tip/x" in run
    found = compare(simulate_experiment(run, "measured"), run)
    rows = {row.channel: row for row in found.differences}
    assert all(rows[f"joint/{n}/position"].max_relative < 0.015 for n in joints)
    count = 2.2 * abs(rigs.calibration(setup).c1_m) / 1024  # noise and drift are a count each
    assert rows[f"link/{link}/tip_deflection"].rms < count


@pytest.mark.parametrize("name", ["rig-r", pytest.param("rig-rr", marks=pytest.mark.slow)])
def test_the_voltages_alone_predict_the_joints(name, tmp_path):
    """Predicted to 2.5 %, by gears that lose half of the load; nothing of the run is fed back."""
    setup = as_the_files_say(rigs.load(name))
    run = ran(setup, plan.inverse(setup, settings(setup)), tmp_path / "run")
    simulation = simulate_experiment(run, "commanded")
    assert simulation.meta["gear_loss_rounds"]
    found = compare(simulation, run)
    assert all(row.rms_relative < 0.025 for row in found.differences if "joint" in row.channel)


# of the strip and its joints; those of the bearing are seen least. (Of rig-r's play the estimates
# of seeds 1 to 5, by two builds of the firmware, scatter by 11 %, RMS: its interval is tested.)
MOST = {"stiffness": 0.02, "payload": 0.02, "damping": 0.08, "sensor_gain": 0.01}
MOST |= {"bearing": 0.2, "coulomb": 0.05, "viscous": 0.02}
SEEDS = (1, 2, 3)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", ["rig-r", "rig-rr"])
def test_its_true_parameters_are_found_from_one_run(name, tmp_path):
    """By the RMS of three runs: what one finds of a rig of two motors scatters by as much as it is
    off, also from the true values on, where the same minimum is found."""
    setup = rigs.load(name)
    runs = [found_of_one_run(name, setup, seed, tmp_path / str(seed)) for seed in SEEDS]
    off = {key: float(np.sqrt(np.mean([run[key] ** 2 for run, _ in runs]))) for key in runs[0][0]}
    assert not {key: value for key, value in off.items() if value > MOST[key[1]]}
    assert all(play for _, play in runs)


def found_of_one_run(name, setup, seed, folder):
    """How far the estimates are off, by the joint (0: the strip) and the name; whether the interval
    of the play holds it, within its width."""
    run = ran(setup, excitation.plan(setup, settings(setup)), folder, seed)
    factors = run.meta["truth"]["factors"]
    known = {key: run.meta[key] for key in run.meta if key not in ("truth", "seed")}
    found = identify(dataclasses.replace(run, meta=known))
    true = factors | {"bearing": factors["friction"], "sensor_gain": factors["flex_gain"]}
    off = {(0, key): found.strip.values[key] / true[key] - 1 for key in MOST if key in true}
    for axis in found.nominal.axes:
        line, joint = joint_line(axis, factors["friction"], own=0.0), found.joints[axis.number]
        for key in ("coulomb", "viscous"):
            off[axis.number, key] = joint.values[key] / getattr(line, key) - 1
    print(name, seed, {key: f"{100 * value:.2f} %" for key, value in off.items()})
    assert len(off) == 5 + 2 * len(found.nominal.axes)
    low, high = found.strip.interval("backlash")
    return off, abs(true["backlash"] - (low + high) / 2) <= high - low < true["backlash"]


def test_a_stepper_without_an_encoder_is_where_its_pulses_are(tmp_path):
    stepper = rigs.load("rig").rig.stepper.model_dump(exclude_none=True)
    del stepper["encoder_pulses"]
    setup = bench("rig", stepper=stepper)
    run = ran(setup, plan.step(setup, settings(setup), (0.002, 0.05), 1.6), tmp_path / "run")
    np.testing.assert_array_equal(run["joint/2/position"], run["joint/2/pulses"])
    assert run["joint/2/position"][-1] == pytest.approx(0.05, abs=2e-3)


@pytest.mark.parametrize(
    "table, channel",
    [
        (None, ""),
        (
            {"strain_gauge": {"at_m": 0.02, "distance_m": 5e-4, "V_per_strain": 800.0}},
            "link/1/strain_gauge_voltage",
        ),
        ({"accelerometer": {"V_s2_per_m": 0.03}}, "sensor/accelerometer"),
    ],
)
def test_other_sensors_and_none(table, channel, tmp_path):
    setup = as_the_files_say(bench("rig-r", flex=None, **(table or {})))
    run = ran(setup, plan.free_vibration(setup, settings(setup), 0.2, 1.4), tmp_path / "run")
    deflects = "link/1/tip_deflection" in run
    assert deflects == bool(table and "strain_gauge" in table)
    assert not channel or channel in run
    if channel == "sensor/accelerometer":
        assert run.units[channel] == "m/s^2" and np.nanmax(np.abs(run[channel])) > 3.0
    if deflects:
        simulated = simulate_experiment(run, "measured")["link/1/tip_deflection"]
        off = run["link/1/tip_deflection"] - simulated
        assert np.nanstd(off) < 0.15 * np.ptp(simulated)


def test_a_flex_sensor_on_the_other_side_reads_the_other_way(tmp_path):
    """Its ohms fall where the other's rise; the calibration makes the same deflection of both."""
    runs = []
    for inverted in (False, True):
        flex = rigs.load("rig-r").rig.flex.model_dump(exclude_none=True)
        setup = bench("rig-r", flex=flex | {"inverted": inverted})
        asked = plan.free_vibration(setup, settings(setup), 0.2, 1.2)
        runs.append(ran(setup, asked, tmp_path / f"{inverted}"))
    rows = min(map(len, runs))
    volts = [run["link/1/flex_voltage"][:rows] for run in runs]
    assert np.corrcoef(*volts)[0, 1] < -0.9
    tips = [run["link/1/tip_deflection"][:rows] for run in runs]
    assert np.corrcoef(*tips)[0, 1] > 0.9


@pytest.mark.parametrize(
    "straight, slope, divider",
    [(24e3, 22918.0, 47e3), (37.3e3, 33550.0, 47e3), (25e3, 47746.0, 47e3), (10e3, 6366.0, 10e3)],
)
def test_flex_sensors_as_sold_are_taken_or_told_a_divider(straight, slope, divider):
    flex = rigs.load("rig").rig.flex.model_dump(exclude_none=True)
    sold = {"straight_ohm": straight, "ohm_per_rad": slope, "divider_ohm": divider}
    for ohm in (divider, 1000.0):
        setup = bench("rig", flex=flex | sold | {"divider_ohm": ohm})
        try:
            settings(setup)
        except InputError as error:
            named = float(error.expected.rpartition("divider_ohm = ")[2].split()[0])
            settings(bench("rig", flex=flex | sold | {"divider_ohm": named}))


def test_the_rigs_are_found_by_name_and_their_robots_too():
    for name in ("rig", "rig-r", "rig-rr"):
        assert rigs.load(name).robot == fx.load(name)
    with pytest.raises(ValidationError, match="one drive of joint 2"):
        bench("rig", motor_2=rigs.load("rig-rr").rig.motor_2.model_dump(exclude_none=True))


END_RAD, BEGIN_S, ROW_S = 0.8, 0.1, 0.004


def amplitude(run, begin):
    """The largest amplitude [m] about the first frequency in a second after the motion."""
    w = run["link/1/tip_deflection"]
    there = (run.t > begin + 0.1) & (run.t < begin + 1.1) & np.isfinite(w)
    t, found = run.t[there], []
    for f in np.arange(2.5, 3.8, 0.05):
        wave = 2 * np.pi * f * t
        basis = np.column_stack([np.cos(wave), np.sin(wave), np.ones_like(t), t])
        found.append(np.hypot(*np.linalg.lstsq(basis, w[there], rcond=None)[0][:2]))
    return max(found)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_robust_motion_leaves_less_than_a_count_of_the_sensor(tmp_path):
    setup = rigs.load("rig-r")
    data = with_nominal_drives(setup.robot, setup)[0].to_dict()
    data["link"][0]["joint"].pop("coulomb_friction_N_m", None)
    robot = fx.Robot.from_dict(data)
    limits = {"drive": [0.5], "speed": [5.0]}
    run = fx.time_optimal(robot, [0.0], [END_RAD], limits, robust=0.1, intervals=80)
    t = np.arange(0.0, 2.3, ROW_S)
    after = fx.feedforward(run, kp=15.0, kd=1.5).drive  # the joint stays where it is
    held = fx.simulate(robot, t, after, rtol=1e-8)["joint/1/position"]
    shifted = np.concatenate([np.zeros(round(BEGIN_S / ROW_S)), held])[: len(t)]
    left = {}
    for name, drive in (
        ("least", fx.Drive.pd([shifted], [1], [0], t_s=t)),
        ("smooth", fx.Drive.pd([polynomial(END_RAD, run.t[-1], at_s=BEGIN_S)], [1], [0])),
    ):
        asked = plan.inverse(setup, settings(setup), fx.Manoeuvre(name, 2.25, 0.005, drive))
        left[name] = amplitude(ran(setup, asked, tmp_path / name), BEGIN_S + run.t[-1])
    count = abs(rigs.calibration(setup).c1_m) / 1024
    print(f"left {left} m, a count is {count} m")
    assert left["least"] < count < 0.25 * left["smooth"]
