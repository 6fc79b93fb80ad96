"""What a disk may hold after a loss of power, from a log of what was done to the files.

What was synchronised is there. Of the rest anything may be: writes that are lost, out of order or
torn, names that are lost or out of order. A rename is there as a whole or not at all.
"""

from __future__ import annotations

import random
import shutil
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

HEAD = struct.Struct("<cIIIq")


@dataclass(frozen=True)
class Operation:
    """One entry of the log; `what`: c create, w write, t truncate, f synchronise, r rename, m new
    folder, u remove, o text on stdout."""

    what: str
    path: str
    other: str
    offset: int
    data: bytes


def operations(log: Path) -> list[Operation]:
    """The operations in a log that the shim wrote."""
    raw, at, found = log.read_bytes(), 0, []
    while at < len(raw):
        what, a, b, c, offset = HEAD.unpack_from(raw, at)
        at += HEAD.size
        path, other, data = raw[at : at + a], raw[at + a : at + a + b], raw[at + a + b :][:c]
        at += a + b + c
        found.append(Operation(what.decode(), path.decode(), other.decode(), offset, data))
    return found


@dataclass
class File:
    """The bytes on the disk, and the writes since; a write at -1 empties the file."""

    safe: bytes = b""
    pending: list[tuple[int, bytes]] = field(default_factory=list)

    def content(self, chosen: list[tuple[int, bytes]]) -> bytes:
        """The bytes after some of the writes."""
        held = bytearray(self.safe)
        for offset, data in chosen:
            if offset < 0:
                held.clear()
                continue
            held.extend(b"\0" * (offset + len(data) - len(held)))
            held[offset : offset + len(data)] = data
        return bytes(held)


@dataclass
class Folder:
    """Names on the disk: files and folders."""

    names: dict[str, File | Folder] = field(default_factory=dict)


# of names that change together: folder, name, what it then names
Change = list[tuple[Folder, str, "File | Folder | None"]]


class Disk:
    """A folder's files, on the disk and in the memory that is lost."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.live: dict[str, File | Folder] = {}
        self.pending: list[Change] = []
        self.said = ""
        self.top = self._taken(root)

    def _taken(self, path: Path) -> Folder:
        """What is there at the beginning is on the disk."""
        folder = Folder()
        self.live[str(path)] = folder
        for each in path.iterdir():
            if each.is_symlink():
                continue
            if each.is_dir():
                folder.names[each.name] = self._taken(each)
            else:
                folder.names[each.name] = self.live[str(each)] = File(each.read_bytes())
        return folder

    def _place(self, path: str) -> tuple[Folder, str]:
        parent, _, name = path.rpartition("/")
        found = self.live[parent]
        assert isinstance(found, Folder)
        return found, name

    def do(self, op: Operation) -> None:
        """One operation."""
        if op.what == "o":
            self.said += op.data.decode(errors="replace")
        elif op.what in "cm":
            self.live[op.path] = File() if op.what == "c" else Folder()
            self.pending.append([(*self._place(op.path), self.live[op.path])])
        elif op.what == "u":
            self.pending.append([(*self._place(op.path), None)])
            self.live.pop(op.path, None)
        elif op.what == "r":
            self._rename(op.path, op.other)
        elif op.what in "wt":
            file = self.live[op.path]
            assert isinstance(file, File)
            file.pending.append((op.offset, op.data) if op.what == "w" else (-1, b""))
        elif op.what == "f":
            held = self.live[op.path]
            if isinstance(held, File):
                held.safe, held.pending = held.content(held.pending), []
            else:
                self._safe_names(held)

    def _rename(self, path: str, other: str) -> None:
        moved = self.live[path]
        change: Change = [(*self._place(path), None), (*self._place(other), moved)]
        self.pending.append(change)
        self.live = {p: x for p, x in self.live.items() if not (p + "/").startswith(other + "/")}
        self.live = {
            other + p[len(path) :] if (p + "/").startswith(path + "/") else p: x
            for p, x in self.live.items()
        }

    def _safe_names(self, folder: Folder) -> None:
        """Changes of a folder, and those before them that they need, are on the disk."""
        for change in [c for c in self.pending if any(f is folder for f, _, _ in c)]:
            apply(change)
            self.pending.remove(change)

    def outcomes(self, chance: random.Random, count: int) -> Iterator[dict[str, bytes | None]]:
        """Trees that a loss of power at this moment may leave: paths and bytes; None: a folder."""
        for k in range(count):
            share = (0.0, 1.0)[k] if k < 2 else chance.random()
            kept = [change for change in self.pending if k == 1 or chance.random() < share]
            names = {id(f): dict(f.names) for f in self._folders()}
            for change in kept:
                for folder, name, held in change:
                    entries = names.setdefault(id(folder), dict(folder.names))
                    if held is None:
                        entries.pop(name, None)
                    else:
                        entries[name] = held
            yield dict(self._tree(self.top, "", names, chance, k))

    def _folders(self) -> Iterator[Folder]:
        for change in self.pending:
            for folder, _, _ in change:
                yield folder

    def _tree(
        self, folder: Folder, above: str, names: dict, chance: random.Random, k: int
    ) -> Iterator[tuple[str, bytes | None]]:
        for name, held in names.get(id(folder), folder.names).items():
            path = f"{above}{name}"
            if isinstance(held, Folder):
                yield path, None
                yield from self._tree(held, f"{path}/", names, chance, k)
            else:
                yield path, held.content(torn(held.pending, chance, k))


def torn(writes: list[tuple[int, bytes]], chance: random.Random, k: int) -> list[tuple[int, bytes]]:
    """Some of the writes: none, all, or any, each perhaps in part."""
    if k < 2:
        return writes if k == 1 else []
    kept = [w for w in writes if chance.random() < 0.6]
    return [
        (at, data[: chance.randrange(len(data) + 1)] if chance.random() < 0.3 else data)
        for at, data in kept
    ]


def apply(change: Change) -> None:
    """Change names on the disk."""
    for folder, name, held in change:
        if held is None:
            folder.names.pop(name, None)
        else:
            folder.names[name] = held


def put(tree: dict[str, bytes | None], place: Path) -> None:
    """Make the files of an outcome."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for path, content in tree.items():
        if content is None:
            (place / path).mkdir(parents=True, exist_ok=True)
        else:
            (place / path).parent.mkdir(parents=True, exist_ok=True)
            (place / path).write_bytes(content)


def losses(
    root: Path, log: list[Operation], seed: int, count: int
) -> Iterator[tuple[Disk, dict[str, bytes | None]]]:
    """After each beginning of the log, `count` outcomes of a loss of power."""
    disk, chance = Disk(root), random.Random(seed)
    for op in [None, *log]:
        if op is not None:
            disk.do(op)
        for tree in disk.outcomes(chance, count):
            yield disk, tree
