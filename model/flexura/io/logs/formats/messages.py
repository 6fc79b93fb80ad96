"""Messages of ROS 2 as columns of numbers: one column a field, a clock a topic."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....errors import InputError
from ..log import Clock, Column
from ..names import known, parted

LONGEST = 64  # numbers of one array field
LATE_S = 1e-3  # what times of the log may be after stamps
# The units of fields of common messages, by the end of their path.
UNITS = {
    "linear_acceleration.x": "m/s^2",
    "linear_acceleration.y": "m/s^2",
    "linear_acceleration.z": "m/s^2",
    "angular_velocity.x": "rad/s",
    "angular_velocity.y": "rad/s",
    "angular_velocity.z": "rad/s",
    "wrench.force.x": "N",
    "wrench.force.y": "N",
    "wrench.force.z": "N",
    "wrench.torque.x": "N m",
    "wrench.torque.y": "N m",
    "wrench.torque.z": "N m",
}


@dataclass
class Topic:
    """What was read of one topic: times [ns] and numbers by field; `channel`, `unit` if said.

    Attributes:
        received: how many of the times are the log's own, of messages without a stamp.
        late: what the log's times are after the stamps [ns], of messages with a stamp.
        long: fields that are left out, and the count of their numbers.
    """

    name: str
    channel: str = ""
    unit: str = ""
    stamps: list[int] = field(default_factory=list)
    fields: dict[str, list[float]] = field(default_factory=dict)
    received: int = 0
    late: list[int] = field(default_factory=list)
    long: dict[str, int] = field(default_factory=dict)

    def add(self, log_time: int, message: Any) -> None:
        """One message: the fields that it has not got are gaps."""
        stamp = stamp_of(message)
        if stamp is None:
            self.received += 1
        else:
            self.late.append(log_time - stamp)
        for name, value in numbers(message, self.long).items():
            self.fields.setdefault(name, [np.nan] * len(self.stamps)).append(value)
        self.stamps.append(log_time if stamp is None else stamp)
        for values in self.fields.values():
            if len(values) < len(self.stamps):
                values.append(np.nan)

    def clock(self) -> str:
        """What its times are, in words."""
        if not self.received:
            return f"the stamps of {self.name}"
        if not self.late:
            return f"the log's times of {self.name}, which has no stamps"
        return (
            f"the stamps of {self.name}, and the log's times where there are none: "
            f"{self.received} of {len(self.stamps)}"
        )


def check_counts(found: dict[str, int], wanted: dict[str, int], said: str, file: str) -> None:
    """Refuse a log that has not the messages that it says.

    Args:
        found: numbers of messages by topic.
        wanted: the same, as the log says.
        said: where it says so.
        file: its path.

    Raises:
        InputError: they differ; both are named.
    """
    for name in wanted | found:
        there, expected = found.get(name, 0), wanted.get(name, 0)
        if there != expected:
            text = f"a damaged log: {there} messages, {said} say {expected}"
            raise InputError(text, key=name, file=file)


def columns(topics: Sequence[Topic]) -> tuple[list[Column], dict[str, Clock]]:
    """The columns of all topics, and the topics' clocks from the first stamp of all."""
    stamped = [topic for topic in topics if topic.stamps]
    first = min((min(topic.stamps) for topic in stamped), default=0)
    out, clocks = [], {}
    for topic in stamped:
        t = np.array([stamp - first for stamp in topic.stamps]) / 1e9
        clocks[topic.name] = Clock(t, first / 1e9, topic.clock())
        for path, values in topic.fields.items():
            head = topic.name + (f".{path}" if path else "")
            plain, said = parted(head.strip("/"))
            plain = topic.channel or known(plain) or plain
            said = topic.unit or said or UNITS.get(".".join(path.split(".")[-2:]), "")
            said = said or UNITS.get(".".join(path.split(".")[-3:]), "")
            out.append(Column(plain, head, said, np.array(values), clock=topic.name))
    return out, clocks


def late(topics: Sequence[Topic]) -> list[str]:
    """A sentence on topics without stamps beside others whose stamps are earlier than the log's
    times, or none."""
    bare = [topic.name for topic in topics if topic.received]
    stamped = [topic for topic in topics if topic.late]
    if not bare or not stamped:
        return []
    after = float(np.median(np.concatenate([topic.late for topic in stamped]))) / 1e9
    if abs(after) < LATE_S:
        return []
    return [
        f"{', '.join(bare)}: the log's times are taken; those of {stamped[0].name} are "
        f"{after:.3g} s after its stamps"
    ]


def left(topics: Sequence[Topic]) -> dict[str, str]:
    """Fields that are left out, and why."""
    return {
        f"{topic.name}.{path}": f"{count} numbers a message, more than {LONGEST}"
        for topic in topics
        for path, count in topic.long.items()
    }


def stamp_of(message: Any) -> int | None:
    """The stamp in a message's header [ns]; None without one, or if it is zero."""
    header = _get(message, "header")
    stamp = None if header is None else _get(header, "stamp")
    if stamp is None:
        return None
    seconds, rest = _get(stamp, "sec"), _get(stamp, "nanosec", _get(stamp, "nsec", 0))
    return (int(seconds) * 10**9 + int(rest or 0)) or None if seconds is not None else None


def numbers(message: Any, long: dict[str, int] | None = None) -> dict[str, float]:
    """The numbers of a message by their path: `linear_acceleration.x`; `data` alone is "".

    Args:
        message: of ROS, or a dictionary.
        long: gets the fields with more numbers than `LONGEST`, which are left out.
    """
    found = dict(_numbers(message, "", 0, {} if long is None else long))
    return {"": found["data"]} if list(found) == ["data"] else found


def _numbers(
    value: Any, path: str, depth: int, long: dict[str, int]
) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float | np.number):
        yield path, float(value)
    elif isinstance(value, np.ndarray | list | tuple):
        if len(value) > LONGEST:
            long[path] = max(len(value), long.get(path, 0))
            return
        for k, item in enumerate(value):
            yield from _numbers(item, f"{path}.{k + 1}".strip("."), depth + 1, long)
    elif depth < 12 and value is not None and not isinstance(value, str | bytes):
        names = _joints(value)
        for key, item in _items(value):
            if key in ("header", "__msgtype__") or key.startswith("_"):
                continue
            inner = f"{path}.{key}".strip(".")
            if names and isinstance(item, np.ndarray | list) and len(item) == len(names):
                for name, number in zip(names, item, strict=True):
                    yield from _numbers(number, f"{inner}.{name}", depth + 1, long)
            else:
                yield from _numbers(item, inner, depth + 1, long)


def _joints(value: Any) -> list[str]:
    """The names of the joints, of a message that has some: sensor_msgs/JointState."""
    names = _get(value, "name")
    listed = isinstance(names, list | tuple) and all(isinstance(n, str) for n in names)
    return list(names) if listed else []


def _items(value: Any) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        return [(str(key), item) for key, item in value.items()]
    return [(key, getattr(value, key)) for key in getattr(value, "__dataclass_fields__", ())]


def _get(value: Any, name: str, default: Any = None) -> Any:
    return value.get(name, default) if isinstance(value, dict) else getattr(value, name, default)
