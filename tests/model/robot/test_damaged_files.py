"""Whatever is changed in a robot file: it loads, or is refused in one line."""

import contextlib

import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import flexura as fx
from robot_files import BASE, COMPLETE, changed


def loads_or_is_refused(path):
    try:
        fx.load(path)
    except fx.InputError as error:
        assert str(error).isprintable() and str(error).startswith(str(path))


@settings(max_examples=250, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.lists(
        st.tuples(st.integers(0, len(COMPLETE)), st.integers(0, 12), st.binary(max_size=4)),
        min_size=1,
        max_size=3,
    )
)
def test_bytes_changed_anywhere_never_raise_anything_else(tmp_path_factory, edits):
    """Each edit replaces some bytes at a place by others."""
    raw = COMPLETE.encode()
    for place, length, new in edits:
        raw = raw[:place] + new + raw[place + length :]
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(raw)
    loads_or_is_refused(path)


anything = st.recursive(
    st.one_of(
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(max_size=5),
        st.dates(),
        st.times(),
        st.datetimes(),
    ),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=5,
)


def places(table, prefix=""):
    """Dotted paths of all tables and values, links counted from 1."""
    found = []
    for key, value in table.items() if isinstance(table, dict) else enumerate(table, 1):
        found.append(f"{prefix}{key}")
        if isinstance(value, dict) or (
            isinstance(value, list) and value and isinstance(value[0], dict)
        ):
            found += places(value, f"{prefix}{key}.")
    return found


@settings(max_examples=250, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.sampled_from([p for p in places(BASE) if not p.split(".")[-1].isdigit()]), anything)
def test_a_value_of_any_type_anywhere_never_raises_anything_else(tmp_path_factory, place, value):
    path = tmp_path_factory.getbasetemp() / "values.toml"
    with contextlib.suppress(UnicodeEncodeError):
        path.write_text(tomli_w.dumps(changed({place: value})))
    loads_or_is_refused(path)


@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.sampled_from(COMPLETE.splitlines()), st.sampled_from(COMPLETE.splitlines()))
def test_lines_in_another_order_never_raise_anything_else(tmp_path_factory, first, second):
    path = tmp_path_factory.getbasetemp() / "lines.toml"
    path.write_text(COMPLETE.replace(first, "\0").replace(second, first).replace("\0", second))
    loads_or_is_refused(path)
