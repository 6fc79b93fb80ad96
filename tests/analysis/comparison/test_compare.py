"""Simulation against experiment. The experiments are the Exudyn twin's (twin_experiments.py),
another program."""

import dataclasses
import io
import json
import re
from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexlab.cli.compare import save
from flexlab.comparison import pages, report, table
from flexlab.comparison.measures import (
    PUBLISHED,
    RESPONSE_LEVEL,
    best_fit_delay,
    compare,
    response_time,
    simulation_first,
)
from flexlab.comparison.replay import lead_screw, stepper_relaxation
from flexlab.comparison.replay.simulate_experiment import DRIVEN_BY, simulate_experiment
from flexlab.comparison.replay.smoothing import (
    continue_past_end,
    recorded_samples,
    resolution,
    smoothing_spline,
)
from flexlab.rig import load
from flexlab.rig.axes import motor_axes
from flexlab.rig.plant.motor import JointLine, joint_line
from flexlab.rig.plant.stepper import MagneticSpring
from flexlab.runs.deviation import deviations
from flexura.errors import InputError
from flexura.io import EMULATED, Run, called
from flexura.signals import JointDrive
from twin_experiments import RIG, experiment


@pytest.fixture(scope="module")
def inverse():
    return experiment("inverse", seconds=1.2)


@pytest.fixture(scope="module")
def forward():
    return experiment("forward", seconds=1.6)


@pytest.fixture(scope="module")
def compared(forward):
    return compare(simulate_experiment(forward[0]), forward[0])


@pytest.fixture(scope="module")
def page(compared):
    return report.html(compared)


@pytest.fixture(scope="module")
def document(compared):
    return pages.pdf(compared)


def run(t, **channels):
    names = {
        name.replace("__", "/"): np.asarray(values, dtype=float)
        for name, values in channels.items()
    }
    return Run(
        np.asarray(t, dtype=float),
        names,
        {n: "rad" if n.startswith("joint/2") else "m" for n in names},
        {"source": "experiment"},
    )


# --- the simulation of an experiment


@pytest.mark.parametrize("which", ["forward", "inverse"])
def test_what_was_commanded_gives_what_another_program_found(which, request):
    """The parts' own equations in Exudyn; in the simulation a line, a relaxed sine and 5 ms of the
    drive's samples."""
    measured, moved = request.getfixturevalue(which)
    found = {
        row.channel: row.max_relative for row in deviations(simulate_experiment(measured), moved)
    }
    assert found["joint/1/position"] < 0.005 and found["joint/2/position"] < 0.0015
    assert found["link/2/tip_deflection"] < 0.011


@pytest.mark.parametrize("which", ["forward", "inverse"])
def test_joints_on_their_encoders_bend_the_strip_as_it_was_bent(which, request):
    """The smoothed motion is as far from the samples as these from the truth (RMS), so at most
    twice that from the truth; an encoder step of 2.6 mrad is 0.8 mm at the tip, which bends by 16
    and 32 mm."""
    measured, moved = request.getfixturevalue(which)
    simulated = simulate_experiment(measured, "measured")
    found = {row.channel: (row.max, row.rms) for row in deviations(simulated, moved)}
    step = 2 * np.pi / 2400
    assert found["joint/2/position"][0] < step and found["joint/2/position"][
        1
    ] < 2 * step / np.sqrt(12)
    assert (
        found["link/2/tip_deflection"][0] < 2 * 0.3 * step
        and found["link/2/tip_deflection"][1] < 0.3 * step
    )


def test_a_simulation_stands_on_the_experiments_times_and_names_its_drive(forward):
    measured, _ = forward
    for by in ("commanded", "measured"):
        simulated = simulate_experiment(measured, by)
        np.testing.assert_allclose(simulated.t, measured.t, atol=1e-12)
        assert simulated.meta["driven_by"] == by and "(emulated)" in simulated.meta["simulates"]
        assert np.isfinite(
            simulated["link/2/tip_deflection"]
        ).all()  # dropouts of the experiment are none of the simulation


def test_set_points_are_followed_exactly(inverse):
    measured, _ = inverse
    simulated = simulate_experiment(measured, "reference")
    there = np.isfinite(measured["joint/2/reference"])
    np.testing.assert_allclose(
        simulated["joint/2/position"][there], measured["joint/2/reference"][there], atol=1e-7
    )


