"""Chunks of a population, in memory or in a folder that a stopped call goes on with.

A folder has `population.json`, the request, and `chunk-0000000.parquet`, ... named after their
first robot: a row a robot, columns robot (from 1), status, reached_s, steps, event, digest, what
was varied as `vary/KEY`, then each channel as a list of T numbers, or each reduced number. Every
file appears as a whole or not at all, so that a folder never holds half a chunk, nor a robot
twice. Every file is sealed: a damaged chunk is made again, a damaged request is refused.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..io import (
    Damaged,
    Tables,
    read_sealed,
    read_sealed_json,
    read_table,
    room_for_arrow,
    say_unsealed,
    sealed_json,
    sealed_parquet,
    write_bytes,
)

MANIFEST = "population.json"
MENDED = "simulating again mends it"
REQUEST_ADVICE = "restore a copy, or simulate into another folder"
NOTES = ("base", "vary", "units")  # of the manifest, for readers; robots are told apart by digests


@dataclass(frozen=True)
class Chunk:
    """Robots `first`, `first` + 1, ... from 0: how each ended and when, and its channels (b, T) or
    reduced numbers (b,); `vary`: the values (b,) of what was varied, by key. Only in a folder
    have they digests."""

    first: int
    status: np.ndarray
    reached_s: np.ndarray
    steps: np.ndarray
    event: list[str]
    digest: list[bytes]
    values: dict[str, np.ndarray]
    vary: dict[str, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.digest)

    def __getitem__(self, name: str) -> np.ndarray:
        try:
            return self.values[name]
        except KeyError:
            raise KeyError(f"no {name!r} was kept; there are: {', '.join(self.values)}") from None

    def to_parquet(self) -> bytes:
        """The chunk as the content of a Parquet file, with a row a robot."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        room_for_arrow(sum(values.nbytes for values in self.values.values()))
        columns: dict[str, Any] = {
            "robot": np.arange(self.first + 1, self.first + 1 + len(self)),
            "status": pa.array(self.status.tolist(), pa.string()),
            "reached_s": self.reached_s,
            "steps": self.steps,
            "event": pa.array(self.event, pa.string()),
            "digest": pa.array(self.digest, pa.binary(16)),
        }
        columns |= {f"vary/{key}": values for key, values in self.vary.items()}
        for name, values in self.values.items():
            flat = pa.array(np.ascontiguousarray(values).ravel())
            columns[f"values/{name}"] = (
                pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
                if values.ndim == 2
                else flat
            )
        sink = pa.BufferOutputStream()
        pq.write_table(
            pa.table(columns),
            sink,
            compression="zstd",
            use_dictionary=["status", "event"],
            write_page_checksum=True,
        )
        return sealed_parquet(sink.getvalue().to_pybytes())

    @staticmethod
    def from_parquet(path: Path) -> Chunk:
        """Raises InputError for a file that is none, or damaged."""
        import pyarrow as pa

        try:
            table = _table(path).combine_chunks()
            values = {}
            for name in table.column_names:
                if name.startswith("values/"):
                    column = table.column(name).combine_chunks()
                    flat = column.flatten() if pa.types.is_fixed_size_list(column.type) else column
                    values[name.removeprefix("values/")] = flat.to_numpy(
                        zero_copy_only=False
                    ).reshape((len(table), -1) if flat is not column else len(table))
            varied = {
                name.removeprefix("vary/"): table.column(name).to_numpy()
                for name in table.column_names
                if name.startswith("vary/")
            }
            plain = {
                name: table.column(name)
                for name in ("robot", "status", "reached_s", "steps", "event", "digest")
            }
        except (Damaged, MemoryError):
            raise
        except (pa.ArrowException, OSError, KeyError, ValueError) as error:
            raise Damaged(f"a damaged chunk ({error}); {MENDED}", file=str(path)) from None
        return Chunk(
            int(plain["robot"][0].as_py()) - 1,
            np.array(plain["status"].to_pylist()),
            plain["reached_s"].to_numpy(),
            plain["steps"].to_numpy(),
            plain["event"].to_pylist(),
            plain["digest"].to_pylist(),
            values,
            varied,
        )


