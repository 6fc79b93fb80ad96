"""Runs whose clocks began at different times, several runs in a review, and peaks that are kept."""

import dataclasses
import json

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

import flexura as fx
from commands import run as command
from flexlab.review import write_review
from flexlab.runs.alignment import best_shift, shifted
from flexlab.runs.export import as_mcap
from flexura.io import Run

UNITS = {
    "joint/1/position": "m",
    "joint/2/position": "rad",
    "link/2/tip_deflection": "m",
}


def measured(start=0.0, step=2e-3, seed=None, first=0.0, last=4.0, robot=True):
    """A move of both joints with a ring; times from `start` on, of the motion's first to last."""
    t = np.arange(first, last, step)
    s = np.clip((t - 0.8) / 0.7, 0, 1)
    cycloid = s - np.sin(2 * np.pi * s) / (2 * np.pi)
    ring = np.where(t > 1.5, np.exp(-1.2 * (t - 1.5)) * np.sin(30 * (t - 1.5)), 0.0)
    channels = dict(zip(UNITS, (0.05 * cycloid, 0.5 * cycloid, 0.004 * ring)))
    if seed is not None:
        rng = np.random.default_rng(seed)
        for values in channels.values():
            values += rng.normal(0, 0.01 * np.ptp(values), len(t))
    meta = {"source": "experiment"} | ({"robot": fx.load("rig").to_dict()} if robot else {})
    return Run(t + start, channels, UNITS, meta)


@pytest.mark.parametrize(
    ("start", "how", "within"),
    [
        (0.35, {}, 1e-5),
        (-0.4321, {"step": 3.3e-3}, 2e-4),
        (5120.1, {"seed": 1}, 1e-3),
        (-17.0, {"first": 1.0, "last": 3.0}, 1e-3),
        (2.5, {"first": 0.5, "step": 0.01, "seed": 2}, 2e-3),
    ],
)
def test_the_shift_between_two_clocks_is_found(start, how, within):
    found = best_shift(measured(), measured(start, **how))
    assert found.seconds == pytest.approx(-start, abs=within) and found.correlation > 0.9


def test_a_shift_moves_events_too():
    run = measured()
    run = dataclasses.replace(run, meta=run.meta | {"events": [{"t": 1.0, "text": "x"}]})
    moved = shifted(shifted(run, 2.0), 0.5)
    assert moved.t[0] == 2.5 and moved.meta["events"][0]["t"] == 3.5
    assert moved.meta["shift_s"] == 2.5 and run.meta["events"][0]["t"] == 1.0


def test_what_does_not_move_is_not_aligned():
    still = Run(np.arange(9.0) / 100, {"joint/1/position": np.ones(9)}, {"joint/1/position": "m"})
    with pytest.raises(fx.InputError, match="a channel in common, in one unit, that moves in both"):
        best_shift(measured(), still)


def test_compare_says_that_no_time_is_in_common(tmp_path):
    measured().save(tmp_path / "a")
    measured(5120.1, seed=3).save(tmp_path / "b")
    a, b = tmp_path / "a", tmp_path / "b"
    status, said, err = command(["compare", a, b, "--out", tmp_path / "x"])
    assert (status, said, err.count("\n")) == (2, "", 1) and not (tmp_path / "x").exists()
    assert "no time in common: 0 to 3.998 s and 5120.1 to 5124.1 s; --align" in err
    status, _, err = command(["compare", a, "--align"])
    assert status == 2 and "two runs" in err
    assert command(["compare", a, b, "--align", "--shift", "1"])[0] == 2


@pytest.mark.slow
def test_compare_moves_the_second_run(tmp_path):
    measured().save(tmp_path / "a")
    measured(5120.1, seed=3).save(tmp_path / "b")
    a, b = tmp_path / "a", tmp_path / "b"
    for words, within in ((["--align"], 1e-3), (["--shift", "-5120.1"], 1e-9)):
        out = tmp_path / words[0].strip("-")
        status, said, err = command(["compare", a, b, *words, "--out", out, "--json"])
        found = json.loads(said)
        assert (status, err) == (0, "")
        assert found["shift_s"] == pytest.approx(-5120.1, abs=within)
        assert all(row["max_relative"] < 0.12 for row in found["deviations"])
        assert all(abs(row["relative"]) < 0.05 for row in found["responses"])


