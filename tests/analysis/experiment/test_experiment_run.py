"""Experiments on the emulated board: the four kinds, what a Run says of itself, and a recording
that is cut anywhere."""

import io
import json
import shutil

import numpy as np
import pytest
from rich.console import Console

import flexura as fx
from experiments import BENCH, SETTINGS, board, experiment
from flexlab import rig
from flexlab.board.base import BoardError
from flexlab.board.protocol import frames, messages
from flexlab.board.protocol.declaration import DECLARATION, Fault
from flexlab.cli.bench_tables import live_table, result_table, selftest_table
from flexlab.experiment import plan as plans
from flexlab.experiment.gains import gains as read_gains
from flexlab.experiment.run_experiment import Hooks, OpenBoard, check, conduct
from flexlab.recordings import recording
from flexlab.recordings.run_from_recording import UNEXPLAINED, knots_from, run_from_recording
from flexlab.recordings.strip_sensor import sensor_of
from flexlab.recordings.unit_conversion import planned_setpoints, units_of
from flexlab.rig.board_axes import board_axes
from flexura.io import write_toml
from flexura.signals import harmonic

# With CRC, COBS and the zero byte.
FRAME_BYTES = messages.HEAD_BYTES + messages.TELEMETRY.itemsize + frames.CRC_BYTES + 2


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """The inverse experiment along the dissertation's law."""
    return experiment(plans.inverse(BENCH, SETTINGS), tmp_path_factory.mktemp("logs") / "inverse")


def test_a_run_says_what_it_is_and_where_it_comes_from(tracked):
    run = fx.Run.read(tracked.folder)
    about = run.meta
    assert (about["kind"], about["source"], about["experiment"]) == (
        "experiment",
        "experiment",
        "inverse",
    )
    assert about["complete"] is True
    assert (
        about["emulated"] is True and about["label"].startswith("emulated") and about["seed"] == 0
    )
    assert about["firmware"]["declaration"] == f"{DECLARATION:08x}" and about["host_version"]
    assert (
        fx.Robot.from_dict(about["robot"]) == BENCH.robot
        and about["rig"]["screw"]["lead_m"] == 0.008
    )
    assert about["settings"] == SETTINGS and "T" in about["started"]
    assert about["asked"] == BENCH.manoeuvre.spec() | {"lead_s": 1.0, "out_s": 1.0}
    units = units_of(board_axes(SETTINGS), 2, "flex")
    assert set(units) | {"tip/x", "tip/y"} == set(run) and run.units["joint/2/pulses"] == "rad"
    assert about["line"] == {
        "reports": len(run),
        "missing": 0,
        "bad_frames": 0,
        "bytes": about["line"]["bytes"],
    }
    assert json.loads(json.dumps(about)) == about


def test_the_clock_begins_with_the_execution_and_the_reports_follow_each_other(tracked):
    t = tracked.run.t
    assert 0 <= t[0] <= 0.003 and tracked.run.meta["start_uncertainty_s"] == 0.0 and t[-1] >= 4.5
    np.testing.assert_allclose(np.diff(t), 0.002, rtol=1e-9)


def test_the_boards_set_points_are_those_that_were_asked(tracked):
    """The manoeuvre's own motion at the run's times: the clock is right to a fraction of a tick,
    the cubics to a microstep/50."""
    run = tracked.run
    begin = next(phase["t"] for phase in run.meta["phases"] if phase["name"] == "manoeuvre")
    inside = (run.t > begin) & (run.t < begin + BENCH.manoeuvre.duration_s - 0.01)
    for number, (joint, least) in enumerate(
        zip(BENCH.manoeuvre.drive.joints, (2e-7, 4e-5), strict=True), 1
    ):
        wanted = np.array([joint.motion(t - begin)[0] for t in run.t[inside]])
        np.testing.assert_allclose(run[f"joint/{number}/reference"][inside], wanted, atol=least)
    kept = recording.read(tracked.folder)
    course = planned_setpoints(knots_from(kept.session["knots"]), SETTINGS)
    k = np.round(run.t[inside] * 1000).astype(int) - 1
    np.testing.assert_allclose(
        run["joint/1/reference"][inside] * 256 * 80e3, course[k, 0], atol=3.0
    )  # three products are cut


