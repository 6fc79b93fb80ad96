"""The command `flexura tune`: killed, interrupted, wrongly called."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexlab.tuning.history import FILE
from flexura.control import gains
from processes import command_line, environment

ROOT = Path(__file__).resolve().parents[3]
MODEL = ROOT / "model"
STEP, RIG = MODEL / "manoeuvres" / "rig-step.toml", MODEL / "controllers" / "rig.toml"
SMALL = (
    "tune",
    MODEL / "robots" / "rig.toml",
    STEP,
    "--controller",
    RIG,
    "--rig",
    ROOT / "firmware" / "rig.toml",
    "--free",
    "kf_2_rad_s_m=1:100",
    "--free",
    "kp_2_1_s=2:50",
    "--population",
    "6",
    "--out",
    "out",
    "--jobs",
    "1",
)


def start(*arguments, cwd):
    pipe, line = subprocess.PIPE, command_line(*arguments)
    return subprocess.Popen(
        line, cwd=cwd, env=environment(140), stdout=pipe, stderr=pipe, text=True
    )


def flexura(*arguments, cwd):
    process = start(*arguments, cwd=cwd)
    out, err = process.communicate(timeout=280)
    return process.returncode, out, err


def state(folder):
    with np.load(folder / "out" / FILE) as data:
        return {name: data[name] for name in ("points", "goals", "ends")}


def test_killed_and_interrupted_the_same_command_comes_to_the_same_end(tmp_path):
    """kill -9, then a real Ctrl-C (SIGINT), then to the end; beside a run that nothing
    disturbed."""
    (tmp_path / "a").mkdir(), (tmp_path / "b").mkdir()
    arguments = (*SMALL, "--generations", "16", "--json")
    for number, (sent, status) in enumerate(((signal.SIGKILL, -9), (signal.SIGINT, 130)), 1):
        process = start(*arguments, cwd=tmp_path / "a")
        until = time.monotonic() + 200
        while (
            not (tmp_path / "a" / "out" / FILE).exists()
            or len(state(tmp_path / "a")["ends"]) < 3 * number
        ):
            assert process.poll() is None and time.monotonic() < until, process.communicate()
            time.sleep(0.01)
        process.send_signal(sent)
        process.communicate(timeout=60)
        assert process.returncode == status
        assert 3 * number <= len(state(tmp_path / "a")["ends"]) < 16
    code, out, err = flexura(*arguments, cwd=tmp_path / "a")
    assert code == 0, err
    other = flexura(*arguments, cwd=tmp_path / "b")
    for name, array in state(tmp_path / "a").items():
        assert np.array_equal(array, state(tmp_path / "b")[name])
    assert (tmp_path / "a/out/gains.toml").read_bytes() == (
        tmp_path / "b/out/gains.toml"
    ).read_bytes()
    first, second = json.loads(out), json.loads(other[1])
    assert first["settings"] == second["settings"] and first["goals"] == second["goals"]
    assert not list((tmp_path / "a/out").glob(f".{FILE}*"))
    kept = fx.Run.read(tmp_path / "a/out/history")
    assert len(kept) == first["generations"] and kept["goal/J/best"][-1] == first["goals"]["J"]
    assert (
        "J = sum_i" in first["objective"]
        and kept.meta["task"]["free"]["kp_2_1_s"]["scale"] == "log"
    )
    assert (
        gains.load(tmp_path / "a/out/gains.toml").board()["kf_2_rad_s_m"]
        == first["settings"]["kf_2_rad_s_m"]
    )


@pytest.mark.parametrize(
    "change, said",
    [
        (("--algorithm", "annealing"), "--algorithm"),
        (("--free", "kp_9_V_m=1:2"), "kp_9_V_m"),
        (("--free", "kp_1_V_m"), "LOW:HIGH"),
        (("--payload-factors", "-1"), "--payload-factors"),
        (("--population", "1"), "--population"),
        (("--vibration", "-1"), "--vibration"),
        (("--dissertation",), "brings its own"),
    ],
)
def test_a_wrong_argument_is_one_line_and_status_2(tmp_path, change, said):
    code, _, err = flexura(*SMALL, *change, cwd=tmp_path)
    assert (
        code == 2
        and said in err
        and len(err.strip().splitlines()) == 1
        and not list(tmp_path.iterdir())
    )
