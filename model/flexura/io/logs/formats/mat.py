"""MAT files of MATLAB and Octave: version 5 by SciPy, version 7.3 and other HDF5 by h5py."""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

from ....errors import InputError
from ....optional import load
from ..log import Column, Log, damaged, floats
from ..names import parted

DEEPEST = 12  # structs in structs
HDF5 = b"\x89HDF\r\n\x1a\n"
MOST_COLUMNS = 200  # of one matrix


def known(raw: bytes) -> bool:
    """Whether bytes begin as a MAT file of version 4 to 7."""
    if raw.startswith(b"MATLAB 5.0") or raw[124:128] in (b"\0\1IM", b"\1\0MI"):
        return True
    return any(_version_4(raw, order) for order in "<>")


def _version_4(raw: bytes, order: str) -> bool:
    """Whether bytes begin as a matrix of version 4, whose head is five integers and a name."""
    if len(raw) < 20:
        return False
    kind, rows, columns, imaginary, length = struct.unpack(f"{order}5i", raw[:20])
    digits = (kind // 1000, kind // 100 % 10, kind // 10 % 10, kind % 10)
    name = raw[20 : 20 + max(length, 0)]
    return (
        0 <= kind < 5000
        and digits[1] == 0
        and digits[2] <= 5
        and digits[3] <= 2
        and min(rows, columns) >= 0
        and imaginary in (0, 1)
        and 1 < length <= 256
        and name.endswith(b"\0")
        and name[:-1].isascii()
    )


def read(raw: bytes, file: str) -> Log:
    """The vectors, and the columns of matrices, of a MAT file of version 4 to 7.

    A field of a struct has the name `struct.field`; columns of a matrix are numbered from 1.

    Raises:
        InputError: the file is damaged.
    """
    from scipy.io import loadmat

    try:
        held = loadmat(io.BytesIO(raw), struct_as_record=False, squeeze_me=False)
        tree = {name: value for name, value in held.items() if not name.startswith("__")}
        leaves = dict(_leaves(tree))
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes of it
        raise damaged(file, "MAT file", error) from None
    return _log(leaves, "MAT", file, [])


def read_hdf5(raw: bytes, file: str) -> Log:
    """The same of a MAT file of version 7.3, or of another HDF5 file.

    Raises:
        InputError: the file is damaged.
        Missing: h5py is not installed.
    """
    h5py = load("h5py")
    _check_end(raw, file)
    leaves: dict[str, Any] = {}
    holes: list[str] = []
    matlab = False
    try:
        with h5py.File(io.BytesIO(raw), "r") as stored:

            def visit(name: str, item: Any) -> None:
                nonlocal matlab
                if not isinstance(item, h5py.Dataset) or name.startswith("#"):
                    return
                kind = _text(item.attrs.get("MATLAB_class", b""))
                matlab = matlab or bool(kind)
                key = name.replace("/", ".")
                if kind == "char":
                    leaves[key] = "".join(map(chr, np.asarray(item[()]).reshape(-1)))
                elif item.dtype.kind in "iufb" and item.size and "MATLAB_empty" not in item.attrs:
                    data = item[()]
                    holes.extend(_holes(key, item))
                    leaves[key] = data.T if kind and data.ndim == 2 else data
                    if said := _text(item.attrs.get("units", item.attrs.get("unit", b""))):
                        leaves[f"units.{key}"] = said

            stored.visititems(visit)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes of it
        raise damaged(file, "HDF5 file", error) from None
    return _log(leaves, "MAT, version 7.3" if matlab else "HDF5", file, holes)


def _holes(name: str, item: Any) -> list[str]:
    """A sentence on parts of an array that the file has not got, or none."""
    if item.chunks is None:
        return []
    wanted = math.prod(-(-n // part) for n, part in zip(item.shape, item.chunks, strict=True))
    stored = item.id.get_num_chunks()
    if stored >= wanted:
        return []
    return [
        f"{name!r}: {stored} of {wanted} parts are in the file, the others are read as "
        f"{item.fillvalue:g}"
    ]


def _check_end(raw: bytes, file: str) -> None:
    """Refuse an HDF5 file that is longer than its head says: bytes were put in."""
    begin = 0 if raw.startswith(HDF5) else 512  # after MATLAB's own head
    version = raw[begin + 8]
    if version > 3:
        return
    wide = raw[begin + (13 if version < 2 else 9)]
    # version 0 has 24 bytes before the addresses, version 1 four more, versions 2 and 3 have 12
    first = begin + {0: 24, 1: 28}.get(version, 12)
    base, end = (int.from_bytes(raw[at : at + wide], "little") for at in (first, first + 2 * wide))
    if len(raw) > end and len(raw) != base + end:
        said = f"{len(raw)} bytes, its head says {end}"
        raise InputError(f"a damaged HDF5 file ({said})", file=file)


def _leaves(tree: Any, name: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Arrays of numbers, and texts, by their path."""
    if depth > DEEPEST:
        return
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from _leaves(value, f"{name}.{key}" if name else str(key), depth + 1)
    elif hasattr(tree, "_fieldnames"):
        fields = {key: getattr(tree, key) for key in tree._fieldnames}
        yield from _leaves(fields, name, depth + 1)
    elif isinstance(tree, np.ndarray) and tree.dtype == object:
        for k, item in enumerate(tree.reshape(-1)[:MOST_COLUMNS]):
            inner = name if tree.size == 1 else f"{name}.{k + 1}"
            yield from _leaves(item, inner, depth + 1)
    elif isinstance(tree, np.ndarray) and tree.dtype.kind in "US":
        if tree.size == 1:
            yield name, str(tree.reshape(-1)[0])
    elif isinstance(tree, np.ndarray) and tree.dtype.kind in "iufb" and tree.size:
        yield name, tree


def _log(leaves: dict[str, Any], form: str, file: str, notes: list[str]) -> Log:
    """Columns of the arrays, with the units and names that an export of flexura has beside them."""
    texts = {name: text for name, text in leaves.items() if isinstance(text, str)}
    columns = []
    unread = {}
    for name, array in leaves.items():
        if isinstance(array, str):
            if not name.startswith("units."):
                unread[name] = "a text"
            continue
        if name.startswith("meta."):
            continue
        if text := _unfit(np.asarray(array)):
            unread[name] = text
        for head, values in _vectors(name, np.asarray(array)):
            spelt = texts.get(f"channels.{head}")
            plain, said = (spelt, "") if spelt else parted(head)
            said = texts.get(f"units.{head}", said)
            numbers, since = floats(values)
            columns.append(Column(plain, head, said, numbers, since))
    try:
        meta = json.loads(texts.get("meta.json", "null"))
    except ValueError:
        meta = None
    own = isinstance(meta, dict)
    return Log(file, form, columns, meta=meta if own else {}, own=own, notes=notes, unread=unread)


def _unfit(array: np.ndarray) -> str:
    """Why an array is no column, and no matrix of columns, or ""."""
    if array.size < 2:
        return "one number"
    if array.ndim == 2 and min(array.shape) > MOST_COLUMNS:
        return f"{min(array.shape)} columns, more than {MOST_COLUMNS}"
    if array.ndim != 2 and array.size > max(array.shape):
        return f"{array.ndim} dimensions"
    return ""


def _vectors(name: str, array: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """A vector under its name; the columns of a matrix, or its rows if they are longer."""
    if array.ndim != 2 or min(array.shape) == 1:
        if array.size > 1 and array.size == max(array.shape):
            yield name, array.reshape(-1)
        return
    long = array if array.shape[0] >= array.shape[1] else array.T
    if long.shape[1] <= MOST_COLUMNS:
        for k in range(long.shape[1]):
            yield f"{name}.{k + 1}", long[:, k]


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
