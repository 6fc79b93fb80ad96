"""MCAP, the container of ROS 2 and Foxglove: messages in CDR or JSON."""

from __future__ import annotations

import io
import json
import struct
import zlib
from collections.abc import Callable
from typing import Any

from ....errors import InputError
from ....optional import load
from ..log import Log, damaged
from . import messages

FLOAT64 = "std_msgs/msg/Float64"
Decoder = Callable[[bytes], Any]


def read(raw: bytes, file: str) -> Log:
    """The topics of an MCAP file; one of an export of flexura has its channel's name and unit.

    Raises:
        InputError: the file is damaged, or its messages are in an encoding that is not known.
        Missing: mcap, or rosbags for messages of other types than Float64, is not installed.
    """
    make_reader = load("mcap.reader").make_reader
    topics: dict[int, messages.Topic] = {}
    decoders: dict[int, Decoder] = {}
    meta: dict[str, Any] | None = None
    unread: dict[str, str] = {}
    try:
        _check_summary(raw)
        reader = make_reader(io.BytesIO(raw), validate_crcs=True)
        for record in reader.iter_metadata():
            if record.name == "flexura":
                meta = json.loads(record.metadata["meta"])
        for schema, channel, message in reader.iter_messages(log_time_order=True):
            number = channel.id
            if number not in decoders:
                decoder = _decoder(schema, channel.message_encoding)
                if decoder is None:
                    unread[channel.topic] = channel.message_encoding
                    continue
                decoders[number] = decoder
                about = channel.metadata if meta is not None else {}
                topics[number] = messages.Topic(
                    channel.topic, about.get("channel", ""), about.get("unit", "")
                )
            found = decoders[number](message.data)
            stamp = messages.stamp_of(found) or message.log_time
            topics[number].add(stamp, messages.numbers(found))
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
    columns, clocks = messages.columns(list(topics.values()))
    notes = [f"{topic} is left out: its encoding is {said}" for topic, said in unread.items()]
    return Log(file, "MCAP", columns, clocks, meta or {}, own=meta is not None, notes=notes)


def _check_summary(raw: bytes) -> None:
    """Compare the summary, from which the reader takes the channels, with its CRC-32 in the footer;
    the reader checks those of chunks alone. Raises ValueError."""
    start, _, wanted = struct.unpack("<QQI", raw[-8 - 20 : -8])
    if start and wanted and zlib.crc32(raw[start : -8 - 4]) != wanted:
        raise ValueError("the checksum of the summary is wrong")


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
