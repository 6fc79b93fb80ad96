"""Parquet: runs of flexura, and tables of pandas, DuckDB and others."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from ....errors import InputError
from ...quantities import suffix
from ..calendar import joined
from ..log import Column, Log, damaged, floats
from ..names import parted


def read(raw: bytes, file: str) -> Log:
    """The columns of numbers and dates of a Parquet file.

    Raises:
        InputError: the file is damaged.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(io.BytesIO(raw), page_checksum_verification=True)
        about = table.schema.metadata or {}
        meta = json.loads(about[b"flexura"]) if b"flexura" in about else None
        columns = []
        unread = {}
        for place, field in enumerate(table.schema):
            calendar = _calendar(field.type)
            cells = table.column(place)
            if calendar == "times":
                cells = cells.cast(pa.time64("ns")).cast(pa.int64())
            array = cells.to_numpy()
            if array.dtype.kind not in "iufbM":
                unread[field.name] = "no numbers"
                continue
            values, since = floats(np.asarray(array))
            if calendar == "times":
                values, since = values / 1e9, None
            said = (field.metadata or {}).get(b"unit", b"").decode()
            name = field.name.removesuffix(f"_{suffix(said)}") if said else field.name
            name, said = (name, said) if said else parted(field.name)
            said = "s" if calendar == "times" else said
            columns.append(Column(name, field.name, said, values, since, calendar=calendar))
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes of it
        raise damaged(file, "Parquet file", error) from None
    own: dict[str, Any] | None = meta if isinstance(meta, dict) else None
    columns, notes = joined(columns)
    return Log(
        file,
        "Parquet",
        columns,
        meta=own or {},
        own=own is not None,
        notes=notes,
        unread=unread,
    )


def _calendar(kind: Any) -> str:
    """Whether a column has dates alone or times of day; "" for others."""
    import pyarrow as pa

    if pa.types.is_date(kind):
        return "dates"
    return "times" if pa.types.is_time(kind) else ""
