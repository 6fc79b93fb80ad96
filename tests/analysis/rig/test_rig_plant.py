"""The emulated rig's plant: each part against what its data or the theory say, all of them together
as a rig."""

import ast
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import flexura as fx
from flexlab import rig
from flexlab.board.emulator.emulated import Outputs
from flexlab.rig.axes import motor_axes
from flexlab.rig.emulation import FACTORS, Ranges, TrueParameters, random_true_parameters
from flexlab.rig.plant.mechanics import STEP_S, Mechanics
from flexlab.rig.plant.motor import DCMotor, back_driven_efficiency, joint_line, motor_data
from flexlab.rig.plant.plant import rig_plant, true_robot
from flexura.errors import InputError

ROOT = Path(__file__).resolve().parents[3]
BENCH = rig.load(ROOT / "firmware" / "rig.toml")
AXIS = motor_axes(BENCH.rig)[0]
DATA = motor_data(AXIS)
SAME = TrueParameters()
STIFF = 1e9, 0.0
QUIET = {"emulated__sensor__noise_V": 0.0, "emulated__sensor__drift_V": 0.0}


def run(plant, seconds, outputs, window=STEP_S):
    """Advance a plant; `outputs(t)` gives duty and steps. Returns t, carriage, nut, joint, tip
    deflection."""
    rows = np.empty((round(seconds / window), 5))
    out = Outputs(motor_on=(True, True), stepper_on=True)
    for k in range(len(rows)):
        duty, out.steps = outputs(k * window)
        out.duty = duty, 0.0
        plant.advance(window, out)
        rows[k] = (
            (k + 1) * window,
            plant.positions[0],
            plant.motor.shaft,
            plant.positions[1],
            plant.tip_deflection_m,
        )
    return rows.T


def vibration(t, y, guess):
    """Frequency [Hz] and decay rate [1/s] of a decaying oscillation about a constant, by least
    squares."""

    def residual(p):
        return p[0] * np.exp(-p[3] * t) * np.sin(2 * math.pi * p[2] * t + p[1]) + p[4] - y

    size = np.ptp(y) / 2
    begin = [[size, phase, guess, 0.1, y.mean()] for phase in range(0, 6, 2)]
    fits = [least_squares(residual, each, x_scale=[size, 1, 1, 1, size]) for each in begin]
    return min(fits, key=lambda fit: fit.cost).x[2:4]


# ---- mechanics


def test_the_held_strip_vibrates_and_decays_as_the_model_says():
    """Clamped: the first frequency of the native model's mesh of 12 elements; decay beta omega^2 /
    2."""
    mechanics = Mechanics(BENCH.robot)
    mechanics.hold(0, *STIFF)
    mechanics.hold(1, 2e4, 0.0)
    for k in range(60):
        mechanics.step(0.0, 0.03 * (k + 1) / 60)
    deflection = np.empty(4000)
    for k in range(len(deflection)):
        mechanics.step(0.0, 0.03)
        deflection[k] = mechanics.tip_deflection_m
    t = np.arange(len(deflection)) * mechanics.step_s
    frequency, decay = vibration(t[600:], deflection[600:], 5.0)
    exact = fx.frequencies(
        fx.assemble(BENCH.robot.replace({"link.2.elements": 12})), joints="locked"
    )[0]
    assert frequency == pytest.approx(exact, rel=2e-3)
    assert decay == pytest.approx(0.5 * 2e-4 * (2 * math.pi * exact) ** 2, rel=0.02)


def test_energy_of_what_nothing_drives_or_damps_stays():
    """Thrown: carriage and strip turn and vibrate freely. The scheme damps what it does not
    resolve, and adds nothing."""
    mechanics = Mechanics(BENCH.robot.replace({"link.2.damping.beta_s": 0.0}))
    mechanics.hold(0, 1e3, 0.0)
    mechanics.hold(1, 2.0, 0.0)
    for k in range(round(0.05 / STEP_S)):
        mechanics.step(0.2 * STEP_S * k, 4.0 * STEP_S * k)
    mechanics.hold(0, 0.0, 0.0)
    mechanics.hold(1, 0.0, 0.0)
    energy = []
    for _ in range(round(1.0 / STEP_S)):
        mechanics.step(0.0, 0.0)
        energy.append(mechanics.energy_J)
    energy = np.array(energy[round(0.05 / STEP_S) :])
    assert abs(mechanics.positions[1]) > 1.0  # it did turn
    assert energy.max() <= energy[0] * (1 + 2e-3) and energy[-1] > 0.98 * energy[0]


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_the_sensor_integrates_the_slope_of_a_loaded_cantilever(angle):
    """w'(s) = P (L s - s^2/2) / EI + q (3 L^2 s - 3 L s^2 + s^3) / (6 EI), weight of payload and
    strip across the strip."""
    weight, (first, last) = 3.0, (0.002, 0.09725)
    gravity = [weight * math.sin(angle), -weight * math.cos(angle)]
    robot = BENCH.robot.replace({"gravity_m_s2": gravity, "link.2.damping.beta_s": 0.05})
    mechanics = Mechanics(robot, (0.0, angle), sensor_m=(first, last))
    mechanics.hold(0, *STIFF)
    mechanics.hold(1, 2e4, 0.0)
    for _ in range(3000):
        mechanics.step(0.0, angle)
    strip = robot.links[1]
    length, ei = strip.length_m, float(strip.bending_stiffness(np.zeros(1))[0])
    p, q = weight * robot.payload.mass_kg, weight * float(strip.mass_per_length(np.zeros(1))[0])

    def slope(s):
        return (
            -(p * (length * s - s**2 / 2) + q * (3 * length**2 * s - 3 * length * s**2 + s**3) / 6)
            / ei
        )

    assert mechanics.bend_rad == pytest.approx(slope(last) - slope(first), rel=3e-3)
    assert mechanics.tip_deflection_m == pytest.approx(
        -(p / 3 + q * length / 8) * length**3 / ei, rel=3e-3
    )


