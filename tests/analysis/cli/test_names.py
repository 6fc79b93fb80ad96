"""Names from files: control codes are refused where files are read, markup is shown as it is."""

import html as html_
import re
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from commands import run
from flexlab.comparison.measures import compare
from flexlab.comparison.pages import pdf
from flexlab.comparison.report import html
from flexlab.review import write_review
from flexlab.runs.formatting import markdown
from flexura.io import is_name

ROOT = Path(__file__).resolve().parents[3]
ROBOT = (ROOT / "model" / "robots" / "rig.toml").read_text()
LAW = (ROOT / "model" / "manoeuvres" / "rig-inverse-law.toml").read_text()
MARKUP = ("[/]", "arm [v2]", "[red]arm", "<b>arm</b> & co", "arm | two", "Zürich 机器人")
CONTROL = (
    "\x1b[31mred",
    "nul\0",
    "two\nlines",
    "bell\x07",
    "rtl\u202e",
    "line\u2028end",
    "x" * 201,
)


def named(text, name):
    quoted = "".join(c if c.isalnum() or c in " []/<>&|" else f"\\U{ord(c):08x}" for c in name)
    return re.sub(
        r"^name = .*$", f'name = "{quoted}"'.replace("\\", "\\\\"), text, count=1, flags=re.M
    )


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law.toml").write_text(LAW)
    return tmp_path


@pytest.mark.parametrize("name", CONTROL, ids=lambda name: ascii(name[:12]))
def test_control_codes_in_a_name_are_refused(name, place):
    assert not is_name(name)
    (place / "robot.toml").write_text(named(ROBOT, name))
    (place / "bad-law.toml").write_text(named(LAW, name))
    for read in (
        lambda: fx.load("robot.toml"),
        lambda: fx.load_manoeuvre("bad-law.toml", 2),
        lambda: fx.Robot.from_dict(
            fx.load(ROOT / "model/robots/rig.toml").to_dict() | {"name": name}
        ),
    ):
        with pytest.raises(fx.InputError, match=r"name = .*expected") as raised:
            read()
        assert raised.value.key == "name" and str(raised.value).isprintable()
    before = set(place.iterdir())
    status, out, err = run(["simulate", "robot.toml", "law.toml"])
    assert status == 2 and out == "" and "\x1b" not in err and set(place.iterdir()) == before


@pytest.mark.parametrize("name", MARKUP)
def test_markup_in_a_name_is_shown_as_it_is(name, place):
    assert is_name(name)
    (place / "robot.toml").write_text(named(ROBOT, name))
    (place / "named.toml").write_text(named(LAW, name))
    for arguments in (
        ["frequencies", "robot.toml"],
        ["simulate", "robot.toml", "named.toml"],
        ["inverse", "robot.toml", "named.toml"],
    ):
        status, out, err = run(arguments)
        assert status == 0, err
        assert name in " ".join(out.split("\n")), out


@pytest.mark.parametrize("name", ["[/]", "<b>arm</b> & co", "arm | *two*"])
def test_markup_in_a_name_does_not_reach_the_report_and_the_review(name, tmp_path):
    """HTML and Markdown have it escaped; the other files are made."""
    robot = fx.load(ROOT / "model/robots/rig.toml").replace({"name": name})
    asked = fx.load_manoeuvre(ROOT / "model/manoeuvres/rig-inverse-law.toml", 2)
    simulated = fx.simulate(robot, np.linspace(0, 0.1, 21), asked.drive)
    simulated.meta["manoeuvre"] = name
    found = compare(simulated, simulated)
    page = html(found)
    assert "<b>arm" not in page and html_.escape(name) in page
    assert pdf(found).startswith(b"%PDF")
    assert write_review(tmp_path / "review.rrd", [simulated]).stat().st_size > 10_000
    heading = markdown(name)
    assert re.sub(r"\\(.)", r"\1", heading) == name
    assert not re.search(r"(?<!\\)[\[\]<>*|]", heading)
