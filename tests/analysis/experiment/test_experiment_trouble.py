"""The host under trouble, with the command in a process of its own and the emulated board at the
other end of a pseudo-terminal.

Always: what had been received is on disk and readable, the motors are off, the next run starts
cleanly.
"""

import json
import os
import random
import resource
import signal
import time
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from experiments import BENCH, SETTINGS, Line, board, command, experiment, running
from flexlab.experiment import plan as plans
from flexlab.experiment.run_experiment import Hooks, OpenBoard
from flexlab.recordings import recording
from flexlab.recordings.run_from_recording import UNEXPLAINED, run_from_recording

LONG = ("free-vibration", "--duration-s", 20)
SHORT = ("free-vibration", "--duration-s", 1.1)
SLOW, HOURS = pytest.mark.slow, pytest.mark.long
# the board's host_timeout_s is 0.2; its time may lag on a busy machine, ours does not wait for it
OFF_S = 1.0


@pytest.fixture
def line():
    with Line() as made:
        yield made


def finished(process, status):
    """The process is over with that status; what it said on stderr."""
    said = process.communicate(timeout=60)[1]
    assert process.returncode == status, said
    return said


def moves_for(line, seconds):
    """So long by the board's clock, which lags on a busy machine."""
    begin = line.board.now()
    line.wait(lambda: line.board.now() - begin > seconds)


def off(line):
    line.wait(lambda: not line.driven, OFF_S * 10)


def ok(line, cwd, out):
    """The next run starts cleanly and comes to its end."""
    process = command(
        *SHORT, "--port", line.device, "--yes", "--countdown-s", 0, "--out", out, "--json", cwd=cwd
    )
    said, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert json.loads(said)["complete"] is True and not line.driven
    return errors


def whole(run):
    """Row after row, nothing missing; a busy board stamps a report a tick late."""
    apart = np.diff(run.t)
    assert (
        apart.min() > 0.0009 and apart.max() < 0.0071 and np.median(apart) == pytest.approx(0.002)
    )
    assert run.meta["line"]["missing"] == 0
    assert np.isfinite(run["joint/1/position"]).all()


def test_over_a_serial_line_all_is_as_in_one_process(line, tmp_path):
    """Real pyserial at a pseudo-terminal, and the board in another process's memory: the motion is
    the same."""
    ok(line, tmp_path, "run")
    far = fx.Run.read(tmp_path / "run")
    assert (
        far.meta["emulated"] is True and far.meta["label"] == f"emulated board at {line.device}"
    )  # a pty is no hardware
    near = experiment(plans.free_vibration(BENCH, SETTINGS, 0.1, 1.1), tmp_path / "near").run
    n = min(len(far), len(near))
    assert n > 540 and far.meta["line"]["missing"] == 0
    at = np.interp(near.t, far.t, far["joint/2/position"])
    np.testing.assert_allclose(
        at, near["joint/2/position"], atol=0.0066
    )  # 2.5 counts: reports a tick apart


def killed(line, cwd, name, after_s):
    """Kill -9 at that time after the recording began; the recording as the killed process left
    it."""
    folder = cwd / name
    process = command(
        *LONG, "--port", line.device, "--yes", "--countdown-s", 0, "--out", name, cwd=cwd
    )
    line.wait(lambda: (folder / recording.RECEIVED).exists())
    time.sleep(after_s)
    process.kill()
    at = line.board.now()
    process.communicate(timeout=20)
    off(line)
    assert line.board.now() - at < OFF_S
    return folder


@pytest.mark.timeout(1200)  # 20 times some 13 s on a machine with much else to do
@pytest.mark.parametrize(
    "count, seed", [(2, 1), pytest.param(3, 2, marks=SLOW), pytest.param(20, 3, marks=HOURS)]
)
def test_kill_9_at_a_random_moment(line, tmp_path, count, seed):
    moments = random.Random(seed)
    ran, saved = 0, []
    for k in range(count):
        folder = killed(line, tmp_path, f"run-{k}", moments.uniform(0.0, 5.0) if k else 1.5)
        kept = recording.read(folder)
        assert kept.session["experiment"] == "free-vibration"
        try:
            run = run_from_recording(folder)
        except fx.InputError as error:
            assert "no report" in str(error)  # killed before the board had answered
            continue
        whole(run)
        assert not run.complete and UNEXPLAINED in run.meta["events"][-1]["text"]
        if run.meta["events"][0]["text"] != "nothing was moved":
            ran += 1
        saved.append(folder / "run.parquet")
    assert ran >= 1
    said = ok(line, tmp_path, "last")
    assert "recovered" in said and all(
        path.exists() for path in saved
    )  # each by the start after it


@pytest.mark.parametrize(
    "number",
    [signal.SIGINT, *(pytest.param(n, marks=SLOW) for n in (signal.SIGTERM, signal.SIGHUP))],
)
def test_ctrl_c_and_its_kin_stop_the_motors_in_order(line, tmp_path, number):
    with running(line, *LONG, "--out", "run", cwd=tmp_path) as process:
        moves_for(line, 0.5)
        process.send_signal(number)
        said = finished(process, 130)
    assert "interrupted" in said and not line.driven
    run = fx.Run.read(tmp_path / "run")
    whole(run)
    assert not run.complete and run.t[-1] > 0.3