def test_the_joints_follow(tracked):
    run = tracked.run
    for number, most in (
        (1, 0.0015),
        (2, 0.02),
    ):  # 1 ms and a pulse behind at 3.3 rad/s, and the motor's dead zone
        assert (
            np.abs(run[f"joint/{number}/reference"] - run[f"joint/{number}/position"]).max() < most
        )
    x = (
        0.1 + run["joint/1/position"] + 0.3 * np.cos(run["joint/2/position"])
    )  # the strip of `Drives` is straight
    np.testing.assert_allclose(run["tip/x"], x, atol=1e-9)
    lag = run.meta["delays"]["joint/2/position"]
    assert lag["behind"] == "joint/2/reference" and 0 <= lag["seconds"] < 0.01 and lag["std"] > 0


def test_the_same_experiment_twice_gives_the_same_bytes(tmp_path):
    asked = plans.inverse(BENCH, SETTINGS, _swing(0.01, 0.4))
    first, second = (experiment(asked, tmp_path / name) for name in "ab")
    for channel in first.run:
        np.testing.assert_array_equal(first.run[channel], second.run[channel])


def test_forward_gives_the_drives_what_the_profile_says(tmp_path):
    path = tmp_path / "profile.toml"
    path.write_text(
        'name = "one stroke"\nduration_s = 0.6\nvoltage_V = { kind = "constant", value = 4.0 }\n'
        'rate_rad_s = { kind = "piecewise", at_s = [0.0, 0.2, 0.4], value = [0.0, 0.5, 0.0] }\n'
    )
    run = experiment(plans.forward(BENCH, SETTINGS, path), tmp_path / "run").run
    held = (run.t > 0.1) & (run.t < 0.59)
    np.testing.assert_allclose(run["joint/1/voltage"][held], 4.0, rtol=0.005)
    np.testing.assert_allclose(run["joint/1/voltage"][run.t > 0.65], 0.0)
    assert run["joint/2/pulses"][-1] == pytest.approx(0.1, abs=0.004)
    assert run["joint/1/velocity"][held][-20] == pytest.approx(
        0.008 * 1000 / 60 * 3 / 11, rel=0.01
    )  # 1 V of 12 starts it
    assert np.isnan(run["joint/1/reference"]).all() and run.meta["asked"]["name"] == "one stroke"


def test_step_uses_the_gains_that_it_was_given(tmp_path):
    """A proportional controller alone: at the step the voltage is kp times its height."""
    for kp in (1500.0, 3000.0):
        (tmp_path / "gains.toml").write_text(
            f"kp_1_V_m = {kp}\nki_1_V_m_s = 0.0\nkv_1_V_s_m = 0.0\nkc_1_V = 0.0\n"
        )
        settings = SETTINGS | read_gains(tmp_path / "gains.toml")
        run = experiment(plans.step(BENCH, settings, (0.003, 0.05), 2.0), tmp_path / f"{kp}").run
        first = np.flatnonzero(run["joint/1/reference"] > 0.0015)[0]
        assert run.t[first] == pytest.approx(0.2, abs=0.011) and run[
            "joint/1/reference"
        ].max() == pytest.approx(0.003, rel=1e-4)
        assert (
            run["joint/2/reference"][-1] == pytest.approx(0.05, rel=1e-4) and run.meta["complete"]
        )
        assert run.meta["settings"]["kp_1_V_m"] == kp
        assert run["joint/1/voltage"].max() == pytest.approx(0.003 * kp, rel=0.03)


