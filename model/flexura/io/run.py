"""A run: a time series with named, unit-carrying channels. A simulation and an experiment are both
a Run.

What each channel means stands in `channels`. Archived as Parquet: one column a channel, named
channel_unit (`joint/1/position_rad`), metadata in the schema.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, ItemsView, Iterator, KeysView
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from . import run_file, summary
from .drawing.film import animation
from .drawing.over_time import figure, heading
from .drawing.pictures import FORMS, saved
from .files import path_of, refuse_taken, write_bytes
from .frames import pandas_frame, xarray_dataset
from .quantities import check_unit, converted, doubted, fault, from_first, listed, suffix, unit
from .run_file import FILE
from .toml_files import Tables

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Run:
    """Times `t` (T,) [s], channels by name (T,), their units, and metadata that JSON can hold.

    `meta` has at least `source` ("simulation", "twin", "experiment"), `program`, `robot` (the
    tables of the robot file), `complete` (false: interrupted or failed, the channels end where it
    ended) and `events`, a list of `{"t": seconds, "text": ..., "level": "INFO" | "WARN" |
    "ERROR"}`. `states` (T, 2n), generalised positions and velocities, is there after a native
    simulation only and isn't archived.

    Channels in other units than SI's are converted; `meta["original_units"]` keeps those. A clock
    of the calendar counts from the first sample; `meta["clock_start_s"]` keeps its first time.

    Raises:
        InputError: times that are not finite, or do not ascend, by the row counted from 1; a unit
            that may be one of two.
        ValueError: names, units and lengths that do not fit together.
    """

    t: np.ndarray
    channels: dict[str, np.ndarray]
    units: dict[str, str]
    meta: Tables = field(default_factory=dict)
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
            check_unit(self.units[name], f"unit of {name}")
            if unit(self.units[name]) is None and not name.startswith("sensor/"):
                raise ValueError(
                    f"channel {name} has the unit {self.units[name]!r}; known: s, m, rad, mm, deg, "
                    "m/s, N, N m, J, V, A, 1 and the like; sensor/NAME may have any"
                )
        self._in_si()
        columns = ["time_s", *map(self.column, self.channels)]
        twice = sorted(column for column, count in Counter(columns).items() if count > 1)
        if twice:
            raise ValueError(f"two channels would share a column: {', '.join(twice)}")
        self._in_seconds()

    def _in_seconds(self) -> None:
        """Refuse a clock that is none; count from the first sample where it is a calendar's."""
        wrong = fault(self.t, doubted(self.meta))
        if wrong:
            raise InputError(wrong.text, key=f"row {wrong.row}")
        t, start = from_first(self.t)
        if start:
            self._set("t", t)
            self._set("meta", {**self.meta, "clock_start_s": start})

    def _in_si(self) -> None:
        """Convert channels in other units; the metadata keep these."""
        channels, units, replaced = converted(self.channels, self.units)
        if replaced:
            self._set("channels", channels)
            self._set("units", units)
            kept = {**replaced, **self.meta.get("original_units", {})}
            self._set("meta", {**self.meta, "original_units": kept})

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def column(self, channel: str) -> str:
        """The name of a channel's column in a file.

        Args:
            channel: name of the channel.

        Returns:
            The name with its unit at the end.
        """
        return f"{channel}_{suffix(self.units[channel])}"

    def __getitem__(self, channel: str) -> np.ndarray:
        try:
            return self.channels[channel]
        except KeyError:
            raise KeyError(f"no channel {channel!r}; there are: {listed(self.channels)}") from None

    def __contains__(self, channel: object) -> bool:
        return channel in self.channels

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __len__(self) -> int:
        return len(self.t)

    def keys(self) -> KeysView[str]:
        """The names of the channels."""
        return self.channels.keys()

    def items(self) -> ItemsView[str, np.ndarray]:
        """Names and values (T,) of the channels."""
        return self.channels.items()

    @property
    def complete(self) -> bool:
        """Whether the run came to its end."""
        return bool(self.meta.get("complete", True))

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the run."""
        return any(event["text"] == "interrupted" for event in self.meta.get("events", []))

    def uninterrupted(self) -> Run:
        """This Run, for a search, to which a part of a run would look like a failure.

        Returns:
            The same Run.

        Raises:
            KeyboardInterrupt: Ctrl-C ended the run.
        """
        if self.interrupted:
            raise KeyboardInterrupt
        return self

    @property
    def stopped(self) -> bool:
        """Whether the run was stopped from outside: by Ctrl-C, or as its wall time was over."""
        late = any(event.get("name") == "wall_time" for event in self.meta.get("events", []))
        return late or self.interrupted

    def __repr__(self) -> str:
        return summary.text(self._title(), self._rows())

    def _repr_html_(self) -> str:
        return summary.html(self._title(), self._rows())

    def _title(self) -> str:
        return f"Run: {heading([self])}"

    def _rows(self) -> list[tuple[str, str]]:
        """What a terminal and a notebook show: the time, and the channels by their first word."""
        span = f"{self.t[0]:.6g} to {self.t[-1]:.6g} s, " if len(self) else ""
        rows = [("t", f"{span}{len(self)} samples")]
        kinds: dict[str, tuple[list[int], list[str]]] = {}
        for name in self.channels:
            kind, _, rest = name.partition("/")
            number, _, part = rest.partition("/")
            counted, parts = kinds.setdefault(kind, ([], []))
            if number.isdigit() and part:
                counted.append(int(number))
                parts.append(part.partition("/")[0])
            else:
                parts.append(rest)
        for kind, (counted, parts) in kinds.items():
            number = f"/{summary.numbers(counted)}" if counted else ""
            rows.append((f"{kind}{number}", summary.listed(dict.fromkeys(filter(None, parts)), 66)))
        if events := self.meta.get("events"):
            rows.append(("events", summary.listed(e.get("text", "") for e in events)))
        return rows

    def plot(self, *channels: str, out: str | Path | None = None, title: str = "") -> Figure:
        """Draw channels over time, one panel a unit, the legend beside it.

        Args:
            channels: names, or patterns such as "joint/*/position"; none: joint positions, tip
                deflections, drives and energies.
            out: a file to write, .pdf, .svg or .png, as a whole or not at all.
            title: by default the robot and what kind of run it is.

        Returns:
            The figure, of pyplot if no file is asked for.

        Raises:
            InputError: a pattern fits no channel, the run is empty, or `out` has another ending.
            Missing: matplotlib is not installed.
        """
        form = "" if out is None else path_of(out, "out").suffix.lower().removeprefix(".")
        if out is not None and form not in FORMS:
            raise InputError(
                f"expected a file that ends with .{', .'.join(FORMS)}", key="out", value=str(out)
            )
        drawing = figure([self], channels, title=title, interactive=out is None)
        if out is not None:
            write_bytes(out, saved(drawing, form, Title=title or heading([self])))
        return drawing

    def animate(
        self,
        out: str | Path,
        *,
        frame_rate: float = 25.0,
        duration: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Path:
        """Write the run as a film: the links as bent as they are, the tip's way, and a clock.

        Args:
            out: the file, .gif, or .mp4 where an encoder is installed.
            frame_rate: pictures a second of the film [1/s].
            duration: of the film [s]; by default the run's own, but 3 to 12 s.
            progress: called with the fraction that is done.

        Returns:
            The path of the file.

        Raises:
            InputError: a wrong argument, or a run that does not say where its links are.
            FlexuraError: there is no encoder for MP4.
            Missing: matplotlib or pillow is not installed.
        """
        return animation(self, out, frame_rate=frame_rate, duration=duration, progress=progress)

    def to_pandas(self) -> pd.DataFrame:
        """The channels as columns over the index `t` [s].

        Returns:
            A table whose `attrs` has "units" by name, and "meta".

        Raises:
            Missing: pandas is not installed.
        """
        return pandas_frame(self.t, self.channels, self.units, self.meta)

    def to_xarray(self) -> xr.Dataset:
        """The channels as variables over the dimension `t` [s].

        Returns:
            A data set; each variable's `attrs` has "units", the data set's the metadata.

        Raises:
            Missing: xarray is not installed.
        """
        return xarray_dataset(self.t, self.channels, self.units, self.meta)

    def save(self, folder: str | Path, *, overwrite: bool = False) -> Path:
        """Write `run.parquet` as a whole or not at all.

        Args:
            folder: where to; it is made if need be.
            overwrite: whether a run that is there already may be replaced.

        Returns:
            The file's path.

        Raises:
            InputError: a run is there already, or the file cannot be written.
        """
        path = path_of(folder, "folder") / FILE
        if not overwrite:
            refuse_taken(path)
        write_bytes(path, self.parquet(), new=not overwrite)
        return path

    def parquet(self) -> bytes:
        """The run as a Parquet file: one column a channel, its unit in the field, the metadata in
        the schema."""
        columns = {self.column(name): values for name, values in self.channels.items()}
        units = {self.column(name): unit for name, unit in self.units.items()}
        return run_file.written({"time_s": self.t} | columns, {"time_s": "s"} | units, self.meta)

    @staticmethod
    def read(folder: str | Path) -> Run:
        """Read a run.

        Args:
            folder: a run's folder, or its Parquet file.

        Returns:
            The Run.

        Raises:
            InputError: there is no run, or a byte of its file is not as it was written.
        """
        return run_file.read(folder, Run)
