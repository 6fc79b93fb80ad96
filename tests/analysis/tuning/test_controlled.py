"""`flexura simulate --controller`: a gains file on a manoeuvre, and what the gains that come along
do on the rig."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexlab.board.protocol.declaration import CONFIG
from flexlab.tuning.closed_loop import controller_from_file
from flexura.control import gains
from processes import flexura

ROOT = Path(__file__).resolve().parents[3]
MODEL = ROOT / "model"
STEP, GAINS = MODEL / "manoeuvres" / "rig-step.toml", MODEL / "controllers" / "rig.toml"


def rig_with_rotor(modes: int = 2) -> fx.System:
    """The rig with its motor's rotor and friction on the carriage, as the board's plant has
    them."""
    tables = fx.load(MODEL / "robots" / "rig.toml").to_dict()
    tables["link"][1]["modes"] = modes
    tables["link"][0]["joint"] |= {"rotor_mass_kg": 123.4, "coulomb_friction_N": 37.5}
    return fx.assemble(fx.Robot.from_dict(tables))


def test_every_name_of_the_board_is_a_name_of_the_file():
    assert set(gains.BOARD) <= set(CONFIG) and set(gains.BOARD) <= set(gains.NAMES) | {
        "derivative_Hz",
        "deflection_Hz",
    }
    starts = (
        "k",
        "jo",
        "bo",
        "observer",
        "voltage",
        "rate_max",
        "acceleration",
        "setpoint",
        "derivative",
        "deflection",
    )
    own = [name for name in CONFIG if name.startswith(starts)]
    assert set(own) | {"feedback_2"} == set(gains.BOARD)
    assert list(gains.load(GAINS).board()) == [
        name for name in gains.BOARD if name in gains.load(GAINS).settings
    ]


def test_the_strips_term_takes_the_vibration_away():
    """The gains that come along, with and without kf: arrival, overshoot below 5 %, no error left,
    ten times less vibration."""
    system = rig_with_rotor()
    asked = fx.load_manoeuvre(STEP, 2)
    drive = controller_from_file(system, asked, GAINS)
    plain = replace(drive, joints=(drive.joints[0], replace(drive.joints[1], kf=0.0)))
    good, poor = (fx.simulate(system, asked.t, d, rtol=1e-5) for d in (drive, plain))
    late = asked.t > 2.5
    for name, end in (("joint/1/position", 0.1), ("joint/2/position", np.pi / 4)):
        assert (
            np.abs(good[name][asked.t > 1.3] / end - 1).max() < 0.02
            and good[name].max() < 1.05 * end
        )
        assert good[name][-1] == pytest.approx(end, rel=1e-4)
    assert (
        np.abs(good["link/2/tip_deflection"][late]).max()
        < 0.1 * np.abs(poor["link/2/tip_deflection"][late]).max()
    )
    assert np.abs(good["joint/1/voltage"]).max() <= 12.0 and good.meta["energy_error"] < 1e-5


def test_the_command_stores_the_run_with_what_the_controller_did(tmp_path):
    done = flexura(
        "simulate",
        MODEL / "robots" / "rig.toml",
        STEP,
        "--controller",
        GAINS,
        "--out",
        "out",
        "--json",
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    run = fx.Run.read(tmp_path / "out")
    assert {"joint/1/voltage", "joint/1/reference", "joint/2/pulses", "joint/2/reference"} <= set(
        run
    )
    assert run.meta["drive"]["joint"][1]["kf"] == 20.0 and run.units["joint/1/voltage"] == "V"


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("kp_2_1_s = 8.0", "kp_2_1_s = 1/8", "not valid TOML"),
        ("kv_2 = 1.0", "kv_2 = true", "controller.kv_2"),
        ("kp_1_V_m", "kp_1_V_mm", "did you mean kp_1_V_m?"),
    ],
)
def test_a_wrong_gains_file_is_one_line_and_status_2(tmp_path, old, new, said):
    (tmp_path / "gains.toml").write_text(GAINS.read_text().replace(old, new))
    done = flexura(
        "simulate", MODEL / "robots" / "rig.toml", STEP, "--controller", "gains.toml", cwd=tmp_path
    )
    assert done.returncode == 2 and said in done.stderr and "gains.toml" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1 and not (tmp_path / "logs").exists()


def test_a_prescribed_joint_is_refused(tmp_path):
    text = STEP.read_text().replace("duration_s = 0.6 }", "duration_s = 0.6 }\nprescribed = true")
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(fx.InputError, match="no prescribed joint"):
        controller_from_file(rig_with_rotor(), fx.load_manoeuvre(tmp_path / "m.toml", 2), GAINS)
