"""Commands that lose their power: nothing that was said to be stored is lost, and what there is can
be read."""

import shutil
from collections import Counter

import numpy as np
import pytest

import archives
import flexura as fx
from disturbance import power
from disturbance.calls import files
from disturbance.judgement import numbers, ready
from flexlab.tuning.history import History

pytestmark = pytest.mark.timeout(3600)


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
    """Every number of a run is the whole one's, or NaN; time may begin as far apart as the run
    says, since the start is estimated from what there is. Where nothing had moved, a run says
    so."""
    if any(event["text"] == "nothing was moved" for event in run.meta["events"]):
        return
    names = ("joint/1/position", "joint/2/position", "link/2/flex_voltage")
    step = np.median(np.diff(whole.t))
    unsure = 1 + round(run.meta["start_uncertainty_s"] / step)
    for shift in sorted(range(-max(unsure, 5), max(unsure, 5) + 1), key=abs):
        at = np.rint((run.t - whole.t[0]) / step).astype(int) + shift
        there = (at >= 0) & (at < len(whole.t))
        pairs = [(run[name][there], whole[name][at[there]]) for name in names]
        if all(np.array_equal(a[np.isfinite(a)], b[np.isfinite(a)]) for a, b in pairs):
            return
    raise AssertionError("a number that the board had not sent")
