"""Commands whose disk fails, whose memory is short, that are killed, or that lose their power: a
sentence, nothing half-written, nothing finished lost."""

import random
import shutil
import signal
import sys
from collections import Counter

import numpy as np
import pytest

import archives
import flexura as fx
from disturbance import power
from disturbance.calls import COMMANDS, Place, files
from disturbance.programs import Program
from flexlab.tuning.history import History
from flexura.io import DRAFT, read_toml, settle

KINDS = ("write", "sync", "rename", "create")
QUICK = ("simulate", "new")
SLOW = [pytest.param(n, marks=pytest.mark.slow) for n in COMMANDS if n not in QUICK]
DONE, STEP = 6, 61  # of long series the first operations are failed, and of the rest a sample
BINDING = 4  # objects of the core that a command makes: nanobind's own table of them may not fail
CORE, NUMPY = "/flexura/_core", "_multiarray_umath"
MEGABYTE = 1 << 20
pytestmark = pytest.mark.timeout(3600)  # a command is called up to some hundreds of times


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    if sys.platform != "linux" or not shutil.which("c++"):
        pytest.skip("the shim needs Linux and a C++ compiler")
    folder = tmp_path_factory.mktemp("disturbed")
    with Program(folder / "program") as program:
        yield Place(program, folder)


def ready(place, name):
    """The command, a fresh working folder, and what else it needs."""
    command = COMMANDS[name]
    if (command.firmware or name == "identify") and place.firmware is None:
        from boards import elf

        place.firmware = elf()
    if name == "identify":
        place.with_experiment()
    work = place.fresh()
    if name == "migrate":
        place.old_robot(work)
    return command, work


def drafts(work):
    """What no command may leave when it ends by itself."""
    return [name for name in files(work) if DRAFT in name]


def ended_well(ended, work, *, killed=False):
    """A sentence and a status; nothing half-written."""
    assert "Traceback" not in ended.err and "Traceback" not in ended.out, ended.err
    if not killed:
        assert ended.status in (0, 1, 2, 130), (ended.status, ended.err)
        assert ended.status == 0 or ended.err.strip(), "no sentence"
        assert not drafts(work), drafts(work)
    readable(work)


def readable(work):
    """Every file that is kept is whole."""
    for path in sorted(work.rglob("*.parquet")):
        if DRAFT in str(path) or path.is_symlink():
            continue
        if path.name.startswith("run") or path.name == "out.parquet":
            fx.Run.read(path)
    for path in work.rglob("population.json"):
        list(fx.Population.read(path.parent))
    for path in work.rglob("*.toml"):
        if DRAFT not in path.name:
            read_toml(path)
    for path in work.rglob("*.rrd"):
        assert DRAFT in path.name or b"RRF2FOOT" in path.read_bytes()[-16:]


# The disk


@pytest.mark.parametrize("name", [*QUICK, *SLOW])
def test_operations_on_the_disk_fail_once(name, place):
    failing_disk(name, place, STEP)


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_every_operation_on_the_disk_fails_once(name, place):
    failing_disk(name, place, 1)


def failing_disk(name, place, step):
    """The n-th operation fails, n = 1, 2, 3, ... until the command passes."""
    counts = Counter()
    for kind in KINDS:
        n = 1
        while True:
            command, work = ready(place, name)
            ended = place.run(command, work, kind=kind, n=n)
            ended_well(ended, work)
            if not ended.disturbed:
                assert ended.status == 0, ended.err
                break
            assert ended.status in (1, 2), (kind, n, ended.err)
            counts[kind] += 1
            if command.resumes and kind == "write":
                again = place.run(command, work)
                assert again.status == 0, again.err
            n += 1 if n < DONE else step
    print(f"{name}: {sum(counts.values())} faults, {dict(counts)}")
    assert set(counts) == set(KINDS) or name == "migrate"


@pytest.mark.parametrize(
    "name",
    [
        "simulate",
        *(pytest.param(n, marks=pytest.mark.slow) for n in ("study", "crosscheck", "review")),
    ],
)
def test_a_failing_disk_keeps_the_finished_results(name, place):
    """A second run over finished results, with other numbers: the old files or the new ones."""
    command, work = ready(place, name)
    assert place.run(command, work).status == 0
    first, faults = files(work), 0
    for kind in KINDS:
        n = 1
        while True:
            _, work = ready(place, name)
            for path, content in first.items():
                (work / path).parent.mkdir(parents=True, exist_ok=True)
                (work / path).write_bytes(content)
            ended = place.run(command, work, "--force", *command.other, kind=kind, n=n)
            assert "Traceback" not in ended.err, ended.err
            settle(work / command.out)
            now = files(work)
            kept = [now.get(path) == content for path, content in first.items()]
            assert set(now) >= set(first), (kind, n, set(first) - set(now))
            assert all(kept) or not any(kept) or not command.other, (kind, n, kept)
            assert not drafts(work)
            if not ended.disturbed:
                assert ended.status == 0
                break
            assert ended.status in (1, 2)
            faults += 1
            n += 1 if n < DONE else STEP
    print(f"{name} over finished results: {faults} faults")
    assert faults >= 8


