import io
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flexura as fx
from flexlab.review import open_viewer, picture, write_gallery, write_review
from flexlab.review.sources import COLOURS, FAMILIES, SECOND, sources
from flexlab.review.ticks import Signal, value_range
from flexlab.runs.deviation import deviation
from flexura.errors import FlexuraError, InputError
from flexura.io import Run, drawing
from flexura.robot import Robot, load
from flexura.simulation.recorder import recorded_channels

RIG = load(Path(__file__).parents[3] / "model" / "robots" / "rig.toml")
STRIP = RIG.to_dict()["link"][1]
DURATION, RAISED = 2.5, 1.0  # s; the rig's arm is horizontal at 0 and highest at RAISED


# Runs whose answers are known: every link bends like a cantilever loaded at its tip.


def synthetic(
    robot: Robot, source: str = "simulation", *, rate: float = 200.0, late: float = 0.0, **meta
) -> Run:
    """A motion that is consistent in all channels; `late` [s] shifts it, `rate` is in samples a
    second."""
    t = np.arange(round(DURATION * rate) + 1) / rate
    channels, units = {}, {}

    def put(name, values, unit):
        channels[name], units[name] = np.broadcast_to(values, t.shape).astype(float), unit

    x, y, angle = np.zeros((3, len(t)))
    length, bend = 0.0, np.zeros(len(t))  # of the previous link; the base has none
    for i, link in enumerate(robot.links, 1):
        turns, swing = link.joint.type == "R", 0.5 * (1 - np.cos(np.pi * (t - late) / RAISED))
        q = (0.9 / i) * swing if turns else 0.04 + 0.06 * swing
        for part, values, unit in (
            ("position", q, ""),
            ("velocity", np.gradient(q, t), "/s"),
            ("drive", -q, ""),
        ):
            put(
                f"joint/{i}/{part}",
                values,
                {"drive": "N m" if turns else "N"}.get(part, ("rad" if turns else "m") + unit),
            )
        along = q if link.joint.type == "Pa" else np.full(len(t), length)
        px, pw, slope = cantilever(along, length, bend)
        x, y = (
            x + px * np.cos(angle) - pw * np.sin(angle),
            y + px * np.sin(angle) + pw * np.cos(angle),
        )
        angle = angle + slope + (q if turns else link.joint.angle_rad)
        length, bend = (
            link.length_m,
            0.02 * link.length_m * np.sin(4 * np.pi * (t - late)) * (link.elements > 0),
        )
        for part, values in (("x", x), ("y", y), ("angle", angle)):
            put(f"link/{i}/{part}", values, "rad" if part == "angle" else "m")
        if link.flexible:
            put(f"link/{i}/tip_deflection", bend, "m")
            put(f"link/{i}/tip_slope", np.arcsin(1.5 * bend / length), "rad")
            for k in range(9):
                put(
                    f"link/{i}/deflection/{k}",
                    cantilever(np.full(len(t), k * length / 8), length, bend)[1],
                    "m",
                )
    px, pw, _ = cantilever(np.full(len(t), length), length, bend)
    put("tip/x", x + px * np.cos(angle) - pw * np.sin(angle), "m")
    put("tip/y", y + px * np.sin(angle) + pw * np.cos(angle), "m")
    put("energy/kinetic", np.sin(t) ** 2, "J")
    put("energy/potential", 0.0, "J")
    events = [{"t": RAISED, "text": "raised", "level": "WARN"}, {"t": 0.0, "text": "start"}]
    about = {
        "source": source,
        "program": "test",
        "robot": robot.to_dict(),
        "complete": True,
        "events": events,
    }
    return Run(t, channels, units, about | meta)


def cantilever(x, length, tip):
    """Place, deflection and angle at the arc length x of an inextensible link whose deflection is
    that of a cantilever loaded at its tip: sin(angle) = w'."""
    if not length:
        return x, 0 * x, 0 * x
    sine = lambda xi: tip / length * (3 * xi - 1.5 * xi**2)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    ahead = sum(
        w / 2 * x * np.sqrt(1 - sine(x / length * (1 + node) / 2) ** 2)
        for node, w in zip(nodes, weights)
    )
    xi = x / length
    return ahead, tip * (3 * xi**2 - xi**3) / 2, np.arcsin(sine(xi))


