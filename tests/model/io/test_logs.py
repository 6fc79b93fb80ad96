"""Logs of other programs: twenty files that their libraries wrote are read back bit for bit."""

from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import flexura as fx
from flexura.io.logs import read_log, read_map, understood
from foreign_logs import (
    bag,
    hdf5_file,
    json_mcap,
    klipper,
    lvm_file,
    mapped,
    numbers,
    tdms_file,
    text_file,
)

T, A, W, F = numbers()
WHOLE = np.rint(T * 1e9) / 1e9  # a clock that nanoseconds hold
HEADS = ("Time", "Angle", "Deflection", "Force")
GERMAN = [("Zeit", "Winkel", "Auslenkung", "Kraft"), ("[s]", "[rad]", "[m]", "[N]")]
DATA = (T, A, W, F)


def csv_with_channels(p):
    heads = ["Time [s]", "joint/1/position [rad]", "link/1/tip_deflection [m]", "sensor/force [N]"]
    return text_file(p / "a.csv", DATA, [heads]), None, T


def csv_of_labview_in_german(p):
    path = text_file(p / "b.csv", DATA, GERMAN, ";", comma=True, encoding="utf-16")
    return path, mapped("Zeit", "Winkel", "Auslenkung", "Kraft"), T


def csv_without_heads(p):
    return text_file(p / "c.txt", DATA, [], "\t", encoding="utf-8-sig"), mapped(1, 2, 3, 4), T


def csv_with_three_rows_of_heads(p):
    heads = [HEADS, ("s", "rad", "m", "N"), ("", "encoder", "laser", "load cell")]
    return text_file(p / "d.csv", DATA, heads, "|"), mapped(*HEADS), T


def csv_with_comments(p):
    above = "% made by a logger\n# second line, with a comma\n"
    return text_file(p / "e.csv", DATA, [HEADS], above=above), mapped(*HEADS), T


def csv_with_decimal_commas_and_tabs(p):
    path = text_file(p / "f.tsv", DATA, [HEADS], "\t", comma=True, encoding="utf-16-be")
    return path, mapped(*HEADS), T


def text_of_numpy(p):
    np.savetxt(
        p / "g.txt", np.column_stack(DATA), fmt="%.17g", header="Time Angle Deflection Force"
    )
    return p / "g.txt", mapped(*HEADS), T


def csv_of_pandas(p):
    pd.DataFrame(dict(zip(HEADS, DATA))).to_csv(p / "h.csv")
    return p / "h.csv", mapped(*HEADS), T


def parquet_of_pandas(p):
    pd.DataFrame(dict(zip(HEADS, DATA))).to_parquet(p / "i.parquet")
    return p / "i.parquet", mapped(*HEADS), T


def tdms_with_a_clock(p):
    return tdms_file(p / "j.tdms", DATA, HEADS, "s rad m N".split()), mapped(*HEADS), T


def tdms_with_a_time_base(p):
    path = tdms_file(p / "k.tdms", DATA[1:], HEADS[1:], "rad m N".split(), wf_increment=0.002)
    text = mapped(*HEADS).replace('[time]\ncolumn = "Time"\nunit = "s"\n', "")
    return path, text, 0.002 * np.arange(len(T))


def lvm_one_clock(p):
    return lvm_file(p / "l.lvm", T, DATA[1:]), without_time(mapped(*HEADS)), T


def lvm_in_german(p):
    path = lvm_file(p / "m.lvm", T, DATA[1:], ";", comma=True)
    return path, without_time(mapped(*HEADS)), T


def lvm_many_clocks(p):
    return lvm_file(p / "n.lvm", T, DATA[1:], layout="Multi"), without_time(mapped(*HEADS)), T


def lvm_no_clock(p):
    path = lvm_file(p / "o.lvm", T, DATA[1:], layout="No")
    return path, without_time(mapped(*HEADS)), 0.002 * np.arange(len(T))


def mat_vectors(p):
    savemat(p / "p.mat", dict(zip(HEADS, DATA)))
    return p / "p.mat", mapped(*HEADS), T


