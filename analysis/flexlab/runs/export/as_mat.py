"""MAT, version 5, of MATLAB and Octave: a column a channel, `units` and `meta` as structs."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from flexura import StateSpace
from flexura.io import EMULATED, Run, called, emulated

from .names import variables

HEADER = 116  # bytes of text at the beginning of a file


def write(run: Run) -> bytes:
    """`t` and the channels (T, 1), "joint/1/position" as `joint_1_position`.

    `units.joint_1_position` is a channel's unit, `channels.joint_1_position` its name; `meta` has
    the run's metadata, all of it as JSON in `meta.json`.
    """
    about = run.meta | {"label": called(run), "json": json.dumps(run.meta)}
    about |= {"description": EMULATED} if emulated(run) else {}
    return packed({"t": run.t, **run.channels}, {"t": "s", **run.units}, about)


def state_space(lin: StateSpace) -> bytes:
    """`A`, `B`, `C`, `D`, the names `states`, `inputs`, `outputs` as cells, `units` by output and
    input, the configuration `q`, and the drives `hold` that keep the robot there."""
    from scipy.io import savemat

    names = {key: _cells(getattr(lin, key)) for key in ("states", "inputs", "outputs")}
    units = _cells([lin.units[name] for name in (*lin.inputs, *lin.outputs)])
    held = {"A": lin.A, "B": lin.B, "C": lin.C, "D": lin.D, "q": lin.q, "hold": lin.hold}
    out = io.BytesIO()
    savemat(out, {**held, **names, "units": units}, oned_as="column", do_compression=True)
    text = b"MATLAB 5.0 MAT-file, written by flexura"
    return text.ljust(HEADER) + out.getvalue()[HEADER:]


def _cells(texts: Any) -> np.ndarray:
    cells = np.empty(len(texts), dtype=object)
    cells[:] = list(texts)
    return cells


def packed(
    columns: Mapping[str, np.ndarray], units: Mapping[str, str], meta: Mapping[str, Any]
) -> bytes:
    """Columns of equal length, numbers or texts, as one file.

    Args:
        columns: by name.
        units: of some or all of them.
        meta: what JSON can hold.
    """
    from scipy.io import savemat

    names = variables(columns, ("units", "channels", "meta"))
    held: dict[str, Any] = {new: _column(columns[name]) for name, new in names.items()}
    held["units"] = {new: units[name] for name, new in names.items() if name in units}
    held["channels"] = {new: name for name, new in names.items()}
    held["meta"] = _struct(meta)
    out = io.BytesIO()
    savemat(out, held, oned_as="column", long_field_names=True, do_compression=True)
    text = b"MATLAB 5.0 MAT-file, written by flexura"
    return text.ljust(HEADER) + out.getvalue()[HEADER:]  # without the time of writing


def _column(values: np.ndarray) -> np.ndarray:
    numbers = np.issubdtype(values.dtype, np.number)
    return values.astype(float) if numbers else np.array(list(map(str, values)), dtype=object)


def _struct(value: Any) -> Any:
    """JSON's values as MATLAB's: a table as a struct, a list as a cell array or an array."""
    if isinstance(value, Mapping):
        named = variables(map(str, value))
        return {named[str(key)]: _struct(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        if value and all(isinstance(v, int | float) and not isinstance(v, bool) for v in value):
            return np.array(value, dtype=float)
        cells = np.empty(len(value), dtype=object)
        cells[:] = [_struct(item) for item in value]
        return cells
    return np.zeros((0, 0)) if value is None else value
