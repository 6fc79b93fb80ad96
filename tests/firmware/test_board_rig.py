"""The rig file: what it says, what follows from it, what is wrong with it."""

import dataclasses
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import flexura as fx
from flexlab import rig
from flexlab.board.emulator.emulated import Outputs
from flexlab.board.protocol.declaration import CONFIG
from flexlab.rig.configuration import tip_per_bend
from flexlab.rig.description import DERIVED_SETTINGS
from flexlab.rig.plant.rigid_plant import RigidPlant
from flexura.signals import harmonic

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "firmware" / "rig.toml"


@pytest.fixture(scope="module")
def bench():
    return rig.load(FILE)


@pytest.fixture
def written(tmp_path):
    """Writes the rig file with some values changed; the other files that it names are shipped
    ones."""

    def write(**changes):
        data = tomllib.loads(FILE.read_text(encoding="utf-8"))
        for path, value in changes.items():
            *parents, last = path.split("__")
            table = data
            for part in parents:
                table = table.setdefault(part, {})
            table[last] = value
        target = tmp_path / "rig.toml"
        target.write_text(tomli_w.dumps(data), encoding="utf-8")
        return target

    return write


def test_every_setting_of_the_board_has_a_value_in_range(bench):
    settings = rig.configuration(bench)
    assert list(settings) == list(CONFIG)
    assert all(
        CONFIG[name].least <= value <= CONFIG[name].greatest for name, value in settings.items()
    )
    assert set(DERIVED_SETTINGS) <= set(CONFIG) and not set(DERIVED_SETTINGS) & set(bench.rig.board)


def test_settings_that_follow_from_the_rig(bench):
    """16 pulses, 10:1 and 8 mm are 80 counts a millimetre; a full step is 1.8 degrees."""
    settings = rig.configuration(bench)
    assert settings["motor_counts_per_m"] == pytest.approx(80e3)
    assert 1 / settings["stepper_steps_per_rad"] == pytest.approx(math.radians(1.8) / 16)
    assert settings["stepper_counts_per_rad"] == pytest.approx(2400 / (2 * math.pi))
    assert (settings["position_min_1_m"], settings["position_max_1_m"]) == bench.robot.links[
        0
    ].joint.limits


def test_flex_chain(bench):
    """By hand: L = 0.3, s = 0.09525 from 2 mm on give 0.3774 m of tip for a radian, and 1.8 mm of
    tip for a count of 10 bits."""
    assert tip_per_bend(bench) == pytest.approx(0.3774, abs=5e-5)
    flex, fitted = bench.rig.flex, rig.calibration(bench)
    assert 1e3 * abs(fitted.c1_m) / 1024 == pytest.approx(1.8, abs=0.05)
    for tip in (-0.01, -0.002, 0.003, 0.012):
        ohms = flex.straight_ohm + flex.ohm_per_rad * tip / tip_per_bend(bench)
        x = flex.divider_ohm / (ohms + flex.divider_ohm) - fitted.zero
        assert fitted.c1_m * x + fitted.c2_m * x**2 + fitted.c3_m * x**3 == pytest.approx(
            tip, rel=1e-5
        )


def test_the_bench_can_follow_what_it_is_built_for(bench):
    checks = rig.check_capability(bench)
    assert len(checks) >= 12 and [c.what for c in checks if not c.passed] == []


def test_a_251_rpm_motor_is_too_slow_for_the_inverse_law(written):
    """75.4 mm/s = 565 rpm are needed, the 251 rpm motor makes 33 mm/s; its encoder at that speed
    would be too fast as well."""
    slow = rig.load(
        written(
            motor__no_load_speed_rpm=251.0, motor__gear_ratio=43.8, motor__stall_torque_N_m=1.765
        )
    )
    failed = {c.what: c for c in rig.check_capability(slow) if not c.passed}
    assert set(failed) == {"carriage speed", "encoder edges"}
    assert "75.4 mm/s = 565 rpm" in failed["carriage speed"].found
    assert "33.47 mm/s without" in failed["carriage speed"].expected


@pytest.mark.parametrize("table, key", [("carriage", None), ("motor", "rotor_inertia_kg_m2")])
def test_a_rig_file_without_what_only_the_emulator_needs_is_checked(table, key):
    shipped = rig.load("rig")
    data = shipped.rig.model_dump(exclude_none=True)
    if key:
        del data[table][key]
    else:
        del data[table]
    real = dataclasses.replace(shipped, rig=rig.Rig.model_validate(data))
    assert [check.what for check in rig.check_capability(real) if not check.passed] == []


