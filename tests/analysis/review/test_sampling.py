"""Which samples of a run a review draws."""

import numpy as np

from flexlab.review import write_review
from flexura.io import drawing
from reviews import scalars, text


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
