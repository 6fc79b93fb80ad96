"""CSV: lines that begin with # say what it is, then a head of column names with units, then numbers
that read back exactly."""

from __future__ import annotations

import csv
import io
import json

import numpy as np

from flexura.io import EMULATED, Run, called, emulated
from flexura.io.logs import digest


def write(run: Run) -> bytes:
    """Times and channels as columns; a dropout is NaN. The metadata stand in one line of JSON, `#
    meta: {...}`, and a digest of the numbers in another."""
    out = io.StringIO(newline="")
    out.write(f"# {called(run)}\n")
    if emulated(run):
        out.write(f"# {EMULATED}\n")
    out.write(
        f"# units: "
        f"{json.dumps({'time_s': 's'} | {run.column(n): u for n, u in run.units.items()})}\n"
    )
    out.write(f"# meta: {json.dumps(run.meta)}\n")
    out.write(f"# digest: {json.dumps({'sha256': digest(run)})}\n")
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["time_s", *map(run.column, run)])
    columns = np.column_stack([run.t, *run.channels.values()]).astype(float)
    rows.writerows([["NaN" if v != v else repr(v) for v in row] for row in columns.tolist()])
    return out.getvalue().encode()