def test_free_vibration_moves_and_holds(tmp_path):
    run = experiment(plans.free_vibration(BENCH, SETTINGS, 0.3, 1.5), tmp_path / "run").run
    rings = run.t > run.meta["asked"]["rings_from_s"] + 0.15
    np.testing.assert_allclose(run["joint/2/position"][rings], 0.3, atol=0.003)
    assert run["joint/2/velocity"].max() == pytest.approx(3.0, rel=0.05)


# ---- a recording that is cut


def cut_at(tracked, tmp_path, size):
    folder = tmp_path / str(size)
    folder.mkdir()
    for name in (recording.SESSION, recording.RECEIVED, recording.EVENTS):
        shutil.copy(tracked.folder / name, folder)
    data = (folder / recording.RECEIVED).read_bytes()
    (folder / recording.RECEIVED).write_bytes(data[:size])
    (folder / recording.EVENTS).write_bytes(b'{"text": "half a li')
    return folder


def test_a_recording_cut_at_any_byte_is_the_beginning_of_the_whole(tracked, tmp_path):
    whole = tracked.run
    total = whole.meta["line"]["bytes"]
    for size in np.random.default_rng(5).integers(total // 2, total, 6):
        run = run_from_recording(cut_at(tracked, tmp_path, int(size)))
        n = len(run)
        assert n >= len(whole) - (total - size) // FRAME_BYTES - 2 and not run.complete
        assert run.meta["events"][-1]["text"] == UNEXPLAINED and run.meta["label"].startswith(
            "emulated"
        )
        for channel in set(run) - {"joint/1/velocity", "joint/2/velocity"}:
            np.testing.assert_array_equal(run[channel], whole[channel][:n], err_msg=channel)
        inner = slice(0, n - 10)  # the window of the velocity ends elsewhere
        np.testing.assert_allclose(
            run["joint/1/velocity"][inner], whole["joint/1/velocity"][: n - 10], rtol=0, atol=1e-12
        )


def test_garbage_in_the_middle_costs_the_frames_that_it_hits(tracked, tmp_path):
    folder = cut_at(tracked, tmp_path, tracked.run.meta["line"]["bytes"])
    data = bytearray((folder / recording.RECEIVED).read_bytes())
    at = 2 * len(data) // 3
    data[at : at + 300] = np.random.default_rng(6).integers(0, 256, 300, dtype=np.uint8).tobytes()
    (folder / recording.RECEIVED).write_bytes(data)
    run = run_from_recording(folder)
    missing = np.isnan(run["joint/1/position"])
    assert (
        len(run) == len(tracked.run)
        and 3 <= missing.sum() <= 8
        and run.meta["line"]["missing"] == missing.sum()
    )
    for channel in ("joint/1/position", "link/2/flex_voltage"):
        np.testing.assert_array_equal(run[channel][~missing], tracked.run[channel][~missing])
    assert any("did not arrive" in event["text"] for event in run.meta["events"])


def test_what_another_program_had_left_on_the_line_is_not_of_this_run(tracked, tmp_path):
    """Reports of an earlier session come first, with other numbers and earlier ticks, then the
    board's introduction."""
    folder = cut_at(tracked, tmp_path, tracked.run.meta["line"]["bytes"])
    data = (folder / recording.RECEIVED).read_bytes()
    (folder / recording.RECEIVED).write_bytes(data[len(data) // 2 :] + data)
    run = run_from_recording(folder)
    assert len(run) == len(tracked.run) and run.meta["line"]["missing"] == 0
    np.testing.assert_array_equal(run["joint/2/position"], tracked.run["joint/2/position"])


def test_recordings_left_behind_are_found_and_those_under_way_are_not(tracked, tmp_path):
    left = cut_at(tracked, tmp_path, 50_000)
    busy = recording.Recording(tmp_path / "busy", {})
    assert recording.unfinished(tmp_path) == [left]
    busy.close()
    assert set(recording.unfinished(tmp_path)) == {left, tmp_path / "busy"}
    run_from_recording(left).save(left)
    assert recording.unfinished(tmp_path) == [tmp_path / "busy"]
    with pytest.raises(fx.InputError, match="no report"):
        shutil.copy(left / recording.SESSION, tmp_path / "busy")
        run_from_recording(tmp_path / "busy")


def test_a_folder_with_a_recording_is_not_written_over(tracked):
    with pytest.raises(fx.InputError, match="holds a recording already"):
        recording.Recording(tracked.folder, {})


# ---- before anything moves


def creeping(plant):
    """Somebody turns the screw."""
    advance = plant.advance

    def crept(seconds, outputs):
        plant.positions[0] += 1e-3 * seconds
        return advance(seconds, outputs)

    plant.advance = crept


def faulty(tmp_path, expected, change=lambda plant: None, plan=None, **more):
    made = board()
    change(made.plant)
    with pytest.raises(BoardError, match=expected):
        experiment(
            plan or plans.inverse(BENCH, SETTINGS),
            tmp_path / "run",
            opened=OpenBoard(made, 0, {}, made.plant),
            **more,
        )
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "expected, change",
    [
        ("supply", lambda plant: setattr(plant, "supply_V", 8.0)),
        (
            "emergency stop: open; expected closed; Release it",
            lambda plant: setattr(plant, "emergency_stop", True),
        ),
        ("limit high", lambda plant: plant.positions.__setitem__(0, 0.2)),
        ("flex sensor", lambda plant: setattr(plant, "flex_V", 0.0)),
        ("strip at rest", lambda plant: setattr(plant, "flex_V", plant.flex_V - 0.2)),
        ("encoder 1: moved by", lambda plant: creeping(plant)),
    ],
)
def test_the_self_test_finds_what_is_wrong_and_leaves_nothing_behind(tmp_path, expected, change):
    faulty(tmp_path, expected, change)


def test_a_board_of_another_declaration_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("flexlab.board.protocol.session.DECLARATION", 1)
    faulty(tmp_path, "speaks declaration")


def test_settings_of_another_rig_are_not_written_without_permission(tmp_path):
    made = board()
    made.emulated, made.label = False, "a board like a real one"
    opened = OpenBoard(made, None, {}, None)
    bench = type(BENCH)(
        BENCH.file,
        BENCH.rig.model_copy(update={"board": BENCH.rig.board | {"kp_1_V_m": 900.0}}),
        *_rest(),
    )
    settings = rig.configuration(bench)
    with pytest.raises(
        BoardError,
        match=(
            "configuration: 1 differ: kp_1_V_m; expected the rig file's; flexura flash --configure"
        ),
    ):
        conduct(
            bench,
            plans.inverse(bench, settings),
            opened,
            tmp_path / "run",
            sensor_of(bench),
            Hooks(),
        )
    made.close()


def _rest():
    return BENCH.robot, BENCH.manoeuvre, BENCH.limits


@pytest.mark.parametrize(
    "plan, key",
    [
        (lambda: plans.step(BENCH, SETTINGS, (0.3, 0.1)), "carriage range"),
        (lambda: plans.free_vibration(BENCH, SETTINGS, 1.55), "step rate"),
        (lambda: plans.inverse(BENCH, SETTINGS, _swing(0.06)), "carriage range"),
    ],
)
def test_what_the_rig_cannot_do_is_refused_before_a_board_is_looked_for(plan, key):
    with pytest.raises(fx.InputError) as raised:
        check(plan())
    assert raised.value.key == key and "the rig cannot do this" in str(raised.value)


@pytest.mark.parametrize(
    "spec, key",
    [
        ({"duration_s": 1.0, "voltage_V": {"kind": "constant", "value": 13.0}}, "motor voltage"),
        ({"duration_s": 5.0, "voltage_V": {"kind": "constant", "value": 6.0}}, "carriage range"),
        ({"duration_s": 4.0, "rate_rad_s": {"kind": "constant", "value": 0.5}}, "joint 2 range"),
        ({"duration_s": 0.1, "rate_rad_s": {"kind": "constant", "value": 7.0}}, "joint 2 rate"),
        ({"duration_s": 0.0}, "duration_s"),
        ({"duration_s": 1.0, "volts": 3}, "volts"),
        ({"duration_s": 1.0, "rate_rad_s": {"kind": "sine"}}, "rate_rad_s.kind"),
    ],
)
def test_a_wrong_profile_is_refused_by_key(tmp_path, spec, key):
    write_toml(tmp_path / "profile.toml", spec)
    with pytest.raises(fx.InputError) as raised:
        check(plans.forward(BENCH, SETTINGS, tmp_path / "profile.toml"))
    assert raised.value.key == key


@pytest.mark.parametrize(
    "text, key, value",
    [
        ("kp_1 = 3.0", "kp_1", 3.0),
        ("kp_1_V_m = 1e7", "kp_1_V_m", 1e7),
        ("supply_V = 12.0", "supply_V", 12.0),
        ("kd_2 = true", "kd_2", True),
    ],
)
def test_wrong_gains_are_refused_by_file_key_and_value(tmp_path, text, key, value):
    path = tmp_path / "gains.toml"
    path.write_text(text)
    with pytest.raises(fx.InputError) as raised:
        read_gains(path)
    assert (raised.value.file, raised.value.key, raised.value.value) == (str(path), key, value)


def test_a_joint_without_a_motion_is_refused():
    alone = fx.Drive.pd([harmonic(0.01, 1.0)], [1], [1])
    with pytest.raises(fx.InputError, match="missing: expected a motion of every joint") as raised:
        plans.inverse(
            BENCH, SETTINGS, fx.Manoeuvre("", 1.0, 0.1, fx.Drive((*alone.joints, fx.JointDrive())))
        )
    assert raised.value.key == "joint[2].motion"


def _swing(amplitude, duration_s=4.0):
    motions = harmonic(amplitude, 0.2, -np.pi / 2), harmonic(0.1, 0.2, -np.pi / 2)
    return fx.Manoeuvre("", duration_s, 0.01, fx.Drive.pd(motions, [1, 1], [1, 1]))


# ---- what is shown


def shown(table):
    out = io.StringIO()
    Console(file=out, width=160).print(table)
    return " ".join(out.getvalue().split())


def test_every_table_says_that_the_board_is_emulated(tracked):
    title = "inverse on the emulated ATmega2560: no hardware is touched"
    plan = plans.inverse(BENCH, SETTINGS)
    last = np.zeros(1, dtype=messages.TELEMETRY)[0]
    tables = [
        result_table(tracked),
        selftest_table(tracked.findings, title),
        live_table(last, 0.3, plan, sensor_of(BENCH), title),
    ]
    for table in tables:
        assert title in shown(table)
    assert "joint/1/position" in shown(tables[0]) and "0 missing" in shown(tables[0])


def test_a_fault_ends_the_experiment_and_is_told(tmp_path):
    """The carriage is blocked on the way."""
    made = board()
    begun = lambda reports, part: made.plant.blocked.update({1} if part > 0.2 else ())
    done = experiment(
        plans.inverse(BENCH, SETTINGS),
        tmp_path / "run",
        Hooks(observe=begun),
        OpenBoard(made, 0, {}, made.plant),
    )
    assert not done.ended.complete and done.ended.stopped and "fault" in done.ended.text
    fault = next(
        e for e in fx.Run.read(done.folder).meta["events"] if e["text"].startswith("board: fault")
    )
    assert (
        any(f"fault {f.name}" in fault["text"] for f in (Fault.stall_1, Fault.following_1))
        and 0.4 < fault["t"] < 1.5
    )
    assert fault["level"] == "ERROR" and len(done.run) > 200