def mat_structs_of_simulink(p):
    values = np.column_stack(DATA[1:])
    savemat(p / "q.mat", {"out": {"time": T[:, None], "signals": {"values": values}}})
    names = [f"out.signals.values.{k}" for k in (1, 2, 3)]
    return p / "q.mat", mapped("out.time", *names), T


def mat_version_4(p):
    savemat(p / "r.mat", {"data": np.column_stack(DATA)}, format="4")
    return p / "r.mat", mapped(*(f"data.{k}" for k in (1, 2, 3, 4))), T


def mat_version_7_3(p):
    return hdf5_file(p / "s.mat", HEADS, DATA, matlab=True), mapped(*HEADS), T


def hdf5_plain(p):
    return hdf5_file(p / "t.h5", HEADS, DATA, matlab=False), mapped(*HEADS), T


def mcap_json(p):
    path = json_mcap(p / "u.mcap", T, DATA[1:], HEADS[1:])
    return path, mapped("/rig/state.clock", *(f"/rig/state.{n}" for n in HEADS[1:])), T


def bag_of_ros2(p):
    names = [f"/joint_states.position.{n}" for n in ("hub", "tip", "load")]
    path = bag(p / "v", T, DATA[1:])
    return path, without_time(mapped("", *names)), WHOLE - WHOLE[0]


def bag_of_ros2_in_mcap(p):
    names = [f"joint_states.position.{n}" for n in ("hub", "tip", "load")]
    path = bag(p / "w", T, DATA[1:], "mcap", stamped=False)
    return path, without_time(mapped("", *names)), WHOLE - WHOLE[0]


def mcap_of_ros2(p):
    path = next(bag(p / "x", T, DATA[1:], "mcap").glob("*.mcap"))
    names = [f"joint_states.position.{n}" for n in ("hub", "tip", "load")]
    return path, without_time(mapped("", *names)), WHOLE - WHOLE[0]


def without_time(text):
    return text[text.index("[channel") :]


FILES = [
    csv_with_channels,
    csv_of_labview_in_german,
    csv_without_heads,
    csv_with_three_rows_of_heads,
    csv_with_comments,
    csv_with_decimal_commas_and_tabs,
    text_of_numpy,
    csv_of_pandas,
    parquet_of_pandas,
    tdms_with_a_clock,
    tdms_with_a_time_base,
    lvm_one_clock,
    lvm_in_german,
    lvm_many_clocks,
    lvm_no_clock,
    mat_vectors,
    mat_structs_of_simulink,
    mat_version_4,
    mat_version_7_3,
    hdf5_plain,
    mcap_json,
    bag_of_ros2,
    bag_of_ros2_in_mcap,
    mcap_of_ros2,
]


def run_of(path, text, folder):
    asked = None
    if text is not None:
        (folder / "map.toml").write_text(text)
        asked = read_map(folder / "map.toml")
    return understood(read_log(path), asked)


@pytest.mark.parametrize("made", FILES, ids=lambda f: f.__name__)
def test_a_file_of_another_program_is_read_back_bit_for_bit(made, tmp_path):
    path, text, t = made(tmp_path)
    run = run_of(path, text, tmp_path).run
    assert list(run) == ["joint/1/position", "link/1/tip_deflection", "sensor/force"]
    assert list(run.units.values()) == ["rad", "m", "N"] and run.meta["source"] == "experiment"
    if made in (bag_of_ros2, bag_of_ros2_in_mcap, mcap_of_ros2):  # stamps: whole nanoseconds
        assert np.abs(run.t - t).max() < 1e-15 and run.meta["clock_start_s"] > 1.6e9
    else:
        assert run.t.tobytes() == t.tobytes()
    for name, values in zip(run, (A, W, F)):
        assert run[name].tobytes() == values.tobytes()


