"""Bags of ROS 2 (a folder with metadata.yaml) and of ROS 1 (.bag), read by rosbags."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from ....errors import InputError
from ....optional import load
from ..log import Log, damaged
from . import messages

_INDEX = {True: "the counts in its metadata.yaml", False: "the counts in its index"}


def read(path: Path) -> Log:
    """The topics of a bag: a folder of ROS 2, or a file of ROS 1.

    Raises:
        InputError: the bag is damaged.
        Missing: rosbags is not installed.
    """
    anyreader = load("rosbags.highlevel").AnyReader
    types = load("rosbags.typesys")
    topics: dict[str, messages.Topic] = {}
    unread: set[str] = set()
    counts: Counter[str] = Counter()
    try:
        store = types.get_typestore(types.Stores.LATEST)
        with anyreader([path], default_typestore=store) as reader:
            said = {name: about.msgcount for name, about in reader.topics.items()}
            for connection, log_time, raw in reader.messages():
                name = connection.topic
                counts[name] += 1
                if name in unread:
                    continue
                try:
                    found = reader.deserialize(raw, connection.msgtype)
                except KeyError:  # a type that neither the bag nor ROS describes
                    unread.add(name)
                    continue
                topic = topics.setdefault(name, messages.Topic(name))
                topic.add(log_time, found)
        messages.check_counts(counts, said, _INDEX[path.is_dir()], str(path))
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes of it
        raise damaged(path, "bag", error) from None
    if not topics:
        raise InputError("a bag without messages that can be read", file=str(path))
    columns, clocks = messages.columns(list(topics.values()))
    notes = messages.late(list(topics.values()))
    notes += [f"{name} is left out: its type is not described" for name in sorted(unread)]
    unread_fields = messages.left(list(topics.values()))
    return Log(str(path), "ROS bag", columns, clocks, notes=notes, unread=unread_fields)
