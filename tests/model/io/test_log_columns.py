"""Columns with other clocks, columns that are left out, and files whose names mislead."""

import logging

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

import flexura as fx
from flexura.io.logs import read_log, read_map, understood
from foreign_logs import bag, hdf5_file, numbers, tdms_file, text_file

T, A, W, F = numbers()
T_FAST = np.arange(300) / 250
START = np.datetime64("2026-11-29T14:03:05")


def channel(group, name, values, **properties):
    import nptdms

    return nptdms.ChannelObject(group, name, values, properties)


def written(path, *channels):
    import nptdms

    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(list(channels))
    return path


def two_clocks(path, time=T_FAST, **properties):
    """A column of times, and a channel with a time base of its own, ten times as slow."""
    slow = 3 * np.arange(30) / 25
    about = {"unit_string": "mm", "wf_increment": 0.04} | properties
    return written(
        path,
        channel("G", "Time", time, unit_string="s"),
        channel("G", "pos", np.sin(T_FAST), unit_string="rad"),
        channel("H", "slow", slow, **about),
    )


MAP = """
[time]
column = "Time"
[channel."joint/1/position"]
column = "pos"
[channel."sensor/slow"]
column = "slow"
"""


def run_of(path, folder, text=MAP, every=False):
    (folder / "map.toml").write_text(text)
    return understood(read_log(path), read_map(folder / "map.toml"), every=every)


@pytest.mark.parametrize("calendar", [False, True])
@pytest.mark.parametrize("late", [0.0, 0.2])
@pytest.mark.parametrize("every", [False, True])
def test_a_channel_with_its_own_time_base_is_interpolated_beside_a_column_of_times(
    calendar, late, every, tmp_path
):
    begin = START + np.timedelta64(round(1e3 * late), "ms")
    about = {"wf_start_time": begin} if calendar else {"wf_start_offset": late}
    time = START + (T_FAST * 1e9).round().astype("timedelta64[ns]") if calendar else T_FAST
    path = two_clocks(tmp_path / "a.tdms", time, **about)
    found = understood(read_log(path), every=True) if every else run_of(path, tmp_path)
    assert found.left == [] and found.notes == [
        "'slow' is interpolated: its clock is the channels' time base, 0.04 s a sample"
    ]
    slow = found.run["sensor/slow"]
    edges = np.abs(found.run.t - late) < 1e-6  # doubles of a calendar have 2.4e-7 s
    inside = (found.run.t > late) & (found.run.t < late + 29 * 0.04 - 1e-6) & ~edges
    np.testing.assert_allclose(slow[inside], 3e-3 * (found.run.t - late)[inside], atol=1e-9)
    assert np.isnan(
        slow[(found.run.t < late - 1e-6) | (found.run.t > late + 29 * 0.04 + 1e-6)]
    ).all()


def test_clocks_of_which_one_is_of_the_calendar_are_not_put_together(tmp_path):
    path = two_clocks(tmp_path / "a.tdms", wf_start_time=START)
    said = "begins at 17959.* s, that of the run at 0 s: one of them is of the calendar"
    with pytest.raises(fx.InputError, match=f"'slow'.*{said}"):
        run_of(path, tmp_path)
    found = understood(read_log(path), every=True)
    assert found.left == ["slow"] and "of the calendar" in found.why["slow"]


def test_a_clock_that_is_not_taken_is_said(tmp_path):
    path = written(
        tmp_path / "a.tdms",
        channel("G", "Time", T_FAST, unit_string="s"),
        channel("G", "pos", T_FAST, unit_string="rad", wf_increment=0.004),
        channel("G", "far", T_FAST, unit_string="rad", wf_increment=1.0),
    )
    found = understood(read_log(path), every=True)
    assert found.notes == [
        "'far' is taken row by row: its own clock, the channels' time base, 1 s a sample, "
        "is not taken"
    ]