def chain(joints: str, **changes) -> Robot:
    """A robot of strips with these joints, such as "R R Pa"; a Pb starts a third of its strip
    out."""
    start = {"R": 0.0, "Pa": 0.0, "Pb": STRIP["length_m"] / 3}
    links = [STRIP | {"joint": {"type": j, "start": start[j]}} for j in joints.split()]
    return Robot.from_dict({"name": f"chain {joints}", "link": links} | changes)


# What is in a file.


def chunks(rrd, content="/**"):
    from rerun.chunk import RrdReader

    return [c for c in RrdReader(rrd).stream().filter(content=content)]


def entities(rrd):
    return {c.entity_path for c in chunks(rrd) if not c.entity_path.startswith("/__")}


def column(rrd, entity, component, timeline="time"):
    """Index (int64) and the cells of one component, in order."""
    import pyarrow as pa

    index, cells = [], []
    for chunk in chunks(rrd, entity):
        batch = chunk.to_record_batch()
        if component in batch.schema.names and timeline in batch.schema.names:
            index += batch.column(timeline).cast(pa.int64()).to_pylist()
            cells += batch.column(component).to_pylist()
    order = np.argsort(index, kind="stable")
    return np.array(index)[order], [cells[k] for k in order]


def scalars(rrd, entity):
    index, cells = column(rrd, entity, "Scalars:scalars")
    return index, np.array([cell[0] for cell in cells])


def text(rrd, entity="/about", component="TextDocument:text"):
    (cells,) = [
        b.column(component).to_pylist()
        for c in chunks(rrd, entity)
        if component in (b := c.to_record_batch()).schema.names
    ]
    return cells[0][0]


@pytest.fixture(scope="module")
def pair():
    return synthetic(RIG), synthetic(RIG, "twin", rate=150, late=0.08)


@pytest.fixture(scope="module")
def rrd(pair, tmp_path_factory):
    return write_review(tmp_path_factory.mktemp("review") / "rig.rrd", pair)


def test_every_signal_reads_back_exactly(rrd, pair):
    for run in pair:
        for name in (
            "joint/1/position",
            "joint/2/velocity",
            "joint/2/drive",
            "link/2/tip_deflection",
            "tip/x",
            "energy/kinetic",
        ):
            index, values = scalars(rrd, f"/{run.meta['source']}/{name}")
            assert np.array_equal(index, np.rint(run.t * 1e9).astype(np.int64)), name
            assert np.array_equal(values, run[name]), name
    steps, _ = column(rrd, "/twin/tip/x", "Scalars:scalars", "step")
    assert np.array_equal(steps, np.arange(len(pair[1])))


def test_deviations_read_back_exactly(rrd, pair):
    for name in (
        "joint/1/position",
        "joint/2/position",
        "link/2/tip_deflection",
        "tip/x",
        "tip/y",
        "tip_distance",
    ):
        index, values = scalars(rrd, f"/deviation/{name}")
        t, expected = deviation(*pair, name)
        assert np.array_equal(values, expected) and np.array_equal(
            index, np.rint(t * 1e9).astype(np.int64)
        )


def test_entities_are_few_and_poses_are_not_among_the_signals(rrd):
    found = entities(rrd)
    assert len(found) < 100
    assert not [e for e in found if "/link/2/x" in e or "/link/2/deflection" in e]
    assert {
        "/simulation/arm/deformed",
        "/twin/arm/deformed",
        "/about",
        "/ground/scale",
        "/events/twin",
    } <= found


def test_units_and_sources_are_in_the_legends(rrd):
    assert text(rrd, "/twin/joint/1/position", "SeriesLines:names") == "joint 1, twin [m]"
    assert (
        text(rrd, "/simulation/joint/2/position", "SeriesLines:names")
        == "joint 2, simulation [rad]"
    )
    assert (
        text(rrd, "/deviation/link/2/tip_deflection", "SeriesLines:names")
        == "link 2, twin − simulation [m]"
    )