@pytest.mark.parametrize(
    "change, failing",
    [
        ({"stepper__microsteps": 64}, {"step rate"}),
        ({"stepper__holding_torque_N_m": 0.1}, {"stepper torque"}),
        ({"stepper__limits_rad": [-0.5, 0.5]}, {"joint 2 range"}),
        ({"stepper__encoder_pulses": 20000}, {"encoder edges"}),
        (
            {"motor__stall_torque_N_m": 0.001},
            {"carriage force", "carriage speed", "motor 1 at rest"},
        ),
        ({"board__stall_voltage_V": 1.3}, {"motor 1 at rest"}),
        ({"driver__current_max_A": 2.0}, {"motor current"}),
        ({"board__speed_max_1_m_s": 0.07}, {"carriage speed limit"}),
        ({"board__rate_max_2_rad_s": 3.0}, {"joint 2 rate limit"}),
        ({"board__acceleration_max_2_rad_s2": 20.0}, {"joint 2 acceleration"}),
        ({"board__supply_max_V": 11.5}, {"supply"}),
        ({"board__flex_max": 0.6}, {"flex sensor at rest"}),
        ({"flex__calibration": {"zero": 0.6, "c1_m": -4.5}}, {"flex sensor's resolution"}),
    ],
)
def test_what_the_rig_cannot_do_is_found(written, change, failing):
    assert {
        c.what for c in rig.check_capability(rig.load(written(**change))) if not c.passed
    } == failing


def test_a_motion_beyond_the_carriage(bench):
    far = fx.Manoeuvre(
        "far", 4.0, 0.01, fx.Drive.pd([harmonic(0.06, 0.25), harmonic(0.1, 0.25)], [1, 1], [1, 1])
    )
    assert {c.what for c in rig.check_capability(bench, far) if not c.passed} == {"carriage range"}


@pytest.mark.parametrize(
    "change, key, value, expected",
    [
        ({"screw__lead_m": 8.0}, "screw.lead_m", 8.0, "at most 0.1 (0.008, not 8)"),
        ({"screw__pitch_m": 0.002}, "screw.pitch_m", 0.002, "an unknown key"),
        ({"stepper__microsteps": 12}, "stepper.microsteps", 12, "a power of two"),
        (
            {"stepper__limits_rad": [1.0, -1.0]},
            "stepper.limits_rad",
            [1.0, -1.0],
            "the lower limit first",
        ),
        ({"motor__encoder_pulses": 16.5}, "motor.encoder_pulses", 16.5, "a whole number"),
        ({"board__kp_1_V_mm": 1.0}, "board.kp_1_V_mm", 1.0, "did you mean kp_1_V_m?"),
        ({"board__kp_1_V_m": 1e9}, "board.kp_1_V_m", 1e9, "between -100000 and 100000"),
        ({"board__supply_V": 12.0}, "board.supply_V", 12.0, "follows from the other tables"),
        ({"emulated__sensor__nois_V": 0.1}, "emulated.sensor.nois_V", 0.1, "did you mean noise_V?"),
        (
            {"carriage__backlash_m": 0.15},
            "carriage.backlash_m",
            0.15,
            "in metres, from 0 to 0.01",
        ),
        (
            {"emulated__truth__stiffness": 0.0},
            "emulated.truth.stiffness",
            0.0,
            "above 0 and at most 10",
        ),
        (
            {"emulated__ranges__payload": [2.0, 1.0]},
            "emulated.ranges.payload",
            [2.0, 1.0],
            "the lower one first",
        ),
        (
            {"robot": str(ROOT / "model/robots/two-link-arm.toml")},
            "robot",
            None,
            "a robot of type IV",
        ),
    ],
)
def test_a_wrong_rig_file_is_refused_by_key_and_value(written, change, key, value, expected):
    path = written(**change)
    with pytest.raises(fx.InputError) as raised:
        rig.load(path)
    error = raised.value
    assert error.file == str(path) and error.key == key and expected in str(error)
    assert value is None or error.value == value


def test_a_rig_whose_settings_leave_the_boards_range(written):
    with pytest.raises(fx.InputError, match="motor_counts_per_m"):
        rig.configuration(rig.load(written(motor__encoder_pulses=10000)))


def test_the_drives_of_the_plant_keep_to_the_motors_data(bench):
    """At 12 V the motor's free speed, 1000 rpm of an 8 mm screw; nothing moves below the starting
    voltage."""
    plant = RigidPlant(bench)
    for _ in range(4000):
        plant.advance(250e-6, Outputs(duty=(1.0, 0.0), motor_on=(True, True)))
    assert plant.speeds[0] == pytest.approx(0.008 * 1000 / 60, rel=1e-6)
    still = RigidPlant(bench)
    for duty, on in ((0.07, True), (1.0, False)):
        assert still.advance(0.1, Outputs(duty=(duty, 0.0), motor_on=(on, on))).encoder_1 == 0.0
    np.testing.assert_allclose(
        still.advance(0.1, Outputs(steps=3200.0, stepper_on=True)).encoder_2, 2400
    )
