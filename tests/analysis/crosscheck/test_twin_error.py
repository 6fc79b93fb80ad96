"""The twin's own error: known from its steps, and no deviation that is the twin's is blamed on the
native solver."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from commands import run
from flexlab.crosscheck import step_error
from flexlab.crosscheck.crosscheck import Check, crosscheck
from flexlab.runs.deviation import deviations

ROOT = Path(__file__).resolve().parents[3]
RIG = ROOT / "model" / "robots" / "rig.toml"
LAW = ROOT / "model" / "manoeuvres" / "rig-inverse-law.toml"
ROBOT = fx.load(RIG)
ASKED = replace(fx.load_manoeuvre(LAW, 2), duration_s=0.5, output_step_s=0.01)
COARSE_S = 0.01 / 3


@pytest.fixture(scope="module")
def coarse():
    """The twin with a step far too long, which it was told to take."""
    return crosscheck(ROBOT, ASKED, tolerance=0.01, step_s=COARSE_S)


def test_a_deviation_by_a_coarse_step_of_the_twin_is_open_and_not_failed(coarse):
    worst = max(coarse.rows, key=lambda row: row.max_relative)
    assert worst.max_relative > 0.01 and worst.channel in coarse.open
    assert coarse.failed == [] and not coarse.passed
    assert coarse.twin.meta["step_s"] == pytest.approx(COARSE_S)


def test_the_estimate_is_the_error_that_the_step_makes(coarse):
    """Beside the native run, which is far more exact: within a factor of 3 where it is large."""
    for row in coarse.rows:
        if row.max_relative > 5e-3:
            assert 1 / 3 < coarse.own_error[row.channel] / row.max_relative < 3


def test_a_step_of_its_own_is_shortened_until_the_twin_can_judge():
    """A tolerance below the default step's own error."""
    asked = crosscheck(ROBOT, ASKED, tolerance=1e-4)
    first = crosscheck(ROBOT, ASKED, tolerance=0.1)
    assert first.passed and asked.twin.meta["step_s"] < first.twin.meta["step_s"]
    for channel, error in asked.own_error.items():
        assert error <= first.own_error[channel]


def test_a_native_error_is_blamed_on_the_native_solver():
    check = crosscheck(ROBOT, ASKED, tolerance=0.01)
    assert check.passed and all(error < 2e-3 for error in check.own_error.values())
    other = ROBOT.replace({"payload.mass_kg": 1.2 * ROBOT.payload.mass_kg})
    wrong = fx.simulate(other, ASKED.t, ASKED.drive, rtol=1e-7)
    blamed = Check(
        wrong, check.twin, deviations(wrong, check.twin), check.tolerance, check.own_error
    )
    assert "link/2/tip_deflection" in blamed.failed and blamed.open == []


def test_the_weights_are_those_of_a_second_order_method():
    """y(h) = y + c h^2: the error of the finer of two runs is c h^2 exactly."""
    t = np.linspace(0, 1, 11)

    def at(step):
        return fx.Run(t, {"tip/x": t + 3 * step**2}, {"tip/x": "m"}, {"step_s": step})

    (error,) = (step_error.estimate(at(0.0), at(0.01), at(coarser))["tip/x"] for coarser in (0.02,))
    assert error == pytest.approx(3 * 0.01**2)


def test_the_command_shows_the_twins_own_error_and_says_what_is_open(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    law = LAW.read_text().replace("duration_s = 2.0", "duration_s = 0.5")
    law = law.replace("output_step_s = 0.005", "output_step_s = 0.01")
    (tmp_path / "law.toml").write_text(law)
    status, out, err = run(["crosscheck", RIG, "law.toml", "--step-s", COARSE_S])
    assert status == 1 and "own error" in " ".join(out.split())
    assert re.search(r"^open: .*the twin's own error may explain", err)
    assert "beyond the tolerance" not in err