def written(tmp_path, text, name="log.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("head", "unit"),
    [
        ("Time [s]", "s"),
        ("time_ms", "ms"),
        ("t (us)", "us"),
        ("Zeit in s", "s"),
        ("Time / ms", "ms"),
    ],
)
def test_the_first_column_in_a_unit_of_time_is_the_clock(head, unit, tmp_path):
    size = {"s": 1, "ms": 1e3, "us": 1e6}[unit]
    rows = "".join(f"{k},{k * 0.004 * size!r},{k * 0.1!r}\n" for k in range(20))
    path = written(tmp_path, f"n,{head},joint/1/position [deg]\n{rows}")
    found = understood(read_log(path))
    np.testing.assert_allclose(found.run.t, 0.004 * np.arange(20), atol=1e-15)
    np.testing.assert_allclose(found.run["joint/1/position"], np.deg2rad(0.1 * np.arange(20)))
    assert found.left == ["n"] and found.run.meta["original_units"] == {"joint/1/position": "deg"}


def test_scale_and_offset_are_in_the_columns_unit(tmp_path):
    rows = "".join(f"{k * 0.01};{1000 + k}\n" for k in range(10))
    path = written(tmp_path, f"t [s];enc\n{rows}")
    text = '[channel."joint/1/position"]\ncolumn = 2\nunit = "deg"\nscale = 0.09\noffset = -90.0\n'
    run = run_of(path, text, tmp_path).run
    np.testing.assert_allclose(
        run["joint/1/position"], np.deg2rad(0.09 * (1000 + np.arange(10)) - 90), atol=1e-15
    )


def test_a_calendar_in_nanoseconds_keeps_every_nanosecond(tmp_path):
    first = 1_700_000_000_123_456_789
    rows = "".join(f"{first + 1_000_003 * k},{k}\n" for k in range(50))
    run = understood(read_log(written(tmp_path, f"stamp_ns,joint/1/position [rad]\n{rows}"))).run
    assert run.t.tolist() == [1_000_003 * k / 1e9 for k in range(50)]
    assert run.meta["clock_start_s"] == pytest.approx(1.7e9, abs=1)


def test_dates_are_a_clock(tmp_path):
    rows = "".join(f"2026-03-02T10:20:{k / 100:09.6f},{k}\n" for k in range(30))
    run = understood(read_log(written(tmp_path, f"Time [s],joint/1/position [rad]\n{rows}"))).run
    np.testing.assert_allclose(run.t, np.arange(30) / 100, atol=1e-6)


CALENDARS = [
    "2026-11-29 {h:02}:03:0{s:.2f}",
    "2026/11/29 {h:02}:03:0{s:.2f}",
    "2026-11-29T{h:02}:03:0{s:.2f}+01:00",
    "29.11.2026 {h:02}:03:0{s:.2f}",
    "11/29/2026 {half}:03:0{s:.2f} PM",
    "29/11/2026 {h:02}:03:0{s:.2f}",
    "29-Nov-2026 {h:02}:03:0{s:.2f}",
    "Nov 29 2026 {h:02}:03:0{s:.2f}",
    "{h:02}:03:0{s:.2f}",
]


@pytest.mark.parametrize("calendar", CALENDARS)
@pytest.mark.parametrize("head", ["Zeit", "Date (local)"])
def test_a_clock_as_a_program_or_a_spreadsheet_writes_it(calendar, head, tmp_path):
    """Whatever its head says: dates and times of day are seconds."""
    rows = "".join(
        f"{calendar.format(h=14, half=2, s=k / 100)};{k}\n".replace(".", ",", 0) for k in range(30)
    )
    found = understood(read_log(written(tmp_path, f"{head};joint/1/position [rad]\n{rows}")))
    np.testing.assert_allclose(found.run.t, np.arange(30) / 100, rtol=0, atol=1e-9)
    if "2026" in calendar:
        noon = datetime(2026, 11, 29, 13 if "+01" in calendar else 14, 3, tzinfo=UTC)
        assert found.run.meta["clock_start_s"] == noon.timestamp()


def test_a_date_that_does_not_tell_its_month_is_said(tmp_path):
    rows = "".join(f"03/04/2026 10:00:0{k}.0,{k}\n" for k in (0, 1, 2))
    rows += "".join(f"03/04/2026 10:00:02.{k},{k}\n" for k in range(1, 9))
    found = understood(read_log(written(tmp_path, f"Time,joint/1/position [rad]\n{rows}")))
    assert any("month/day/year" in note for note in found.notes)
    rows = rows.replace("03/04", "13/04")
    found = understood(read_log(written(tmp_path, f"Time,joint/1/position [rad]\n{rows}")))
    assert not any("month" in note for note in found.notes)
    assert found.run.meta["clock_start_s"] == datetime(2026, 4, 13, 10, tzinfo=UTC).timestamp()


