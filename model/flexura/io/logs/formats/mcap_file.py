"""MCAP, the container of ROS 2 and Foxglove: messages in CDR or JSON."""

from __future__ import annotations

import io
import json
import struct
import zlib
from collections import Counter
from collections.abc import Callable
from typing import Any

from ....errors import InputError
from ....optional import load
from ..log import Log, damaged
from . import messages

STATISTICS = "the file's statistics"
FLOAT64 = "std_msgs/msg/Float64"
Decoder = Callable[[bytes], Any]


def read(raw: bytes, file: str) -> Log:
    """The topics of an MCAP file; one of an export of flexura has its channel's name and unit.

    Raises:
        InputError: the file is damaged, or its messages are in an encoding that is not known.
        Missing: mcap, or rosbags for messages of other types than Float64, is not installed.
    """
    records = load("mcap.records")
    stream_reader = load("mcap.stream_reader").StreamReader
    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    held: dict[int, list[tuple[int, bytes]]] = {}
    statistics: Any = None
    meta: dict[str, Any] | None = None
    try:
        _check_summary(raw)
        for record in stream_reader(io.BytesIO(raw), validate_crcs=True).records:
            if isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel):
                channels[record.id] = record
            elif isinstance(record, records.Message):
                held.setdefault(record.channel_id, []).append((record.log_time, record.data))
            elif isinstance(record, records.Statistics):
                statistics = record
            elif isinstance(record, records.Metadata) and record.name == "flexura":
                meta = json.loads(record.metadata["meta"])
        names = {number: channel.topic for number, channel in channels.items()}
        if statistics is not None:
            _check_counts(statistics, {k: len(each) for k, each in held.items()}, names, file)
            _check_span(statistics, [time for each in held.values() for time, _ in each])
        topics, unread = _topics(held, channels, schemas, meta is not None)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes of it
        raise damaged(file, "MCAP file", error) from None
    if not topics and unread:
        topic, encoding = next(iter(unread.items()))
        raise InputError(
            "expected messages in cdr (ROS 2) or json",
            key=f"encoding of {topic}",
            value=encoding,
            file=file,
        )
    columns, clocks = messages.columns(topics)
    notes = messages.late(topics)
    notes += [f"{topic} is left out: its encoding is {said}" for topic, said in unread.items()]
    unread_fields = messages.left(topics)
    return Log(
        file,
        "MCAP",
        columns,
        clocks,
        meta or {},
        own=meta is not None,
        notes=notes,
        unread=unread_fields,
    )


def _topics(
    held: dict[int, list[tuple[int, bytes]]],
    channels: dict[int, Any],
    schemas: dict[int, Any],
    own: bool,
) -> tuple[list[messages.Topic], dict[str, str]]:
    """The topics of messages in the order of their log times, and the encodings of the others."""
    topics, unread = [], {}
    for number, each in held.items():
        channel = channels[number]
        schema = schemas[channel.schema_id] if channel.schema_id else None
        decoder = _decoder(schema, channel.message_encoding)
        if decoder is None:
            unread[channel.topic] = channel.message_encoding
            continue
        about = channel.metadata if own else {}
        topic = messages.Topic(channel.topic, about.get("channel", ""), about.get("unit", ""))
        for log_time, data in sorted(each, key=lambda item: item[0]):
            topic.add(log_time, decoder(data))
        topics.append(topic)
    return topics, unread


def _check_summary(raw: bytes) -> None:
    """Compare the summary with its CRC-32 in the footer; the reader checks those of chunks and of
    the data alone. Raises ValueError."""
    start, _, wanted = struct.unpack("<QQI", raw[-8 - 20 : -8])
    if start and wanted and zlib.crc32(raw[start : -8 - 4]) != wanted:
        raise ValueError("the checksum of the summary is wrong")


def _check_counts(statistics: Any, found: dict[int, int], names: dict[int, str], file: str) -> None:
    """Compare the numbers of messages, by topic and of all, with those of the statistics."""
    there: Counter[str] = Counter()
    wanted: Counter[str] = Counter()
    for number, count in found.items():
        there[names[number]] += count
    for number, count in statistics.channel_message_counts.items():
        wanted[names.get(number, f"channel {number}")] += count
    if wanted or not found:  # they may be left out
        messages.check_counts(there, wanted, STATISTICS, file)
    every = {"all topics": sum(found.values())}
    messages.check_counts(every, {"all topics": statistics.message_count}, STATISTICS, file)


def _check_span(statistics: Any, times: list[int]) -> None:
    """Compare the first and the last log time [ns] with those of the statistics. Raises
    ValueError."""
    said = (statistics.message_start_time, statistics.message_end_time)
    if times and any(said) and (min(times), max(times)) != said:
        there = " to ".join(f"{time / 1e9:.9f}" for time in (min(times), max(times)))
        wanted = " to ".join(f"{time / 1e9:.9f}" for time in said)
        raise ValueError(f"log times from {there} s, {STATISTICS} say {wanted} s")


def _decoder(schema: Any, encoding: str) -> Decoder | None:
    """What makes a message of its bytes; None for an encoding that is not known."""
    if encoding == "json":
        return json.loads
    if encoding != "cdr" or schema is None:
        return None
    if schema.name == FLOAT64:
        return _float64
    types = load("rosbags.typesys")
    text = schema.data.decode()
    if schema.encoding == "ros2msg":
        found = types.get_types_from_msg(text, schema.name)
    elif schema.encoding == "ros2idl":
        found = types.get_types_from_idl(text)
    else:
        return None
    store = types.get_typestore(types.Stores.LATEST)
    store.register({name: made for name, made in found.items() if name not in store.fielddefs})
    return lambda data: store.deserialize_cdr(data, schema.name)


def _float64(data: bytes) -> dict[str, float]:
    """A std_msgs/msg/Float64: the encapsulation says the order of the bytes."""
    (value,) = struct.unpack_from("<d" if data[1] & 1 else ">d", data, 4)
    return {"data": value}
