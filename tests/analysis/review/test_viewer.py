"""What Rerun's viewer makes of a review."""

import io
import os
from dataclasses import replace

import numpy as np
import pytest

from flexlab.review import headless, picture, write_gallery, write_review
from flexlab.review.sources import COLOURS
from flexura.errors import FlexuraError, InputError
from reviews import (
    RAISED,
    chain,
    entities,
    synthetic,
)


@pytest.fixture(scope="session")
def viewer():
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


class Busy:
    """A client that is late with its first pictures, as on a busy machine; the real one is late
    only there."""

    def __init__(self, late):
        self.late = late

    def take_screenshot(self, _):
        self.late -= 1
        if self.late >= 0:
            raise TimeoutError("Deadline expired")
        return b"png"


def test_a_picture_that_is_late_is_asked_for_again():
    assert headless.settled_picture(Busy(3)) == b"png"
    with pytest.raises(TimeoutError):
        headless.settled_picture(Busy(4))
