"""The file of a run, in Parquet: one column a channel, named channel_unit (`joint/1/position_rad`),
its unit in the field, metadata in the schema."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, within_memory
from .files import path_of, settle
from .quantities import suffix
from .seal import Damaged, read_sealed, read_table, room_for_arrow, say_unsealed, sealed_parquet
from .toml_files import Tables
from .validation import FORMAT, check_format

if TYPE_CHECKING:
    from .run import Run

FILE = "run.parquet"


@within_memory
def written(columns: dict[str, np.ndarray], units: dict[str, str], meta: Tables) -> bytes:
    """A run as a Parquet file.

    Args:
        columns: values (T,) by the name of the column.
        units: by the same names.
        meta: what JSON can hold.

    Returns:
        The bytes of the file.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    room_for_arrow(8 * sum(len(values) for values in columns.values()))
    fields = [pa.field(name, pa.float64(), metadata={"unit": units[name]}) for name in columns]
    about = {"flexura": json.dumps(meta), "format": str(FORMAT)}
    schema = pa.schema(fields, metadata=about)
    sink = pa.BufferOutputStream()
    pq.write_table(
        pa.table([_float_column(values) for values in columns.values()], schema=schema),
        sink,
        compression="zstd",
        write_page_checksum=True,
    )
    return sealed_parquet(sink.getvalue().to_pybytes())


@within_memory
def read(folder: str | Path, made: Callable[..., Run]) -> Run:
    """Read a run.

    Args:
        folder: a run's folder, or its Parquet file.
        made: the Run of times, channels, units and metadata.

    Returns:
        The Run.

    Raises:
        InputError: there is no run, or a byte of its file is not as it was written.
    """
    import pyarrow as pa

    path = path_of(folder, "folder")
    try:
        for place in (path, path.parent):
            settle(place)
        path = path / FILE if path.is_dir() else path
        there = path.is_file()
    except OSError:  # a name that is too long, a folder that may not be looked into
        there = False
    if not there:
        raise InputError(f"no run here: expected a folder with {FILE}", file=str(folder))
    sealed = False
    try:
        content, sealed = read_sealed(path, "restore a copy, or make it again", "a damaged run")
        table = read_table(content)
    except (Damaged, MemoryError):
        raise
    except (pa.ArrowException, OSError, ValueError) as error:
        why = (str(error) or "damaged").splitlines()[0]
        what = "cannot be read now, though its checksum fits" if sealed else "not a Parquet file"
        raise InputError(f"{what} ({why})", file=str(path)) from None
    try:
        run = _from_table(table, str(path), made)
    except MemoryError:
        raise
    except (
        pa.ArrowException,
        KeyError,
        ValueError,
    ) as error:  # ValueError: of Run, json and decode too
        raise InputError(
            f"a damaged run ({(str(error) or 'unreadable').splitlines()[0]})", file=str(path)
        ) from None
    if not sealed:
        say_unsealed(path)
    return run


def _from_table(table: Any, file: str, made: Callable[..., Run]) -> Run:
    stored = (table.schema.metadata or {}).get(b"flexura")
    if stored is None or "time_s" not in table.column_names:
        raise InputError(
            "a Parquet file, but not a run of flexura: expected a column time_s and metadata",
            file=file,
        )
    check_format({"format": int(table.schema.metadata.get(b"format", FORMAT))}, file)
    meta, channels, units = json.loads(stored), {}, {}
    if not isinstance(meta, dict):
        raise ValueError("its metadata is not a table")
    for column in table.schema:
        values = table.column(column.name).cast("float64").to_numpy()
        if column.name == "time_s":
            t = values
        else:
            stored_unit = (column.metadata or {}).get(b"unit", b"1").decode()
            name = column.name.removesuffix(f"_{suffix(stored_unit)}")
            channels[name], units[name] = values, stored_unit
    try:
        return made(t, channels, units, meta)
    except InputError as error:
        raise error.in_file(file) from None


def _float_column(values: np.ndarray) -> Any:
    """Numbers as a column of Arrow; its own conversion of an array first imports pandas."""
    import pyarrow as pa

    numbers = np.ascontiguousarray(values, dtype=float)
    return pa.Array.from_buffers(pa.float64(), len(numbers), [None, pa.py_buffer(numbers)])
