"""The emulated rig's plant as a whole, with its sensor and its true parameters."""

import dataclasses
import math

import numpy as np
import pytest

import flexura as fx
from flexlab.board.emulator.emulated import Outputs
from flexlab.rig.emulation import FACTORS, Ranges, TrueParameters, random_true_parameters
from flexlab.rig.plant.mechanics import STEP_S
from flexlab.rig.plant.motor import joint_line
from flexlab.rig.plant.plant import rig_plant, true_robot
from flexura.errors import InputError
from plants import AXIS, BENCH, QUIET, SAME, run

# ---- sensor


def test_the_flex_sensor_divides_the_supply_by_its_bend():
    plant = rig_plant(BENCH, truth=TrueParameters(flex_gain=0.9), **QUIET)
    flex = BENCH.rig.flex
    for bend in (-0.03, 0.0, 0.02):
        volts = plant.sensor.voltage(bend)
        ohms = flex.divider_ohm * (5.0 / volts - 1.0)
        assert ohms == pytest.approx(
            flex.straight_ohm + 0.9 * flex.ohm_per_rad * bend * (1 + flex.nonlinearity_1_rad * bend)
        )


def test_noise_and_drift_are_as_large_and_as_slow_as_the_file_says():
    flex = rig_plant(
        BENCH,
        seed=5,
        emulated__sensor__noise_V=0.0,
        emulated__sensor__drift_V=0.01,
        emulated__sensor__drift_s=0.05,
    ).sensor
    drift = np.array([flex.sample(0.0) for _ in range(400_000)]) - flex.voltage(0.0)
    assert drift.std() == pytest.approx(0.01, rel=0.1)
    assert np.mean(drift[100:] * drift[:-100]) / drift.var() == pytest.approx(
        math.exp(-100 * STEP_S / 0.05), abs=0.06
    )
    flex = rig_plant(
        BENCH, seed=5, emulated__sensor__noise_V=0.004, emulated__sensor__drift_V=0.0
    ).sensor
    noise = np.array([flex.sample(0.0) for _ in range(20_000)]) - flex.voltage(0.0)
    assert (
        noise.std() == pytest.approx(0.004, rel=0.03)
        and abs(np.mean(noise[1:] * noise[:-1])) < 0.03 * noise.var()
    )


# ---- the whole


def profile(t):
    """Both joints back and forth once a second, open-loop."""
    return 0.5 * math.sin(2 * math.pi * t), round(200 * (1 - math.cos(2 * math.pi * t)))


def test_coarse_steps_do_what_fine_ones_do():
    """The same drives, held for a step, on steps a fifth as long with 8 elements: 0.5 % of the
    peak, rms; joints 0.1 %."""
    plant = rig_plant(BENCH, **QUIET)
    rough = run(plant, 1.0, profile)
    fine = rig_plant(BENCH, step_s=STEP_S / 5, elements=8, **QUIET)
    exact = run(
        fine, 1.0, lambda t: profile(STEP_S * math.floor(t / STEP_S + 1e-6)), window=STEP_S / 5
    )[:, 4::5]
    for k, most in ((1, 1e-3), (2, 1e-3), (3, 1e-3), (4, 5e-3)):
        error = math.sqrt(np.mean((rough[k] - exact[k]) ** 2))
        assert error < most * np.ptp(exact[k]) / 2


def test_each_pulse_acts_when_it_comes():
    """A law's 520 microsteps as means over steps of 0.5 ms, against 0.05 ms and 8 elements: the tip
    (5 mm, ripple and all) is the same to 1.2 % rms. Counted at the steps' ends instead it would be
    1.6 %, and 2.5 % if they came a step late."""
    at = np.arange(100_000) * 1e-5
    given = np.round(130 * (1 - np.cos(2 * math.pi * at)))
    seen = []
    for step, elements in ((STEP_S, 3), (STEP_S / 10, 8)):
        plant = rig_plant(BENCH, truth=SAME, step_s=step, elements=elements, **QUIET)
        means = given.reshape(-1, round(step / 1e-5)).mean(axis=1)
        seen.append(
            run(
                plant,
                1.0,
                lambda t, means=means, step=step: (0.0, means[round(t / step)]),
                window=step,
            )
        )
    rough, fine = seen[0], seen[1][:, 9::10]
    for k, most in ((3, 6e-4), (4, 1.2e-2)):
        assert np.std(rough[k] - fine[k]) < most * np.abs(fine[k]).max()


def test_encoders_are_drawn_on_by_a_step():
    """After each step they say where the shafts are a step later: the motor's to a hundredth of a
    count, the joint's to what the microsteps' ripple makes of it; half a second later they stand
    there."""
    plant, out = rig_plant(BENCH, **QUIET), Outputs(motor_on=(True, True), stepper_on=True)
    told, true = [], []
    for k in range(3000):
        t = k * STEP_S
        duty, out.steps = profile(t) if t < 1.0 else (0.0, 0.0)
        out.duty = duty, 0.0
        sensors = plant.advance(STEP_S, out)
        told.append((sensors.encoder_1, sensors.encoder_2))
        true.append((plant.motor.shaft / 0.008 * 640, plant.positions[1] / (2 * math.pi) * 2400))
    ahead = np.abs(np.array(told[:-1]) - np.array(true[1:]))
    assert (ahead.max(axis=0) < (0.02, 0.4)).all() and (ahead.mean(axis=0) < (0.01, 0.1)).all()
    assert np.ptp(np.array(true), axis=0).min() > 100 and (ahead[-1] < (1e-9, 1e-3)).all()


