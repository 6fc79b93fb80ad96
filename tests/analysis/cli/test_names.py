"""Names from files: control codes are refused where files are read, markup is shown as it is."""

import html as html_
import re
import string
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from commands import run
from flexlab.comparison.measures import compare
from flexlab.comparison.pages import pdf
from flexlab.comparison.report import html
from flexlab.review import write_review
from flexlab.runs.formatting import file_name, markdown
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


NASTY = (
    *MARKUP,
    "<script>alert(1)</script>",
    "\"quoted\" 'twice' `thrice`",
    "$x_{1 and \\frac{a",
    "$\\alpha$ beta",
    "{0} %s %(x)s",
    "../../etc/passwd",
    "javascript:alert(1)",
    "&lt;b&gt; &amp;",
    "](http://x) **b** # h",
    "-rf --help",
    "con: a\\b/c?*|",
)
LINK = "<i>link</i> [/] $y_{"


def outputs(run, robot, folder):
    """Each output of a run as text or bytes, by its kind."""
    batch = fx.Batch.vary(robot, {"payload.mass_kg": [0.01, 0.02]})
    population = fx.simulate(batch, run.t)
    shown = (robot, fx.assemble(robot), run, population)
    found = {"terminal": "\n".join(map(repr, shown))}
    found["notebook"] = "\n".join(each._repr_html_() for each in shown)
    found["page"] = html(compare(run, run))
    for form in ("svg", "pdf", "png"):
        run.plot("tip/x").savefig(folder / f"plot.{form}")
        found[form] = (folder / f"plot.{form}").read_bytes()
    found["report"] = pdf(compare(run, run))
    found["review"] = write_review(folder / "review.rrd", [run]).read_bytes()
    fx.save(robot, folder / "robot.toml")
    run.save(folder)
    assert fx.load(folder / "robot.toml") == robot
    assert fx.Run.read(folder).meta["name"] == robot.name
    return found


ALL = (
    "[/] [v2] <script>alert(1)</script> & | $x_{1 \\frac{a {0} %s ../../x ](http://x) **b** `c` \\"
)
EACH = [pytest.param(name, marks=pytest.mark.slow) for name in NASTY]


@pytest.mark.parametrize("name", [ALL, *EACH])
def test_nasty_names_through_every_output(name, tmp_path):
    """Terminal, notebook, HTML, SVG, PDF, PNG, Rerun, robot file and archive."""
    robot = fx.load(ROOT / "model/robots/rig.toml").replace({"name": name, "link.2.name": LINK})
    run = fx.simulate(robot, np.linspace(0, 0.05, 6))
    run.meta["manoeuvre"] = name
    found = outputs(run, robot, tmp_path)
    assert all(line.isprintable() for line in found["terminal"].split("\n"))
    for kind in ("notebook", "page"):
        assert not re.search(r"<(script|i|b)>", found[kind])
        assert html_.escape(name) in found[kind]
    assert b"<script>" not in found["svg"] and b"<i>" not in found["svg"]
    assert found["pdf"].startswith(b"%PDF") and found["report"].startswith(b"%PDF")
    assert found["png"].startswith(b"\x89PNG") and len(found["review"]) > 10_000
    part = file_name(name)
    assert part and not set(part) - set("._-" + string.ascii_letters + string.digits)
    assert part[0] not in ".-"


@pytest.mark.parametrize("name", CONTROL, ids=lambda name: ascii(name[:12]))
def test_control_codes_in_the_names_of_links_and_rigs_are_refused(name):
    tables = fx.load(ROOT / "model/robots/rig.toml").to_dict()
    tables["link"][1]["name"] = name
    with pytest.raises(fx.InputError, match="one line of at most 200") as raised:
        fx.Robot.from_dict(tables)
    assert raised.value.key == "link[2].name" and str(raised.value).isprintable()