def entities(path):
    return {chunk.entity_path for chunk in RrdReader(path).stream()}


def curve(path, entity):
    """All values of a scalar curve of a review."""
    out = []
    for chunk in RrdReader(path).stream().filter(content=entity):
        batch = chunk.to_record_batch()
        names = [name for name in batch.schema.names if name.endswith(":scalars")]
        out += [x for name in names for row in batch.column(name).to_pylist() for x in row or []]
    return np.array(out)


def test_several_runs_stand_in_one_review_and_a_log_is_drawn_as_the_robot(tmp_path):
    first = measured()
    log = measured(0.1, seed=4, robot=False)
    path = write_review(tmp_path / "x.rrd", [first, log, measured(0.2), measured(0.3)])
    found = entities(path)
    roots = ("experiment", "experiment_2", "experiment_3", "experiment_4")
    for root in roots:
        assert f"/{root}/joint/1/position" in found and f"/{root}/arm/deformed" in found
    for root in roots[1:]:
        assert f"/deviation/{root}/joint/1/position" in found
    assert not any(entity.startswith("/deviation/joint") for entity in found)
    alone = entities(write_review(tmp_path / "y.rrd", [log]))
    assert "/experiment/joint/1/position" in alone and "/experiment/arm/deformed" not in alone


def test_the_command_reviews_three_runs_and_says_what_has_no_time_in_common(tmp_path):
    for name, start in (("a", 0.0), ("b", 0.5), ("c", 100.0)):
        measured(start).save(tmp_path / name)
    words = ["review", tmp_path / "a", tmp_path / "b", tmp_path / "c"]
    status, _, err = command([*words, "--save", tmp_path / "x.rrd"])
    assert status == 0 and err.count("\n") == 1 and "no time in common" in err
    assert command(["review", *[tmp_path / "a"] * 7, "--save", tmp_path / "y.rrd"])[0] == 2


def test_a_curve_keeps_its_extremes_when_it_is_thinned_and_when_it_is_drawn(tmp_path):
    """Case b31: one sample in a million stands out, and the viewer is told to draw extremes."""
    rng = np.random.default_rng(1)
    t = np.arange(400_000) / 1e5
    values = rng.normal(0, 1e-3, len(t))
    values[[123_457, 300_001]] = 0.05, -0.04
    run = Run(t, {"joint/1/position": values}, {"joint/1/position": "rad"})
    still = Run(t, {"joint/1/position": 0 * t}, {"joint/1/position": "rad"})
    path = write_review(tmp_path / "x.rrd", [still, run])
    for entity in ("/simulation_2/joint/1/position", "/deviation/joint/1/position"):
        shown = curve(path, entity)
        assert len(shown) < 0.7 * len(t) and (shown.max(), shown.min()) == (0.05, -0.04)
    policies = set()
    for chunk in RrdReader(path).stream().filter(content="/deviation/**"):
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if "aggregation_policy" in name:
                policies |= {x for row in batch.column(name).to_pylist() for x in row or []}
    assert policies == {rr.components.AggregationPolicy.MinMax.value}


TOPIC = r"(/[A-Za-z][A-Za-z0-9_]*)+"


def test_topics_have_names_that_ros_2_allows(tmp_path):
    """Case b26: a token begins with a letter, and no two channels share a topic."""
    import re

    from mcap.reader import make_reader

    names = ["joint/1/position", "link/2/deflection/0", "sensor/2nd laser", "sensor/2nd_laser"]
    names += ["tip/x", "sensor/größe", "sensor/__", "state/12/a"]
    t = np.arange(3.0) / 10
    run = Run(t, dict.fromkeys(names, t), dict.fromkeys(names, "1"))
    (tmp_path / "x.mcap").write_bytes(as_mcap.write(run))
    with open(tmp_path / "x.mcap", "rb") as stream:
        topics = [c.topic for c in make_reader(stream).get_summary().channels.values()]
    assert len(set(topics)) == len(names) + 1
    assert all(re.fullmatch(TOPIC, topic) and "__" not in topic for topic in topics), topics