def test_the_robot_may_be_another(forward):
    measured, _ = forward
    soft = fx.Robot.from_dict(measured.meta["robot"]).replace({"link.2.young_modulus_Pa": 1e11})
    rows = {
        row.channel: row
        for row in compare(simulate_experiment(measured, robot=soft), measured).differences
    }
    own = {row.channel: row for row in compare(simulate_experiment(measured), measured).differences}
    assert rows["link/2/tip_deflection"].max > 5 * own["link/2/tip_deflection"].max


@pytest.mark.parametrize("pulse", [0.02, 0.2])
@pytest.mark.parametrize("prescribed", [False, True])
def test_the_relaxed_field_is_the_sine(pulse, prescribed):
    """Against the same torque as a Python function in the native solver; 0.2 rad at once lose
    steps. A carriage that nothing drives hardly moves; one that is told to stand goes by its force
    where steps are lost."""
    bench = load(RIG)
    spring = MagneticSpring(bench.rig.stepper)
    robot = bench.robot.replace(
        {"link.1.joint.viscous_friction": 1e3, "link.2.joint.viscous_friction": 2e-3}
    )
    system = fx.assemble(robot)
    t = np.linspace(0, 0.5, 101)
    pulses = continue_past_end(t, pulse * np.minimum(t / 0.02, 1.0))
    zero = fx.signals.constant(0.0)
    stands = JointDrive(force=zero, motion=zero, prescribed=True) if prescribed else zero
    found = stepper_relaxation.simulate_with_stepper(
        (system, system.start()), t, stands, pulses, spring, 1e-6
    )
    exact = fx.simulate(
        system, t, lambda at, q, qd, tip: [0.0, spring.torque(pulses(at)[0], float(q[1]), on=True)]
    )
    lost = abs(exact["joint/2/position"][-1] - pulse) > 0.03
    assert lost == (pulse > 0.1)
    assert (found.meta["relaxation_rounds"] is None) == lost
    tolerance = 1e-6 if lost else 1e-2 if prescribed else 2e-3
    for name in ("joint/2/position", "link/2/tip_deflection"):
        np.testing.assert_allclose(
            found[name], exact[name], atol=tolerance * np.abs(exact[name]).max()
        )


def test_a_constant_voltage_ends_at_the_lines_speed():
    """v = (a u - f) / b of `rig.plant.motor.joint_line`."""
    bench = load(RIG)
    line, dead = joint_line(motor_axes(bench.rig)[0]), bench.rig.driver.dead_zone_V
    t = np.arange(201) / 200.0
    still = np.zeros(len(t))
    measured = run(t, joint__1__position=still, joint__2__position=still, joint__2__pulses=still)
    channels, units = (
        measured.channels | {"joint/1/voltage": still + 6.0},
        measured.units | {"joint/1/voltage": "V"},
    )
    meta = {
        "robot": bench.robot.to_dict(),
        "rig": bench.rig.model_dump(mode="json"),
        "source": "experiment",
    }
    simulated = simulate_experiment(Run(t, channels, units, meta))
    speed = (line.force_per_V * (6.0 - dead) - line.coulomb) / line.viscous
    assert simulated["joint/1/velocity"][-1] == pytest.approx(speed, rel=1e-4)


# --- joint 1 by its voltage

LINE = JointLine(
    force_per_V=50.0,
    viscous=4e3,
    coulomb=36.0,
    inertia=120.0,
    static=56.0,
    guide=4.0,
)


def pushed(force, play_m=0.0, seconds=0.6, line=LINE):
    t = np.arange(round(seconds / lead_screw.STEP_S)) * lead_screw.STEP_S
    return t, *lead_screw.nut_and_carriage(t, force, line, 121.0, play_m, 0.0)


def test_static_friction_holds_the_nut_until_its_force():
    for newtons, moves in ((55.9, False), (-55.9, False), (56.1, True), (-56.1, True)):
        _, nut, speed, carriage = pushed(fx.signals.constant(newtons))
        assert (nut[-1] != 0.0) == (speed[-1] != 0.0) == moves
        np.testing.assert_array_equal(nut, carriage)  # without play


