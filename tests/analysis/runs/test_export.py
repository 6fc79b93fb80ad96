"""A run in other formats, read back by programs that did not write it: numpy, DuckDB, a reader by
NI's text, Rerun."""

import io
import json
import re
import struct
import subprocess
from dataclasses import replace

import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st

from flexlab.cli.export import forms
from flexlab.review.headless import executable
from flexlab.runs.export.names import topics, variables
from flexura.errors import InputError
from flexura.io import EMULATED, Run

UNITS = {
    "joint/1/position": "m",
    "joint/2/velocity": "rad/s",
    "joint/1/drive": "N",
    "joint/2/drive": "N m",
    "joint/1/voltage": "V",
    "energy/strain": "J",
    "link/2/tip_deflection": "m",
}


@pytest.fixture(scope="module")
def run():
    """Numbers that a careless writer changes: no short decimals, very large and very small,
    negative zero, gaps."""
    rng, t = np.random.default_rng(7), np.arange(257) / 200
    channels = {
        name: rng.normal(size=len(t)) * 10.0 ** rng.integers(-12, 9, len(t)) for name in UNITS
    }
    for k, values in enumerate(channels.values()):
        values[k:40:11] = np.nan
        values[100] = -0.0
    meta = {
        "source": "experiment",
        "kind": "experiment",
        "emulated": True,
        "label": "emulated experiment",
        "experiment": "inverse",
        "robot": {"name": 'rig "β", 2\n'},
        "seed": 3,
        "started": "2026-11-24T11:00:00.25+00:00",
        "complete": True,
        "events": [],
    }
    return Run(t, channels, UNITS, meta)


def written(run, form, tmp_path):
    path = tmp_path / f"run.{form}"
    path.write_bytes(forms()[form](run))
    return path


def same(run, name, values):
    expected = run.t if name == "time" else run[name]
    np.testing.assert_array_equal(np.asarray(values), expected, strict=True)
    assert np.array_equal(np.signbit(values), np.signbit(expected)) or np.isnan(expected).any()


def test_csv_read_by_numpy(run, tmp_path):
    path = written(run, "csv", tmp_path)
    lines = path.read_text().splitlines()
    assert lines[0] == "# experiment (emulated)" and lines[1] == f"# {EMULATED}"
    units, meta = (json.loads(line.split(": ", 1)[1]) for line in lines[2:4])
    assert lines[4].startswith("# digest: ")
    assert meta == run.meta
    names = lines[5].split(",")
    table = np.genfromtxt(path, delimiter=",", comments="#", skip_header=6)
    assert table.shape == (len(run), len(names))
    for k, name in enumerate(["time", *run]):
        column = "time_s" if name == "time" else run.column(name)
        assert names[k] == column and units[column] == ("s" if name == "time" else UNITS[name])
        same(run, name, table[:, k])


def test_parquet_read_by_duckdb(run, tmp_path):
    import duckdb

    path = written(run, "parquet", tmp_path)
    found = duckdb.sql(f"select * from read_parquet('{path}')").fetchnumpy()
    assert list(found) == ["time_s", *map(run.column, run)]
    for name in ("time", *run):
        values = found["time_s" if name == "time" else run.column(name)]
        assert not np.ma.is_masked(values)  # NaN is a number that is none, not a missing one
        same(run, name, np.asarray(values))
    ((stored,),) = duckdb.sql(
        f"select value from parquet_kv_metadata('{path}') where key = 'flexura'"
    ).fetchall()
    assert json.loads(stored) == run.meta and json.loads(stored)["emulated"] is True


def test_tdms_read_by_its_description(run, tmp_path):
    objects = tdms(written(run, "tdms", tmp_path).read_bytes())
    about = objects["/"][0]
    assert (
        about["label"] == "experiment (emulated)" == about["name"]
        and about["description"] == EMULATED
    )
    assert about["emulated"] is True and json.loads(about["flexura"]) == run.meta
    assert objects["/'run'"][0]["label"] == "experiment (emulated)"
    for name in ("time", *run):
        properties, values = objects[f"/'run'/'{name}'"]
        assert properties["unit_string"] == ("s" if name == "time" else UNITS[name])
        same(run, name, values)
        if name != "time":
            assert (
                properties["wf_increment"] == pytest.approx(1 / 200)
                and properties["wf_start_offset"] == 0.0
            )


def test_tdms_without_even_times_has_no_time_base(run, tmp_path):
    t = run.t.copy()
    t[5] += 1e-3
    objects = tdms(written(replace(run, t=t), "tdms", tmp_path).read_bytes())
    properties, _ = objects["/'run'/'joint/1/position'"]
    assert "wf_increment" not in properties
    np.testing.assert_array_equal(objects["/'run'/'time'"][1], t)


def tdms(data):
    """Properties and values by object path, as in NI's "TDMS File Format Internal Structure": one
    segment, not interleaved."""
    assert data[:4] == b"TDSm"
    mask, version, _, raw_at = struct.unpack_from("<IIQQ", data, 4)
    assert (
        version in (4712, 4713)
        and mask & 0b1110 == 0b1110
        and not mask & (1 << 5)
        and not mask & (1 << 6)
    )
    at = 28

    def number(form):
        nonlocal at
        (value,) = struct.unpack_from("<" + form, data, at)
        at += struct.calcsize(form)
        return value

    def text():
        nonlocal at
        size = number("I")
        at += size
        return data[at - size : at].decode()

    found, raw = {}, 28 + raw_at
    for _ in range(number("I")):
        path, index, count = text(), number("I"), 0
        if index != 0xFFFFFFFF:
            kind, dimension, count = number("I"), number("I"), number("Q")
            assert kind == 10 and dimension == 1  # double
        properties = {}
        for _ in range(number("I")):
            name, kind = text(), number("I")
            properties[name] = (
                text()
                if kind == 0x20
                else bool(number("B"))
                if kind == 0x21
                else number(
                    {
                        1: "b",
                        2: "h",
                        3: "i",
                        4: "q",
                        5: "B",
                        6: "H",
                        7: "I",
                        8: "Q",
                        9: "f",
                        10: "d",
                    }[kind]
                )
            )
        found[path] = properties, np.frombuffer(data, "<f8", count, raw)
        raw += 8 * count
    assert at == 28 + raw_at and raw == len(data)
    return found


