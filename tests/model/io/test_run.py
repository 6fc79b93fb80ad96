"""Runs: exact storage, one name for a channel everywhere, and one error for whatever is no run."""

import json
import os
import random
import signal
import string
import threading

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.io import Run

UNITS = {
    "s": "s",
    "m": "m",
    "rad": "rad",
    "m/s": "m_s",
    "rad/s": "rad_s",
    "N": "N",
    "N m": "N_m",
    "J": "J",
    "V": "V",
    "A": "A",
}
META = {
    "source": "simulation",
    "complete": True,
    "robot": {"name": "rig, ä"},
    "events": [{"t": 0.5, "text": "x", "level": "INFO"}],
}


def example():
    t = np.linspace(0, 1, 11)
    channels = {
        "joint/1/position": np.sin(t),
        "joint/1/velocity": np.cos(t),
        "joint/1/drive": t**3,
        "energy/kinetic": t / 3,
    }
    return Run(t, channels, dict(zip(channels, ("rad", "rad/s", "N m", "J"))), META)


def same_bits(a, b):
    return a.dtype == b.dtype == np.float64 and a.tobytes() == b.tobytes()


def test_a_run_is_read_back_bit_for_bit(tmp_path):
    run = example()
    assert run.save(tmp_path / "new" / "folder") == tmp_path / "new" / "folder" / "run.parquet"
    for place in (
        tmp_path / "new" / "folder",
        tmp_path / "new" / "folder" / "run.parquet",
        str(tmp_path / "new" / "folder"),
    ):
        again = Run.read(place)
        assert same_bits(again.t, run.t) and list(again) == list(run)
        assert all(same_bits(again[name], run[name]) for name in run)
        assert again.units == run.units and again.meta == run.meta and again.complete


ROWS = np.arange(40.0) / 3
bits = st.lists(st.integers(0, 2**64 - 1), min_size=0, max_size=40)


@settings(max_examples=50, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    bits,
    st.text(alphabet=string.ascii_letters + "/_1", min_size=1, max_size=20),
    st.sampled_from(sorted(UNITS)),
)
def test_any_double_is_read_back_bit_for_bit_under_any_name(tmp_path_factory, patterns, name, unit):
    """Not-a-numbers with their payload, infinities, negative zeros, subnormal numbers."""
    values = np.array(patterns, dtype=np.uint64).view(np.float64)
    folder = tmp_path_factory.getbasetemp() / "bits"
    if f"{name}_{UNITS[unit]}" == "time_s":
        return
    t = ROWS[: len(values)]
    Run(t, {name: values}, {name: unit}).save(folder, overwrite=True)
    again = Run.read(folder)
    assert same_bits(again[name], values) and same_bits(again.t, t)
    assert again.units == {name: unit} and again.meta == {}


def test_the_columns_are_named_by_channel_and_unit(tmp_path):
    table = pq.read_table(example().save(tmp_path))
    assert table.column_names == [
        "time_s",
        "joint/1/position_rad",
        "joint/1/velocity_rad_s",
        "joint/1/drive_N_m",
        "energy/kinetic_J",
    ]
    assert all(field.type == pa.float64() for field in table.schema)
    assert [field.metadata[b"unit"].decode() for field in table.schema] == [
        "s",
        "rad",
        "rad/s",
        "N m",
        "J",
    ]
    assert json.loads(table.schema.metadata[b"flexura"]) == META
    np.testing.assert_array_equal(
        table["joint/1/position_rad"].to_numpy(), example()["joint/1/position"]
    )


@pytest.mark.parametrize("unit", UNITS)
def test_every_unit_has_its_suffix_and_comes_back(unit, tmp_path):
    Run(ROWS[:2], {"x": np.ones(2)}, {"x": unit}).save(tmp_path)
    assert pq.read_schema(tmp_path / "run.parquet").names == ["time_s", f"x_{UNITS[unit]}"]
    assert Run.read(tmp_path).units == {"x": unit}