def test_the_nut_runs_and_coasts_as_the_line_says():
    """v = v_1 (1 - exp(-c t / m)), v_1 = (F - f) / c; from v_0 it coasts  m v_0 / c - (f m / c^2)
    ln(1 + c v_0 / f)."""
    t, nut, speed, _ = pushed(fx.signals.piecewise([0.0, 0.3], [236.0, 0.0]))
    c, m, f = LINE.viscous, 121.0, LINE.coulomb
    until = np.searchsorted(t, 0.3 - 1e-9)
    np.testing.assert_allclose(
        speed[:until], 0.05 * (1 - np.exp(-c / m * t[:until])), rtol=1e-9, atol=1e-15
    )
    v = speed[until]
    assert nut[-1] - nut[until] == pytest.approx(
        m * v / c - f * m / c**2 * np.log(1 + c * v / f), rel=1e-9
    )
    assert speed[-1] == 0.0


def test_the_nut_crosses_its_play_without_the_rail_and_then_takes_the_carriage_along():
    b = 3e-4
    t, nut, speed, carriage = pushed(fx.signals.constant(236.0), b)
    free = np.abs(nut) < b / 2
    c, m = LINE.viscous, 121.0
    np.testing.assert_allclose(
        speed[free], (236.0 - 32.0) / c * (1 - np.exp(-c / m * t[free])), rtol=1e-9, atol=1e-15
    )
    assert not carriage[free].any() and free.sum() > 20
    np.testing.assert_allclose(carriage[~free], nut[~free] - b / 2, atol=1e-15)
    assert speed[-1] == pytest.approx((236.0 - 36.0) / c, rel=1e-6)
    held_by_rail = dataclasses.replace(LINE, static=50.0, coulomb=50.0, guide=40.0)
    _, nut, _, carriage = pushed(fx.signals.constant(45.0), b, seconds=2.0, line=held_by_rail)
    assert nut[-1] == nut[-2] and 0.0 < carriage[-1] < b / 2  # the flank soon stops it
    assert carriage[-1] == pytest.approx(nut[-1] - b / 2)


# --- smoothing


def test_a_smoothed_motion_is_twice_differentiable_and_has_no_lag():
    t = np.arange(601) / 200.0
    true, step = 0.5 * np.sin(2 * np.pi * t), 2 * np.pi / 2400
    motion = smoothing_spline(t, np.round(true / step) * step)
    for at in motion.breaks[1:]:
        jump = np.subtract(motion(np.nextafter(at, -np.inf)), motion(at))
        assert (np.abs(jump) < [1e-9, 1e-8, 1e-5]).all()
    values = np.array([motion(at)[0] for at in t])
    assert np.sqrt(np.mean((values - true) ** 2)) < 0.5 * step / np.sqrt(12)  # of the noise
    lags = np.linspace(-2e-3, 2e-3, 81)
    left = [np.mean((values - 0.5 * np.sin(2 * np.pi * (t - lag))) ** 2) for lag in lags]
    assert abs(lags[np.argmin(left)]) <= 1e-4


def test_the_residual_is_what_quantisation_leaves():
    t = np.arange(401) / 200.0
    y = np.round(np.sin(5 * t) / 0.01) * 0.01
    motion = smoothing_spline(t, y)
    fit = np.array([motion(at)[0] for at in t])
    moving = np.append(np.diff(y) != 0, False) | np.insert(np.diff(y) != 0, 0, False)
    assert np.sqrt(np.mean((fit - y)[moving] ** 2)) == pytest.approx(0.01 / np.sqrt(12), rel=0.02)


def test_the_resolution_is_found():
    t = np.linspace(0, 1, 300)
    assert resolution(np.round(np.sin(9 * t) / 0.004) * 0.004) == pytest.approx(0.004)
    assert resolution(np.sin(9 * t)) == 0.0 and resolution(np.zeros(5)) == 0.0


def test_what_was_not_quantised_is_passed_through():
    t = np.linspace(0, 1, 50)
    motion = smoothing_spline(t, np.exp(t))
    np.testing.assert_allclose([motion(at)[0] for at in t], np.exp(t), atol=1e-14)


def test_a_motion_of_dropouts_is_refused():
    with pytest.raises(InputError, match="joint/1/position = 3: expected at least 8 samples"):
        recorded_samples(np.arange(9.0), np.array([1, 2, 3] + 6 * [np.nan]), "joint/1/position")


# --- measures


def test_response_times_of_known_motions():
    t = np.arange(2001) / 1000
    assert response_time(t, 3 + 0.2 * np.sin(2 * np.pi * t)) == pytest.approx(
        np.arcsin(RESPONSE_LEVEL) / (2 * np.pi), abs=1e-5
    )
    first_order = 1 - np.exp(-t / 0.1)
    level = RESPONSE_LEVEL * first_order[-1]
    assert response_time(t, -first_order) == pytest.approx(-0.1 * np.log(1 - level), abs=1e-5)
    assert np.isnan(response_time(t, np.zeros(len(t)))) and np.isnan(response_time(t, t * np.nan))