def test_the_line_is_unplugged(line, tmp_path):
    with running(line, *LONG, "--out", "run", cwd=tmp_path) as process:
        moves_for(line, 0.6)
        line.unplug()
        said = finished(process, 1)
    assert "the line is gone" in said and "the board stops by itself" in said
    whole(run := fx.Run.read(tmp_path / "run"))
    assert not run.complete and run.t[-1] > 0.3
    before = line.board.now()  # the board itself goes on, and hears nothing
    while line.driven:
        line.board.wait(0.002)
    assert line.board.now() - before < 0.3


def test_the_board_is_reset_in_the_middle(line, tmp_path):
    with running(line, *LONG, "--out", "run", cwd=tmp_path) as process:
        moves_for(line, 0.6)
        line.do(line.board.reset)
        said = finished(process, 1)
    assert "the board was reset (external)" in said and not line.driven
    whole(run := fx.Run.read(tmp_path / "run"))
    assert not run.complete and run.t[-1] > 0.3
    ok(line, tmp_path, "next")


class Noisy:
    """A board on a bad line: bytes are changed, and bursts of noise come between."""

    def __init__(self, inner, every=400):
        self.inner, self.random, self.every = inner, random.Random(7), every
        self.label, self.emulated = inner.label, inner.emulated
        self.bad, self.commands = False, 0

    def read(self):
        data = bytearray(self.inner.read())
        if self.bad:
            for k in range(len(data)):
                if self.random.randrange(self.every) == 0:
                    data[k] = self.random.randrange(256)
            if data and self.random.randrange(40) == 0:
                data += self.random.randbytes(50)
        return bytes(data)

    def write(self, data):
        self.commands += (
            self.bad
        )  # never two in a row: at the third the board would stop by itself, as it should
        self.inner.write(
            data
            if self.commands % 10 != 5 or not self.bad
            else data[:-3] + self.random.randbytes(3)
        )

    def wait(self, seconds):
        self.inner.wait(seconds)

    def now(self):
        return self.inner.now()

    def reset(self):
        self.inner.reset()

    def close(self):
        self.inner.close()


def test_garbage_on_the_line_costs_reports_and_nothing_else(tmp_path):
    """One command in ten is damaged, one report in eight: the motion is that of a clean line, the
    gaps are NaN."""
    noisy = Noisy(board())
    plan = plans.free_vibration(BENCH, SETTINGS, 0.3, 1.5)

    def dirty(reports, part):
        noisy.bad = True

    run = experiment(
        plan, tmp_path / "noisy", Hooks(observe=dirty), OpenBoard(noisy, 0, {}, None)
    ).run
    clean = experiment(plan, tmp_path / "clean").run
    assert (
        run.complete
        and run.meta["line"]["bad_frames"] > 20
        and 20 < run.meta["line"]["missing"] < len(run) // 3
    )
    there = np.isfinite(run["joint/2/position"])
    n = min(len(run), len(clean))
    np.testing.assert_allclose(
        run["joint/2/position"][:n][there[:n]], clean["joint/2/position"][:n][there[:n]], atol=0.01
    )
    assert (~there).sum() == run.meta["line"]["missing"]


def limited(size):
    """Files of this process may not grow beyond `size` bytes; the write that would fails, as on a
    full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def test_the_disk_is_full_in_the_middle(line, tmp_path):
    """The system refuses to let the file grow; what had been received is there, to the byte that
    still went in."""
    size = 250_000
    with running(
        line, *LONG, "--out", "run", cwd=tmp_path, preexec_fn=lambda: limited(size)
    ) as process:
        said = finished(process, 1)
    assert "what had been received before is kept" in said and not line.driven
    assert (tmp_path / "run" / recording.RECEIVED).stat().st_size == size
    run = (
        run_from_recording(tmp_path / "run")
        if not (tmp_path / "run" / "run.parquet").exists()
        else fx.Run.read(tmp_path / "run")
    )
    whole(run)
    assert not run.complete and run.t[-1] > 0.3
    ok(line, tmp_path, "next")


def test_no_space_left_on_device(tmp_path, monkeypatch):
    """/dev/full answers every write with ENOSPC: the first byte from the board ends it before
    anything moves."""
    opened = os.open

    def full(path, *arguments, **options):
        if Path(path).name == recording.RECEIVED:
            return opened("/dev/full", os.O_WRONLY)
        return opened(path, *arguments, **options)

    monkeypatch.setattr(recording.os, "open", full)
    made = board()
    with pytest.raises(recording.RecordingError, match="No space left on device"):
        experiment(
            plans.free_vibration(BENCH, SETTINGS, 0.3, 1.5),
            tmp_path / "run",
            opened=OpenBoard(made, 0, {}, None),
        )


def test_a_port_that_another_program_has(line, tmp_path):
    with running(line, *LONG, "--out", "run", cwd=tmp_path):
        second = command(*SHORT, "--port", line.device, "--yes", "--out", "second", cwd=tmp_path)
        assert "cannot be opened" in finished(second, 2)
        assert line.driven and not (tmp_path / "second").exists()


def test_a_silent_port_is_told_and_leaves_nothing_behind(tmp_path):
    master, slave = os.openpty()
    process = command(*SHORT, "--port", os.ttyname(slave), "--yes", "--out", "run", cwd=tmp_path)
    assert "silent, and without a reset line" in finished(process, 1)
    assert not (tmp_path / "run").exists()
    os.close(master)
    os.close(slave)


def test_without_a_person_to_ask_nothing_moves_on_a_real_port(line, tmp_path):
    process = command(*SHORT, "--port", line.device, "--out", "run", cwd=tmp_path)
    assert "--yes: missing" in finished(process, 2)
    assert not (tmp_path / "run").exists()
