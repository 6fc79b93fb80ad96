"""TDMS, the binary format of LabVIEW and DIAdem, read by npTDMS."""

from __future__ import annotations

import io
import json
import logging
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ....errors import InputError
from ....optional import load
from ..log import Clock, Column, Log, damaged, floats
from ..names import parted

NO_UTF_8 = "Error decoding string"  # LabVIEW writes texts in the code page of its machine


def read(raw: bytes, file: str) -> Log:
    """The channels of a TDMS file, each with its time base where it has one.

    Raises:
        InputError: the file is damaged.
        Missing: npTDMS is not installed.
    """
    nptdms = load("nptdms")
    try:
        with _complaints() as (complaints, texts):
            found = nptdms.TdmsFile.read(io.BytesIO(raw))
            every = [(group, channel) for group in found.groups() for channel in group.channels()]
            parts = [part for part in every if part[1].dtype.kind in "iufbM"]
            data = [channel[:] for _, channel in parts]
        if complaints:
            raise ValueError(complaints[0])
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes of it
        raise damaged(file, "TDMS file", error) from None
    about = found.properties.get("flexura")
    own = _json(about)
    times = Counter(channel.name for _, channel in parts)
    columns: list[Column] = []
    clocks: dict[str, Clock] = {}
    for (group, channel), numbers in zip(parts, data, strict=True):
        alone = times[channel.name] == 1
        head = channel.name if alone else f"{group.name}/{channel.name}"
        name, said = (head, "") if own is not None else parted(head)
        said = str(channel.properties.get("unit_string") or said)
        said = "s" if numbers.dtype.kind == "M" else said
        values, since = floats(numbers)
        base = _base(channel.properties, len(values), file)
        if base is not None:
            clocks[head] = base
        clock = head if base is not None else ""
        columns.append(Column(name, head, said, values, since, clock))
    notes = []
    if texts:
        shown = ", ".join(map(repr, list(dict.fromkeys(texts))[:3]))
        notes = [f"texts are not UTF-8, \ufffd stands for what cannot be read: {shown}"]
    numbers_of = {id(channel) for _, channel in parts}
    return Log(
        file,
        "TDMS",
        columns,
        clocks,
        own or {},
        own=own is not None,
        notes=notes,
        unread={c.name: "no numbers" for _, c in every if id(c) not in numbers_of},
        digest=str(found.properties.get("digest", "")),
    )


@contextmanager
def _complaints() -> Iterator[tuple[list[str], list[str]]]:
    """What npTDMS says meanwhile, kept off the terminal: of a loss after which it reads on, and of
    texts that it cannot decode."""
    losses: list[str] = []
    texts: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        raw = record.args[0] if isinstance(record.args, tuple) and record.args else None
        if isinstance(raw, bytes) and str(record.msg).startswith(NO_UTF_8):
            texts.append(raw.decode(errors="replace")[:60])
        elif record.levelno >= logging.WARNING:
            losses.append(record.getMessage())
        return False

    names = [name for name in logging.root.manager.loggerDict if name.startswith("nptdms")]
    loggers = [logging.getLogger(name) for name in names]
    for logger in loggers:
        logger.addFilter(keep)
    try:
        yield losses, texts
    finally:
        for logger in loggers:
            logger.removeFilter(keep)


def _json(text: Any) -> dict[str, Any] | None:
    """Metadata of an export of flexura."""
    try:
        found = json.loads(text) if isinstance(text, str) else None
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def _base(properties: Any, length: int, file: str) -> Clock | None:
    """A channel's time base: offset + k increment after the start."""
    step = properties.get("wf_increment")
    if step is None:
        return None
    try:
        step, offset = float(step), float(properties.get("wf_start_offset") or 0.0)
    except (TypeError, ValueError):
        raise InputError(
            "expected a time base", key="wf_increment", value=step, file=file
        ) from None
    begin = properties.get("wf_start_time")
    start = 0.0
    if isinstance(begin, np.datetime64) and not np.isnat(begin):
        start = begin.astype("datetime64[us]").astype(np.int64) / 1e6
    said = f"the channels' time base, {step:g} s a sample"
    return Clock(offset + step * np.arange(length), float(start), said)