def test_a_response_behind_a_dropout_is_not_known():
    t = np.linspace(0, 1, 101)
    y = t.copy()
    y[88:92] = np.nan  # 0.9 is reached at 0.9
    assert np.isnan(response_time(t, y))
    y = t.copy()
    y[50:60] = np.nan  # not where it is reached
    assert response_time(t, y) == pytest.approx(0.9)


@pytest.mark.parametrize("late", [-0.013, 0.0, 0.0317, 0.2])
def test_a_delay_is_found_to_a_part_of_a_sample(late):
    t = np.arange(401) / 200
    noise = np.random.default_rng(3).normal(0, 0.002, len(t))
    law = lambda s: np.sin(2 * np.pi * s) + 0.3 * np.sin(7 * s)
    first, second = (
        run(t, joint__1__position=law(t)),
        run(t, joint__1__position=law(t - late) + noise),
    )
    second["joint/1/position"][40:45] = np.nan
    assert best_fit_delay(first, second, "joint/1/position") == pytest.approx(late, abs=2e-4)


def test_the_table_is_of_what_deviates():
    """A sine with 3 % more amplitude deviates by 3 % of the peak, at the peak; half a degree of
    phase by its chord."""
    t = np.arange(1001) / 1000
    first = run(
        t, joint__1__position=0.01 * np.sin(2 * np.pi * t), link__2__tip_deflection=np.cos(t)
    )
    second = run(
        t,
        joint__1__position=0.0103 * np.sin(2 * np.pi * t),
        link__2__tip_deflection=1.1 * np.cos(t),
    )
    second.meta["experiment"] = "forward"
    found = compare(first, second)
    joint, tip = found.differences
    assert joint.max_relative == pytest.approx(0.03, rel=1e-9) and joint.at_s == pytest.approx(0.25)
    assert joint.peak == pytest.approx(0.01) and joint.rms_relative == pytest.approx(
        0.03 / np.sqrt(2), rel=1e-3
    )
    assert tip.max_relative == pytest.approx(0.1) and tip.at_s == 0.0
    assert joint.published_percent == 4.35 and tip.published_percent == 7.5
    assert found.worst_response == pytest.approx(0.0, abs=1e-9) and found.lost == 0


def test_dropouts_are_counted_and_left_out():
    t = np.arange(101) / 100
    first, second = run(t, joint__1__position=t), run(t, joint__1__position=t + 0.01)
    second["joint/1/position"][[3, 50]] = np.nan
    found = compare(first, second)
    assert found.lost == 2 and found.differences[0].max == pytest.approx(0.01)


def test_the_dissertations_figures():
    assert PUBLISHED["forward"] == {
        "joint/1/position": 4.35,
        "joint/2/position": 7.5,
        "link/2/tip_deflection": 7.5,
    }
    assert [
        PUBLISHED["inverse"][k]
        for k in ("joint/1/position", "joint/2/position", "response", "link/2/tip_deflection")
    ] == [
        8.3,
        1.15,
        17.8,
        11.5,
    ]


def test_the_experiment_comes_last(forward):
    measured, moved = forward
    for pair in ((measured, moved), (moved, measured)):
        assert simulation_first(*pair) == (moved, measured)
    assert simulation_first(moved, moved) == (moved, moved)


def test_runs_with_nothing_in_common_are_refused():
    with pytest.raises(InputError, match="expected two runs with joint positions in common"):
        compare(run([0, 1], tip__x=[0, 1]), run([0, 1], tip__x=[0, 1]))


# --- what is wrong is named


@pytest.mark.parametrize(
    "by, changes, words",
    [
        ("guess", {}, "by = 'guess': expected one of commanded, reference, measured"),
        ("commanded", {"rig": None}, "rig: missing: the run has no rig file"),
        ("commanded", {"rig": {"name": 3}}, "expected the rig file's tables"),
        ("measured", {"robot": None}, "robot: missing: the run has no robot file"),
        ("reference", {"experiment": "step"}, "no joint can follow the set-points of a step"),
    ],
)
def test_what_an_experiment_lacks_is_named(by, changes, words, forward):
    with pytest.raises(InputError, match=re.escape(words)):
        simulate_experiment(replace(forward[0], meta=forward[0].meta | changes), by)


