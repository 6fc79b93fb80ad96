"""`flexura flash` and `flexura doctor` as a shell sees them; the board is emulated and says so."""

import json
from pathlib import Path

import pytest

from boards import elf
from flexlab.board.protocol.declaration import CONFIG
from processes import flexura

ROOT = Path(__file__).resolve().parents[2]
RIG = ROOT / "firmware" / "rig.toml"


@pytest.fixture
def changed(tmp_path):
    """The rig file with one text replaced by another."""

    def write(old, new):
        text = RIG.read_text(encoding="utf-8")
        assert old in text
        target = tmp_path / "rig.toml"
        target.write_text(
            text.replace(old, new).replace('"../model', f'"{ROOT}/model'), encoding="utf-8"
        )
        return target

    return write


def test_flash_into_the_emulated_board_with_the_rigs_constants(tmp_path):
    elf()
    done = flexura("flash", "--emulated", "--configure", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["emulated"] is True and told["board"].startswith("emulated")
    assert told["configured"] and told["differing"] == [] and list(told["settings"]) == list(CONFIG)
    assert (told["state"], told["fault"], told["resets"]) == ("idle", "none", ["external"])


def test_flash_without_configuring_tells_what_differs(tmp_path):
    elf()
    done = flexura("flash", "--emulated", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "emulated ATmega2560" in done.stdout and "no hardware is touched" in done.stdout
    assert "bad_configuration" in done.stdout and "differs" in done.stdout
    assert "to write them: flexura flash --configure" in done.stdout


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--port", "/dev/not-there"], "flexura: --port = '/dev/not-there': "),
        (
            ["--port", "x", "--emulated"],
            "flexura: --port = 'x': expected either a port or --emulated",
        ),
        (["not-there.toml", "--emulated"], "flexura: not-there.toml: no such file"),
    ],
)
def test_wrong_arguments_end_in_one_line_and_status_2(tmp_path, arguments, said):
    done = flexura("flash", *arguments, cwd=tmp_path)
    assert (
        done.returncode == 2 and done.stderr.startswith(said) and len(done.stderr.splitlines()) == 1
    )


def test_doctor_says_before_anything_moves_that_the_motor_is_too_slow(tmp_path, changed):
    done = flexura(
        "doctor",
        changed("no_load_speed_rpm = 1000.0", "no_load_speed_rpm = 251.0"),
        "--json",
        cwd=tmp_path,
    )
    wrong = [f for f in json.loads(done.stdout) if f["state"] == "wrong"]
    assert done.returncode == 1 and [f["what"] for f in wrong] == ["rig: carriage speed"]
    assert (
        "75.4 mm/s" in wrong[0]["found"]
        and "33.47 mm/s" in wrong[0]["found"]
        and "cannot follow" in wrong[0]["cost"]
    )


def test_doctor_finds_the_emulator_and_a_sound_rig(tmp_path):
    found = {f["what"]: f for f in json.loads(flexura("doctor", "--json", cwd=tmp_path).stdout)}
    assert found["emulated board"]["state"] == found["rig"]["state"] == "ok"


def test_doctor_refuses_a_wrong_rig_file(tmp_path, changed):
    done = flexura("doctor", changed("lead_m = 0.008", "lead_m = 8"), cwd=tmp_path)
    assert (
        done.returncode == 2 and "screw.lead_m = 8: expected the carriage's travel" in done.stderr
    )
