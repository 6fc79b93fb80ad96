"""The table of a population in other programs' formats: a row a robot."""

from __future__ import annotations

import csv
import io
import json

import numpy as np

import flexura as fx
from flexura.io import room_for_arrow, sealed_parquet

from .as_mat import packed


def as_csv(population: fx.Population) -> bytes:
    """Lines that begin with # say what it is, then names, then a row a robot; numbers read back
    exactly."""
    columns, units = population.table()
    out = io.StringIO(newline="")
    out.write(f"# population: {population.count} robots\n# units: {json.dumps(units)}\n")
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(columns)
    cells = [[_cell(value) for value in values.tolist()] for values in columns.values()]
    rows.writerows(zip(*cells, strict=True))
    return out.getvalue().encode()


def as_parquet(population: fx.Population) -> bytes:
    """A column a name, its unit in the field."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    room_for_arrow()
    columns, units = population.table()
    arrays = [pa.array(values.tolist()) for values in columns.values()]
    fields = [
        pa.field(name, array.type, metadata={"unit": units[name]} if name in units else None)
        for name, array in zip(columns, arrays, strict=True)
    ]
    sink = pa.BufferOutputStream()
    table = pa.table(arrays, schema=pa.schema(fields))
    pq.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return sealed_parquet(sink.getvalue().to_pybytes())


def as_mat(population: fx.Population) -> bytes:
    """A column vector a name; texts as cell arrays."""
    columns, units = population.table()
    base = {} if population.base is None else population.base.to_dict()
    return packed(columns, units, {"robots": population.count, "robot": base})


def _cell(value: object) -> object:
    if isinstance(value, float):
        return "NaN" if np.isnan(value) else repr(value)
    return value