def test_a_day_passes_midnight(tmp_path):
    rows = "".join(f"{'23:59:59' if k < 10 else '00:00:00'}.{k % 10},{k}\n" for k in range(20))
    run = understood(read_log(written(tmp_path, f"Time,joint/1/position [rad]\n{rows}"))).run
    np.testing.assert_allclose(run.t, np.arange(20) / 10, atol=1e-9)


def test_thousands_that_are_set_apart_are_numbers(tmp_path):
    for text in (
        't [s],joint/1/position [m]\n0,"1,234.5"\n1e-3,"2,345,678"\n2e-3,1.5\n',
        "t [s];joint/1/position [m]\n0;1.234,5\n0,001;2.345.678\n0,002;1,5\n",
        "t [s];joint/1/position [m]\n0;1'234.5\n1e-3;2'345'678\n2e-3;1.5\n",
        "t [s];joint/1/position [m]\n0;1\u202f234,5\n0,001;2\u202f345\u202f678\n0,002;1,5\n",
    ):
        run = understood(read_log(written(tmp_path, text))).run
        assert run["joint/1/position"].tolist() == [1234.5, 2345678.0, 1.5]


def test_a_unit_that_is_likely_wrong_or_not_known_is_said(tmp_path):
    rows = "".join(f"{k / 1e3},{k}\n" for k in range(30))
    found = understood(
        read_log(written(tmp_path, f"Time [ms],sensor/p [furlong]\n{rows}")), every=True
    )
    assert "the clock has 1e+06 samples a second: is ms its unit?" in found.notes
    assert any("unit furlong is not known" in note for note in found.notes)


def test_an_accelerometer_log_of_klipper_needs_no_map(tmp_path):
    run = understood(read_log(klipper(tmp_path / "raw.csv", 5120.1 + T, (A, W, F)))).run
    assert list(run) == ["sensor/accel_x", "sensor/accel_y", "sensor/accel_z"]
    assert set(run.units.values()) == {"m/s^2"} and run.t[0] == 0.0
    assert (run["sensor/accel_x"] == A / 1000).all()
    assert run.meta["clock_start_s"] == 5120.1 + T[0]


def test_gaps_are_not_numbers_and_are_counted(tmp_path):
    path = written(tmp_path, "t [s],joint/1/position [rad]\n0,1\n1e-3,\n2e-3,NaN\n3e-3,4\n")
    found = understood(read_log(path))
    assert found.taken[0].gaps == 2 and np.isnan(found.run["joint/1/position"][1:3]).all()


