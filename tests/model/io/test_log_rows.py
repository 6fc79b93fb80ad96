"""Text logs: no row of numbers passes for a row of heads, and a date beside a time is its day."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

import flexura as fx
from flexura.io.logs import read_log, read_map, understood

HEAD = "joint/1/position [deg]"
NOON = datetime(2026, 11, 29, 14, 3, 5, 120000, tzinfo=UTC)


def written(folder, text, name="log.csv"):
    path = folder / name
    path.write_text(text)
    return path


def german(stamp="%d.%m.%Y %H:%M:%S,%f", head=f"Zeit;{HEAD}\n", rows=20):
    lines = [
        f"{(NOON + k * timedelta(seconds=0.05)).strftime(stamp)};{1000 + 10 * k},50\n"
        for k in range(rows)
    ]
    return head, lines


SPOILT = [
    ("29.11.2026", "29.g1.2026", "line 2: a damaged row of numbers: '29.g1.2026 14"),
    ("29.11.2026", "29.11..2026", r"line 2: a damaged row of numbers: '29.11\.\.2026 14"),
    ("29.11.2026", "29.11-2026", "line 2: a damaged row of numbers: '29.11-2026 14"),
    ("14:03", "14f03", "line 2: a damaged row of numbers: '29.11.2026 14f03"),
    ("1000,50", "10x0,50", "line 2: a damaged row of numbers: '10x0,50' is no number"),
    (",120000;", ",120000:", "line 2: a damaged row"),
    (",120000;1000,50", ",1200#0;10x0,50", "line 2: a damaged row of numbers: '29.11"),
]


@pytest.mark.parametrize("head", [f"Zeit;{HEAD}\n", f"Bank 3;\n\nZeit;{HEAD}\n", ""])
@pytest.mark.parametrize(("old", "new", "said"), SPOILT)
def test_a_damaged_first_row_is_no_row_of_heads(head, old, new, said, tmp_path):
    _, lines = german()
    lines[0] = lines[0].replace(old, new)
    path = written(tmp_path, head + "".join(lines))
    said = said.replace("line 2", f"line {1 + head.count(chr(10))}")
    with pytest.raises(fx.InputError, match=said):
        understood(read_log(path), every=True)


@pytest.mark.parametrize("row", ["29.11.2026 14:00,50\n", "29.11.2026;14:03:05,12;1000,50\n"])
def test_a_first_row_with_other_cells_is_no_title(row, tmp_path):
    head, lines = german()
    with pytest.raises(fx.InputError, match="line 2: a damaged row of numbers"):
        read_log(written(tmp_path, head + row + "".join(lines[1:])))


def test_rows_are_missing_in_a_clock_that_is_even_but_for_a_damaged_time(tmp_path):
    rows = [f"{k / 20:.2f},{k}\n" for k in range(40)]
    rows[20] = rows[20].replace("1.00", "1.005")
    del rows[21:24]
    found = understood(read_log(written(tmp_path, f"Time [s],{HEAD}\n" + "".join(rows))))
    assert found.notes == [
        "rows are missing after row 21 (line 22): a step of 0.195 s, the others are 0.05 s"
    ]


def test_two_damaged_rows_are_named_by_the_first(tmp_path):
    head, lines = german()
    lines[:2] = [line.replace("29.11.", "29.1k.") for line in lines[:2]]
    with pytest.raises(fx.InputError, match="line 2: a damaged row"):
        read_log(written(tmp_path, head + "".join(lines)))


@pytest.mark.parametrize(
    "heads",
    [
        "Time,Angle,State\ns,rad,1\n",
        "Time,Angle,State\ns,1,1\n",
        "Run 7 of 2026-11-29 14:03:05\nTime,Angle,State\n",
        "Time,Ch 101,Ch 102\n",
        "Time,T100,P200\n",
        "Rate,100,Hz\nTime,Angle,State\n",
        "Time [s],Angle [rad],State\n,SN1234,SN1235\n",
        "20261129_140305\nTime,Angle,State\n",
    ],
)
def test_heads_with_digits_are_heads(heads, tmp_path):
    rows = "".join(f"{k / 100:.2f},{k * 0.1:.3f},{k % 2}\n" for k in range(1, 30))
    found = read_log(written(tmp_path, heads + rows))
    assert [len(column.values) for column in found.columns] == [29] * 3
    assert not any(column.fault for column in found.columns)


SCOPE = "Model,DS1054Z\nDate,2026-11-30\nRate,100\n"


@pytest.mark.parametrize(
    "above",
    [
        f"{SCOPE}Note,two\ntime [s],{HEAD}\n",
        f"{SCOPE}Note,two\n\ntime,joint/1/position\ns,deg\n",
        f"{SCOPE}time,joint/1/position\n[s],[deg]\n",
    ],
)
def test_a_preamble_of_as_many_cells_is_no_head(above, tmp_path):
    path = written(tmp_path, above + "".join(f"{k / 100},{90 * k}\n" for k in range(20)))
    log = read_log(path)
    assert [column.name for column in log.columns] == ["time", "joint/1/position"]
    assert understood(log).run["joint/1/position"][1] == np.pi / 2


def test_a_row_that_became_a_comment_is_said(tmp_path):
    head, lines = german()
    lines[7] = "#" + lines[7][1:]
    found = read_log(written(tmp_path, head + "# by a logger\n" + "".join(lines)))
    assert found.notes == ["line 10: a comment that looks like a row of numbers is left out"]
    assert len(found.columns[0].values) == 19


MARKS = ["29.11/2026", "29..11.2026", "29-11.2026", "2026-11--29", "2026/11-29", "29.11.202"]


@pytest.mark.parametrize("date", [*MARKS, "29.11.20266", "Nov..29 2026", "29-Novi-2026"])
def test_a_date_has_one_kind_of_mark_once_and_a_whole_year(date, tmp_path):
    head, lines = german()
    lines[3] = lines[3].replace("29.11.2026", date)
    with pytest.raises(fx.InputError, match=r"row 4 \(line 5\)"):
        understood(read_log(written(tmp_path, head + "".join(lines))))


DATES = [
    ("%Y-%m-%d", "%H:%M:%S.%f"),
    ("%Y/%m/%d", "%H:%M:%S.%f"),
    ("%d.%m.%Y", "%H:%M:%S,%f"),
    ("%d.%m.%y", "%H:%M:%S,%f"),
    ("%m/%d/%Y", "%I:%M:%S.%f %p"),
    ("%d/%m/%Y", "%H:%M:%S.%f"),
    ("%d-%b-%Y", "%H:%M:%S.%f"),
    ("%b %d %Y", "%H:%M:%S.%f"),
    ("%B %d, %Y", "%H:%M:%S.%f"),
    ("%d %b. %Y", "%H:%M:%S.%f"),
]


def apart(date, time, begin, swapped=False, gap=0, rows=20):
    """A log with its dates and times of day in two columns; `gap`: days between two rows."""
    text = f"{'Time;Date' if swapped else 'Date;Time'};{HEAD}\n"
    comma = time.endswith(",%f")
    for k in range(rows):
        at = begin + k * timedelta(seconds=0.05) + timedelta(days=gap if k >= 10 else 0)
        cells = [at.strftime(date), at.strftime(time)]
        text += ";".join([*(cells[::-1] if swapped else cells), f"{k}{',5' if comma else '.5'}\n"])
    return text


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(("date", "time"), DATES)
@pytest.mark.parametrize("gap", [0, 2])
def test_a_column_of_dates_and_one_of_times_are_one_clock(date, time, swapped, gap, tmp_path):
    """Past midnight too, and over days without rows."""
    begin = datetime(2026, 11, 29, 23, 59, 59, 500000, tzinfo=UTC)
    found = understood(read_log(written(tmp_path, apart(date, time, begin, swapped, gap))))
    t = 0.05 * np.arange(20) + 86400.0 * gap * (np.arange(20) >= 10)
    np.testing.assert_allclose(found.run.t, t, rtol=0, atol=1e-9)
    assert found.run.meta["clock_start_s"] == begin.timestamp()
    assert found.clock == "'Date' and 'Time'" and found.left == []
    assert bool(found.notes) == bool(gap)  # rows are missing


def test_a_date_apart_that_does_not_tell_its_month_is_said(tmp_path):
    begin = datetime(2026, 3, 4, 10, tzinfo=UTC)
    text = apart("%m/%d/%Y", "%H:%M:%S.%f", begin)
    found = understood(read_log(written(tmp_path, text)))
    assert found.notes == ["'Date': '03/04/2026' is read as month/day/year"]
    assert found.run.meta["clock_start_s"] == begin.timestamp()


def test_the_date_of_a_start_stays_where_midnight_passes(tmp_path):
    begin = datetime(2026, 11, 29, 23, 59, 59, 500000, tzinfo=UTC)
    text = apart("%d.%m.%Y", "%H:%M:%S,%f", begin).replace("30.11.", "29.11.")
    found = understood(read_log(written(tmp_path, text)))
    np.testing.assert_allclose(found.run.t, 0.05 * np.arange(20), rtol=0, atol=1e-9)
    assert "'Date' stays where 'Time' passes midnight after row 10" in found.notes[0]


@pytest.mark.parametrize("column", ["Date", "Time", 1, 2])
def test_a_map_names_either_of_the_two_columns(column, tmp_path):
    path = written(tmp_path, apart("%Y-%m-%d", "%H:%M:%S.%f", NOON))
    spelt = f'"{column}"' if isinstance(column, str) else column
    text = f'[time]\ncolumn = {spelt}\n[channel."joint/1/position"]\ncolumn = 3\n'
    found = understood(read_log(path), read_map(written(tmp_path, text, "map.toml")))
    assert found.run.meta["clock_start_s"] == NOON.timestamp() and found.left == []


def test_a_damaged_date_apart_is_refused(tmp_path):
    text = apart("%Y-%m-%d", "%H:%M:%S.%f", NOON)
    lines = text.splitlines(keepends=True)
    for k in (5, 1):
        wrong = "".join([*lines[:k], lines[k].replace("2026-11", "2026-1x"), *lines[k + 1 :]])
        said = rf"row {k} \(line {k + 1}\): '2026-1x-29' is no (date|number)"
        with pytest.raises(fx.InputError, match=said):
            understood(read_log(written(tmp_path, wrong)))
    alone = "Date;x\n" + "".join(f"2026-11-{k:02};{k}.5\n" for k in range(1, 9))
    asked = '[time]\ncolumn = "Date"\n[channel."sensor/x"]\ncolumn = 2\n'
    path = written(tmp_path, alone)
    with pytest.raises(fx.InputError, match="'Date': it has dates without times"):
        understood(read_log(path), read_map(written(tmp_path, asked, "map.toml")))