def test_a_plant_knows_nothing_of_the_native_solver():
    """The emulated rig and the twin's modules that it uses import none of the solver."""
    native = ("core", "link", "system", "control", "simulation", "population", "api")
    folders = [ROOT / "analysis/flexlab/rig/plant", ROOT / "model/flexura/twin"]
    for path in [p for folder in folders for p in folder.rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                parts = (node.module or "").split(".") + [a.name for a in node.names]
                assert not set(native) & set(parts), (path.name, ast.unparse(node))


# ---- motor and screw


@pytest.mark.parametrize("part", [0.0, 0.25, 0.5, 0.9])
def test_the_motor_is_on_the_line_of_its_data_sheet(part):
    """n = n0 (1 - M / M_stall), I = I0 + (I_stall - I0) M / M_stall, the gear's losses in it."""
    motor, sheet = DCMotor(DATA), BENCH.rig.motor
    load = part * sheet.stall_torque_N_m
    for _ in range(2000):
        motor.advance(5e-4, sheet.rated_voltage_V, load)
    assert motor.speed_rad_s * 30 / math.pi == pytest.approx(
        sheet.no_load_speed_rpm * (1 - part), rel=1e-3
    )
    expected = sheet.no_load_current_A + part * (sheet.stall_current_A - sheet.no_load_current_A)
    assert motor.current_A == pytest.approx(expected, rel=1e-3)


def test_the_blocked_motor_takes_its_stall_current_with_the_coil_s_time_constant():
    motor = DCMotor(dataclasses.replace(DATA, inertia_kg_m2=1e6))
    motor.advance(1e-3, 12.0)
    assert motor.current_A == pytest.approx(
        7.0 * (1 - math.exp(-1e-3 * DATA.resistance_ohm / DATA.inductance_H)), rel=1e-6
    )
    for _ in range(20):
        motor.advance(1e-3, 12.0)
    assert motor.current_A == pytest.approx(7.0, rel=1e-6)


def test_the_motor_starts_at_its_voltage_and_the_friction_of_the_truth_moves_it():
    starts = BENCH.rig.motor.starts_at_V
    for factor in (1.0, 1.3):
        for volts, turns in ((0.98 * factor * starts, False), (1.03 * factor * starts, True)):
            motor = DCMotor(DATA, friction=factor)
            for _ in range(100):
                motor.advance(1e-3, volts)
            assert (motor.angle_rad != 0) == turns


def test_a_motor_without_voltage_coasts_and_a_shorted_one_brakes():
    turned = []
    for volts in (None, 0.0):
        motor = DCMotor(DATA)
        motor.speed_rad_s = 50.0
        for _ in range(2000):
            motor.advance(1e-3, volts)
        assert motor.speed_rad_s == 0.0
        turned.append(motor.angle_rad)
    assert turned[0] == pytest.approx(
        0.5 * 50.0**2 * DATA.inertia_kg_m2 / DATA.friction_N_m, rel=0.01
    )  # J w^2 / 2 = T phi
    assert turned[1] < 0.5 * turned[0]


@pytest.mark.parametrize("efficiency", [0.6, 0.9])
def test_a_load_costs_the_motor_more_than_it_gives_back(efficiency):
    """Lifting takes the current (T_f + M / eta) / K, lowering (-T_f + M eta') / K; a self-locking
    screw turns for no load."""
    load = 0.02
    currents = []
    for volts in (6.0, -6.0):
        motor = DCMotor(DATA, screw_efficiency=efficiency)
        for _ in range(2000):
            motor.advance(5e-4, volts, load)
        currents.append(motor.current_A)
    gear = DATA.gear_efficiency
    both = (
        load
        * (
            1 / (gear * efficiency)
            + back_driven_efficiency(gear) * back_driven_efficiency(efficiency)
        )
        / DATA.constant_N_m_A
    )
    assert currents[0] + currents[1] == pytest.approx(both, rel=2e-3)
    assert back_driven_efficiency(0.5) == 0.0 and back_driven_efficiency(1.0) == 1.0
    locked = DCMotor(DATA, screw_efficiency=0.5)
    locked.advance(0.1, None, 100.0)
    assert locked.angle_rad == 0.0


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_the_carriage_lags_by_the_play(factor):
    """Slowly up and down: the carriage minus the nut differs, between the ways, by the play and
    twice the nut's give F / k."""
    emulated = BENCH.rig.carriage
    plant = rig_plant(BENCH, truth=TrueParameters(backlash=factor), **QUIET)
    _, carriage, nut, _, _ = run(plant, 4.0, lambda t: (0.25 if t < 2.0 else -0.25, 0))
    up, down = (carriage - nut)[round(1.75 / STEP_S)], (carriage - nut)[round(3.75 / STEP_S)]
    force = emulated.coulomb_friction_N + emulated.viscous_friction_N_s_m * 0.015
    expected = factor * emulated.backlash_m + 2 * force / emulated.contact_stiffness_N_m
    assert down - up == pytest.approx(expected, rel=0.02)
    assert nut[round(1.9 / STEP_S)] - nut[0] > 0.02  # it did move


def test_the_line_of_joint_1_is_what_the_plant_does():
    """Steady speed at a voltage, by force = viscous v + coulomb, with the bridge's dead zone
    beside."""
    line = joint_line(AXIS)
    plant = rig_plant(BENCH, truth=SAME, **QUIET)
    _, _, nut, _, _ = run(plant, 1.0, lambda t: (0.5, 0))
    speed = (nut[-1] - nut[-401]) / (400 * STEP_S)
    volts = 6.0 - BENCH.rig.driver.dead_zone_V
    assert speed == pytest.approx(
        (line.force_per_V * volts - line.coulomb) / line.viscous, rel=2e-3
    )


# ---- stepper


def heavy(inertia):
    """The bench with a flywheel on joint 2 and a stiff, light strip."""
    changes = {
        "link.2.joint.hub_inertia_kg_m2": inertia,
        "link.2.section": {"width_m": 0.02, "height_m": 0.004},
        "link.2.density_kg_m3": 800.0,
        "payload.mass_kg": 0.0,
    }
    return dataclasses.replace(BENCH, robot=BENCH.robot.replace(changes))


def test_the_stepper_swings_about_its_step_with_its_magnetic_spring():
    """omega^2 = (N T_h + 4 N T_d) / J for small swings about a full step."""
    bench = heavy(0.02)
    plant = rig_plant(bench, truth=SAME, stepper__damping_N_m_s=0.0, **QUIET)
    stepper, strip = bench.rig.stepper, bench.robot.links[1]
    command = stepper.microsteps  # one full step
    t, _, _, joint, _ = run(plant, 1.5, lambda t: (0, command * min(1.0, t / 0.2)))
    mass = float(strip.mass_per_length(np.zeros(1))[0]) * strip.length_m
    inertia = 0.02 + strip.joint.rotor_inertia + mass * strip.length_m**2 / 3
    n = stepper.full_steps_per_turn / 4
    expected = math.sqrt(
        n * (stepper.holding_torque_N_m + 4 * bench.rig.stepper.detent_torque_N_m) / inertia
    )
    swing = joint[t > 0.25]
    assert np.ptp(swing) < 0.01
    frequency, _ = vibration(t[t > 0.25], swing, expected / (2 * math.pi))
    assert 2 * math.pi * frequency == pytest.approx(expected, rel=0.01)


def test_an_overloaded_stepper_loses_steps_by_fours_and_a_spared_one_none():
    bench = heavy(0.02)
    steps = 832  # 13 x 4 full steps: a rotor that stays behind rests in a minimum of its spring
    after = {}

    def smooth(s):
        return round(steps * min(1.0, s) ** 2 * (3 - 2 * min(1.0, s)))

    for ramp in (
        2.0,
        0.1,
    ):  # 2.4 rad/s^2 at most is 0.05 N m; 20 times as fast is beyond the holding torque
        plant = rig_plant(bench, truth=SAME, stepper__damping_N_m_s=0.05, **QUIET)
        _, _, _, joint, _ = run(plant, ramp + 3.0, lambda t, ramp=ramp: (0, smooth(t / ramp)))
        after[ramp] = (steps * plant.stepper.field.rad_per_step - joint[-1]) / (
            4 * math.radians(1.8)
        )
    assert after[2.0] == pytest.approx(0.0, abs=0.01)
    assert abs(after[0.1]) > 0.9 and after[0.1] == pytest.approx(round(after[0.1]), abs=0.02)


def test_a_stepper_without_current_lets_the_joint_go():
    plant = rig_plant(BENCH, truth=SAME, start=(0.0, 0.01), stepper__detent_torque_N_m=0.0, **QUIET)
    out = Outputs(stepper_on=False)
    plant.mechanics.hold(1, 1.0, 0.0)
    plant.mechanics.step(0.0, 0.3)
    for _ in range(2000):
        plant.advance(STEP_S, out)
    assert abs(plant.positions[1] - 0.01) > 0.001


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
