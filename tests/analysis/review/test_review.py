"""A review's names, notes and errors."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from flexlab.review import open_viewer, picture, write_review
from flexlab.review.sources import COLOURS, SECOND, sources
from flexura.errors import FlexuraError, InputError
from flexura.io import Run
from reviews import column, entities, text


def test_sources_have_their_own_roots_and_colours(pair):
    one, two = pair
    a, b = sources([one, one])
    assert (a.root, a.colour, b.root, b.label, b.colour) == (
        "simulation",
        COLOURS["simulation"],
        "simulation_2",
        "simulation 2",
        SECOND,
    )
    assert [s.root for s in sources([one, two])] == ["simulation", "twin"]


def test_an_emulated_experiment_is_never_unlabelled(tmp_path, pair):
    emulated = replace(pair[1], meta=pair[1].meta | {"source": "experiment", "emulated": True})
    rrd = write_review(tmp_path / "e.rrd", [pair[0], emulated])
    names = [e for e in entities(rrd) if e.startswith("/experiment/joint")]
    assert names and all("emulated" in text(rrd, e, "SeriesLines:names") for e in names)
    assert "nothing here was measured" in text(rrd)
    _, cells = column(rrd, "/events/experiment", "TextLog:text")
    assert all("emulated" in cell[0] for cell in cells)


def test_an_incomplete_run_says_so(tmp_path, pair):
    cut = Run(
        pair[0].t[:100],
        {k: v[:100] for k, v in pair[0].channels.items()},
        pair[0].units,
        pair[0].meta | {"complete": False},
    )
    rrd = write_review(tmp_path / "cut.rrd", [cut])
    assert "incomplete" in text(rrd) and "incomplete" in text(
        rrd, "/simulation/joint/1/position", "SeriesLines:names"
    )


def test_the_about_page_has_the_robot_and_the_deviations(rrd):
    page = text(rrd)
    for expected in (
        "rig (type IV, PaR)",
        "**PaR**",
        "payload 0.02 kg",
        "| 2 strip | R | 0.3 | flexible, 4 elements |",
        "0.3333",
        "tip_distance",
    ):
        assert expected in page, expected


def test_a_failing_write_leaves_nothing(tmp_path, monkeypatch, pair):
    target = tmp_path / "r.rrd"
    target.write_bytes(b"the old one")
    monkeypatch.setattr("flexlab.review.writer.summary", lambda *a, **k: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_review(target, pair)
    assert target.read_bytes() == b"the old one" and list(tmp_path.iterdir()) == [target]


def test_bad_arguments_are_named(tmp_path, pair):
    empty = Run(np.zeros(0), {}, {}, {"source": "simulation"})
    for runs in ([], [pair[0]] * 7, [empty]):
        with pytest.raises(InputError):
            write_review(tmp_path / "r.rrd", runs)
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="no such file"):
        picture(tmp_path / "none.rrd", tmp_path / "p.png")
    (tmp_path / "no.rrd").write_text("no recording")
    with pytest.raises(InputError):
        picture(tmp_path / "no.rrd", tmp_path / "p.png")


@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="other systems always have a display"
)
def test_without_a_display_there_is_no_window(rrd, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(FlexuraError, match="no display"):
        open_viewer(rrd)


def test_without_vulkan_the_packages_are_named(rrd, tmp_path, monkeypatch):
    from flexlab.review import headless

    fake = tmp_path / "rerun"
    fake.write_text(
        '#!/bin/sh\n[ "$1" = analytics ] || { echo "Failed to get render context" >&2; exit 102; '
        "}\n"
    )
    fake.chmod(0o755)
    monkeypatch.setattr(headless, "executable", lambda: fake)
    with pytest.raises(FlexuraError, match="mesa-vulkan-drivers libvulkan1"):
        picture(rrd, tmp_path / "p.png")
    assert not (tmp_path / "p.png").exists()


def test_rerun_is_imported_only_when_used():
    heavy = "{'rerun', 'rerun_cli', 'rerun_bindings', 'pyarrow'}"
    code = "import sys, flexlab.review, flexlab.runs.deviation\n"
    code += f"sys.exit(bool({heavy} & set(sys.modules)))"
    assert (
        subprocess.run(
            [sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        ).returncode
        == 0
    )


def test_no_rerun_name_in_use_is_deprecated(tmp_path):
    code = (
        "import sys; from flexura.io import Run; from flexlab.review import write_gallery, "
        "write_review; import numpy as np\n"
        "import rerun.experimental, rerun.chunk, flexlab.review.headless\n"
        "meta = {'source': 'simulation', 'phases': [{'t': 0.0, 'name': 'move'}], 'events': [{'t': "
        "0.0, 'text': 'start'}]}\n"
        "write_review(sys.argv[1], [Run(np.arange(3.0), {'joint/1/position': np.zeros(3)}, "
        "{'joint/1/position': 'rad'}, meta)])\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning", "-c", code, str(tmp_path / "d.rrd")],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
