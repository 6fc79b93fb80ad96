"""The file of a review: every signal, unit, source and shape reads back."""

import os
import re
import subprocess

import numpy as np

from flexlab.runs.deviation import deviation
from flexura.io import drawing
from reviews import DURATION, chunks, column, entities, scalars, text


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