def test_topics_with_other_clocks_are_interpolated_and_it_is_said(tmp_path):
    from mcap.writer import Writer

    with open(tmp_path / "two.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start()
        for topic, step, count in (("/fast", 10**7, 100), ("/slow", 4 * 10**7, 20)):
            schema = writer.register_schema("x", "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", schema)
            for k in range(count):
                data = b'{"data": %d}' % (k * step)
                writer.add_message(channel, 10**18 + k * step, data, 10**18 + k * step)
        writer.finish()
    text = '[channel."sensor/fast"]\ncolumn = "fast"\n[channel."sensor/slow"]\ncolumn = "/slow"\n'
    found = run_of(tmp_path / "two.mcap", text, tmp_path)
    assert len(found.run) == 100 and "interpolated" in found.notes[0]
    inside = found.run.t <= 19 * 0.04
    np.testing.assert_allclose(found.run["sensor/slow"][inside], found.run["sensor/fast"][inside])
    assert np.isnan(found.run["sensor/slow"][~inside]).all()


WRONG = [
    ("t [s],joint/1/position [V]\n0,1\n1e-3,2\n", "joint/1/position is in rad or m, not in V"),
    ("t [s],joint/1/position [counts]\n0,1\n1e-3,2\n", 'give unit = "rad" and the scale'),
    ("t [s],joint/1/position [furlong]\n0,1\n1e-3,2\n", "a unit that is not known"),
    ("t [s],joint/1/position\n0,1\n1e-3,2\n", "no unit: expected a head as joint/1/position"),
    ("t [s],speed [m/s]\n0,1\n1e-3,2\n", "no column is named as a channel"),
    ("n,joint/1/position [rad]\n0,1\n1,2\n", "no clock: expected a column in a unit of time"),
    ("t [s],joint/1/position [rad]\n0,1\n1e-3,2\n2e-3\n", r"row 3 \(line 4\): 1 cells"),
    ("t [s],joint/1/position [rad]\n0,1\n1e-3,2x\n2e-3,3\n3e-3,4\n", r"row 2 \(line 3\)"),
    ("t [s],joint/1/position [rad]\n0,1\n1e-3,2\n5e-4,3\n", r"row 3 \(line 4\).*falls"),
    ("t [s],joint/1/position [rad]\n0,1\n0,2\n5e-4,3\n", r"row 2 \(line 3\).*twice"),
    ("t [s],joint/1/position [rad]\n0,1\nnan,2\n5e-4,3\n", r"row 2 \(line 3\).*nan"),
    ("t [s],a [rad],a [deg]\n0,1,2\n1e-3,1,2\n", "no column is named as a channel"),
    ("t [s],joint/1/position [rad],joint_1_position [deg]\n0,1,2\n1e-3,1,2\n", "two columns for"),
    ("hello\nworld\n", "no table of numbers"),
    ("t [s],y [m]\n0 o'clock,a1\n1 o'clock,a2\n", r"line 2: \"0 o'clock\" is no number"),
    ("When,y\n31.02.2026 10:00:00,a\n31.02.2026 10:00:01,b\n", "'31.02.2026 10:00:00' is no time"),
    (
        't [s],joint/1/position [rad]\n0,"1,234.5"\n1e-3,"1,235"\n2e-3,"1,236.5"\n',
        r"row 2 \(line 3\): '1,235' has a decimal comma, or thousands set apart",
    ),
    ("", "empty"),
    ("t [s];joint/1/position [rad];x\n0;1\n1e-3;2\n", "3 heads above rows of 2 cells"),
]


@pytest.mark.parametrize(("text", "said"), WRONG)
def test_what_is_wrong_is_said_in_one_sentence(text, said, tmp_path):
    with pytest.raises(fx.InputError, match=said) as caught:
        understood(read_log(written(tmp_path, text)))
    assert "log.csv" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("t", ["ms", "epoch ms as s"])
def test_milliseconds_under_a_head_of_seconds_are_refused(t, tmp_path):
    start = 1_700_000_000_000 if t == "epoch ms as s" else 0
    rows = "".join(f"{start + 2 * k},{k}\n" for k in range(100))
    with pytest.raises(fx.InputError, match=r"row .*milliseconds"):
        understood(read_log(written(tmp_path, f"Time [s],joint/1/position [rad]\n{rows}")))


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("[channel]\n", "channel"),
        ('[time]\nunit = "s"\n', "time.column"),
        ('[time]\ncolumn = 1\nunit = "mm"\n', "time.unit"),
        ('[channel."joint/1/position"]\nunit = "mm"\n', "column"),
        ('[channel."joint/1/position"]\ncolumn = 0\n', "column = 0"),
        ('[channel."joint/1/position"]\ncolumn = 9\nunit = "m"\n', "column = 9"),
        ('[channel."joint/1/position"]\ncolumn = "y"\nunit = "m"\n', "column = 'y'"),
        ('[channel."joint/1/position"]\ncolumn = 2\nscale = 0\n', "scale"),
        ('[channel."joint/1/position"]\ncolumn = 2\nunits = "m"\n', "units: an unknown key"),
        ("[chanel]\n", "chanel: an unknown key"),
    ],
)
def test_a_wrong_map_is_refused_by_its_key(text, key, tmp_path):
    path = written(tmp_path, "t [s],x\n0,1\n1e-3,2\n")
    with pytest.raises(fx.InputError, match=key) as caught:
        run_of(path, text, tmp_path)
    assert "map.toml" in str(caught.value)
