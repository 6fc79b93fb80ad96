"""Messages of ROS 2 as columns of numbers: one column a field, a clock a topic."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..log import Clock, Column
from ..names import known, parted

LONGEST = 64  # numbers of one array field
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
    """What was read of one topic: stamps [ns] and numbers by field; `channel`, `unit` if said."""

    name: str
    channel: str = ""
    unit: str = ""
    stamps: list[int] = field(default_factory=list)
    fields: dict[str, list[float]] = field(default_factory=dict)

    def add(self, stamp: int, numbers: dict[str, float]) -> None:
        """One message: the fields that it has not got are gaps."""
        for name, value in numbers.items():
            self.fields.setdefault(name, [np.nan] * len(self.stamps)).append(value)
        self.stamps.append(stamp)
        for values in self.fields.values():
            if len(values) < len(self.stamps):
                values.append(np.nan)


def columns(topics: Sequence[Topic]) -> tuple[list[Column], dict[str, Clock]]:
    """The columns of all topics, and the topics' clocks from the first stamp of all."""
    stamped = [topic for topic in topics if topic.stamps]
    first = min((min(topic.stamps) for topic in stamped), default=0)
    out, clocks = [], {}
    for topic in stamped:
        t = np.array([stamp - first for stamp in topic.stamps]) / 1e9
        clocks[topic.name] = Clock(t, first / 1e9, f"the stamps of {topic.name}")
        for path, values in topic.fields.items():
            head = topic.name + (f".{path}" if path else "")
            plain, said = parted(head.strip("/"))
            plain = topic.channel or known(plain) or plain
            said = topic.unit or said or UNITS.get(".".join(path.split(".")[-2:]), "")
            said = said or UNITS.get(".".join(path.split(".")[-3:]), "")
            out.append(Column(plain, head, said, np.array(values), clock=topic.name))
    return out, clocks


def stamp_of(message: Any) -> int | None:
    """The stamp in a message's header [ns]; None without one, or if it is zero."""
    header = _get(message, "header")
    stamp = None if header is None else _get(header, "stamp")
    if stamp is None:
        return None
    seconds, rest = _get(stamp, "sec"), _get(stamp, "nanosec", _get(stamp, "nsec", 0))
    return (int(seconds) * 10**9 + int(rest or 0)) or None if seconds is not None else None


def numbers(message: Any) -> dict[str, float]:
    """The numbers of a message by their path: `linear_acceleration.x`; `data` alone is ""."""
    found = dict(_numbers(message, "", 0))
    return {"": found["data"]} if list(found) == ["data"] else found


def _numbers(value: Any, path: str, depth: int) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float | np.number):
        yield path, float(value)
    elif isinstance(value, np.ndarray | list | tuple):
        if len(value) <= LONGEST:
            for k, item in enumerate(value):
                yield from _numbers(item, f"{path}.{k + 1}".strip("."), depth + 1)
    elif depth < 12 and value is not None and not isinstance(value, str | bytes):
        names = _joints(value)
        for key, item in _items(value):
            if key in ("header", "__msgtype__") or key.startswith("_"):
                continue
            inner = f"{path}.{key}".strip(".")
            if names and isinstance(item, np.ndarray | list) and len(item) == len(names):
                for name, number in zip(names, item, strict=True):
                    yield from _numbers(number, f"{inner}.{name}", depth + 1)
            else:
                yield from _numbers(item, inner, depth + 1)


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