@pytest.mark.parametrize("started", ["2026-11-24T11:00:00.25+00:00", None])
def test_mcap_read_by_rerun(run, started, tmp_path):
    import pyarrow as pa
    from rerun.chunk import RrdReader

    run = replace(run, meta=run.meta | {"started": started})
    path, converted = written(run, "mcap", tmp_path), tmp_path / "run.rrd"
    subprocess.run(
        [str(executable()), "mcap", "convert", str(path), "-o", str(converted)],
        check=True,
        capture_output=True,
        timeout=60,
    )
    values, stamps, units, about = {}, {}, {}, {}
    named = {topic[1:]: name for name, topic in topics(("time", *run)).items()}
    for chunk in RrdReader(converted).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            cells = batch.column(name)
            if name == "std_msgs.msg.Float64:message":
                values.setdefault(named[chunk.entity_path[1:]], []).extend(
                    cell[0]["data"] for cell in cells.to_pylist()
                )
                at = batch.column("message_log_time").cast(pa.int64()).to_pylist()
                stamps.setdefault(named[chunk.entity_path[1:]], []).extend(at)
            elif name == "McapChannel:metadata":
                units[named[chunk.entity_path[1:]]] = {
                    pair["first"]: pair["second"] for pair in cells[0].as_py()[0]
                }
            elif chunk.entity_path == "/__mcap_metadata" and name == "flexura":
                about = {pair["first"]: pair["second"] for pair in cells[0].as_py()[0]}
    assert set(values) == {"time", *run}
    start = 1795518000_250_000_000 if started else 0
    for name in values:
        order = np.argsort(stamps[name], kind="stable")
        same(run, name, np.array(values[name])[order])
        np.testing.assert_array_equal(
            np.array(stamps[name])[order], start + np.rint(run.t * 1e9).astype(np.int64)
        )
        assert units[name] == {
            "unit": "s" if name == "time" else UNITS[name],
            "label": "experiment (emulated)",
            "channel": name,
        }
    assert about["label"] == "experiment (emulated)" and about["description"] == EMULATED
    assert json.loads(about["meta"]) == run.meta and about["start_ns"] == str(start)


TOPIC = re.compile(r"(/[A-Za-z](_?[A-Za-z0-9])*)+")  # ROS 2: no token begins with a digit, no __


@pytest.mark.parametrize(
    "name, topic",
    [
        ("joint/1/position", "/joint_1/position"),
        ("link/2/deflection/8", "/link_2/deflection_8"),
        ("sensor/strain gauge, 3", "/sensor/strain_gauge_3"),
        ("sensor/__x__", "/sensor/x"),
        ("sensor/β", "/sensor"),
    ],
)
def test_topics_are_names_that_ros_2_allows(name, topic):
    assert topics([name]) == {name: topic} and TOPIC.fullmatch(topic)


@given(st.lists(st.text(alphabet="a1_/ β", min_size=1, max_size=12), unique=True))
def test_any_names_give_topics_and_variables_that_differ(names):
    for made, allowed in ((topics, TOPIC), (variables, re.compile(r"[A-Za-z]\w{0,62}", re.A))):
        found = made(names)
        assert len(set(found.values())) == len(names)
        assert all(allowed.fullmatch(new) for new in found.values())


def test_mat_read_by_scipy(run, tmp_path):
    path = written(run, "mat", tmp_path)
    found = scipy.io.loadmat(path, simplify_cells=True)
    for name, new in variables(("t", *run)).items():
        same(run, "time" if name == "t" else name, found[new])
        assert found["units"][new] == ("s" if name == "t" else UNITS[name])
        assert found["channels"][new] == name
    assert found["joint_1_position"].shape == (len(run),)
    about = found["meta"]
    assert about["label"] == "experiment (emulated)" and about["description"] == EMULATED
    assert json.loads(about["json"]) == run.meta and about["seed"] == 3
    assert about["robot"]["name"] == run.meta["robot"]["name"]
    assert path.read_bytes() == forms()["mat"](run)  # the same run, the same bytes


def test_mcap_refuses_what_it_cannot_say(run):
    with pytest.raises(InputError, match="started = 'noon': expected a time in ISO form"):
        forms()["mcap"](replace(run, meta=run.meta | {"started": "noon"}))
    with pytest.raises(InputError, match="not before 1970"):
        forms()["mcap"](replace(run, t=run.t - 1, meta={}))


@pytest.mark.parametrize("form", forms())
def test_a_measurement_or_simulation_is_not_called_emulated(form, run):
    for meta in ({"source": "experiment", "emulated": False}, {"source": "simulation"}):
        data = forms()[form](replace(run, meta=meta))
        if form == "mat":
            data = str(scipy.io.loadmat(io.BytesIO(data))).encode()
        assert b"(emulated)" not in data and EMULATED.encode() not in data


@pytest.mark.parametrize("form", forms())
def test_an_empty_run_is_written(form, run, tmp_path):
    empty = Run(np.zeros(0), {name: np.zeros(0) for name in UNITS}, UNITS, run.meta)
    assert written(empty, form, tmp_path).stat().st_size > 100
