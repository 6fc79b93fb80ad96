"""The gains file of a PID."""

from __future__ import annotations

import pytest

import flexura as fx
from flexura import signals
from flexura.control import gains

FILE = """
[controller]
kp_1_V_m = 2000.0
ki_1_V_m_s = 4000
voltage_max_V = 12.0
kp_2_1_s = 20.0
kg_2_rad_m = -1.5
kd_2 = 0.1
rate_max_2_rad_s = 6.0
setpoint_2_Hz = 2.0
derivative_Hz = 40.0

[[output]]
kind = "motor"
force_per_V = 13.1
damping = 1180.0
"""


def test_a_gains_file_is_the_controller_that_it_names(tmp_path):
    path = tmp_path / "gains.toml"
    path.write_text(FILE)
    read = gains.load(path)
    one, two = read.controller([signals.step(0.1), signals.step(0.7)]).joints
    assert (one.kp, one.ki, one.limit, one.derivative_Hz) == (
        2000,
        4000,
        12,
        40,
    ) and one.output == fx.Motor(13.1, 1180.0)
    assert (two.kp, two.kg, two.kd, two.limit, two.setpoint_Hz) == (
        20,
        -1.5,
        0.1,
        6,
        2,
    ) and two.output == fx.Stepper()
    assert two.delay_s == 1e-3 and one.delay_s == 0.0
    read.write(tmp_path / "again.toml")
    again = gains.load(tmp_path / "again.toml")
    assert again.settings == read.settings and again.outputs == read.outputs
    assert read.board()["kp_1_V_m"] == 2000 and "rate_Hz" not in read.board()


@pytest.mark.parametrize(
    "old, new, key",
    [
        ("kp_1_V_m = 2000.0", "kp_1_V = 2000.0", "controller.kp_1_V"),
        ("kp_1_V_m = 2000.0", "kp_1_V_m = nan", "controller.kp_1_V_m"),
        ("kp_1_V_m = 2000.0", "kp_1_N_m = 2000.0", "controller"),
        ("voltage_max_V = 12.0", "voltage_max_V = -12.0", "controller.voltage_max_V"),
        ("setpoint_2_Hz = 2.0", "setpoint_2_Hz = -2.0", "controller.setpoint_2_Hz"),
        ("derivative_Hz = 40.0", "derivative_Hz = -40.0", "controller.derivative_Hz"),
        ("derivative_Hz = 40.0", "rate_Hz = 0.0", "controller.rate_Hz"),
        ("derivative_Hz = 40.0", "kp_4_1_s = 1.0", "controller"),
        ('kind = "motor"', 'kind = "steam"', "output[1].kind"),
        ("force_per_V = 13.1", "", "output[1]"),
        ("damping = 1180.0", "damping = -1.0", "output[1].damping"),
        ("[controller]", "[control]", "control"),
        ("kd_2 = 0.1", "feedback_2 = 7", "controller.feedback_2"),
        ("kd_2 = 0.1", "delay_2_s = 0.0012", "controller.delay_2_s"),
        ("kd_2 = 0.1", "voltage_max_1_V = 5.0", "controller.voltage_max_1_V"),
        (
            'kind = "motor"\nforce_per_V = 13.1\ndamping = 1180.0',
            'kind = "force"',
            "output[1].kind",
        ),
        ("[[output]]", '[[output]]\nkind = "stepper"\n' * 2 + "[[output]]", "output"),
    ],
)
def test_a_wrong_gains_file_is_refused_by_key(tmp_path, old, new, key):
    path = tmp_path / "gains.toml"
    assert old in FILE
    path.write_text(FILE.replace(old, new))
    with pytest.raises(fx.InputError) as caught:
        gains.load(path)
    assert caught.value.key == key and caught.value.file == str(path)


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("kp_1_V_m", "kp_1", "did you mean kp_1_V_m?"),
        ("ki_1_V_m_s", "ki_1", "did you mean ki_1_V_m_s?"),
        ("kp_2_1_s", "kp_2", "did you mean kp_2_1_s?"),
        ("kd_2 ", "kdd_2 ", "did you mean kd_2?"),
    ],
)
def test_a_name_is_suggested_that_fits_its_joint(tmp_path, old, new, said):
    path = tmp_path / "gains.toml"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(fx.InputError, match="unknown setting") as caught:
        gains.load(path)
    assert said in str(caught.value)


def test_units_of_the_other_kind_of_joint_are_refused(tmp_path):
    path = tmp_path / "gains.toml"
    path.write_text(FILE)
    gains.load(path).check_joints([False, True])
    with pytest.raises(fx.InputError, match="a joint that turns") as caught:
        gains.load(path).check_joints([True, True])
    assert caught.value.key == "controller.kp_1_V_m" and caught.value.file == str(path)


def test_what_the_board_has_not_is_not_sent_to_it():
    with pytest.raises(fx.InputError, match="the board has too"):
        gains.Gains({"kp_1_V_m": 1.0, "ks_1_V_rad": 2.0, "kp_2_1_s": 1.0}).board()