def test_shapes_are_in_the_file_at_frame_rate(rrd, pair):
    index, cells = column(rrd, "/simulation/arm/deformed", "LineStrips2D:strips")
    assert len(index) <= DURATION * drawing.FRAME_RATE + 2
    rows = np.searchsorted(np.rint(pair[0].t * 1e9), index)
    ends = np.array([cell[0][-1] for cell in cells])
    np.testing.assert_allclose(
        ends, np.stack([pair[0]["tip/x"], pair[0]["tip/y"]], axis=1)[rows], atol=1e-6
    )


def test_rerun_verifies_the_file(rrd):
    from flexlab.review.headless import executable

    done = subprocess.run(
        [executable(), "rrd", "verify", str(rrd)],
        capture_output=True,
        text=True,
        env=os.environ | {"NO_COLOR": "1"},
    )
    assert "1 file verified" in done.stdout + done.stderr and done.returncode == 0


def test_the_extremes_of_each_pixel_are_drawn(rrd):
    """By default the viewer averages what falls into one pixel: a deviation looks too small."""
    from rerun.components import AggregationPolicy

    name = "SeriesLines:aggregation_policy"
    curves = [e for e in entities(rrd) if re.search(r"/(joint|tip|link|energy|deviation)/", e)]
    found = {
        chunk.entity_path: batch.column(name)[0].as_py()
        for entity in curves
        for chunk in chunks(rrd, entity)
        if name in (batch := chunk.to_record_batch()).schema.names
    }
    assert set(found) == set(curves)
    assert all(value == [AggregationPolicy.MinMax.value] for value in found.values())


# Colours and ticks.


def luminance(colour):
    """Relative luminance (WCAG 2)."""
    c = np.array(colour) / 255
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(a, b):
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("family", FAMILIES.values(), ids=map(str, FAMILIES))
def test_curves_are_seen_on_light_and_dark_and_differ(family):
    for k, colour in enumerate(family):
        assert contrast(colour, (255, 255, 255)) > 2.2 and contrast(colour, (13, 13, 13)) > 2.8
        for other in family[:k]:
            assert np.linalg.norm(np.subtract(colour, other)) > 50


@pytest.mark.parametrize("height", [140, 265])
@given(
    low=st.floats(-1e3, 1e3),
    size=st.floats(1e-4, 1e4),
    lines=st.integers(1, 3),
)
def test_a_plot_has_two_numbers_to_read_off_and_room_for_its_legend(height, low, size, lines):
    curves = {str(k): Signal("m", "x" * 30, low, low + size) for k in range(lines)}
    bottom, top = value_range(curves, height)
    assert bottom < low and low + size < top
    assert top - low - size > 0.98 * (23 * lines + 14) / height * 0.9 * (size)
    # the viewer numbers the smallest power of ten whose multiples are far enough apart
    step = 10.0 ** np.ceil(np.log10((top - bottom) * 20 / height))
    shown = np.floor(top / step * (1 - 1e-12)) - np.ceil(bottom / step * (1 - 1e-12)) + 1
    assert shown >= 2


# The shapes as numbers.


@pytest.mark.parametrize("joints", ["R", "Pa R", "R R Pa", "R R R R R"])
@pytest.mark.parametrize("stiffening", [True, False])
def test_the_curve_of_the_last_link_ends_at_the_tip(joints, stiffening):
    """Without geometric stiffening the model has no shortening, and neither has the curve."""
    run = synthetic(chain(joints, stiffening=stiffening))
    c = drawing.curves(run, np.arange(0, len(run), 7), 0.01)
    tip = np.stack([run["tip/x"], run["tip/y"]], axis=1)[c.index]
    off = np.linalg.norm(c.deformed[:, -1, -1] - tip, axis=1)
    length = np.full(len(c.index), STRIP["length_m"])
    bend = run[f"link/{len(joints.split())}/tip_deflection"][c.index]
    lost = length - cantilever(length, STRIP["length_m"], bend)[0]
    np.testing.assert_allclose(off, 0 if stiffening else lost, atol=1e-12)


def test_a_cubic_bending_line_is_drawn_exactly():
    run = synthetic(chain("R"))
    index = np.array([150])
    curve = drawing.bent(run, 1, drawing.outlines(run.meta)[0], index)[0]
    x = np.linspace(0, STRIP["length_m"], drawing.POINTS)
    px, w, _ = cantilever(x, STRIP["length_m"], run["link/1/tip_deflection"][150])
    np.testing.assert_allclose(curve, np.stack([px, w], axis=1), atol=1e-15)


