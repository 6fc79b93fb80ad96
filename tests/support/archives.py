"""A small example of each kind of archive, and damage to every byte of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

import flexura as fx
from flexlab.recordings import recording
from flexlab.review import write_review
from flexlab.review.headless import default_time
from flexlab.studies import output
from flexlab.studies.sweep import Finding, Study
from flexlab.tuning import history as histories
from flexura.io import read_sealed
from populations import ARM, DRIVE

HEADER = 64  # bytes at each end of a file whose every bit is flipped
T = np.linspace(0.0, 0.02, 3)


@dataclass(frozen=True)
class Archive:
    """A kept file, how it is read, and what the kind may lose with a word (None: nothing)."""

    file: Path
    read: Callable[[], Any]
    lost: Callable[[Any], bool] = lambda found: False


def flips(data: bytes, every: int = 1) -> Iterator[tuple[int, int]]:
    """Places and masks: each byte turned round and by one bit, and each bit of both ends; of
    `every` such bytes one."""
    for at in range(0, len(data), every):
        ends = at < HEADER or at >= len(data) - HEADER
        for mask in (0xFF, *((1 << bit for bit in range(8)) if ends else (1 << at % 8,))):
            yield at, mask


def damaged(archive: Archive, every: int = 1) -> Counter[str]:
    """Flip the file's bytes one after the other, of `every` bytes one, and read it.

    Returns:
        How often it was refused by name, or read with a word on what is lost.

    Raises:
        AssertionError: numbers are wrong and nothing is said.
    """
    good, right = archive.file.read_bytes(), same(archive.read())
    counts: Counter[str] = Counter(bytes=len(good))
    for at, mask in flips(good, every):
        raw = bytearray(good)
        raw[at] ^= mask
        archive.file.write_bytes(raw)
        try:
            found = archive.read()
        except fx.InputError as error:
            text = str(error)
            assert str(archive.file.name) in text and text.isprintable() and len(text) < 500, text
            counts["refused"] += 1
        else:
            lost = archive.lost(found)
            assert lost, f"byte {at} ^ {mask:#x} was not seen"
            counts["lost with a word"] += 1
        counts["flips"] += 1
    archive.file.write_bytes(good)
    assert same(archive.read()) == right
    return counts


def same(found: Any) -> str:
    """Everything that was read, as a text that is equal for equal archives."""
    with np.printoptions(threshold=10**9, precision=17, floatmode="unique"):
        return repr(vars(found) if hasattr(found, "__dict__") else found)


def run(folder: Path) -> Archive:
    channels = {"tip/x": np.sin(T), "joint/1/position": 0.1 * T}
    meta = {"source": "simulation", "robot": {"name": "arm"}, "complete": True, "events": []}
    made = fx.Run(T, channels, {"tip/x": "m", "joint/1/position": "rad"}, meta)
    return Archive(made.save(folder), lambda: fx.Run.read(folder))


def population(folder: Path) -> fx.Population:
    """Three robots in two chunks."""
    batch = fx.Batch.vary(ARM, {"payload.mass_kg": [0.0, 0.1, 0.2]})
    return fx.simulate(batch, T, DRIVE, folder=folder, chunk=2, channels=["joint/1/position"])


def chunk(folder: Path) -> Archive:
    population(folder)

    def read() -> list[Any]:
        return [vars(each) for each in fx.Population.read(folder)]

    return Archive(folder / "chunk-0000000.parquet", read)


def request(folder: Path) -> Archive:
    population(folder)
    return Archive(
        folder / "population.json",
        lambda: (found := fx.Population.read(folder)) and (found.t, found.units, found.base),
    )


def state(folder: Path) -> Archive:
    made = histories.History.open(folder, "digest")
    for k in range(2):
        points = np.arange(4.0).reshape(2, 2) / 7 + k
        made.append(points, points[:, :1], points[:, :, None], points[:, :1], 0.5)
    assert made.path is not None
    return Archive(made.path, lambda: histories.History.open(folder, "digest"))


def study(folder: Path) -> Archive:
    rows = [
        {"payload_kg": m, "first_frequency_Hz": 2.0, "max_m": m, "later_m": m, "complete": True}
        for m in (0.0, 0.1)
    ]
    finding = Finding("a claim", None, "words", {})
    output.save(Study("payload", ARM, "about", 2, rows, finding, True), folder)
    file = folder / "study.parquet"

    def read() -> Any:
        read_sealed(file, "make it again")
        table = pq.read_table(file)
        return table.to_pydict(), table.schema.metadata

    return Archive(file, read)


def stored_recording(folder: Path, name: str) -> Archive:
    """A recording whose events and session are read; its frames are another matter."""
    made = recording.Recording(folder, {"knots": {"mode": 1}, "rest": None, "numbers": [0.1, 2]})
    made.received(b"\x01\x02\x03\x00")
    made.event("the board greets", tick=3)
    made.event("the end", ended=True, complete=True)
    made.close()
    return Archive(
        folder / name, lambda: recording.read(folder), lost=lambda found: found.lost_events > 0
    )


def review(folder: Path) -> Archive:
    folder.mkdir(parents=True, exist_ok=True)
    made = fx.Run(T, {"tip/x": np.sin(T)}, {"tip/x": "m"}, {"source": "simulation"})
    path = write_review(folder / "review.rrd", [made])
    return Archive(path, lambda: default_time(path))


KINDS: dict[str, Callable[[Path], Archive]] = {
    "run": run,
    "chunk": chunk,
    "request": request,
    "search": state,
    "study": study,
    "review": review,
    "session": lambda folder: stored_recording(folder, recording.SESSION),
    "events": lambda folder: stored_recording(folder, recording.EVENTS),
}
