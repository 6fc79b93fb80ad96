"""Signals of all kinds, drawn by Hypothesis."""

import numpy as np
from hypothesis import strategies as st

from flexura.signals import (
    bang_bang,
    constant,
    cycloid,
    harmonic,
    piecewise,
    polynomial,
    step,
    table,
    trapezoidal,
)
from flexura.signals.shaping import matched_cycloid, zv, zvd

level = st.floats(-10, 10)
instant = st.floats(0, 2)
duration = st.floats(0.2, 3)


def points(least):
    """Ascending instants and as many values."""
    pairs = st.lists(st.tuples(st.floats(0.2, 1), level), min_size=least, max_size=6)
    return st.builds(
        lambda start, rows: (start + np.cumsum([gap for gap, _ in rows]), [y for _, y in rows]),
        instant,
        pairs,
    )


PLAIN = st.one_of(
    st.builds(constant, level),
    st.builds(harmonic, level, st.floats(0, 2), st.floats(-4, 4), level),
    st.builds(cycloid, level, duration, level, instant),
    st.builds(polynomial, level, duration, level, instant),
    st.builds(
        lambda a, T, part, at: bang_bang(a, T, part * T, at),
        level,
        duration,
        st.floats(0.1, 0.25),
        instant,
    ),
    st.builds(
        lambda end, T, part, start, at: trapezoidal(end, T, part * T, start, at),
        level,
        duration,
        st.floats(0.1, 0.5),
        level,
        instant,
    ),
    st.builds(matched_cycloid, level, st.floats(0.5, 5), st.integers(2, 5), level, instant),
    st.builds(lambda points: table(*points), points(2)),
)
SMOOTH = PLAIN | st.builds(
    lambda shape, s, f, zeta: shape(s, f, zeta),
    st.sampled_from([zv, zvd]),
    PLAIN,
    st.floats(0.5, 5),
    st.floats(0, 0.5),
)
STEPPED = st.one_of(
    st.builds(step, level, instant),
    st.builds(lambda a, T, at: bang_bang(a, T, 0.0, at), level, duration, instant),
    st.builds(lambda points: piecewise(*points), points(1)),
    st.builds(zv, st.builds(step, level, instant), st.floats(0.5, 5)),
)
SIGNALS = st.one_of(SMOOTH, STEPPED)