@pytest.mark.parametrize("by", DRIVEN_BY)
def test_a_run_without_the_channels_is_named(by):
    with pytest.raises(InputError, match=f"by = '{by}': expected a run with joint/1/"):
        simulate_experiment(run([0, 1], tip__x=[0, 1]), by)


def test_a_rig_without_its_friction_is_told_what_is_missing(forward):
    """A real rig needs no [emulated]; its friction and play have tables of their own."""
    rig = forward[0].meta["rig"] | {"emulated": None}
    simulate_experiment(replace(forward[0], meta=forward[0].meta | {"rig": rig}))
    rig = rig | {"carriage": None}
    with pytest.raises(InputError, match=r"carriage: missing"):
        simulate_experiment(replace(forward[0], meta=forward[0].meta | {"rig": rig}))


# --- what it leaves, and that nothing emulated passes as measured


def text_chunks(png):
    from PIL import Image

    return Image.open(io.BytesIO(png)).text


def terminal(c):
    from rich.console import Console

    console = Console(width=120, file=io.StringIO())
    console.print(table.table(c))
    return console.file.getvalue()


def test_what_is_emulated_says_so_everywhere(compared, page, document):
    words = EMULATED.removeprefix("emulated: ")
    assert "experiment (emulated)" in terminal(compared) and words[:40] in terminal(compared)
    assert (
        table.numbers(compared)["emulated"] is True
        and "(emulated)" in table.numbers(compared)["title"]
    )
    head = page[: page.index("<table")]
    assert '<p class="emulated">' in head and words in head and "(emulated)" in head
    figures = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(figures) == 3 and all("(emulated)" in figure for figure in figures)
    assert page.count("<figcaption>Fig. ") == 3
    assert all(
        "(emulated)" in caption for caption in re.findall(r"<figcaption>(.*?)</figcaption>", page)
    )
    said = text_chunks(report.png(compared))
    assert "(emulated)" in said["Title"] and said["Description"] == EMULATED
    assert (
        rb"\(emulated\)" in document and words.encode() in document
    )  # its properties; its text is compressed


def test_a_measurement_does_not_say_emulated(compared):
    meta = compared.experiment.meta | {"emulated": False, "label": "experiment"}
    simulated = replace(
        compared.simulation, meta=compared.simulation.meta | {"simulates": "forward experiment"}
    )
    real = compare(simulated, replace(compared.experiment, meta=meta))
    assert "emulated" not in terminal(real) and not table.numbers(real)["emulated"]
    own = report.html(real)
    assert "(emulated)" not in own and 'class="emulated"' not in own
    assert "emulated" not in str(text_chunks(report.png(real)))


def test_the_page_stands_alone(page):
    assert (
        not re.findall(r'(?:src|href)="(?!#)', page.replace('xlink:href="#', ""))
        and "<script" not in page
    )
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', page))
    assert used <= set(ids)


def test_the_same_runs_give_the_same_report(compared, page, document):
    assert report.html(compared) == page and pages.pdf(compared) == document


def test_all_tables_have_the_same_cells(compared, page):
    rows = table.rows(compared)
    assert [row[0] for row in rows[:3]] == [
        "joint variable 1",
        "joint variable 2",
        "tip displacement of link 2",
    ]
    assert [row[-1] for row in rows[:3]] == ["4.35 %", "7.5 %", "7.5 %"]
    for row in rows:
        assert "".join(f"<td>{cell}</td>" for cell in row) in page


def test_the_sheets_have_every_row_and_no_text_lies_on_another(compared):
    sheets = pages.drawn(compared)
    found = []
    for sheet in sheets:
        sheet.draw_without_rendering()
        texts = [text for text in sheet.texts if text.get_text()]
        found += [text.get_text() for text in texts]
        boxes = [text.get_window_extent() for text in texts]
        boxes += [axes.get_tightbbox() for axes in sheet.axes]
        for k, box in enumerate(boxes):
            assert sheet.bbox.x0 < box.x0 and box.x1 < sheet.bbox.x1
            assert sheet.bbox.y0 < box.y0 and box.y1 < sheet.bbox.y1
            for other in boxes[:k]:
                across = min(box.x1, other.x1) - max(box.x0, other.x0)
                up = min(box.y1, other.y1) - max(box.y0, other.y0)
                assert across <= 1 or up <= 1
    written = " ".join(found).replace(" ", "")
    for row in [*table.rows(compared), *report.about(compared)]:
        for cell in row:
            assert cell.replace(" ", "") in written
    assert sum(len(sheet.axes) for sheet in sheets) == 2 * len(compared.differences)