def test_a_channel_whose_name_ends_like_a_unit_keeps_it(tmp_path):
    channels = {"a_m": np.ones(2), "b_rad_s": np.ones(2), "c": np.ones(2)}
    Run(ROWS[:2], channels, {"a_m": "m", "b_rad_s": "rad/s", "c": "1"}).save(tmp_path)
    assert Run.read(tmp_path).units == {"a_m": "m", "b_rad_s": "rad/s", "c": "1"}


def test_channels_that_would_share_a_column_are_refused():
    with pytest.raises(ValueError, match="share a column: a_m_s"):
        Run(np.zeros(2), {"a": np.zeros(2), "a_m": np.zeros(2)}, {"a": "m/s", "a_m": "s"})
    with pytest.raises(ValueError, match="share a column: time_s"):
        Run(np.zeros(2), {"time": np.zeros(2)}, {"time": "s"})


@pytest.mark.parametrize("unit", ["furlong", "", "M", "x/y"])
def test_an_unknown_unit_is_refused(unit):
    with pytest.raises(ValueError, match=f"channel x has the unit '{unit}'; known: s, m, rad"):
        Run(np.zeros(2), {"x": np.zeros(2)}, {"x": unit})


@pytest.mark.parametrize("shape", [(), (2,), (4,), (3, 1), (1, 3)])
def test_a_channel_of_another_shape_than_the_times_is_refused(shape):
    with pytest.raises(ValueError, match="channel x has shape"):
        Run(np.zeros(3), {"x": np.zeros(shape)}, {"x": "m"})


@pytest.mark.parametrize("units", [{}, {"x": "m", "y": "m"}, {"y": "m"}])
def test_a_unit_for_every_channel_and_no_other(units):
    with pytest.raises(ValueError, match="channels and units differ"):
        Run(np.zeros(3), {"x": np.zeros(3)}, units)


def test_a_channel_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(
        KeyError, match="no channel 'joint/2/position'; there are: joint/1/position"
    ):
        example()["joint/2/position"]
    run = example()
    assert "joint/1/position" in run and "joint/2/position" not in run and len(run) == 11


def test_a_run_is_complete_unless_it_says_otherwise():
    assert Run(np.zeros(1), {}, {}).complete
    assert not Run(np.zeros(1), {}, {}, {"complete": False}).complete


def test_a_run_without_samples_or_channels_is_a_run(tmp_path):
    Run(np.zeros(0), {"x": np.zeros(0)}, {"x": "m"}).save(tmp_path)
    assert len(Run.read(tmp_path)) == 0
    Run(np.arange(3.0), {}, {}).save(tmp_path, overwrite=True)
    assert list(Run.read(tmp_path)) == [] and len(Run.read(tmp_path)) == 3


def test_the_name_of_the_folder_is_no_data(tmp_path):
    """Parquet readers take folders named key=value for a column."""
    folder = tmp_path / "beam=ge"
    example().save(folder)
    assert list(Run.read(folder)) == list(example())


def refused(place, words):
    with pytest.raises(fx.InputError) as caught:
        Run.read(place)
    assert (
        words in str(caught.value)
        and str(place) in str(caught.value)
        and str(caught.value).isprintable()
    )


def test_a_folder_without_a_run_is_named(tmp_path):
    refused(tmp_path, "no run here: expected a folder with run.parquet")
    refused(tmp_path / "absent", "no run here: expected a folder with run.parquet")
    (tmp_path / "run.parquet").mkdir()
    refused(tmp_path, "no run here")


def column(*values, type=None):
    return pa.array(values, type or pa.float64())


