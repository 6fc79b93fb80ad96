"""`flexura bench ...` as a shell sees it: tables, JSON, the stop key, one line for what is
wrong."""

import json
import os
import time

import pytest

import flexura as fx
from boards import elf
from experiments import command
from flexlab.recordings import recording


def finished(*arguments, cwd, status=0):
    """stdout and stderr of the command, which must end with that status."""
    process = command(*arguments, cwd=cwd)
    said, errors = process.communicate(timeout=120)
    assert process.returncode == status, errors
    return said, errors


def test_an_experiment_with_its_own_calibration_and_gains_for_scripts(tmp_path):
    """Emulated unless a port is named, and it says so in every place."""
    (tmp_path / "gains.toml").write_text("kp_1_V_m = 1500.0\n")
    said, _ = finished(
        "calibrate",
        "--firmware",
        elf(),
        "--out",
        "cal",
        "--json",
        "--tips-mm=-20,-12,-4,4,12,20",
        cwd=tmp_path,
    )
    fitted = json.loads(said)
    assert (
        fitted["emulated"] is True
        and fitted["label"].startswith("emulated")
        and len(fitted["held_m"]) == 6
    )
    more = [
        "--firmware",
        elf(),
        "--calibration",
        "cal/calibration.toml",
        "--gains",
        "gains.toml",
        "--seed",
        4,
    ]
    said, _ = finished("step", "--duration-s", 1.2, *more, "--json", cwd=tmp_path)
    told = json.loads(said)
    assert (
        told["emulated"] is True
        and told["label"].startswith("emulated")
        and told["complete"] is True
    )
    assert (
        told["run"].startswith("logs/emulated-step-")
        and told["channels"]["joint/1/position"]["error_max"] > 0.004
    )
    run = fx.Run.read(tmp_path / told["run"])
    assert (
        run.meta["seed"] == 4
        and run.meta["settings"]["kp_1_V_m"] == 1500.0
        and run.meta["asked"]["gains"] == "gains.toml"
    )
    assert run.meta["calibration"] == fitted["calibration"] and run.meta[
        "tip_deflection_std"
    ].endswith("calibration")


def test_the_tables_for_people_and_the_recording_beside_that_was_cut(tmp_path):
    finished(
        "free-vibration",
        "--duration-s",
        1.2,
        "--firmware",
        elf(),
        "--out",
        "logs/cut",
        "--json",
        cwd=tmp_path,
    )
    cut = tmp_path / "logs" / "cut"
    whole = fx.Run.read(cut)
    (cut / "run.parquet").unlink()
    data = (cut / recording.RECEIVED).read_bytes()
    (cut / recording.RECEIVED).write_bytes(data[: 3 * len(data) // 4])
    (cut / recording.EVENTS).write_bytes(b"")
    said, errors = finished(
        "free-vibration",
        "--duration-s",
        1.2,
        "--firmware",
        elf(),
        "--out",
        "logs/next",
        cwd=tmp_path,
    )
    assert (
        said.count("free-vibration on the emulated ATmega2560: no hardware is touched") == 2
    )  # self-test and result
    assert (
        "declaration" in said
        and "joint/2/position" in said
        and "look at it: flexura review logs/next" in said
    )
    assert "recovered logs/cut" in errors
    assert 0 < len(fx.Run.read(cut)) < len(whole)
    (cut / "run.parquet").unlink()
    said, errors = finished("recover", "logs/cut", cwd=tmp_path)
    assert said.startswith("emulated ATmega2560: ") and "the host ended without a word" in errors


def test_the_stop_key_stops(tmp_path):
    """On a terminal, q pressed in the middle: the motors stop in order, what was received is a
    run."""
    keyboard, terminal = os.openpty()
    process = command(
        "free-vibration",
        "--duration-s",
        60,
        "--firmware",
        elf(),
        "--out",
        "run",
        cwd=tmp_path,
        stdin=terminal,
    )
    received, end = tmp_path / "run" / recording.RECEIVED, time.monotonic() + 60
    while not received.exists() or received.stat().st_size < 120_000:
        assert time.monotonic() < end and process.poll() is None
        time.sleep(0.02)
    os.write(keyboard, b"q")
    _, errors = process.communicate(timeout=60)
    os.close(keyboard)
    os.close(terminal)
    assert process.returncode == 130 and "stopped with the key q" in errors
    run = fx.Run.read(tmp_path / "run")
    assert not run.complete and 0.1 < run.t[-1] < 59


@pytest.mark.parametrize(
    "arguments, said",
    [
        (
            ["forward", "--port", "/dev/not-there", "--yes"],
            "flexura: --port = '/dev/not-there': no such device",
        ),
        (
            ["forward", "--port", "x", "--emulated"],
            "flexura: --port = 'x': expected either a port or --emulated",
        ),
        (["forward", "--profile", "none.toml"], "flexura: none.toml: no such file"),
        (["step", "--gains", "none.toml"], "flexura: none.toml: no such file"),
        (
            ["step", "--step-1-m", 0.4],
            "flexura: carriage range = '0 to 400 mm': the rig cannot do this",
        ),
        (["inverse", "none-rig.toml"], "flexura: none-rig.toml: no such file"),
        (
            ["calibrate", "--tips-mm", "1,two"],
            "flexura: --tips-mm = '1,two': expected deflections in mm",
        ),
        (["recover", "nowhere"], "flexura: nowhere: no recording here: expected session.json"),
    ],
)
def test_wrong_arguments_end_in_one_line_and_status_2_with_nothing_written(
    tmp_path, arguments, said
):
    _, errors = finished(*arguments, cwd=tmp_path, status=2)
    assert errors.startswith(said) and len(errors.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_every_experiment_has_an_example_in_its_help(tmp_path):
    for name in ("forward", "inverse", "step", "free-vibration", "calibrate", "recover"):
        assert f"Example: flexura bench {name}" in finished(name, "--help", cwd=tmp_path)[0]