def test_the_folder_has_it_all(compared, tmp_path):
    paths = save(compared, tmp_path, simulated=True)
    assert {p.name for p in paths} == {
        "run.parquet",
        "comparison.json",
        "report.html",
        "report.pdf",
        "comparison.png",
        "review.rrd",
    }
    stored = json.loads((tmp_path / "comparison.json").read_text())
    assert stored == json.loads(json.dumps(table.numbers(compared)))
    assert [row["published_percent"] for row in stored["deviations"]] == [4.35, 7.5, 7.5]
    again = Run.read(tmp_path / "simulation")
    assert compare(again, compared.experiment).differences == compared.differences
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")


def test_the_review_shows_the_dissertations_figures(compared, tmp_path):
    from flexlab.review.layout import _figures
    from flexlab.review.writer import _part

    shown, scene = _part("", [compared.simulation, compared.experiment])
    assert scene.measured
    names = [
        column.contents[0].name
        if not hasattr(column.contents[0], "active_tab")
        else column.contents[0].contents[0].name
        for column in _figures(scene)
    ]
    assert names == ["joint variable 1", "joint variable 2", "tip flexural displacement, link 2"]
    below = [column.contents[1].name for column in _figures(scene)]
    assert below == [f"deviation of {name}" for name in names]
    assert all("(emulated)" in s.label for s in scene.signals.values() if "experiment" in s.label)
    assert called(compared.experiment) == shown[1].label == "experiment (emulated)"


def test_the_review_file_says_emulated(compared, tmp_path):
    from rerun.chunk import RrdReader

    from flexlab.review import write_review

    path = write_review(tmp_path / "r.rrd", [compared.simulation, compared.experiment])
    roots, pages = set(), []
    for chunk in RrdReader(path).stream():
        roots.add(chunk.entity_path.split("/")[1])
        batch = chunk.to_record_batch()
        if "TextDocument:text" in batch.schema.names:
            pages += batch.column("TextDocument:text").to_pylist()
    assert {"simulation", "experiment", "deviation"} <= roots
    (page,) = [p[0] for p in pages]
    assert (
        "experiment (emulated): emulated." in page
        and "| joint variable 1 |" in page
        and "7.5 %" in page
    )


# --- the command


def invoke(*arguments):
    from typer.testing import CliRunner

    from flexlab.cli.app import app

    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_the_command_compares_two_runs_and_leaves_them_as_they_are(compared, tmp_path):
    compared.experiment.save(tmp_path / "experiment")
    compared.simulation.save(tmp_path / "simulation")
    before = (tmp_path / "experiment" / "run.parquet").read_bytes()
    done = invoke("compare", tmp_path / "experiment", tmp_path / "simulation", "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert (
        found["emulated"] is True and found["runs"]["second"]["called"] == "experiment (emulated)"
    )
    assert {k: found[k] for k in ("deviations", "responses")} == {
        k: json.loads(json.dumps(table.numbers(compared)[k])) for k in ("deviations", "responses")
    }
    folder = tmp_path / "experiment" / "comparison-1"
    assert not (folder / "simulation").exists() and (folder / "report.html").is_file()
    assert (tmp_path / "experiment" / "run.parquet").read_bytes() == before


def test_the_command_exports_with_the_label(compared, tmp_path):
    compared.experiment.save(tmp_path)
    done = invoke("export", tmp_path, "--to", "csv", "--json")
    assert done.exit_code == 0 and json.loads(done.stdout)["emulated"] is True
    assert (tmp_path / "run.csv").read_text().startswith("# experiment (emulated)\n")


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["compare", "RUN", "RUN", "--by", "measured"], "--by = 'measured': expected one run"),
        (["compare", "RUN", "--by", "guess"], "by = 'guess': expected one of"),
        (["compare", "absent"], "absent: no run here"),
        (
            ["export", "RUN", "--to", "xlsx"],
            "--to = 'xlsx': expected one of csv, parquet, mat, tdms, mcap",
        ),
    ],
)
def test_the_command_names_what_is_wrong_and_leaves_nothing(arguments, words, compared, tmp_path):
    compared.experiment.save(tmp_path / "run")
    done = invoke(*(tmp_path / "run" if a == "RUN" else a for a in arguments))
    assert isinstance(done.exception, InputError) and words in str(done.exception)
    assert [p.name for p in (tmp_path / "run").iterdir()] == ["run.parquet"]
