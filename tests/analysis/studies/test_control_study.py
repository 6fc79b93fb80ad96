"""`flexura study control`: what each method achieves, measured on one motion of two robots."""

import json

import numpy as np
import pytest

from commands import run as command
from flexlab.studies import control
from flexlab.studies.control.following import following
from flexlab.studies.control.learning import trials
from flexlab.studies.control.methods import LEFT, bang_bang, gaussian, pid, predictive, shaped
from flexlab.studies.control.tasks import DERIVATIVE_HZ, RATE_HZ
from flexura.signals import zv

TASK = control.TASKS["rig"]


def judged(*methods):
    return {row.method: row for row in control.compare(TASK, methods, rtol=1e-5)}


def test_shaped_set_points_leave_less_and_the_figures_are_those_of_the_run():
    rows = judged(control.Method("PID", pid), control.Method("PID, ZV", shaped(zv)))
    plain, quiet = rows["PID"], rows["PID, ZV"]
    assert quiet.nominal.residual_m < 0.5 * plain.nominal.residual_m
    for row in rows.values():
        run, one = row.run, row.nominal
        assert one.peak[1] == np.abs(run["joint/2/drive"]).max() <= TASK.limits[1] * (1 + 1e-12)
        end = 0.1 + 0.1 + 0.3 / np.sqrt(2), 0.3 / np.sqrt(2)
        away = np.hypot(run["tip/x"] - end[0], run["tip/y"] - end[1])
        late = run.t >= row.begin_s + one.time_s
        assert away[late].max() <= 0.01 * away[0] < away[~late][-1]
        assert row.worst("residual_m") == max(f.residual_m for f in row.figures[1:])
        assert len({f.residual_m for f in row.figures}) == 3


def test_bang_bang_takes_the_rigid_robots_drives_to_what_is_left_of_a_limit_and_reverses():
    motion = bang_bang(TASK)
    shares = motion.drive.function.drives / TASK.limits  # a row a tick
    assert np.abs(shares).max() == pytest.approx(1 - LEFT, abs=1e-3)
    half = motion.end_s / 2
    for k, end in enumerate(TASK.end):
        wanted = motion.drive.function.wanted[:, k]
        early, late = (round(x * half * RATE_HZ) for x in (0.5, 1.5))
        for tick, sign in ((early, 1), (late, -1)):
            bend = np.diff(wanted[tick - 1 : tick + 2], 2)[0] * RATE_HZ**2
            assert bend == pytest.approx(sign * 4 * end / motion.end_s**2, rel=1e-3)
        assert wanted[-1] == pytest.approx(end)
    assert np.abs(shares[-1]).max() < 1e-12


def test_drives_given_ahead_saturate_with_the_pd_beside_them():
    t = np.linspace(0.0, 0.2, 41)
    still = np.zeros((41, 2))
    most = TASK.limits
    drive = following(TASK, t, still, lambda s: np.outer(0.9 * most, 1 + 0 * s))
    law = drive.function
    there = lambda k, at: law(k / RATE_HZ, np.array(at), np.zeros(2), 0.0)
    assert there(0, [0.0, 0.0]) == pytest.approx(0.9 * most)
    assert (there(1, [-1.0, 1.0]) == [most[0], -most[1]]).all()
    # a ramp is averaged over a tick, and the PD's rate is filtered as the PIDs' is
    law = following(TASK, t, still, lambda s: np.outer(most, s)).function
    assert there(0, [0.0, 0.0]) == pytest.approx(most * 0.5 / RATE_HZ)
    kp, kd = TASK.gains
    step = np.array([1e-6, 1e-6])
    share = 1 - np.exp(-2 * np.pi * DERIVATIVE_HZ / RATE_HZ)
    asked = most * 1.5 / RATE_HZ - kp * step - kd * share * step * RATE_HZ
    assert there(1, step) == pytest.approx(asked)


@pytest.mark.parametrize(
    "arguments", [["single-r"], ["rig", "--values", "1:2:3"], ["rig", "--channels"]]
)
def test_wrong_arguments_end_with_status_2(arguments, tmp_path):
    status, _, said = command(["study", "control", *arguments, "--out", tmp_path / "x"])
    assert status == 2 and "expected" in said and not (tmp_path / "x").exists()


@pytest.mark.slow
def test_learning_lessens_the_tip_error_of_a_model_that_is_off():
    errors = [trial.error_m for trial in trials(TASK, 5)]
    print([f"{1e3 * error:.3g} mm" for error in errors])
    assert errors[0] > 3e-4 and min(errors) < 0.3 * errors[0]
    assert max(errors) <= 1.5 * errors[0]


@pytest.mark.slow
def test_the_same_study_is_stored_in_the_same_bytes(tmp_path):
    some = [
        control.Method("PID", pid),
        control.Method("LQG", gaussian),
        control.Method("NMPC", predictive),
    ]
    saved = []
    for _ in range(2):
        study = {"rig": (TASK, control.compare(TASK, some, rtol=1e-5))}
        paths = control.save(study, tmp_path)
        saved.append([path.read_bytes() for path in paths])
    assert [path.name for path in paths] == [f"study.{k}" for k in ("parquet", "png", "svg", "pdf")]
    assert saved[0] == saved[1]
    assert len(control.numbers(study)["rows"]) == 9
    for row in control.numbers(study)["rows"]:
        for k, most in enumerate(TASK.limits, 1):
            assert row[f"peak_drive_{k}"] <= most * (1 + 1e-12)


def stored(folder, *arguments):
    """The study's numbers, and the bytes of its table."""
    status, out, said = command(["study", "control", *arguments, "--out", folder, "--json"])
    assert status == 0, said
    return json.loads(out), (folder / "study.parquet").read_bytes()


def check_what_each_method_buys(found, name):
    task = control.TASKS[name]
    rows = [row for row in found["rows"] if row["robot"] == name]
    for row in rows:  # the same limits for all methods and payloads
        for k, most in enumerate(task.limits, 1):
            assert row[f"peak_drive_{k}"] <= most * (1 + 1e-9)
    nominal = {row["method"]: row for row in rows if row["payload_factor"] == 1}
    assert list(nominal) == [method.name for method in control.METHODS]
    plain, blunt, quick = (nominal[key] for key in ("PID", "bang-bang", "least time"))
    assert nominal["inversion"]["tip_error_m"] < 1e-5 < 1e-3 < plain["tip_error_m"]
    assert nominal["inversion"]["residual_m"] < 1e-5
    assert nominal["NMPC"]["tip_error_m"] < nominal["LQG"]["tip_error_m"]
    assert nominal["LQG"]["tip_error_m"] < plain["tip_error_m"]
    assert quick["time_s"] < min(blunt["time_s"], plain["time_s"])
    assert quick["residual_m"] < 0.1 * min(plain["residual_m"], blunt["residual_m"])


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_study_of_one_robot_shows_what_each_method_buys(tmp_path):
    found, _ = stored(tmp_path / "x", "rig")
    check_what_each_method_buys(found, "rig")


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_the_whole_study_is_the_same_twice(tmp_path):
    (found, table), (_, again) = (stored(tmp_path / name) for name in ("x", "y"))
    assert table == again
    for name in control.TASKS:
        check_what_each_method_buys(found, name)
