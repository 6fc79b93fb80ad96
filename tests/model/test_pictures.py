"""Figures, animations and tables of a run, what a notebook shows, and what each channel means."""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest

import flexura as fx
from flexura import optional
from flexura.io import CHANNELS, channel, drawing
from flexura.io.drawing.over_time import SAMPLES, label
from flexura.signals import constant
from flexura.simulation.recorder import channel_units
from robots import beam, rigid, robot

ARM = robot(
    rigid(0.1, 0.6, 0.05, 5e-4, "Pa", hub_mass_kg=0.1),
    beam(0.3, 0.157, 0.33, 3, hub_inertia_kg_m2=1e-3, damping={"beta_s": 1e-3}),
    payload=0.02,
)
BENT = robot(
    beam(0.3, 0.1, 0.3, 3, "Pb", start=0.2), beam(0.2, 0.1, 0.3, 3, hub_inertia_kg_m2=1e-3)
)


@pytest.fixture(scope="module")
def run():
    system = fx.assemble(ARM)
    return fx.simulate(system, np.linspace(0, 0.4, 81), fx.Drive.force(*map(constant, (0.3, 0.02))))


# Channels


def test_every_channel_of_a_simulation_is_described_with_its_unit():
    for described in (ARM, BENT):
        for name, unit in channel_units(described).items():
            known = channel(name)
            assert known.meaning and unit in known.units, name


def test_a_channel_is_described_once():
    for known in CHANNELS:
        parts = {"i": "12", "k": "3", "NAME": "laser"}
        example = "/".join(parts.get(part, part) for part in known.name.split("/"))
        assert [other.name for other in CHANNELS if other.fits(example)] == [known.name]
        assert known.meaning.endswith(".") and known.quantity
        assert known.units or known.name == "sensor/NAME"  # any unit
    assert channel("joint/1/torque").meaning == "" and channel("joint/0/position").meaning == ""


# Figures


def test_a_figure_has_the_numbers_units_and_a_legend_beside_the_curves(run):
    figure = run.plot("tip/*", "joint/*/position", "link/2/tip_deflection")
    metres, radians = figure.axes
    assert metres.get_ylabel().endswith("[m]") and radians.get_ylabel() == "joint position [rad]"
    assert radians.get_xlabel() == "time [s]"
    names = ["tip/x", "tip/y", "joint/1/position", "link/2/tip_deflection"]
    assert len(metres.lines) == len(names)
    for line, name in zip(metres.lines, names):
        np.testing.assert_array_equal(line.get_xdata(), run.t)
        np.testing.assert_array_equal(line.get_ydata(), run[name])
    figure.draw_without_rendering()
    for axes in figure.axes:
        assert axes.get_legend().get_window_extent().x0 >= axes.get_window_extent().x1
        assert axes.get_legend().get_window_extent().x1 <= figure.bbox.x1


def test_without_channels_joints_deflections_drives_and_energies_are_shown(run):
    labels = [axes.get_ylabel() for axes in run.plot().axes]
    assert labels == [
        "joint position [m]",
        "joint position [rad]",
        "tip deflection [m]",
        "drive [N]",
        "drive [N m]",
        "energy [J]",
    ]
    (last,) = [axes for axes in run.plot().axes if axes.get_ylabel() == "energy [J]"]
    assert "potential energy" not in [line.get_label() for line in last.lines]  # 0 all the time