@dataclass
class Store:
    """Where the chunks are: in `kept`, by their first robot, or in `folder`."""

    folder: Path | None = None
    kept: dict[int, Chunk] = field(default_factory=dict)

    @staticmethod
    def opened(folder: str | Path, request: Tables) -> Store:
        """The store of this request: a new folder, or one that the same request began. Raises
        InputError for another's."""
        path = Path(folder) / MANIFEST
        asked = json.loads(json.dumps(request))
        if not path.exists():
            if any(Path(folder).glob("chunk-*.parquet")):
                raise InputError(
                    f"chunks without their {MANIFEST}: expected an empty folder, or all of one",
                    file=str(folder),
                )
            write_bytes(path, sealed_json(asked), new=True)
            return Store(Path(folder))
        begun = manifest(folder)
        differing = [
            key
            for key in asked
            if key not in NOTES and (key not in begun or begun[key] != asked[key])
        ]
        if differing:
            key = differing[0]
            raise InputError(
                f"expected {_short(begun.get(key))}, with which this folder was begun, or another "
                f"folder",
                key=key,
                value=_short(asked[key]),
                file=str(path),
                more=len(differing) - 1,
            )
        return Store(Path(folder))

    def _path(self, first: int) -> Path:
        assert self.folder is not None
        return self.folder / f"chunk-{first:07d}.parquet"

    def put(self, chunk: Chunk) -> None:
        """Keep a chunk: in its file, or in memory where there is no folder.

        Args:
            chunk: the chunk.

        Raises:
            InputError: another process put one of other robots there meanwhile.
        """
        if self.folder is None:
            self.kept[chunk.first] = chunk
        elif not self.has(chunk.first, chunk.digest):
            write_bytes(self._path(chunk.first), chunk.to_parquet())

    def has(self, first: int, digests: list[bytes]) -> bool:
        """Whether the chunk of these robots is done. Raises InputError where it has been done with
        other robots."""
        if self.folder is None or not self._path(first).exists():
            return False
        found = _digests(self._path(first))
        for k, (one, other) in enumerate(zip(found, digests, strict=False)):
            if one != other:
                text = (
                    "another robot or drive than this folder was begun with: expected the "
                    "same, "
                    "or another folder"
                )
                raise InputError(text, key=f"robots[{first + k + 1}]", file=str(self._path(first)))
        return len(found) == len(digests)

    def rows(self) -> int:
        """How many robots are done."""
        if self.folder is None:
            return sum(map(len, self.kept.values()))
        return sum(len(_digests(path)) for path in self.folder.glob("chunk-*.parquet"))

    def chunks(self) -> Iterator[Chunk]:
        """The chunks that are done, in their order."""
        if self.folder is None:
            yield from (self.kept[first] for first in sorted(self.kept))
            return
        for path in sorted(self.folder.glob("chunk-*.parquet")):
            yield Chunk.from_parquet(path)


def is_population(folder: str | Path) -> bool:
    """Whether a folder is one of a population.

    Args:
        folder: the folder.

    Returns:
        True if a population was stored there.
    """
    return (Path(folder) / MANIFEST).is_file()


def manifest(folder: str | Path) -> Tables:
    """The request that a folder was begun with.

    Args:
        folder: of a population.

    Returns:
        The table in its population.json.

    Raises:
        InputError: there is none, or another file.
    """
    path = Path(folder) / MANIFEST
    if not path.is_file():
        raise InputError(f"no population here: expected a folder with {MANIFEST}", file=str(folder))
    try:
        found, sealed = read_sealed_json(path, REQUEST_ADVICE, "a damaged request of a population")
        if not isinstance(found, dict) or not {"t_s", "channels", "count"} <= set(found):
            raise ValueError("expected t_s, channels and count")
    except Damaged:
        raise
    except (ValueError, OSError, RecursionError) as error:
        raise InputError(f"not the request of a population ({error})", file=str(path)) from None
    if not sealed:
        say_unsealed(path)
    return found


def _table(path: Path) -> Any:
    """The table of a chunk's file, all of it verified."""
    content, _ = read_sealed(path, MENDED, "a damaged chunk")
    return read_table(content)


def _digests(path: Path) -> list[bytes]:
    """The digests of a chunk's robots; none of a damaged file, which is then done again."""
    import pyarrow as pa

    try:
        return list(_table(path).column("digest").to_pylist())
    except MemoryError:
        raise
    except (Damaged, pa.ArrowException, OSError, KeyError, ValueError):
        return []


def in_memory() -> Store:
    """A store without a folder."""
    return Store()


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) < 60 else text[:40] + " ... " + text[-15:]