T, STORED = ("time_s", column(0, 1)), {"flexura": "{}"}
OTHER_PARQUET = {
    "another's Parquet": (
        [T, ("x_m", column(1, 2))],
        None,
        "m",
        "a Parquet file, but not a run of flexura",
    ),
    "no times": ([("x_m", column(1, 2))], STORED, "m", "a Parquet file, but not a run of flexura"),
    "metadata that are no JSON": ([T], {"flexura": "{"}, "m", "a damaged run"),
    "metadata that are no text": ([T], {"flexura": b"\xff\xfe"}, "m", "a damaged run"),
    "metadata that are no table": ([T], {"flexura": "[1]"}, "m", "a damaged run"),
    "a foreign unit": (
        [T, ("x_m", column(1, 2))],
        STORED,
        "furlong",
        "a damaged run (channel x_m has the unit 'furlong'",
    ),
    "a unit that is no text": ([T, ("x_m", column(1, 2))], STORED, b"\xff", "a damaged run"),
    "texts": ([T, ("x_m", column("a", "b", type=pa.string()))], STORED, "m", "a damaged run"),
    "lists": (
        [T, ("x_m", column([1.0], [2.0], type=pa.list_(pa.float64())))],
        STORED,
        "m",
        "a damaged run",
    ),
    "a column given twice": (
        [T, ("x_m", column(1, 2)), ("x_m", column(1, 2))],
        STORED,
        "m",
        "run.parquet: ",
    ),
}


@pytest.mark.parametrize(
    "columns, metadata, unit, words", OTHER_PARQUET.values(), ids=OTHER_PARQUET
)
def test_other_parquet_is_no_run(columns, metadata, unit, words, tmp_path):
    schema = pa.schema(
        [pa.field(name, v.type, metadata={"unit": unit}) for name, v in columns], metadata=metadata
    )
    pq.write_table(
        pa.Table.from_arrays([v for _, v in columns], schema=schema), tmp_path / "run.parquet"
    )
    refused(tmp_path, words)


@pytest.mark.parametrize(
    "content", [b"", b"PAR1", b"PAR1PAR1", b"rubbish" * 100, b"\0" * 1000, b'name = "rig"\n']
)
def test_rubbish_is_no_run(content, tmp_path):
    (tmp_path / "run.parquet").write_bytes(content)
    refused(tmp_path, "not a Parquet file")


def test_a_damaged_file_never_raises_anything_else(tmp_path):
    good, rng = example().save(tmp_path).read_bytes(), random.Random(1)
    for trial in range(300):
        raw = bytearray(good)
        for _ in range(rng.randint(1, 4)):
            raw[rng.randrange(len(raw))] = rng.randrange(256)
        (tmp_path / "run.parquet").write_bytes(
            raw[: rng.randrange(len(raw))] if trial % 3 == 0 else raw
        )
        try:
            Run.read(tmp_path)
        except fx.InputError as error:
            assert str(error).isprintable()