@pytest.mark.parametrize("turn", [0.1, 0.5, 1.0, 1.9, 3.9])
def test_a_link_that_is_rolled_up_is_drawn_as_a_circle(turn):
    """With the constant curvature of an end moment: x = r sin(s / r), y = r (1 - cos(s / r))."""
    angle, length = turn * np.pi, STRIP["length_m"]
    r = length / angle
    stations = r * (1 - np.cos(np.linspace(0, angle, 9)))
    names = [f"link/1/deflection/{k}" for k in range(9)]
    channels = {name: np.array([w]) for name, w in zip(names, stations)}
    channels["link/1/tip_slope"] = np.array([angle])
    units = dict.fromkeys(names, "m") | {"link/1/tip_slope": "rad"}
    run = Run(np.zeros(1), channels, units, {"robot": chain("R").to_dict()})
    (curve,) = drawing.bent(run, 1, drawing.outlines(run.meta)[0], np.array([0]))
    s = np.linspace(0, length, drawing.POINTS)
    exact = np.stack([r * np.sin(s / r), r * (1 - np.cos(s / r))], axis=1)
    assert np.abs(curve - exact).max() < 1e-4 * length


@pytest.mark.parametrize("force", [(0.0, -20.0), (0.0, -100.0), (-30.0, 1.0), (-60.0, 1.0)])
def test_an_elastica_of_any_size_ends_at_the_tip_of_the_model(force):
    strip = {"length_m": 0.5, "elements": 12, "joint": {"type": "R"}}
    strip |= {"mass_per_length_kg_m": 0.2, "bending_stiffness_N_m2": 2.0}
    system = fx.assemble(Robot.from_dict({"link": [strip]}))
    q = fx.static(system, tip_force=force)
    names, row = recorded_channels(system.robot), system.observe(q[None], 0 * q[None])
    run = Run(
        np.zeros(1),
        {name: row[:, k] for k, name in enumerate(names)},
        dict.fromkeys(names, "1"),
        {"robot": system.robot.to_dict()},
    )
    c = drawing.curves(run, np.array([0]), 0.01)
    assert np.linalg.norm(c.deformed[0, -1, -1] - c.tip[0]) < 3e-4 * 0.5


def test_the_ghost_is_straight_and_as_long_as_the_link():
    run = synthetic(chain("R Pa R"))
    c = drawing.curves(run, np.arange(len(run)), 0.01)
    ghost = c.undeformed[:, 2]
    np.testing.assert_allclose(np.linalg.norm(ghost[:, 1] - ghost[:, 0], axis=1), STRIP["length_m"])
    np.testing.assert_allclose(
        np.arctan2(*(ghost[:, 1] - ghost[:, 0]).T[::-1]), run["link/3/angle"]
    )


def test_joints_are_marked_where_they_are():
    run = synthetic(RIG)
    c = drawing.curves(run, np.array([0, 50]), 0.01)
    assert (
        c.rail is not None
        and c.rail[:, 1].tolist() == [0, 0]
        and c.rail[0, 0] < -0.05
        and c.rail[1, 0] > 0.15
    )
    np.testing.assert_allclose(
        c.sliders[:, 0, :4].mean(axis=1)[:, 0], run["joint/1/position"][[0, 50]]
    )
    np.testing.assert_allclose(c.pins[:, 0, 0], run["link/2/x"][[0, 50]])


def test_a_sleeve_is_where_the_link_passes_it():
    robot, t = chain("Pb"), np.zeros(1)
    length, d = STRIP["length_m"], 0.1
    run = Run(
        t,
        {"joint/1/position": t + d, "link/1/tip_deflection": t + 0.002},
        dict.fromkeys(("joint/1/position", "link/1/tip_deflection"), "m"),
    )
    run, computed = drawing.with_poses(
        replace(run, meta={"source": "experiment", "robot": robot.to_dict()})
    )
    assert (
        computed
        and run["link/1/x"] == pytest.approx(d - length)
        and run["tip/x"] == pytest.approx(cantilever(t + d, d, 0.002)[0])
        and run["tip/y"] == 0.002
    )
    c = drawing.curves(run, np.array([0]), 0.01)
    np.testing.assert_allclose(c.sliders[0, 0, :4].mean(axis=0), 0, atol=1e-15)


