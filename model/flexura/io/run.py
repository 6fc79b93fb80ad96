"""A run: a time series with named, unit-carrying channels. A simulation and an experiment are both
a Run.

Channel names (also the entity paths of the review), joints and links counted from 1:

    joint/i/position  joint/i/velocity  joint/i/drive      m or rad; m/s or rad/s; N or N m link/i/x
    link/i/y  link/i/angle                       pose of the link's hub frame in the base frame [m,
    m, rad] link/i/tip_deflection  link/i/tip_slope                flexible links: of the tip, in
    the hub's frame [m, rad] link/i/deflection/k                                    flexible links:
    at x = k L / 8, k = 0 ... 8 [m] tip/x  tip/y                                           the last
    link's tip in the base frame [m] energy/kinetic  energy/strain  energy/potential        [J]
    energy/work  energy/loss                               work of the drives, dissipated energy
    since the start [J]

Archived as Parquet: one column a channel, named channel_unit (`joint/1/position_rad`), metadata in
the schema.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .format import FORMAT, check_format
from .toml_files import write_bytes

FILE = "run.parquet"
STATIONS = 9  # places along a flexible link at which a Run holds the deflection

_SUFFIX = {
    "s": "s",
    "m": "m",
    "rad": "rad",
    "m/s": "m_s",
    "rad/s": "rad_s",
    "N": "N",
    "N m": "N_m",
    "J": "J",
    "V": "V",
    "A": "A",
    "1": "1",
}


@dataclass(frozen=True)
class Run:
    """Times `t` (T,) [s], channels by name (T,), their units, and metadata that JSON can hold.

    `meta` has at least `source` ("simulation", "twin", "experiment"), `program`, `robot` (the
    tables of the robot file), `complete` (false: interrupted or failed, the channels end where it
    ended) and `events`, a list of `{"t": seconds, "text": ..., "level": "INFO" | "WARN" |
    "ERROR"}`. `states` (T, 2n), generalised positions and velocities, is there after a native
    simulation only and isn't archived.
    """

    t: np.ndarray
    channels: dict[str, np.ndarray]
    units: dict[str, str]
    meta: dict[str, Any] = field(default_factory=dict)
    states: np.ndarray | None = None

    def __post_init__(self) -> None:
        if set(self.channels) != set(self.units):
            raise ValueError(
                f"channels and units differ: {sorted(set(self.channels) ^ set(self.units))}"
            )
        for name, values in self.channels.items():
            if np.shape(values) != np.shape(self.t):
                raise ValueError(
                    f"channel {name} has shape {np.shape(values)}, the times have "
                    f"{np.shape(self.t)}"
                )
            if self.units[name] not in _SUFFIX:
                raise ValueError(
                    f"channel {name} has the unit {self.units[name]!r}; known: {', '.join(_SUFFIX)}"
                )
        columns = ["time_s", *map(self.column, self.channels)]
        twice = sorted(column for column, count in Counter(columns).items() if count > 1)
        if twice:
            raise ValueError(f"two channels would share a column: {', '.join(twice)}")

    def column(self, channel: str) -> str:
        """The name of a channel's column in a file, its unit at the end."""
        return f"{channel}_{_SUFFIX[self.units[channel]]}"

    def __getitem__(self, channel: str) -> np.ndarray:
        try:
            return self.channels[channel]
        except KeyError:
            raise KeyError(
                f"no channel {channel!r}; there are: {', '.join(self.channels)}"
            ) from None

    def __contains__(self, channel: object) -> bool:
        return channel in self.channels

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def complete(self) -> bool:
        return bool(self.meta.get("complete", True))

    def save(self, folder: str | Path) -> Path:
        """Write `run.parquet` into `folder` (made if need be) as a whole or not at all; returns its
        path."""
        path = Path(folder) / FILE
        write_bytes(path, self.parquet())
        return path

    def parquet(self) -> bytes:
        """The run as a Parquet file: one column a channel, its unit in the field, the metadata in
        the schema."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns = {"time_s": self.t} | {
            self.column(name): values for name, values in self.channels.items()
        }
        units = {"time_s": "s"} | {self.column(name): unit for name, unit in self.units.items()}
        fields = [pa.field(name, pa.float64(), metadata={"unit": units[name]}) for name in columns]
        about = {"flexura": json.dumps(self.meta), "format": str(FORMAT)}
        schema = pa.schema(fields, metadata=about)
        sink = pa.BufferOutputStream()
        pq.write_table(
            pa.table(
                [pa.array(np.asarray(v, dtype=float)) for v in columns.values()], schema=schema
            ),
            sink,
            compression="zstd",
        )
        return bytes(sink.getvalue().to_pybytes())

    @staticmethod
    def read(folder: str | Path) -> Run:
        """Read a run's folder, or its Parquet file. Raises InputError for anything else."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        path = Path(folder)
        try:
            path = path / FILE if path.is_dir() else path
            there = path.is_file()
        except OSError:  # a name that is too long, a folder that may not be looked into
            there = False
        if not there:
            raise InputError(f"no run here: expected a folder with {FILE}", file=str(folder))
        try:
            table = pq.read_table(path, partitioning=None)  # a folder named a=b is just a folder
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputError(
                f"not a Parquet file ({(str(error) or 'damaged').splitlines()[0]})", file=str(path)
            ) from None
        try:
            return Run._from_table(table, str(path))
        except (
            pa.ArrowException,
            KeyError,
            ValueError,
        ) as error:  # ValueError: of Run, json and decode too
            raise InputError(
                f"a damaged run ({(str(error) or 'unreadable').splitlines()[0]})", file=str(path)
            ) from None

    @staticmethod
    def _from_table(table: Any, file: str) -> Run:
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
                unit = (column.metadata or {}).get(b"unit", b"1").decode()
                name = column.name.removesuffix(f"_{_SUFFIX.get(unit, '')}")
                channels[name], units[name] = values, unit
        return Run(t, channels, units, meta)
