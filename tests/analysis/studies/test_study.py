"""The studies: the dissertation's findings with this project's own numbers, and what a sweep
promises."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexlab import studies
from flexlab.studies import length_ratio, payload, sweep
from flexura.signals import Drive, Manoeuvre, bang_bang, cycloid, load_manoeuvre

MODEL = Path(__file__).resolve().parents[3] / "model"
SET_I = {
    0: 13.0,
    10: 13.5,
    20: 10.5,
    30: 12.8,
    50: 15.2,
    80: 15.0,
    120: 13.7,
    200: 11.9,
}  # g: mm, linear model, n = 2 + 2
SET_III = {
    0.10: (32.68, 376.4),
    0.15: (17.13, 169.1),
    0.20: (10.738, 96.53),
    0.30: (5.482, 44.07),
    0.40: (3.363, 25.35),
}  # m: Hz


def robot(name: str, **changes) -> fx.Robot:
    return fx.load(MODEL / "robots" / f"{name}.toml").replace(changes)


def bang() -> Manoeuvre:
    return load_manoeuvre(MODEL / "manoeuvres" / "type-1-bang-bang.toml", 2)


# The dissertation's findings


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_payload_near_20_g_bends_type_1_least():
    """Finding 1, and the table of an independent linear model with two elements a link: to 1.5
    %."""
    linear = robot("type-1-rr", **{"stiffening": False, "link.1.elements": 2, "link.2.elements": 2})
    every_2_ms = replace(bang(), output_step_s=2e-3)
    done = studies.run("payload", linear, every_2_ms, "0:0.2:41", jobs=1)
    by_payload = {round(1e3 * row["payload_kg"]): row for row in done.rows}
    for grams, mm in SET_I.items():
        assert 1e3 * by_payload[grams]["max_m"] == pytest.approx(mm, rel=0.015)
    assert (
        done.complete
        and done.finding.reproduced
        and done.finding.numbers["payload_kg"] == pytest.approx(0.020)
    )
    assert (
        done.finding.numbers["dips"] == 2 and "narrower dips: 11" in done.finding.words
    )  # the other one is at 3.5 g
    assert 0.010 < done.finding.numbers["from_kg"] < 0.020 < done.finding.numbers["to_kg"] < 0.030
    assert (
        done.finding.numbers["residual_payload_kg"] == pytest.approx(0.020)
        and by_payload[20]["later_m"] < 2e-3
    )


def test_the_exact_geometry_has_that_payload_too_and_the_published_arm_has_none():
    exact = studies.run("payload", robot("type-1-rr"), bang(), "0.01:0.05:9", jobs=1)
    assert exact.finding.reproduced and exact.finding.numbers["payload_kg"] == pytest.approx(0.020)
    arm = studies.run("payload", robot("two-link-arm"), None, "0:0.4:9", jobs=1)
    assert arm.finding.reproduced is False and "NOT reproduced" in studies.output.verdict(arm)


def test_a_sleeve_makes_type_3_bend_less():
    """Finding 3, and the frequencies and deflections of an independent node-by-node model: 5.0 mm
    at 0.25 m, 34 mm at 0.40 m.

    That model's sliding strip has 10 mm with 4 nodes and 13 mm with 8; this one's mesh moves with
    it: 7.2 mm with any number.
    """
    done = studies.run(
        "boundary",
        robot("type-3-rpb", **{"link.2.damping": {"alpha_1_s": 1.0}}),
        values="0.1:0.4:7",
        jobs=1,
    )
    by_length = {
        round(row["free_length_m"], 3): row for row in done.rows if row["case"] != "sliding"
    }
    for length, (f1, f2) in SET_III.items():
        assert by_length[length]["first_frequency_Hz"] == pytest.approx(f1, rel=1e-3)
        held = robot(
            "type-3-rpb", **{"link.2.joint.limits": [0.05, 0.4], "link.2.joint.start": length}
        )
        assert fx.frequencies(fx.assemble(held))[1] == pytest.approx(f2, rel=0.01)
    assert 1e3 * by_length[0.25]["later_m"] == pytest.approx(5.0, abs=0.05)
    assert 1e3 * by_length[0.4]["later_m"] == pytest.approx(34.0, rel=0.03)
    sliding = [row for row in done.rows if row["case"] == "sliding"]
    assert len(sliding) == 1 and 1e3 * sliding[0]["later_m"] == pytest.approx(7.17, abs=0.03)
    assert done.finding.reproduced and done.finding.numbers["ratio"] == pytest.approx(
        0.205, abs=0.01
    )


@pytest.mark.parametrize("keep", length_ratio.KEEP)
def test_most_of_the_change_is_where_the_flexible_link_is_longer(keep):
    """Finding 2, whatever is kept: of prescribed motions the bending depends on L2 alone, drives on
    the masses too."""
    done = studies.run("length-ratio", robot("rig"), keep=keep, jobs=1)
    rows = done.rows
    total = np.array([row["L1_m"] + row["L2_m"] for row in rows])
    assert np.ptp([row["L1_m"] for row in rows] if keep == "first" else total) < 1e-12
    assert [row["L2_m"] / row["L1_m"] for row in rows] == pytest.approx(
        [row["ratio"] for row in rows]
    )
    assert (
        done.finding.reproduced
        and 0.8 < done.finding.numbers["share_above_1"] < 1
        and length_ratio.KEEP[keep] in done.about
    )
    at_three = studies.run("length-ratio", robot("rig"), values="1:3:3", keep=keep, jobs=1).rows[-1]
    assert (at_three["L1_m"], at_three["L2_m"]) == pytest.approx((0.1, 0.3))
    motions = [joint.motion for joint in length_ratio._law(robot("rig")).drive.joints]
    inverse = fx.inverse(fx.assemble(robot("rig")), np.linspace(0, 2, 401), motions)
    assert at_three["max_m"] == pytest.approx(
        np.abs(inverse["link/2/tip_deflection"]).max(), rel=1e-4
    )


# Cases


def test_what_belongs_to_a_length_goes_with_it():
    heavy = robot("rig", **{"link.1.mass_kg": 0.6})
    doubled = length_ratio._with_lengths(heavy, [0.2, 0.3], "density").links[0]
    assert (doubled.mass_kg, doubled.centre_of_mass_m, doubled.inertia_kg_m2) == pytest.approx(
        (1.2, 0.1, 8 * 5e-4)
    )
    kept = length_ratio._with_lengths(heavy, [0.2, 0.3], "total").links[0]
    assert (kept.mass_kg, kept.centre_of_mass_m, kept.inertia_kg_m2) == pytest.approx(
        (0.6, 0.1, 5e-4)
    )
    slider = length_ratio._with_lengths(robot("type-2-rpa"), [1.0, 0.3], "total").links[1].joint
    assert (slider.start, slider.limits) == (0.5, (0.2, 0.8))
    sleeve = length_ratio._with_lengths(robot("type-3-rpb"), [0.2, 0.8], "total").links[1].joint
    assert (sleeve.start, sleeve.limits) == (0.5, (0.3, 0.7))


@pytest.mark.parametrize(
    "y, where",
    [
        ([3, 2, 1, 2, 3], [2]),
        ([1, 2, 3], []),
        ([3, 2, 1], []),
        ([2, 1.95, 2], []),
        ([5, 1, 2, 0.9, 4], [1, 3]),
        ([9, 1, 9, 2, 2.1, 2.05, 2.1, 9], [3, 1]),  # the widest first; the ripple inside it is none
    ],
)
def test_a_dip_lies_between_two_hills(y, where):
    assert sorted(
        k for k, _, _ in payload._dips(np.arange(len(y)), np.array(y, dtype=float))
    ) == sorted(where)
    assert [k for k, _, _ in payload._dips(np.arange(len(y)), np.array(y, dtype=float))][
        :1
    ] == where[:1]


def test_the_range_of_a_dip_ends_where_its_sides_have_risen_by_a_tenth():
    x, y = np.array([0.0, 1.0, 2.0, 3.0]), np.array([2.0, 1.0, 1.05, 2.0])
    assert payload._around(x, y, 1) == pytest.approx((0.9, 2 + 0.05 / 0.95))


# The sweep


def short(name: str = "type-1-rr") -> tuple[fx.Robot, Manoeuvre]:
    drive = Drive.force(bang_bang(0.3, 0.2), bang_bang(0.05, 0.2))
    return robot(name, **{"link.1.modes": 2, "link.2.modes": 2}), Manoeuvre(
        "short", 0.3, 0.01, drive
    )


def numbers_of(rows):
    return [{key: value for key, value in row.items() if key != "wall_s"} for row in rows]


def test_processes_give_the_rows_of_one(monkeypatch, tmp_path):
    one = studies.run("payload", *short(), "0:0.04:5", jobs=1)
    monkeypatch.setattr(sweep, "POOL_PAYS_S", -1.0)
    fractions = []
    two = studies.run(
        "payload",
        *short(),
        "0:0.04:5",
        jobs=2,
        progress=fractions.append,
        channels=tmp_path / "runs",
    )
    assert numbers_of(one.rows) == numbers_of(two.rows) and two.complete
    assert fractions == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    stored = [fx.Run.read(tmp_path / "runs" / f"{k:03d}") for k in range(5)]
    assert [run.meta["case"]["payload_kg"] for run in stored] == [
        row["payload_kg"] for row in one.rows
    ]
    assert [np.abs(run["link/2/tip_deflection"]).max() for run in stored] == [
        row["max_m"] for row in one.rows
    ]


def test_an_interruption_keeps_what_is_done(tmp_path):
    def stop(fraction):
        if fraction > 0.5:
            raise KeyboardInterrupt

    done = studies.run("payload", *short(), "0:0.04:5", jobs=1, progress=stop)
    assert not done.complete and len(done.rows) == 3 and done.finding.reproduced is not None
    assert all(path.stat().st_size > 0 for path in studies.save(done, tmp_path))


def test_a_case_that_cannot_be_simulated_is_a_row_that_says_so():
    """A robot whose joint runs into its limit with a light payload, and not with a heavy one."""
    limited, manoeuvre = short()
    limited = limited.replace({"link.2.joint.limits": [-0.2, 0.2]})
    done = studies.run("payload", limited, manoeuvre, "0:2:9", jobs=1)
    assert [row["complete"] for row in done.rows] == sorted(row["complete"] for row in done.rows)
    assert (
        not done.rows[0]["complete"]
        and "left its limits" in done.rows[0]["error"]
        and done.rows[-1]["complete"]
        and done.complete
    )
    assert "failed at payload [g] 0: joint 2 left its limits" in studies.table(done).notes[0]


def test_a_study_is_stored_with_its_finding(tmp_path):
    import pyarrow.parquet as pq

    done = studies.run("payload", *short(), "0:0.04:5", jobs=1)
    parquet, png, svg = studies.save(done, tmp_path)
    stored = pq.read_table(parquet)
    about = json.loads(stored.schema.metadata[b"flexura_study"])
    assert stored.column("max_m").to_pylist() == [row["max_m"] for row in done.rows]
    assert (
        about["finding"]["words"] == done.finding.words
        and fx.Robot.from_dict(about["robot_file"]) == done.robot
    )
    assert png.read_bytes().startswith(b"\x89PNG") and b"<svg" in svg.read_bytes()
    told = json.loads(json.dumps(studies.numbers(done)))
    assert [row["payload_kg"] for row in told["rows"]] == [0.0, 0.01, 0.02, 0.03, 0.04] and told[
        "link"
    ] == 2


def test_every_study_has_a_figure_of_its_own():
    runs = {
        "length-ratio": studies.run("length-ratio", robot("rig"), values="0.5:2:3", jobs=1),
        "boundary": studies.run("boundary", robot("type-3-rpb"), values="0.2:0.4:3", jobs=1),
    }
    for name, label in (
        ("length-ratio", "L2 / L1"),
        ("boundary", "free length [mm] (sliding: its mean)"),
    ):
        axes = studies.output.figure(runs[name]).axes[0]
        assert axes.get_xlabel() == label and axes.get_ylabel() == "tip deflection of link 2 [mm]"
        drawn = max(
            np.nanmax(line.get_ydata()) for line in axes.get_lines() if len(line.get_ydata()) > 2
        )
        assert drawn == pytest.approx(
            1e3 * max(row["later_m" if name == "boundary" else "max_m"] for row in runs[name].rows)
        )


# What is refused

RIGID = fx.Robot.from_dict(
    {"link": [{"length_m": 0.1, "mass_kg": 1.0, "joint": {"type": "R"}}] * 2}
)


@pytest.mark.parametrize(
    "arguments, keys, words",
    [
        (
            ("mass", robot("rig")),
            {},
            "KIND = 'mass': expected one of payload, length-ratio, boundary",
        ),
        (("payload", RIGID), {}, "a robot with a flexible link"),
        (("payload", robot("rig"), None, "0:1"), {}, "values = '0:1': expected LOW:HIGH:COUNT"),
        (("payload", robot("rig"), None, "1:0:5"), {}, "expected LOW below HIGH"),
        (("payload", robot("rig"), None, "-1:1:5"), {}, "payloads of 0 or more"),
        (("length-ratio", robot("single-r")), {}, "two links or more"),
        (("length-ratio", robot("rig"), None, "0:1:5"), {}, "ratios above 0"),
        (
            ("length-ratio", robot("rig")),
            {"keep": "mass"},
            "keep = 'mass': expected one of total, first, density",
        ),
        (("boundary", robot("rig")), {}, "a flexible link behind a joint Pb"),
        (("boundary", robot("type-3-rpb"), None, "0.1:0.5:5"), {}, "up to 0.4 m"),
    ],
)
def test_what_a_study_cannot_be_of_is_named(arguments, keys, words):
    with pytest.raises(fx.InputError) as caught:
        studies.run(*arguments, **keys)
    assert words in str(caught.value)


def test_a_prescribed_motion_may_drive_a_study():
    manoeuvre = Manoeuvre(
        "cycloids", 0.5, 0.01, Drive.prescribed(cycloid(0.5, 0.3), cycloid(0.3, 0.3))
    )
    done = studies.run("payload", short()[0], manoeuvre, "0:0.04:3", jobs=1)
    assert done.complete and all(
        np.isfinite(row["later_m"]) and row["joint_1_peak_N_m"] > 0 for row in done.rows
    )
