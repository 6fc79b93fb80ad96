"""A foreign file by what it begins with, whatever its name is."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from ...errors import InputError
from .formats import csv_file, lvm, mat, mcap_file, rosbag, tables, tdms, text
from .log import Log

BINARY = {
    ".tdms": "TDMS",
    ".mcap": "MCAP",
    ".parquet": "Parquet",
    ".mat": "MAT",
    ".h5": "HDF5",
    ".hdf5": "HDF5",
    ".bag": "ROS bag",
    ".db3": "ROS bag",
}
MOST_BYTES, PART_BYTES = 4_000_000_000, 1 << 24


def read_log(path: str | os.PathLike[str]) -> Log:
    """Read a log: CSV, LVM, TDMS, MAT, HDF5, MCAP, Parquet, or a bag of ROS.

    Args:
        path: of the file, or of the folder of a bag.

    Returns:
        Its columns of numbers.

    Raises:
        InputError: it is not there, not known, or damaged.
        Missing: the package that reads it is not installed.
    """
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        log = _opened(Path(path), str(path))
    kinds = (DeprecationWarning, PendingDeprecationWarning, ResourceWarning, ImportWarning)
    texts = [str(each.message) for each in said if not issubclass(each.category, kinds)]
    notes = [f"its reader says: {' '.join(text.split())[:120]}" for text in dict.fromkeys(texts)]
    return replace(log, notes=[*log.notes, *notes]) if notes else log


def _opened(place: Path, name: str) -> Log:
    try:
        if place.is_dir():
            if not (place / "metadata.yaml").is_file():
                raise InputError(
                    "a folder without metadata.yaml: expected a log, or a bag of ROS 2", file=name
                )
            return rosbag.read(place)
        with open(place, "rb") as stream:
            head = stream.read(1024)
            if head.startswith(b"#ROSBAG V"):
                return rosbag.read(place)
            raw = _whole(head, stream, name)
    except FileNotFoundError:
        raise InputError("no such file: expected a log", file=name) from None
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({said}): expected a log", file=name) from None
    return _read(raw, place, name)


def _whole(head: bytes, stream: BinaryIO, name: str) -> bytes:
    """All bytes of a file, read in parts: a read takes all the memory that it asks for."""
    parts, count = [head], len(head)
    while part := stream.read(PART_BYTES):
        parts.append(part)
        count += len(part)
        if count > MOST_BYTES:
            raise InputError("more than 4 GB: expected a shorter log", file=name)
    return b"".join(parts)


def _read(raw: bytes, place: Path, name: str) -> Log:
    if not raw.strip(b"\0 \t\r\n"):
        raise InputError("empty: expected a log", file=name)
    if raw.startswith(b"PAR1"):
        return tables.read(raw, name)
    if raw.startswith((b"TDSm", b"TDSh")):
        return tdms.read(raw, name)
    if raw.startswith(mat.HDF5) or raw[512:520] == mat.HDF5:
        return mat.read_hdf5(raw, name)
    if raw.startswith(b"\x89MCAP"):
        return mcap_file.read(raw, name)
    if raw.startswith(b"SQLite format 3"):
        if (place.parent / "metadata.yaml").is_file():
            return rosbag.read(place.parent)
        raise InputError(
            "the data of a bag of ROS 2: expected its folder, with metadata.yaml", file=name
        )
    if mat.known(raw):
        return mat.read(raw, name)
    if raw.lstrip(b"\xef\xbb\xbf").startswith(b"LabVIEW Measurement"):
        return lvm.read(raw, name)
    form = BINARY.get(place.suffix.lower())
    if form and not text.likely(raw):
        raise InputError(f"no {form} file: its first bytes are others", file=name)
    return csv_file.read(raw, name)