def test_poses_that_a_measurement_lacks_are_computed():
    """From joints and tip deflections alone, the arm is where the synthetic run, which bends that
    way, has it."""
    for joints in ("Pa R", "R Pa R", "R R R R"):
        full = synthetic(chain(joints), "experiment")
        kept = [
            name for name in full if name.startswith("joint") or name.endswith("tip_deflection")
        ]
        bare = Run(full.t, {k: full[k] for k in kept}, {k: full.units[k] for k in kept}, full.meta)
        rebuilt, computed = drawing.with_poses(bare)
        assert computed and not drawing.with_poses(full)[1]
        for name in ("tip/x", "tip/y", "link/2/angle"):
            np.testing.assert_allclose(rebuilt[name], full[name], atol=1e-12)


def test_a_gap_stays_a_gap(tmp_path, pair):
    first, second = pair
    gap = {
        name: np.where((second.t > 1) & (second.t < 1.5), np.nan, values)
        for name, values in second.channels.items()
    }
    rrd = write_review(tmp_path / "gap.rrd", [first, replace(second, channels=gap)])
    _, values = scalars(rrd, "/twin/joint/1/position")
    assert (
        np.array_equal(values, gap["joint/1/position"], equal_nan=True) and np.isnan(values).any()
    )
    _, apart = scalars(rrd, "/deviation/joint/1/position")
    assert (
        np.isnan(apart[(first.t > 1) & (first.t < 1.5)]).all()
        and np.isfinite(apart[first.t < 0.99]).all()
    )
    index, strips = column(rrd, "/twin/arm/deformed", "LineStrips2D:strips")
    hidden = (index > 1.0e9) & (index < 1.5e9)
    assert hidden.any() and [bool(s) for s in strips] == (~hidden).tolist()


# Which samples are drawn.


def test_frames_are_at_most_sixty_a_second_with_both_ends():
    t = np.arange(10_001) / 1000
    index = drawing.frames(t)
    assert (
        index[0] == 0
        and index[-1] == 10_000
        and np.diff(t[index])[:-1].min() >= 1 / 60 - 1e-3
        and len(index) <= 602
    )
    assert drawing.frames(np.arange(11) / 10).tolist() == list(range(11))
    assert len(drawing.frames(np.linspace(0, 3600, 100_000))) <= drawing.MAX_FRAMES
    assert drawing.frames(np.zeros(1)).tolist() == [0] and len(drawing.frames(np.zeros(0))) == 0


def test_thinning_keeps_peaks_and_gaps():
    y = np.sin(np.linspace(0, 20, 100_000))
    y[777], y[50_001], y[90_000:90_010] = 9, -9, np.nan
    keep = drawing.thinned(y, 3000)
    assert (
        len(keep) <= 3002
        and (np.diff(keep) > 0).all()
        and {0, 777, 50_001, 99_999} <= set(keep.tolist())
    )
    assert np.isnan(y[keep]).any()
    assert np.array_equal(drawing.thinned(y[:100], 3000), np.arange(100))


def test_a_long_run_is_thinned_and_says_so(tmp_path, monkeypatch, pair):
    monkeypatch.setattr("flexlab.review.writer.MAX_SAMPLES", 3000)
    rrd = write_review(tmp_path / "long.rrd", pair)
    _, values = scalars(rrd, "/simulation/tip/y")
    assert len(values) < len(pair[0]) and values.max() == pair[0]["tip/y"].max()
    assert "thinned" in text(rrd)


# Names, notes and errors.


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


# What the viewer makes of it.


@pytest.fixture(scope="session")
def viewer():
    from flexlab.review import headless

    try:
        with headless.viewer((1200, 800)) as client:
            yield client
    except FlexuraError as error:
        if os.environ.get("REQUIRE_VIEWER") == "1":
            raise
        pytest.skip(str(error))


