"""Parquet: runs of flexura, and tables of pandas, DuckDB and others."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from ....errors import InputError
from ...quantities import suffix
from ..log import Column, Log, damaged, floats
from ..names import parted


def read(raw: bytes, file: str) -> Log:
    """The columns of numbers and dates of a Parquet file.

    Raises:
        InputError: the file is damaged.
    """
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(io.BytesIO(raw), page_checksum_verification=True)
        about = table.schema.metadata or {}
        meta = json.loads(about[b"flexura"]) if b"flexura" in about else None
        columns = []
        for field in table.schema:
            array = table.column(field.name).to_numpy()
            if array.dtype.kind not in "iufbM":
                continue
            values, since = floats(np.asarray(array))
            said = (field.metadata or {}).get(b"unit", b"").decode()
            name = field.name.removesuffix(f"_{suffix(said)}") if said else field.name
            name, said = (name, said) if said else parted(field.name)
            columns.append(Column(name, field.name, said, values, since))
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes of it
        raise damaged(file, "Parquet file", error) from None
    own: dict[str, Any] | None = meta if isinstance(meta, dict) else None
    return Log(file, "Parquet", columns, meta=own or {}, own=own is not None)
