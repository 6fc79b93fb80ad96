"""Every robot file of the project: it loads, assembles, and does its default manoeuvre inside its
limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexlab.crosscheck.default_manoeuvre import REACH, _reach, modest
from flexura.signals import load_manoeuvre, polynomial, table

ROOT = Path(__file__).resolve().parents[3]
FILES = sorted((ROOT / "model" / "robots").glob("*.toml"))


def test_the_nine_structures_are_there():
    structures = {fx.load(path).structure for path in FILES}
    assert {a + b for a in ("R", "Pa", "Pb") for b in ("R", "Pa", "Pb")} <= structures
    assert {"R", "Pa", "Pb", "RPbPa"} <= structures


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_robot_file_is_read_and_written_and_says_what_it_is(path, tmp_path):
    robot = fx.load(path)
    fx.save(robot, tmp_path / "again.toml")
    assert fx.load(tmp_path / "again.toml") == robot
    assert (
        path.read_text().startswith("#") and robot.name and all(link.name for link in robot.links)
    )


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_robot_does_its_default_manoeuvre(path):
    """Every joint moves, none leaves its limits or the link it slides on, links bend by 1 % or so,
    energy is kept."""
    robot = fx.load(path)
    system = fx.assemble(robot)
    asked = modest(system)
    run = fx.simulate(system, asked.t, asked.drive, rtol=1e-7)
    assert run.complete and run.meta["events"] == [] and run.meta["energy_error"] < 1e-5
    for i, link in enumerate(robot.links, 1):
        position = run[f"joint/{i}/position"]
        assert 0.02 * REACH[link.joint.type] < np.ptp(position) < 1.2 * REACH[link.joint.type]
        assert np.all((position >= system.limits[i - 1, 0]) & (position <= system.limits[i - 1, 1]))
        if link.joint.type == "Pa" and i > 1 and robot.links[i - 2].joint.type == "Pb":
            assert np.all(position > robot.links[i - 2].length_m - run[f"joint/{i - 1}/position"])
        if link.flexible:
            sag = abs(run[f"link/{i}/tip_deflection"]).max() / link.length_m
            assert 1e-5 < sag < (0.05 if np.any(robot.gravity_m_s2) else 0.012)


def runs_of_r16(path, gravity, locked):
    """The default method at its default tolerance, and small explicit steps, or implicit ones where
    the robot is too stiff for those."""
    changes = {"gravity_m_s2": gravity}
    robot = fx.load(path)
    if locked:
        changes |= {f"link.{i}.joint.locked": True for i in range(1, len(robot.links) + 1)}
    system = fx.assemble(robot.replace(changes))
    asked = modest(fx.assemble(robot))
    drive = None if locked else asked.drive
    t = np.linspace(0.0, 0.5, 6) if locked else asked.t[: len(asked.t) // 2]
    keys = {"start": "straight"}
    run = fx.simulate(system, t, drive, **keys)
    for method in ("explicit", "implicit"):
        sharp = fx.simulate(
            system,
            t,
            drive,
            method=method,
            rtol=1e-10,
            max_steps=20_000 if method == "explicit" else None,
            **keys,
        )
        if all(event["name"] != "exhausted" for event in sharp.meta["events"]):
            break
    return run, sharp


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("locked", [True, False], ids=["locked", "driven"])
@pytest.mark.parametrize("gravity", [(0.0, 0.0), (0.0, -9.81)], ids=["level", "gravity"])
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_loss_is_that_of_small_steps(path, gravity, locked):
    """r16: to a thousandth, or to 1e-9 of the largest energy where next to nothing is lost."""
    run, sharp = runs_of_r16(path, gravity, locked)
    assert len(run.t) == len(sharp.t) and run.meta["energy_error"] < 1e-4
    kinds = ("kinetic", "strain", "potential")
    energy = max(np.abs(sharp[f"energy/{kind}"]).max() for kind in kinds)
    lost, wanted = run["energy/loss"], sharp["energy/loss"]
    assert np.abs(lost - wanted).max() <= max(1e-3 * wanted[-1], 1e-9 * energy)


STIFF_RIDES = {
    "chain-r-pb-pa",
    "type-2-rpa",
    "type-5-papa",
    "type-7-pbr",
    "type-8-pbpa",
    "type-9-pbpb",
}  # joints that slide on damped links: up to minutes at this tolerance


def replayed(path):
    marks = [pytest.mark.slow, pytest.mark.timeout(1800)] if path.stem in STIFF_RIDES else []
    return pytest.param(path, id=path.stem, marks=marks)


@pytest.mark.parametrize("path", list(map(replayed, FILES)))
def test_replayed_inverse_drives_return_the_motion(path):
    """Every joint most of its way in half a second, exactly; its drives, as splines through 4 kHz
    values, forward again: 1e-6."""
    system = fx.assemble(fx.load(path))
    t, start = np.linspace(0.0, 0.6, 2401), system.robot.start
    motions = [
        polynomial(s + 0.8 * reach, 0.5, s) for s, reach in zip(start, _reach(system), strict=True)
    ]
    run = fx.inverse(system, t, motions, rtol=1e-10)
    drives = fx.Drive.force(*(table(t, run[f"joint/{i}/drive"]) for i in range(1, len(start) + 1)))
    again = fx.simulate(system, t, drives, rtol=1e-10)
    assert again.complete and run.meta["energy_error"] < 1e-8
    for i, motion in enumerate(motions, 1):
        assert run[f"joint/{i}/position"][-1] == pytest.approx(motion(0.6)[0], abs=1e-12)
        assert np.abs(again[f"joint/{i}/position"] - run[f"joint/{i}/position"]).max() < 1e-6


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_robot_has_natural_frequencies_and_a_linear_model(path):
    system = fx.assemble(fx.load(path))
    locked = fx.frequencies(system)
    assert np.all(locked > 0.1) and len(locked) == len(system.elastic_rows)
    linear = fx.linearize(system)
    zeros = linear.zeros(linear.inputs[0], "joint/1/position")
    assert len(zeros) >= len(linear.poles) - 2 and np.all(np.isfinite(linear.A))


def test_the_cart_of_the_single_link_comes_to_rest():
    """The manoeuvre file beside it: a cycloid over two periods; the exact geometry and mode 2 leave
    0.2 % of the deflection."""
    system = fx.assemble(fx.load(ROOT / "model" / "robots" / "single-pa.toml"))
    asked = load_manoeuvre(ROOT / "model" / "manoeuvres" / "single-pa-at-rest.toml", 1)
    tip = np.abs(fx.simulate(system, asked.t, asked.drive, rtol=1e-8)["link/1/tip_deflection"])
    assert tip[asked.t > 2 / 1.44972].max() < 2e-3 * tip.max() and tip.max() == pytest.approx(
        0.0255, abs=2e-4
    )