def test_topics_are_put_together_where_a_field_is_the_clock(tmp_path):
    """By the stamps of its messages, even if both topics have as many."""
    from mcap.writer import Writer

    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b"{}")
        for topic, step in (("/fast", 10**7), ("/slow", 2 * 10**7)):
            number = writer.register_channel(topic, "json", schema)
            for k in range(100):
                data = b'{"clock": %f, "y": %f}' % (k / 100, k * step / 1e9)
                writer.add_message(number, 10**18 + k * step, data, 10**18 + k * step)
        writer.finish()
    text = '[time]\ncolumn = "/fast.clock"\nunit = "s"\n[channel."sensor/y"]\ncolumn = "/slow.y"\n'
    found = run_of(tmp_path / "a.mcap", tmp_path, text)
    np.testing.assert_allclose(found.run["sensor/y"], np.arange(100) / 100, atol=1e-9)


def reasons(path):
    return understood(read_log(path), every=True).why


def test_what_is_left_out_with_all_is_left_out_for_a_reason(tmp_path):
    rows = "".join(f"{k / 100},{k},RUN,{'x' if k == 7 else k}\n" for k in range(20))
    (tmp_path / "a.csv").write_text(f"Time [s],n,state,part\n{rows}")
    assert reasons(tmp_path / "a.csv") == {
        "state": "no numbers: row 1 (line 2): 'RUN' is no number",
        "part": "row 8 (line 9): 'x' is no number",
    }
    path = written(
        tmp_path / "a.tdms",
        channel("G", "Time", T_FAST, unit_string="s"),
        channel("G", "pos", T_FAST),
        channel("G", "short", T_FAST[:290]),
        channel("G", "words", ["a", "b"]),
    )
    assert reasons(path) == {"short": "290 rows, the clock has 300", "words": "no numbers"}
    pq.write_table(pa.table({"Time": T, "n": A, "word": ["a"] * len(T)}), tmp_path / "a.parquet")
    assert reasons(tmp_path / "a.parquet") == {"word": "no numbers"}
    held = {"Time": T, "n": A, "short": A[:9], "who": "me", "rate": 3.0, "cube": np.ones((3, 3, 3))}
    savemat(tmp_path / "a.mat", held | {"image": np.ones((300, 300))})
    assert reasons(tmp_path / "a.mat") == {
        "short": f"9 rows, the clock has {len(T)}",
        "who": "a text",
        "rate": "one number",
        "cube": "3 dimensions",
        "image": "300 columns, more than 200",
    }


def test_a_map_takes_the_other_columns_with_all(tmp_path):
    path = two_clocks(tmp_path / "a.tdms")
    text = '[time]\ncolumn = "Time"\n[channel."joint/1/position"]\ncolumn = "pos"\n'
    assert run_of(path, tmp_path, text).left == ["slow"]
    found = run_of(path, tmp_path, text, every=True)
    assert list(found.run) == ["joint/1/position", "sensor/slow"] and found.left == []


def test_times_of_the_log_are_not_called_stamps(tmp_path):
    bare = understood(read_log(bag(tmp_path / "a", T, (A, W, F), stamped=False)), every=True)
    assert bare.clock == "the log's times of /joint_states, which has no stamps"
    stamped = understood(read_log(bag(tmp_path / "b", T, (A, W, F))), every=True)
    assert stamped.clock == "the stamps of /joint_states"


@pytest.mark.parametrize("suffix", [".mat", ".tdms", ".mcap", ".parquet", ".h5", ".bag", ".lvm"])
def test_what_a_file_is_says_its_content(suffix, tmp_path):
    heads = ["Time [s]", "joint/1/position [rad]"]
    path = text_file(tmp_path / f"text{suffix}", (T, A), [heads])
    assert understood(read_log(path)).form.startswith("CSV")
    for other, form in ((tmp_path / "a", "4"), (tmp_path / "b", "5")):
        savemat(other, {"Time": T, "n": A}, format=form, appendmat=False)
        place = other.rename(tmp_path / f"mat{form}{suffix}")
        assert understood(read_log(place), every=True).form == "MAT"
    path.write_bytes(bytes(range(256)) * 9)
    with pytest.raises(fx.InputError, match=r"its first bytes are others|not a text"):
        read_log(path)