def test_windows_shorter_than_a_step_change_nothing_but_the_time_between():
    one, two = rig_plant(BENCH, seed=1), rig_plant(BENCH, seed=1)
    out = Outputs(duty=(0.4, 0.0), motor_on=(True, True), stepper_on=True)
    for _ in range(200):
        a = dataclasses.replace(one.advance(STEP_S, out))
        half = dataclasses.replace(two.advance(STEP_S / 2, out))
        b = two.advance(STEP_S / 2, out)
        assert (a.encoder_1, a.encoder_2, a.flex_V) == pytest.approx(
            (b.encoder_1, b.encoder_2, b.flex_V), rel=1e-12, abs=1e-12
        )
        assert half.encoder_1 <= b.encoder_1
    assert one.positions[0] == two.positions[0] > 0


def test_the_same_seed_is_the_same_rig_and_another_one_is_not():
    def readings(seed):
        plant, out = (
            rig_plant(BENCH, seed),
            Outputs(duty=(0.3, 0.0), motor_on=(True, True), stepper_on=True),
        )
        return [plant.advance(STEP_S, out).flex_V for _ in range(50)]

    assert readings(1) == readings(1) != readings(2)


def test_the_truth_is_told_and_is_in_the_robot():
    truth = TrueParameters(
        stiffness=0.9, damping=1.5, payload=1.2, friction=1.1, backlash=0.8, flex_gain=0.95
    )
    plant = rig_plant(BENCH, seed=3, truth=truth)
    told = plant.truth
    assert (
        told["factors"] == truth.model_dump()
        and list(told["factors"]) == list(FACTORS)
        and told["seed"] == 3
    )
    robot = fx.Robot.from_dict(told["robot"])
    nominal = BENCH.robot
    ratio = robot.links[1].bending_stiffness(np.zeros(1)) / nominal.links[1].bending_stiffness(
        np.zeros(1)
    )
    assert ratio == pytest.approx(0.9)
    assert robot.links[1].damping.beta_s == pytest.approx(1.5 * nominal.links[1].damping.beta_s)
    assert (
        told["payload_kg"] == pytest.approx(1.2 * nominal.payload.mass_kg) == robot.payload.mass_kg
    )
    assert told["joint_1"]["coulomb_N"] == pytest.approx(1.1 * joint_line(AXIS).coulomb)
    given = {
        "mass_per_length_kg_m": 0.157,
        "bending_stiffness_N_m2": [{"at_m": 0.0, "value": 0.3}, {"at_m": 0.3, "value": 0.2}],
    }
    data = nominal.to_dict()
    for key in ("section", "young_modulus_Pa", "density_kg_m3"):
        del data["link"][1][key]
    data["link"][1] |= given
    bent = (
        true_robot(fx.Robot.from_dict(data), truth).links[1].bending_stiffness(np.array([0.0, 0.3]))
    )
    assert bent == pytest.approx([0.27, 0.18])


def test_random_truths_lie_in_their_ranges_and_follow_their_seed():
    ranges = Ranges(stiffness=(0.5, 0.6))
    drawn = [random_true_parameters(seed, ranges) for seed in range(50)]
    for name in FACTORS:
        low, high = getattr(ranges, name)
        values = [getattr(truth, name) for truth in drawn]
        assert low <= min(values) < max(values) <= high and np.ptp(values) > 0.7 * (high - low)
    assert random_true_parameters(4, ranges) == drawn[4] != drawn[5]


@pytest.mark.parametrize(
    "change, key",
    [({"emulated__sensor__nois_V": 0.0}, "emulated.sensor.nois_V"), ({"noise_V": 0.0}, "noise_V")],
)
def test_what_is_not_in_the_table_cannot_differ(change, key):
    with pytest.raises(InputError) as caught:
        rig_plant(BENCH, **change)
    assert caught.value.key == key


def test_a_value_that_cannot_be_is_refused_with_its_key():
    with pytest.raises(InputError, match=r"backlash_m.*from 0 to 0\.01"):
        rig_plant(BENCH, carriage__backlash_m=-1.0)


@pytest.mark.parametrize(
    "table, change, key",
    [
        ("motor", {"no_load_current_A": 7.5}, "motor.no_load_current_A"),
        ("motor", {"stall_torque_N_m": 0.8}, "motor.stall_torque_N_m"),
    ],
)
def test_data_that_contradict_each_other_are_refused(table, change, key):
    part = getattr(BENCH.rig, table).model_copy(update=change)
    bench = dataclasses.replace(BENCH, rig=BENCH.rig.model_copy(update={table: part}))
    with pytest.raises(InputError) as caught:
        rig_plant(bench)
    assert caught.value.key == key and caught.value.value is not None


def test_a_rig_file_without_friction_has_no_plant_and_one_without_noise_is_quiet():
    bench = dataclasses.replace(BENCH, rig=BENCH.rig.model_copy(update={"carriage": None}))
    with pytest.raises(InputError, match=r"carriage: missing"):
        rig_plant(bench)
    bench = dataclasses.replace(BENCH, rig=BENCH.rig.model_copy(update={"emulated": None}))
    plant = rig_plant(bench)
    volts = {plant.advance(STEP_S, Outputs()).flex_V for _ in range(5)}
    assert len(volts) == 1