def look(viewer, rrd):
    """The review's views by name, after checking that nothing is empty and nothing is reported."""
    from flexlab.review import headless

    state = headless.show(viewer, rrd)
    logged = entities(rrd)
    queries = 0
    for table in viewer.get_blueprint("recording").blueprint.values():
        query = table.get("ViewContents", {}).get("query", [])
        for part in [query] if isinstance(query, str) else query:
            base = part.lstrip("+- ").strip().removesuffix("/**")
            assert any(e == base or e.startswith(base + "/") for e in logged), (
                f"nothing is logged for {part}"
            )
            queries += 1
    assert queries
    views = {view.name: view for view in state.views}
    assert not [report for view in state.views for report in view.reports]
    assert not [entry for entry in viewer.get_logs() if entry.level == "ERROR"]
    return views


def shot(viewer, view, time_s):
    from PIL import Image

    from flexlab.review import headless

    viewer.set_time("time", duration=time_s, play_state="paused")
    return np.asarray(
        Image.open(io.BytesIO(headless.settled_picture(viewer, view.view_id))).convert("RGB")
    ).astype(int)


def painted(pixels, colour):
    return np.argwhere((np.abs(pixels - np.array(colour)) < 30).all(-1))


def test_both_arms_are_seen_and_up_is_up(viewer, rrd):
    views = look(viewer, rrd)
    both = views["overlaid: blue simulation, orange twin"]
    up, flat = shot(viewer, both, RAISED), shot(viewer, both, 0.0)
    for source in ("simulation", "twin"):
        assert len(painted(up, COLOURS[source])) > 200, source
    assert (
        painted(up, COLOURS["simulation"])[:, 0].min()
        < painted(flat, COLOURS["simulation"])[:, 0].min() - 50
    )
    alone = shot(viewer, views["simulation"], RAISED)
    assert len(painted(alone, COLOURS["simulation"])) > 100 and not len(
        painted(alone, COLOURS["twin"])
    )


def test_the_review_of_one_run_has_no_empty_view(viewer, pair, tmp_path):
    views = look(viewer, write_review(tmp_path / "one.rrd", pair[:1]))
    assert "simulation" in views and not [
        name for name in views if "deviation" in name or "overlaid" in name or "twin" in name
    ]
    views = look(
        viewer,
        write_review(tmp_path / "bare.rrd", [replace(pair[0], meta={"source": "simulation"})]),
    )
    assert "simulation" not in views and "events" not in views


def test_a_robot_with_five_links(viewer, tmp_path):
    robot = chain("R Pa R R R")
    rrd = write_review(
        tmp_path / "five.rrd",
        [synthetic(robot), synthetic(robot, "experiment", late=0.05, emulated=True)],
    )
    views = look(viewer, rrd)
    assert "overlaid: blue simulation, green experiment (emulated)" in views
    tabs = [
        k
        for k in viewer.get_blueprint("recording").blueprint.values()
        if k.get("ContainerBlueprint", {}).get("container_kind") == "Tabs"
    ]
    assert tabs


def test_a_gallery_shows_every_robot_at_a_glance_and_on_a_page_of_its_own(viewer, pair, tmp_path):
    groups = {
        "I RR": [synthetic(chain("R R")), synthetic(chain("R R"), "experiment")],
        "IV PaR": pair,
    }
    rrd = write_gallery(tmp_path / "all.rrd", groups)
    found = entities(rrd)
    for root in ("/i_rr", "/iv_par"):
        assert {
            f"{root}/about",
            f"{root}/ground/grid",
            f"{root}/deviation/joint/1/position",
        } <= found
    assert {"/i_rr/experiment/joint/2/position", "/iv_par/simulation/arm/deformed"} <= found
    assert all(path.startswith(("/i_rr", "/iv_par")) for path in found)
    views = look(viewer, rrd)
    assert [
        name
        for name in ("I RR", "IV PaR")
        if not any(view.startswith(f"{name}: blue simulation") for view in views)
    ] == []
    with pytest.raises(InputError, match="one robot or more"):
        write_gallery(tmp_path / "none.rrd", {})


def test_the_picture_has_its_size_and_is_not_blank(viewer, rrd, tmp_path):
    from PIL import Image

    png = picture(rrd, tmp_path / "p.png", size=(1000, 600))
    image = Image.open(png)
    assert image.size == (1000, 600)
    assert len(painted(np.asarray(image.convert("RGB")).astype(int), COLOURS["twin"])) > 50
    assert [p.name for p in tmp_path.iterdir()] == ["p.png"]