def test_a_reader_says_nothing_past_the_notes(tmp_path, capfd, recwarn):
    """Texts in the code page of a machine, and damage that npTDMS reads past."""
    logging.getLogger("nptdms").setLevel(logging.WARNING)
    path = tdms_file(
        tmp_path / "a.tdms", (T, A), ("Time", "Angle"), ("s", "rad"), note="Gr\xf6\xdfe"
    )
    raw = path.read_bytes()
    path.write_bytes(raw.replace("Gr\xf6\xdfe".encode(), b"Gr\xf6\xdfe.."))
    found = understood(read_log(path), every=True)
    said = "texts are not UTF-8, \ufffd stands for what cannot be read: 'Gr\ufffd\ufffde..'"
    assert said in found.notes
    path.write_bytes(raw.replace(b"\x68\x12\0\0", b"\x6a\x12\0\0", 1))
    with pytest.raises(fx.InputError, match="a damaged TDMS file"):
        read_log(path)
    savemat(tmp_path / "a.mat", {"Time": T, "n": A})
    raw = (tmp_path / "a.mat").read_bytes()
    (tmp_path / "a.mat").write_bytes(raw + raw[128:])  # each variable twice
    notes = understood(read_log(tmp_path / "a.mat"), every=True).notes
    assert [note for note in notes if note.startswith("its reader says: Duplicate variable name")]
    assert capfd.readouterr().err == "" and not recwarn.list


def test_parts_that_are_missing_in_an_hdf5_file_are_said(tmp_path):
    import h5py

    path = hdf5_file(tmp_path / "a.h5", ["Time"], [T], matlab=False)
    with h5py.File(path, "a") as stored:
        made = stored.create_dataset("n", shape=(len(T),), chunks=(60,), dtype=float)
        made[:120] = A[:120]
    notes = understood(read_log(path), every=True).notes
    assert "'n': 2 of 4 parts are in the file, the others are read as 0" in notes


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_dates_and_times_apart_in_parquet_are_one_clock(unit, tmp_path):
    kind = pa.time32(unit) if unit in ("s", "ms") else pa.time64(unit)
    ticks = np.arange(9) * {"s": 1, "ms": 50, "us": 50_000, "ns": 50_000_000}[unit]
    ticks = pa.array(ticks).cast(pa.int32() if unit in ("s", "ms") else pa.int64())
    dates = pa.array(np.full(9, "2026-11-29", dtype="datetime64[D]"))
    table = {"Date": dates, "Clock": ticks.cast(kind), "n": np.arange(9.0)}
    if unit == "s":
        table["Date"] = dates.cast(pa.date64())
    pq.write_table(pa.table(table), tmp_path / "a.parquet")
    log = read_log(tmp_path / "a.parquet")
    column = log.columns[1]
    step = 1.0 if unit == "s" else 0.05
    np.testing.assert_allclose(column.since, step * np.arange(9), atol=1e-12)
    assert column.values[0] == np.datetime64("2026-11-29", "s").astype(int)
    found = understood(log, every=True)
    assert found.clock == "'Date' and 'Clock'" and list(found.run) == ["sensor/n"]


def test_a_channel_with_its_own_time_base_is_interpolated_beside_a_rate(tmp_path):
    path = two_clocks(tmp_path / "a.tdms")
    found = run_of(path, tmp_path, MAP.replace('column = "Time"', "rate_Hz = 250"))
    assert "'slow' is interpolated" in found.notes[0] and len(found.run) == 300
    np.testing.assert_allclose(found.run["sensor/slow"][:280], 3e-3 * T_FAST[:280], atol=1e-12)
