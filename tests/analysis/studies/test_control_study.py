"""`flexura study control`: what each method achieves, measured on one motion of two robots."""

import json

import numpy as np
import pytest

from commands import run as command
from flexlab.studies import control
from flexlab.studies.control.methods import bang_bang, pid, shaped
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


def test_bang_bang_takes_the_rigid_robots_drives_to_a_limit_and_reverses():
    motion = bang_bang(TASK)
    drives = motion.drive.joints
    t = np.linspace(0.0, motion.end_s, 200, endpoint=False)
    share = [
        np.abs([joint.force(s)[0] for s in t]) / most
        for joint, most in zip(drives, TASK.limits, strict=True)
    ]
    assert np.max(share) == pytest.approx(1.0, abs=1e-3)
    for joint, end in zip(drives, TASK.end, strict=True):
        first, second = (joint.motion(x * motion.end_s)[2] for x in (0.2, 0.8))
        assert first == -second == pytest.approx(4 * end / motion.end_s**2)
        assert joint.motion(motion.end_s)[0] == pytest.approx(end)


@pytest.mark.parametrize(
    "arguments", [["single-r"], ["rig", "--values", "1:2:3"], ["rig", "--channels"]]
)
def test_wrong_arguments_end_with_status_2(arguments, tmp_path):
    status, _, said = command(["study", "control", *arguments, "--out", tmp_path / "x"])
    assert status == 2 and "expected" in said and not (tmp_path / "x").exists()


@pytest.mark.slow
def test_the_same_study_is_stored_in_the_same_bytes(tmp_path):
    study = {"rig": (TASK, control.compare(TASK, [control.Method("PID", pid)], rtol=1e-5))}
    stored = []
    for _ in range(2):
        paths = control.save(study, tmp_path)
        stored.append([path.read_bytes() for path in paths])
    assert [path.name for path in paths] == [f"study.{k}" for k in ("parquet", "png", "svg", "pdf")]
    assert stored[0] == stored[1]
    assert len(control.numbers(study)["rows"]) == 3


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_whole_study_shows_what_each_method_buys(tmp_path):
    status, out, said = command(["study", "control", "rig", "--out", tmp_path / "x", "--json"])
    assert status == 0, said
    rows = json.loads(out)["rows"]
    nominal = {row["method"]: row for row in rows if row["payload_factor"] == 1}
    assert list(nominal) == [method.name for method in control.METHODS]
    plain = nominal["PID"]
    assert nominal["inversion"]["tip_error_m"] < 1e-5 < 1e-3 < plain["tip_error_m"]
    assert nominal["inversion"]["residual_m"] < 1e-5
    quick = nominal["least time"]
    assert quick["time_s"] < 0.75 * min(
        row["time_s"]
        for name, row in nominal.items()
        if name != "bang-bang" and not name.startswith("least")
    )
    blunt = nominal["bang-bang"]
    assert quick["time_s"] < blunt["time_s"] < plain["time_s"]
    assert quick["residual_m"] < 0.1 * min(plain["residual_m"], blunt["residual_m"])
    for row in nominal.values():  # feedback adds little to the drives of the shortest motions
        assert row["peak_drive_1"] < 1.1 * TASK.limits[0]
