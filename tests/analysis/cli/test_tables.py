"""Tables at 80 columns: every line fits, every number stands whole, no ellipsis."""

import io
import random
import re
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import flexura as fx
from commands import drawn, run
from flexlab.runs.formatting import duration, finite, number, percent, printable
from flexlab.runs.table import Styled, Table, text

ROOT = Path(__file__).resolve().parents[3]
LONG = {"name": "r" * 60 + " [/] [v2] [red]", "payload": "0:0.00123456789:3"}


def rendered(table, width=80):
    out = io.StringIO()
    Console(width=width, file=out).print(table)
    return out.getvalue()


def assert_whole(table, shown, width=80):
    """No line is wider, nothing is cut, and every cell of a column of numbers is there."""
    lines = shown.splitlines()
    assert max(map(len, lines), default=0) <= width
    assert "…" not in shown and "..." not in shown
    for row in table.rows:
        for head, cell in zip(table.heads, row or ()):
            value = text(cell)
            if head not in table.words and value:
                assert re.search(rf"(?<!\S){re.escape(value)}(?!\S)", shown), (head, value)
    words = re.findall(r"\S+", " ".join(text(c) for row in table.rows for c in row or ()))
    flat = re.sub(r"\s+", "", shown)
    assert all(re.sub(r"\s+", "", word) in flat for word in words if len(word) < 20)


@pytest.mark.parametrize("width", [80, 60, 132])
def test_random_tables_fit_and_no_digit_is_cut(width):
    rng = random.Random(width)
    for _ in range(150):
        columns, rows = rng.randint(1, 12), rng.randint(0, 9)
        units = ("", " [m]", " [N m]", " [m/s]")
        heads = [
            f"{rng.choice(('largest', 'rise', 'RMS of the'))} {k}{rng.choice(units)}"
            for k in range(columns)
        ]
        words = rng.sample(heads, rng.randint(0, min(2, columns)))
        table = Table("a title [/] of a table", heads, words)
        for _ in range(rng.randint(0, rows)):
            cells = [f"{rng.gauss(0, 10 ** rng.randint(-12, 9)):.{rng.randint(1, 8)}g}"]
            table.add(
                *(
                    rng.choice(("link/2/tip_deflection [m]", "joint 1", "never seen before"))
                    if head in words
                    else rng.choice((*cells, "", Styled("yes", "green"), cells[0] + " %"))
                    for head in heads
                )
            )
        assert_whole(table, rendered(table, width), width)


def test_names_from_files_are_shown_as_they_are():
    table = Table("arm [v2] [/] [red]x", ("name", "value [m]"), ("name",))
    table.add("[bold]b[/bold] \x1b[31m\0", "1.5")
    table.notes.append("a note [/] \x07")
    shown = rendered(table)
    assert "arm [v2] [/] [red]x" in shown and "[bold]b[/bold] \\x1b[31m\\x00" in shown
    assert "a note [/] \\x07" in shown and not set("\x1b\0\x07") & set(shown)


def test_a_wide_table_of_few_rows_is_transposed_and_one_of_many_goes_on_below():
    heads = ["drive", *(f"quantity {k} [N m]" for k in range(9))]
    few, many = Table("", heads, ("drive",)), Table("", heads, ("drive",))
    for table, rows in ((few, 2), (many, 6)):
        for k in range(rows):
            table.add(f"joint {k}", *["-1.23456e-05"] * 9)
    assert rendered(few).count("joint 1") == 1 and "quantity 3 [N m]" in rendered(few)
    assert rendered(many).count("joint 1") == 2


def test_empty_columns_are_left_out_and_a_row_of_another_length_is_refused():
    table = Table("", ("a", "b", "c"))
    table.add("1", "", "3")
    assert "b" not in rendered(table)
    with pytest.raises(ValueError, match="2 cells for 3 heads"):
        table.add("1", "2")


def test_numbers_as_text():
    assert (number(1.23456), number(float("nan")), number(float("inf"), missing="")) == (
        "1.235",
        "-",
        "",
    )
    assert [percent(x) for x in (0.012345, 0.994, 0.999, 12.0, float("nan"))] == [
        "1.2 %",
        "99 %",
        "100 %",
        "1200 %",
        "-",
    ]
    assert percent(3.21, 3) == "321 %" and percent(-0.5) == "-50 %"
    assert (duration(0.01234), duration(12.34)) == ("12.3 ms", "12.3 s")
    assert [finite(x) for x in (float("nan"), 2, True, "x", None)] == [None, 2.0, True, "x", None]
    assert printable("a\tb\x1b\u202e é") == "a\\tb\\x1b\\u202e é"


# --- the tables of every command

