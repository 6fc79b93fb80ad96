"""Tables of signals: each is a signal, or is refused with its key."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura import signals
from flexura.signals import (
    from_spec,
)

KINDS = ", ".join(signals.KINDS)
nan, inf = math.nan, math.inf
WRONG_SIGNALS = {
    "a text alone": ("3", "signal", "3", "a number, or a table with kind"),
    "a list": ([1.0], "signal", [1.0], "a table with kind"),
    "an empty table": ({}, "signal.kind", None, "missing: expected one of constant, step"),
    "an unknown kind": ({"kind": "sine"}, "signal.kind", "sine", f"one of {KINDS}"),
    "a kind that is a list": ({"kind": ["step"]}, "signal.kind", ["step"], "one of"),
    "a kind that is a table": ({"kind": {"a": 1}}, "signal.kind", {"a": 1}, "one of"),
    "an unknown key": (
        {"kind": "constant", "value": 1, "at_s": 1},
        "signal.at_s",
        1,
        "unknown key; known for constant: value",
    ),
    "a missing key": (
        {"kind": "cycloid", "end": 1},
        "signal.duration_s",
        None,
        "missing: expected a finite number",
    ),
    "a text": ({"kind": "constant", "value": "1"}, "signal.value", "1", "a finite number"),
    "a truth value": ({"kind": "constant", "value": True}, "signal.value", True, "a finite number"),
    "not a number": ({"kind": "constant", "value": nan}, "signal.value", nan, "a finite number"),
    "infinity": ({"kind": "step", "value": inf}, "signal.value", inf, "a finite number"),
    "a whole number beyond all": (
        {"kind": "step", "value": 10**400},
        "signal.value",
        10**400,
        "a finite number",
    ),
    "a list for a number": (
        {"kind": "constant", "value": [1, 2]},
        "signal.value",
        [1, 2],
        "a finite number",
    ),
    "a table for a number": (
        {"kind": "constant", "value": {"a": 1}},
        "signal.value",
        {"a": 1},
        "a finite number",
    ),
    "a number for a list": (
        {"kind": "table", "t_s": 1, "y": [1]},
        "signal.t_s",
        1,
        "a list of finite numbers",
    ),
    "a list with a text": (
        {"kind": "table", "t_s": [0, 1], "y": [1, "2"]},
        "signal.y",
        [1, "2"],
        "a list of finite numbers",
    ),
    "a table of one point": (
        {"kind": "table", "t_s": [0], "y": [1]},
        "signal.t_s",
        [0.0],
        "at least two ascending times",
    ),
    "times that go back": (
        {"kind": "table", "t_s": [0, 2, 1], "y": [1, 2, 3]},
        "signal.t_s",
        [0.0, 2.0, 1.0],
        "ascending",
    ),
    "times given twice": (
        {"kind": "table", "t_s": [0, 1, 1], "y": [1, 2, 3]},
        "signal.t_s",
        [0.0, 1.0, 1.0],
        "ascending",
    ),
    "too few values": (
        {"kind": "table", "t_s": [0, 1], "y": [1]},
        "signal.y",
        [1],
        "2 finite values, one a time",
    ),
    "no instants": (
        {"kind": "piecewise", "at_s": [], "value": []},
        "signal.at_s",
        [],
        "at least one",
    ),
    "instants that go back": (
        {"kind": "piecewise", "at_s": [1, 0], "value": [1, 2]},
        "signal.at_s",
        [1.0, 0.0],
        "ascending",
    ),
    "no duration": (
        {"kind": "cycloid", "end": 1, "duration_s": 0},
        "signal.duration_s",
        0,
        "above 0 in seconds",
    ),
    "a negative duration": (
        {"kind": "polynomial", "end": 1, "duration_s": -1},
        "signal.duration_s",
        -1,
        "above 0 in seconds",
    ),
    "a rise beyond a quarter": (
        {"kind": "bang_bang", "amplitude": 1, "duration_s": 1, "rise_s": 0.3},
        "signal.rise_s",
        0.3,
        "between 0 and a quarter",
    ),
    "a negative rise": (
        {"kind": "bang_bang", "amplitude": 1, "duration_s": 1, "rise_s": -0.1},
        "signal.rise_s",
        -0.1,
        "between 0 and a quarter",
    ),
    "a duration too short to differentiate": (
        {"kind": "polynomial", "end": 1, "duration_s": 1e-200},
        "signal.duration_s",
        1e-200,
        "leaves the derivatives finite",
    ),
    "a duration too long to cube": (
        {"kind": "polynomial", "end": 1, "duration_s": 1e200},
        "signal.duration_s",
        1e200,
        "between -1e12 and 1e12",
    ),
    "a rise beyond half": (
        {"kind": "trapezoidal", "end": 1, "duration_s": 1, "rise_s": 1},
        "signal.rise_s",
        1,
        "at most half",
    ),
    "a number for a signal": (
        {"kind": "zv", "signal": 1, "frequency_Hz": 1},
        "signal.signal",
        1,
        "a table of a signal",
    ),
    "half a period": (
        {"kind": "matched_cycloid", "end": 1, "frequency_Hz": 1, "periods": 2.5},
        "signal.periods",
        2.5,
        "a whole number",
    ),
    "a rise too steep": (
        {"kind": "cycloid", "end": 1e12, "duration_s": 1e-300},
        "signal.kind",
        "cycloid",
        "are finite",
    ),
    "points too far apart": (
        {"kind": "table", "t_s": [0, 1e-200, 1], "y": [0, 1e12, -1e12]},
        "signal.kind",
        "table",
        "derivatives are finite",
    ),
}


@pytest.mark.parametrize("spec, key, value, words", WRONG_SIGNALS.values(), ids=WRONG_SIGNALS)
def test_a_wrong_signal_is_named(spec, key, value, words):
    with pytest.raises(fx.InputError) as caught:
        from_spec(spec)
    assert (caught.value.key, repr(caught.value.value)) == (
        key,
        repr(value),
    ) and words in caught.value.expected
    assert str(caught.value).isprintable()


KEYS = (
    "kind value at_s end duration_s start rise_s amplitude t_s y signal frequency_Hz periods "
    "damping_ratio"
).split()
scalars = st.one_of(st.floats(), st.integers(), st.booleans(), st.text(max_size=3), st.none())


@settings(max_examples=300, deadline=None)
@given(
    st.dictionaries(
        st.sampled_from(KEYS),
        scalars
        | st.lists(scalars, max_size=3)
        | st.sampled_from([1.0, 0.1, {"kind": "constant", "value": 1.0}]),
    ),
    st.sampled_from(sorted(signals.KINDS)),
)
def test_any_table_is_a_signal_or_refused(spec, kind):
    for tried in (spec, spec | {"kind": kind}):
        try:
            s = from_spec(tried)
        except fx.InputError as error:
            assert str(error).isprintable()
        else:
            assert np.isfinite(s.segments).all() and np.isfinite(s(0.0)[0])
