"""What of a controller is free, and within which bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexlab.tuning import search_space as freedom
from flexlab.tuning.closed_loop import closed_loop_controller
from flexlab.tuning.search_space import free_gain
from flexura.control import gains
from flexura.errors import InputError
from tunings import FREE, GAINS, ROBOT, SWING, task


def test_places_and_values_of_free_settings():
    gain, through = free_gain("kp_1_V_m", 10, 1000), free_gain("kg_2_rad_m", -2, 2)
    assert (gain.scale, through.scale) == ("log", "linear")
    assert gain.from_unit_interval(np.array([0, 0.5, 1])) == pytest.approx(
        [10, 100, 1000]
    ) and through.from_unit_interval(np.array([0.25])) == [-1.0]
    assert (
        gain.to_unit_interval(100) == pytest.approx(0.5)
        and gain.to_unit_interval(1e9) == 1.0
        and through.to_unit_interval(1) == 0.75
    )
    assert free_gain("kg_2_rad_m", -100, -1).from_unit_interval(np.array([0.5])) == pytest.approx(
        [-10]
    )


def test_rows_of_the_law_are_those_of_a_controller_with_the_same_settings():
    settings = {
        "kp_1_N_m_rad": 3.0,
        "kt_1_N_m_s_rad": 0.2,
        "setpoint_1_Hz": 2.0,
        "torque_max_1_N_m": 0.7,
        "derivative_Hz": 33.0,
        "deflection_Hz": 21.0,
        "torque_slew_1_N_m_s": 9.0,
        "observer_1_Hz": 4.0,
        "jo_1_N_m_s2_rad": 0.01,
        "bo_1_N_m_s_rad": 0.02,
    }
    free_gains = [free_gain(name, value / 2, value * 2) for name, value in settings.items()]
    system = fx.assemble(ROBOT)
    made, plain = (
        closed_loop_controller(system, SWING, gains.Gains(GAINS.settings | more))
        for more in (settings, {})
    )
    base = plain.gains()
    row = freedom.rows(free_gains, np.array([list(settings.values())]), plain, base)
    assert np.array_equal(row[0], made.gains())


@pytest.mark.parametrize(
    "text, said",
    [
        ("[free]\nkp_1_V_mm = [1, 2]", "setting of a gains file"),
        ("[free]\nkp_1_V_m = [2, 1]", "LOW below HIGH"),
        ("[free]\nkp_1_V_m = 3", "[low, high]"),
        ("free = 1", "table [free]"),
        ("[frei]\nkp_1_V_m = [1, 2]", "unknown key"),
        ('[free]\nkp_1_V_m = { low = -1, high = 2, scale = "log" }', "one sign"),
        ("[free]\ndelay_1_s = [0, 1]", "expected a gain"),
    ],
)
def test_a_wrong_file_of_bounds_is_refused_by_key(tmp_path, text, said):
    (tmp_path / "free.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        freedom.read(tmp_path / "free.toml")
    assert said in str(caught.value) and "free.toml" in str(caught.value)


def test_free_settings_are_those_of_the_controllers_outputs_and_once():
    with pytest.raises(InputError, match="torque"):
        task(free=(free_gain("kp_1_V_m", 1, 2),))
    with pytest.raises(InputError, match="once"):
        task(free=(FREE[0], FREE[0]))
    with pytest.raises(InputError, match="elsewhere"):
        _ = task(manoeuvre=replace(SWING, drive=fx.Drive((fx.JointDrive(),)))).controllers