RIG = "model/robots/rig.toml"
LAW = "model/manoeuvres/rig-inverse-law.toml"
TYPE_1 = "model/robots/type-1-rr.toml"
GAINS = ["--controller", "model/controllers/rig.toml"]
QUICK = {
    "simulate": ["simulate", "wild.toml", LAW],
    "population": ["simulate", RIG, "--vary", f"payload.mass_kg={LONG['payload']}"]
    + ["--vary", "link.2.length_m=0.25:0.3:7"],
    "inverse": ["inverse", RIG, LAW],
    "inverse, nine joints": ["inverse", "nine.toml", "nine-motions.toml"],
    "robots": ["robots"],
    "frequencies": ["frequencies", "model/robots/two-link-arm.toml", "--zeros"],
    "crosscheck": ["crosscheck", RIG, LAW],
    "payload": ["study", "payload", TYPE_1, "--values", "0:0.2:5"],
    "length-ratio": ["study", "length-ratio", RIG, "--values", "0.5:2:3"],
    "boundary": ["study", "boundary", "model/robots/type-3-rpb.toml", "--values", "0.2:0.4:3"],
    "tune": ["tune", RIG, "model/manoeuvres/rig-step.toml", *GAINS]
    + ["--population", "4", "--generations", "1", "--payload-factors", "0,1,2"],
    "compare": ["compare", "logs/first", "logs/second"],
}
SLOW = {
    "bench": ["bench", "step", "--duration-s", "2", "--out", "logs/step"],
    "calibrate": ["bench", "calibrate", "--tips-mm=-15,-10,-5,0,5,10,15"],
    "flash": ["flash", "--emulated", "--configure"],
    "doctor": ["doctor"],
    "nine": ["crosscheck", "--all"],
    "demo": ["demo"],
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A working folder like the project's, with a robot of an odd name, one of nine joints, and two
    runs."""
    monkeypatch.chdir(tmp_path)
    for name in ("model", "firmware"):
        (tmp_path / name).symlink_to(ROOT / name)
    rig = (ROOT / RIG).read_text()
    named = re.sub(r'^name = ".*"$', f'name = "{LONG["name"]}"', rig, flags=re.MULTILINE)
    (tmp_path / "wild.toml").write_text(named)
    rigid = "[[link]]\nlength_m = 0.1\nelements = 0\nmass_kg = 0.1\ninertia_kg_m2 = 1e-4\n"
    (tmp_path / "nine.toml").write_text((rigid + '[link.joint]\ntype = "R"\n') * 9)
    motion = '[[joint]]\nmotion = { kind = "cycloid", end = 0.1, duration_s = 0.3 }\n'
    (tmp_path / "nine-motions.toml").write_text("duration_s = 0.3\n" + motion * 9)
    return tmp_path


def assert_tables_fit(arguments, statuses=(0,)):
    with drawn() as tables:
        status, out, err = run(arguments)
    assert status in statuses, err
    assert "…" not in out
    for table in tables:
        shown = rendered(table)
        assert_whole(table, shown)
        assert shown in out
    return tables


@pytest.mark.parametrize("arguments", QUICK.values(), ids=QUICK)
def test_the_tables_of_a_command_fit(arguments, place):
    if arguments[0] == "compare":
        for rtol, name in (("1e-6", "first"), ("1e-4", "second")):
            assert run(["simulate", RIG, LAW, "--rtol", rtol, "--out", f"logs/{name}"])[0] == 0
    assert assert_tables_fit(arguments)


@pytest.mark.slow
@pytest.mark.parametrize("arguments", SLOW.values(), ids=SLOW)
def test_the_tables_of_a_slow_command_fit(arguments, place):
    tables = assert_tables_fit(arguments, (0, 1) if arguments == ["doctor"] else (0,))
    assert tables


@pytest.mark.slow
def test_the_tables_of_an_identification_fit(place):
    assert run(["bench", "excite", "--seed", "1", "--out", "logs/excite"])[0] == 0
    assert assert_tables_fit(["identify", "logs/excite", "--check", "logs/excite"])


@pytest.mark.parametrize("command", ["simulate", "inverse"])
def test_internal_forces_are_stored_and_the_largest_are_shown(command, tmp_path):
    """Of joints and links, with place and time; without the option there are none."""
    table = (
        "gravity_m_s2 = [0.0, -9.81]\n[[link]]\nlength_m = 0.5\nelements = 2\n"
        "section = { width_m = 0.02, height_m = 0.002 }\nyoung_modulus_Pa = 2.0e11\n"
        'density_kg_m3 = 7850.0\n[link.joint]\ntype = "R"\n'
    )
    rise = 'duration_s = 0.2\noutput_step_s = 0.05\n[[joint]]\nmotion = { kind = "polynomial", '
    (tmp_path / "arm.toml").write_text(table)
    (tmp_path / "rise.toml").write_text(rise + "end = 0.2, duration_s = 0.2 }\n")
    files = [tmp_path / "arm.toml", tmp_path / "rise.toml", "--out", tmp_path / command]
    files += ["--prescribed"] if command == "simulate" else []
    status, shown, told = run([command, *files, "--internal-forces"])
    assert status == 0, told
    stored = fx.Run.read(tmp_path / command)
    for name, row in (("joint/1/reaction_y [N]", "joint/1/reaction_y"),):
        assert name in shown and number(np.abs(stored[row]).max(), 5) in shown
    stress = max(np.abs(stored[f"link/1/stress/{k}"]).max() for k in range(9))
    assert "link/1/stress [Pa]" in shown and number(stress, 5) in shown
    assert "0/8 of the length" in shown
    status, shown, _ = run([command, *files, "--force"])
    assert status == 0 and "internal forces" not in shown
    assert "joint/1/reaction_x" not in fx.Run.read(tmp_path / command)