# Signals


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_three_kills_of_each_command(name, place):
    killed(name, place, 1)


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_twenty_kills_of_each_command(name, place):
    killed(name, place, 20)


def killed(name, place, times):
    """kill -9, SIGINT and SIGTERM at random moments; then the command again."""
    command, work = ready(place, name)
    whole = place.run(command, work)
    assert whole.status == 0, whole.err
    right = numbers(work / command.out)
    chance, counts = random.Random(name), Counter()
    for number in (signal.SIGKILL, signal.SIGINT, signal.SIGTERM):
        for _ in range(times):
            command, work = ready(place, name)
            moment = chance.uniform(0.0, whole.seconds)
            ended = place.run(command, work, signal=int(number), after_s=moment)
            by_itself = number == signal.SIGINT or not ended.sent
            ended_well(ended, work, killed=not by_itself or ended.status < 0)
            counts[f"{number.name} {ended.status}"] += 1
            if ended.status == 0:
                assert numbers(work / command.out) == right
            elif command.resumes:
                again = place.run(command, work)
                assert again.status == 0 and numbers(work / command.out) == right, again.err
    print(f"{name}: {dict(counts)}")


def numbers(out):
    """What was computed: all runs and chunks below a result, and the gains."""
    found = {}
    for path in sorted(out.rglob("*")) if out.is_dir() else [out]:
        if DRAFT in str(path):
            continue
        if path.name in ("run.parquet", "out.parquet"):
            run = fx.Run.read(path)
            found[path.name, path.parent.name] = {k: v.tobytes() for k, v in run.items()}
        elif path.name.startswith("chunk-") or path.suffix == ".toml":
            found[path.name, path.parent.name] = path.read_bytes()
    return found


# Memory


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_two_limits_of_memory(name, place):
    short_memory(name, place, [2, 40])


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_twenty_limits_of_memory(name, place):
    short_memory(name, place, np.geomspace(0.25, 400, 20))


def short_memory(name, place, limits):
    """A command with so many megabytes more than it has when it begins."""
    counts = Counter()
    for megabytes in limits:
        command, work = ready(place, name)
        ended = place.run(command, work, memory=int(megabytes * MEGABYTE))
        counts[ended.status] += 1
        # Arrow and others crash where a small piece of memory is refused: what is kept is whole
        ended_well(ended, work, killed=ended.status < 0)
    print(f"{name}: statuses {dict(counts)}")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["simulate", "simulate --vary", "inverse", "tune"])
