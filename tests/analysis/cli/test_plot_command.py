"""`flexura plot` and `flexura animate`: what they write, and what they refuse before they begin."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexlab.cli.app import app
from robots import beam, robot

STRIP = robot(beam(0.3, 0.1, 0.3, 2, hub_inertia_kg_m2=1e-3))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    system = fx.assemble(STRIP)
    run = fx.simulate(system, np.linspace(0, 0.1, 21), fx.Drive.force(fx.signals.constant(0.01)))
    place = tmp_path_factory.mktemp("runs") / "strip"
    run.save(place)
    return place


def call(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.mark.parametrize("form, begins", [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_a_figure_is_written(form, begins, folder, tmp_path):
    out = tmp_path / f"a.{form}"
    done = call("plot", folder, "joint/*/position", "tip/x", "--out", out)
    assert done.exit_code == 0 and f"stored {out}" in done.stdout.replace("\n", "")
    assert out.read_bytes().startswith(begins)


def test_further_runs_are_drawn_too(folder, tmp_path):
    fx.Run.read(folder).save(tmp_path / "other")
    done = call("plot", folder, tmp_path / "other", "tip/x", "--out", tmp_path / "a.svg")
    assert done.exit_code == 0, done.output
    text = (tmp_path / "a.svg").read_text()
    assert "tip x, strip, simulation" in text and "tip x, other, simulation" in text


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize("title", ["$5 to $6_a", r"a $\frac$", r"\$ and $", "手 and 足"])
def test_a_title_is_shown_letter_by_letter(title, folder, tmp_path):
    named = fx.Run.read(folder)
    named.meta["robot"]["name"] = title
    named.save(tmp_path / "named")
    for source, options in ((folder, ["--title", title]), (tmp_path / "named", [])):
        call("plot", source, "--out", tmp_path / "a.svg", "--force", *options)
        shown = (tmp_path / "a.svg").read_text()
        assert f">{title}{'' if options else ': simulation'}</text>" in shown
        done = call("plot", source, "--out", tmp_path / "a.png", "--force", *options)
        assert done.exit_code == 0
        assert done.stderr.count("\n") <= 1, done.stderr
    assert call("animate", tmp_path / "named", "--duration-s", "0.1").exit_code == 0


def test_an_animation_is_written_beside_the_run(folder):
    done = call("animate", folder, "--duration-s", "0.2", "--frame-rate", "10")
    assert done.exit_code == 0 and (folder / "run.gif").read_bytes().startswith(b"GIF89a")
    again = call("animate", folder, "--duration-s", "0.2")
    assert "a file is there: expected another name, or --force" in str(again.exception)
    forced = call("animate", folder, "--duration-s", "0.2", "--frame-rate", "10", "--force")
    assert forced.exit_code == 0


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["plot", "RUN", "tip/z", "--out", "OUT.pdf"], "channel = 'tip/z': expected one of"),
        (["plot", "RUN", "--out", "OUT.jpg"], "ends with .pdf, .svg, .png"),
        (["plot", "RUN", "--out", "FOLDER"], "ends with .pdf, .svg, .png"),
        (["plot", "RUN", "--robot", "1", "--out", "OUT.pdf"], "a folder of a population"),
        (["plot", "FOLDER", "--out", "OUT.pdf"], "no run here"),
        (["animate", "RUN", "--out", "OUT.avi"], "ends with .gif or .mp4"),
        (["animate", "RUN", "--out", "FOLDER"], "a folder: expected the name of a file"),
        (["animate", "RUN", "--out", "OUT.gif", "--frame-rate", "0"], "frame_rate"),
        (["animate", "FOLDER", "--out", "OUT.gif"], "no run here"),
    ],
)
def test_what_is_wrong_is_named_and_nothing_is_left(arguments, words, folder, tmp_path):
    (tmp_path / "empty").mkdir()
    places = {"RUN": str(folder), "FOLDER": str(tmp_path / "empty")}
    given = [places.get(a, a.replace("OUT", str(tmp_path / "a"))) for a in arguments]
    done = call(*given)
    assert isinstance(done.exception, fx.InputError) and words in str(done.exception)
    assert [p.name for p in tmp_path.rglob("*")] == ["empty"]


def test_help_has_a_complete_example():
    for command in ("plot", "animate", "export"):
        assert f"Example: flexura {command} " in call(command, "--help").stdout