@pytest.mark.parametrize("form, begins", [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_a_figure_is_a_file_and_the_same_again(run, form, begins, tmp_path):
    for name in ("a", "b"):
        run.plot("tip/x", out=tmp_path / f"{name}.{form}")
    first, again = ((tmp_path / f"{name}.{form}").read_bytes() for name in ("a", "b"))
    assert first == again and first.startswith(begins)
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"a.{form}", f"b.{form}"]


def test_a_long_run_is_drawn_with_its_extremes():
    t = np.linspace(0, 1, 200_001)
    y = np.sin(40 * t)
    y[77_777], y[123_456] = 3.0, -4.0
    (line,) = fx.Run(t, {"tip/x": y}, {"tip/x": "m"}).plot("tip/x").axes[0].lines
    assert len(line.get_ydata()) <= SAMPLES + 2
    assert line.get_ydata().max() == 3.0 and line.get_ydata().min() == -4.0


def test_two_runs_are_told_apart_by_dashes(run):
    figure = drawing.figure([run, run], ["joint/*/position"], names=["one", "other"])
    solid, dashed = figure.axes[0].lines
    assert solid.get_color() == dashed.get_color()
    assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    assert [line.get_label() for line in (solid, dashed)] == ["joint 1, one", "joint 1, other"]


def test_nothing_emulated_is_drawn_without_the_word():
    meta = {"source": "experiment", "emulated": True, "robot": {"name": "a $b$"}}
    run = fx.Run(np.arange(3.0), {"tip/x": np.zeros(3)}, {"tip/x": "m"}, meta)
    assert "(emulated)" in run.plot().get_suptitle()


@pytest.mark.parametrize(
    "name, text, alone",
    [
        ("joint/2/position", "joint 2", "joint 2 position"),
        ("link/3/tip_deflection", "link 3", "link 3 tip deflection"),
        ("energy/strain", "strain energy", "strain energy"),
        ("sensor/laser", "laser", "laser"),
    ],
)
def test_labels(name, text, alone):
    assert label(name, True) == text and label(name, False) == alone


@pytest.mark.parametrize(
    "arguments, key",
    [({"out": "x.jpg"}, "out"), ({"out": "x"}, "out")],
)
def test_a_wrong_ending_is_refused_before_anything_is_drawn(run, arguments, key, tmp_path):
    with pytest.raises(fx.InputError) as raised:
        run.plot("tip/x", **arguments)
    assert raised.value.key == key


def test_a_channel_that_is_not_there_and_an_empty_run_are_refused(run):
    with pytest.raises(fx.InputError, match="expected one of joint/1/position"):
        run.plot("tip/z")
    with pytest.raises(fx.InputError, match="samples"):
        fx.Run(np.zeros(0), {"tip/x": np.zeros(0)}, {"tip/x": "m"}).plot()
    with pytest.raises(fx.InputError, match="channels"):
        fx.Run(np.arange(2.0), {}, {}).plot()


# Animations


@pytest.mark.parametrize("described", [ARM, BENT], ids=["PaR", "PbR"])
def test_an_animation_has_its_pictures_duration_and_the_robot(described, tmp_path):
    from PIL import Image

    system = fx.assemble(described)
    drive = fx.Drive.force(constant(0.05), constant(0.01))
    run = fx.simulate(system, np.linspace(0, 0.2, 41), drive)
    seen = []
    path = run.animate(
        tmp_path / "a.gif", frame_rate=10, duration=0.6, progress=lambda part: seen.append(part)
    )
    with Image.open(path) as film:
        shown = 0
        for k in range(film.n_frames):
            film.seek(k)
            shown += film.info["duration"]
        picture = np.asarray(film.convert("RGB")).astype(int)
    assert shown == 600 and seen[-1] == 1.0 and len(seen) == 6
    blue = np.array([0, 0x72, 0xB2])  # the flexible links
    assert (np.abs(picture - blue).max(axis=2) < 30).sum() > 100
    assert (picture[0] == 255).all()
    assert [p.name for p in tmp_path.iterdir()] == ["a.gif"]


def test_a_run_with_joints_only_is_animated(run, tmp_path):
    names = ["joint/1/position", "joint/2/position", "link/2/tip_deflection"]
    bare = fx.Run(run.t, {n: run[n] for n in names}, {n: run.units[n] for n in names}, run.meta)
    assert bare.animate(tmp_path / "bare.gif", duration=0.2, frame_rate=10).stat().st_size > 1000


def test_what_cannot_be_animated_is_named_and_leaves_nothing(run, tmp_path, monkeypatch):
    for arguments, words in (
        ({"out": tmp_path / "a.avi"}, r"ends with \.gif or \.mp4"),
        ({"out": tmp_path / "a.gif", "frame_rate": 0}, "above 0"),
        ({"out": tmp_path / "a.gif", "duration": -1.0}, "above 0"),
        ({"out": tmp_path / "a.gif", "duration": 3000.0}, "at most 5000 pictures"),
    ):
        with pytest.raises(fx.InputError, match=words):
            run.animate(**arguments)
    nowhere = fx.Run(run.t, {"tip/x": run["tip/x"]}, {"tip/x": "m"})
    with pytest.raises(fx.InputError, match="poses or joint positions"):
        nowhere.animate(tmp_path / "a.gif")

    def stop(part):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run.animate(tmp_path / "a.gif", duration=0.2, progress=stop)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(fx.FlexuraError, match=r"no encoder for MP4 here: install ffmpeg.*\.gif"):
        run.animate(tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


def test_a_film_is_written_through_an_encoder(run, tmp_path, monkeypatch):
    """A program in ffmpeg's place that keeps what it is given: the pictures, row by row."""
    fake = tmp_path / "bin" / "ffmpeg"
    fake.parent.mkdir()
    fake.write_text(
        f"#!{sys.executable}\nimport sys\nopen(sys.argv[-1], 'wb').write(sys.stdin.buffer.read())\n"
    )
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", str(fake.parent))
    path = run.animate(tmp_path / "a.mp4", duration=0.2, frame_rate=10)
    assert path.stat().st_size % (2 * 3 * 4) == 0 and path.stat().st_size > 2 * 3 * 640 * 200
    fake.write_text(f"#!{sys.executable}\nimport sys\nsys.exit('no such codec')\n")
    with pytest.raises(fx.FlexuraError, match="no such codec"):
        run.animate(tmp_path / "b.mp4", duration=0.2, frame_rate=10)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mp4", "bin"]


# Tables


def test_pandas_has_the_channels_their_units_and_the_times(run):
    pytest.importorskip("pandas")
    frame = run.to_pandas()
    assert list(frame.columns) == list(run) and frame.index.name == "t"
    np.testing.assert_array_equal(frame.index, run.t)
    assert frame.attrs["units"] == {"t": "s"} | run.units
    frame.loc[frame.index[0], "tip/x"] = 99.0  # a copy: the run stays as it is
    assert run["tip/x"][0] != 99.0


def test_xarray_has_the_channels_with_their_units_and_the_metadata(run):
    pytest.importorskip("xarray")
    data = run.to_xarray()
    assert set(data.data_vars) == set(run) and data["t"].attrs["units"] == "s"
    for name in run:
        np.testing.assert_array_equal(data[name], run[name])
        assert data[name].dims == ("t",) and data[name].attrs["units"] == run.units[name]
    assert data.attrs["robot"] == run.meta["robot"]


@pytest.mark.parametrize(
    "package, call",
    [
        ("pandas", lambda run: run.to_pandas()),
        ("xarray", lambda run: run.to_xarray()),
        ("matplotlib", lambda run: run.plot()),
    ],
)
def test_a_missing_package_is_one_sentence(package, call, run, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(
        optional.Missing, match=rf'^{package} is not installed; type: pip install "flexura\['
    ):
        call(run)


def test_a_figure_needs_no_screen(tmp_path, run):
    run.save(tmp_path)
    picture = str(tmp_path / "a.png")
    code = f"import flexura as fx; fx.Run.read({str(tmp_path)!r}).plot().savefig({picture!r})"
    env = {"PYTHONPATH": ":".join(sys.path), "PATH": "", "HOME": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], check=True, env=env, timeout=120)
    assert (tmp_path / "a.png").stat().st_size > 1000


# What a terminal and a notebook show


class Table(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)

    def handle_data(self, data):
        self.text += data


def shown(run):
    long = robot(*[beam(0.3, 0.1, 0.3, 3, hub_inertia_kg_m2=1e-3) for _ in range(20)])
    system = fx.assemble(ARM)
    batch = fx.Batch.vary(ARM, {"payload.mass_kg": np.linspace(0, 0.1, 3)})
    population = fx.simulate(batch, np.linspace(0, 0.02, 3))
    odd = ARM.replace({"name": "<b>arm</b> [/] " + "x" * 100})
    coded = fx.Run(run.t, run.channels, run.units, {"robot": {"name": "\x1b[31m\n" + "x" * 100}})
    drives = fx.Drive.pd([fx.signals.cycloid(0.8, 1.0), np.sin, 0.3] * 7, 100, 4)
    asked = fx.load_manoeuvre("rig-step", 2)
    inside = [fx.internal_forces(ARM), fx.internal_forces(long)]
    models = [system, fx.assemble(odd), fx.linearize(system)]
    return [run, ARM, long, odd, coded, *models, population, drives, asked, *inside]


def test_twelve_lines_of_eighty_columns_and_a_table(run):
    for thing in shown(run):
        lines = repr(thing).splitlines()
        assert 2 <= len(lines) <= 12 and max(map(len, lines)) <= 80, repr(thing)
        assert all(line.isprintable() for line in lines)
        html = Table(thing._repr_html_())
        assert set(html.tags) == {"table", "caption", "tbody", "tr", "th", "td"}
        assert type(thing).__name__ in html.text
    assert str(ARM) == repr(ARM)
    assert "<b>arm</b>" in Table(shown(run)[3]._repr_html_()).text


def test_a_drive_says_what_each_joint_does():
    motions = [fx.signals.cycloid(0.8, 1.0), np.sin]
    assert repr(fx.Drive.pd(motions, [100, 20], 4)).splitlines() == [
        "Drive of 2 joints",
        "  joint 1  kp 100, kd 4 on cycloid(end=0.8, duration_s=1, start=0, at_s=0)",
        "  joint 2  kp 20, kd 4 on function(name=sin)",
    ]
    force = fx.Drive((fx.JointDrive(force=2.0, motion=0.1, prescribed=True), fx.JointDrive()))
    assert repr(force).splitlines()[1:] == [
        "  joint 1  force constant(value=2); follows constant(value=0.1)",
        "  joint 2  free",
    ]


def test_internal_forces_say_what_the_joints_bear():
    lines = repr(fx.internal_forces(ARM)).splitlines()
    reaction = fx.internal_forces(ARM).reaction(1)
    assert f"{reaction.force.imag:.4g} N, moment {reaction.moment:.4g} N m" in lines[1]


def test_a_run_says_what_it_holds(run):
    text = repr(run)
    assert re.search(r"0 to 0\.4 s, 81 samples", text)
    assert re.search(r"joint/1-2 +position, velocity, drive", text)
    assert list(run.keys()) == list(run) and dict(run.items()) == run.channels


def test_an_unknown_channel_is_answered_with_numbered_channels_as_one_pattern():
    run = fx.simulate("single-r", [0.0, 0.01], start="straight")
    with pytest.raises(fx.InputError, match=r"link/1/deflection/\*") as caught:
        run.plot("nope")
    assert "link/1/deflection/0" not in str(caught.value)