@pytest.mark.parametrize("earlier", [False, True])
def test_a_run_that_cannot_be_stored_leaves_what_was_there(tmp_path, monkeypatch, earlier):
    if earlier:
        example().save(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(fx.InputError, match=r"run\.parquet: cannot be written \(disk full\)"):
        Run(ROWS[:2], {}, {}).save(tmp_path, overwrite=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_run_that_is_there_is_replaced_only_if_that_is_asked_for(tmp_path):
    first = example().save(tmp_path).read_bytes()
    other = Run(ROWS[:2], {}, {})
    with pytest.raises(fx.InputError, match=r"run\.parquet: a file is there.*overwrite=True"):
        other.save(tmp_path)
    assert (tmp_path / "run.parquet").read_bytes() == first
    other.save(tmp_path, overwrite=True)
    assert len(Run.read(tmp_path)) == 2


def test_a_run_interrupted_while_it_is_written_leaves_nothing(tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        example().save(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_metadata_that_json_cannot_hold_are_refused_before_anything_is_written(tmp_path):
    with pytest.raises(TypeError, match="JSON"):
        Run(ROWS[:2], {}, {}, {"robot": object()}).save(tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("t", "row", "said"),
    [
        ([0.0, 0.1, np.nan, 0.3], 3, "nan: expected a finite"),
        ([0.0, 0.1, 0.1, 0.2], 3, "stands there twice"),
        ([0.3, 0.2, 0.1, 0.0], 2, "falls from 0.3 to 0.2 s"),
        ([0.0, 1.0, 2.0, 0.0], 4, "the clock was reset"),
        ([0.0, np.inf, 2.0, 3.0], 2, "inf: expected a finite"),
    ],
)
def test_a_clock_that_is_none_is_named_with_its_row(t, row, said):
    with pytest.raises(fx.InputError, match=f"row {row}: .*{said}"):
        Run(np.array(t), {}, {})


def test_milliseconds_that_pass_for_seconds_are_refused_for_experiments_only():
    t = np.arange(0.0, 200.0, 2.0)
    assert len(Run(t, {}, {}, {"source": "simulation"})) == 100
    with pytest.raises(fx.InputError, match=r"row 2: the time is 2 s after row 1: .*milliseconds"):
        Run(t, {}, {}, {"source": "experiment"})


def test_a_clock_of_the_calendar_counts_from_the_first_sample():
    run = Run(1.7e9 + np.arange(5) / 4, {}, {}, {"source": "experiment"})
    assert run.t.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0] and run.meta["clock_start_s"] == 1.7e9
    assert Run(5120.1 + np.arange(5) / 4, {}, {}).t[0] == 5120.1


@pytest.mark.parametrize(
    ("given", "si", "value"),
    [
        ("mm", "m", 0.0125),
        ("deg", "rad", np.deg2rad(12.5)),
        ("rev", "rad", 25 * np.pi),
        ("turns", "rad", 25 * np.pi),
        ("counts", "1", 12.5),
        ("m/s2", "m/s^2", 12.5),
        ("g", "m/s^2", 12.5 * 9.80665),
        ("degC", "K", 285.65),
        ("%", "1", 0.125),
        ("deg/s", "rad/s", np.deg2rad(12.5)),
        ("rpm", "rad/s", 12.5 * np.pi / 30),
        ("mNm", "N m", 0.0125),
        ("kN/mm", "N/m", 1.25e7),
        ("µm", "m", 1.25e-5),
        ("mm/s²", "m/s^2", 0.0125),
        ("mJ", "J", 0.0125),
        ("bar", "Pa", 1.25e6),
    ],
)
def test_other_units_become_those_of_si_and_the_metadata_keep_them(given, si, value):
    run = Run(ROWS[:1], {"sensor/x": np.array([12.5])}, {"sensor/x": given}, {"source": "twin"})
    assert run.units == {"sensor/x": si} and run["sensor/x"][0] == pytest.approx(value, rel=1e-15)
    assert run.meta == {"source": "twin", "original_units": {"sensor/x": given}}


def test_a_sensor_may_have_any_unit(tmp_path):
    Run(ROWS[:2], {"sensor/x": np.ones(2)}, {"sensor/x": "furlong/h 2"}).save(tmp_path)
    again = Run.read(tmp_path)
    assert again.units == {"sensor/x": "furlong/h 2"} and list(again) == ["sensor/x"]


def test_a_part_of_a_run_ends_a_search():
    """Where many runs are made, one that Ctrl-C ended must not count as one that failed."""
    run = fx.simulate("rig", [0.0, 0.01])
    assert run.uninterrupted() is run
    ended = fx.simulate("rig", np.linspace(0.0, 0.1, 11), lambda t: stop_at(t, 0.05))
    assert ended.interrupted and not ended.complete
    with pytest.raises(KeyboardInterrupt):
        ended.uninterrupted()


def stop_at(t, end):
    if t >= end:
        signal.raise_signal(signal.SIGINT)
    return [0.0, 0.0]


@pytest.mark.parametrize("after_s", [0.3, 0.6])
def test_ctrl_c_ends_a_search_of_runs(after_s):
    """Once, the least time went on with the part of a motion."""
    threading.Timer(after_s, lambda: signal.raise_signal(signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        while True:
            fx.time_optimal("single-r", [0.0], [0.5], {"drive": [1.0]}, intervals=40)
