"""The drawn shapes of links as numbers."""

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexlab.review import write_review
from flexura.io import Run, drawing
from flexura.robot import Robot
from flexura.simulation.recorder import recorded_channels
from reviews import RIG, STRIP, cantilever, chain, column, scalars, synthetic


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