def test_every_allocation_of_the_core_fails_once(name, place):
    n, faults, binding = 1, 0, 0
    while True:
        command, work = ready(place, name)
        ended = place.run(command, work, kind="allocation", n=n, library=CORE, bytes=0)
        if ended.status == -signal.SIGABRT:
            binding, n = binding + 1, n + 1
            assert "bad_alloc" in ended.err and binding <= BINDING
            continue
        ended_well(ended, work)
        if not ended.disturbed:
            assert ended.status == 0
            break
        assert ended.status in (0, 1) and (ended.status == 0 or "not enough memory" in ended.err)
        faults += 1
        n += 1 if n < DONE else max(1, n // 4)
    print(f"{name}: {faults} allocations of the core failed, {binding} of the binding's")
    assert faults > DONE


@pytest.mark.slow
@pytest.mark.parametrize("name", ["simulate", "export csv", "export mat"])
def test_every_large_array_fails_once(name, place):
    """Of NumPy, above 16 kB, since the examples are small: what is above 1 MB in use is among
    them."""
    n, faults = 1, 0
    while True:
        command, work = ready(place, name)
        ended = place.run(command, work, kind="array", n=n, library=NUMPY, bytes=16_000)
        ended_well(ended, work)
        if not ended.disturbed:
            break
        assert ended.status in (0, 1), ended.err
        faults += 1
        n += 1 if n < DONE else max(1, n // 4)
    print(f"{name}: {faults} arrays failed")
    assert faults


# The power


def outcomes(place, name, folder, before, *more, count=6, seed=1):
    """Outcomes of a loss of power after each operation of a command, each put into a folder; with
    what the command had said until then."""
    command, work = ready(place, name)
    for path, content in before.items():
        (work / path).parent.mkdir(parents=True, exist_ok=True)
        (work / path).write_bytes(content)
    image = folder / "image"
    shutil.copytree(work, image, symlinks=True)
    log = folder / "log"
    ended = place.run(command, work, *more, kind="write", n=0, log=str(log))
    assert ended.status == 0, ended.err
    done = power.operations(log)
    # the log names the working folder: the image takes its place while it is read
    shutil.rmtree(work)
    shutil.copytree(image, work, symlinks=True)
    for disk, tree in power.losses(work, done, seed, count):
        power.put(tree, folder / "after")
        yield folder / "after" / command.out, disk.said


@pytest.mark.parametrize("old", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_loss_of_power_while_a_run_is_saved(old, place, tmp_path):
    command, work = ready(place, "simulate")
    assert place.run(command, work).status == 0
    before = files(work) if old else {}
    new = place.fresh()
    assert place.run(command, new, *command.other).status == 0
    texts = {"new": same(new / "out")}
    place.run(command, place.fresh())
    texts["old"] = same(place.folder / "work" / "out")
    more = (*command.other, *(("--force",) if old else ()))
    counts = Counter()
    for out, said in outcomes(place, "simulate", tmp_path, before, *more, count=6 if old else 4):
        if not out.exists() or not any(out.iterdir()):
            found = "nothing"
        else:
            found = next((k for k, v in texts.items() if v == same(out)), "wrong")
        counts[found] += 1
        assert found in (("old", "new") if old else ("nothing", "new")), found
        if "stored" in said:
            assert found == "new"
    print(f"a run over {'an old one' if old else 'nothing'}: {dict(counts)}")
    assert counts["new"] > 0 and sum(counts.values()) > 30


def same(folder):
    """The numbers of a run, and its metadata without the duration."""
    run = fx.Run.read(folder)
    meta = {k: v for k, v in run.meta.items() if "wall" not in k}
    return archives.same(
        (run.t, run.channels, {k: meta[k] for k in sorted(meta) if k != "steps_s"})
    )


@pytest.mark.slow
def test_a_loss_of_power_while_a_population_is_simulated(place, tmp_path):
    command, work = ready(place, "simulate --vary")
    assert place.run(command, work).status == 0
    right, counts = numbers(work / "out"), Counter()
    for out, said in outcomes(place, "simulate --vary", tmp_path, {}):
        if (out / "population.json").exists():
            try:
                done = fx.Population.read(out)
                found = "whole" if done.complete else "in part"
            except fx.InputError as error:
                assert "population.json" in str(error)
                found = "refused"
        else:
            found = "nothing"
        counts[found] += 1
        assert "stored" not in said or found == "whole"
        if found == "whole":
            assert numbers(out) == right
    print(f"a population: {dict(counts)}")
    assert counts["whole"] and counts["in part"] and not counts["refused"]


@pytest.mark.slow
def test_a_loss_of_power_while_gains_are_tuned(place, tmp_path):
    command, work = ready(place, "tune")
    assert place.run(command, work).status == 0
    whole = np.load(work / "out" / "state.npz")
    counts = Counter()
    for out, said in outcomes(place, "tune", tmp_path, {}):
        there = (out / "state.npz").exists()
        history = History.open(out, str(whole["digest"])) if there else None
        n = 0 if history is None else len(history)
        if history is not None:
            assert np.array_equal(history.all("points"), whole["points"][: history.evaluations])
        counts[n] += 1
        if "stored" in said:
            assert n == 2 and numbers(out) == numbers(work_copy(out))
    print(f"a search, by generations: {dict(counts)}")
    assert counts[2] and counts[1] and counts[0]


def work_copy(out):
    """The folder itself: all that is in it can be read."""
    assert (out / "gains.toml").exists() and fx.Run.read(out / "best").complete
    return out


@pytest.mark.slow
def test_a_loss_of_power_while_an_experiment_is_recorded(place, tmp_path):
    from flexlab.recordings.run_from_recording import run_from_recording

    command, work = ready(place, "bench step")
    ended = place.run(command, work)
    assert ended.status == 0, ended.err
    whole, counts = fx.Run.read(work / "out"), Counter()
    for out, said in outcomes(place, "bench step", tmp_path, {}, count=3):
        if (out / "run.parquet").exists():
            run, found = fx.Run.read(out), "run"
            assert run.complete
        else:
            try:
                run, found = run_from_recording(out), "recording"
            except fx.InputError:
                run, found = None, "refused"
        counts[found] += 1
        assert "stored" not in said or found == "run"
        if run is not None:
            equal_or_missing(run, whole)
            assert run.complete or any(event["level"] == "ERROR" for event in run.meta["events"])
    print(f"an experiment: {dict(counts)}")
    assert counts["run"] and counts["refused"]


def equal_or_missing(run, whole):
    """Every number of a run is the whole one's, or NaN; time may begin some ticks apart, since the
    start is estimated from what there is. Where nothing had moved, a run says so."""
    if any(event["text"] == "nothing was moved" for event in run.meta["events"]):
        return
    names = ("joint/1/position", "joint/2/position", "link/2/flex_voltage")
    step = np.median(np.diff(whole.t))
    for shift in sorted(range(-5, 6), key=abs):
        at = np.rint((run.t - whole.t[0]) / step).astype(int) + shift
        there = (at >= 0) & (at < len(whole.t))
        pairs = [(run[name][there], whole[name][at[there]]) for name in names]
        if all(np.array_equal(a[np.isfinite(a)], b[np.isfinite(a)]) for a, b in pairs):
            return
    raise AssertionError("a number that the board had not sent")
