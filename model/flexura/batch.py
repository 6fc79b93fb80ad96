"""A batch: many robots of one topology with different numbers, made one at a time when they are needed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from dataclasses import dataclass
from typing import Any

import numpy as np

from .drive import Drive
from .errors import InputError
from .robot import Robot

Item = tuple[Robot, Drive | None]  # None: the drive that all share


@dataclass(frozen=True)
class Batch:
    """`count` robots, each with its own drive or with the one that `simulate` is given; robots are counted from 1 in messages.

    `source` is what they come from: an iterable of Robot or (Robot, Drive), or a function (k, random) of the number k from 0 and
    a numpy Generator of its own, which gives one: the same one whatever is simulated before, elsewhere, or not at all.
    """

    source: Iterable[Any] | Callable[[int, np.random.Generator], Any]
    count: int
    seed: int = 0

    @staticmethod
    def of(robots: Any, count: int | None = None, seed: int = 0) -> Batch:
        """A Batch of an iterable of Robot or (Robot, Drive), or of a function (k, random) that makes the k-th.

        `count` is needed where `robots` has no length. A generator is good for one simulation, a list or a function for any.
        """
        if count is None:
            if not isinstance(robots, Sized):
                raise InputError("missing: expected how many robots there are", key="count")
            count = len(robots)
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise InputError("expected a whole number of robots, 1 or more", key="count", value=count)
        if not callable(robots) and not isinstance(robots, Iterable):
            raise InputError("expected robots, or a function (k, random) that makes one", key="robots", value=robots)
        return Batch(robots, count, seed)

    @staticmethod
    def vary(robot: Robot, changes: Mapping[str, Any]) -> Batch:
        """The robots of `robot.replace({key: value})` along arrays of values, all of one length B: {"payload.mass_kg": (B,)}."""
        columns = {key: np.atleast_1d(np.asarray(values, dtype=float)) for key, values in changes.items()}
        counts = {len(values) for values in columns.values()}
        if len(counts) != 1:
            raise InputError("expected one or more keys with equally many values", key="changes", value=sorted(counts))
        return Batch(_Varied(robot, columns), counts.pop())

    def __iter__(self) -> Iterator[Item]:
        """The robots in their order, each checked against the first one's topology."""
        first: tuple[Any, ...] | None = None
        k = -1
        for k, given in enumerate(self._given()):
            if k >= self.count:
                raise InputError(f"expected {self.count} robots, but there are more", key="robots")
            robot, drive = given if isinstance(given, tuple) and len(given) == 2 else (given, None)
            if not isinstance(robot, Robot) or not (drive is None or isinstance(drive, Drive)):
                raise InputError("expected a Robot or (Robot, Drive)", key=f"robots[{k + 1}]", value=given)
            shape = topology(robot)
            first = first or shape
            if shape != first:
                raise InputError("expected robots of one topology, that of the first", key=f"robots[{k + 1}]", value=shape)
            if robot.nodal:
                raise InputError('expected "continuous" in a batch', key=f"robots[{k + 1}].sliding", value="nodal")
            yield robot, drive
        if k + 1 < self.count:
            raise InputError(f"expected {self.count} robots, but there are only {k + 1}", key="robots")

    def _given(self) -> Iterator[Any]:
        if callable(self.source):
            return (self.source(k, np.random.default_rng([self.seed, k])) for k in range(self.count))
        return iter(self.source)


@dataclass(frozen=True)
class _Varied:
    """A robot with values from columns of numbers, again and again; no generator is made where none is used."""

    robot: Robot
    columns: Mapping[str, np.ndarray]

    def __iter__(self) -> Iterator[Robot]:
        for row in zip(*(values.tolist() for values in self.columns.values()), strict=True):
            yield self.robot.replace(dict(zip(self.columns, row, strict=True)))


def topology(robot: Robot) -> tuple[Any, ...]:
    """What robots of one batch share: a tuple (joint type, elements, modes, locked) a link, and whether links stiffen."""
    return robot.stiffening, *((k.joint.type, k.elements, k.modes, k.joint.locked) for k in robot.links)


def digest(robot: Robot, drive: Drive | None) -> bytes:
    """16 bytes that tell this robot and drive from any other: of all numbers, to the last bit."""
    found = hashlib.blake2b(robot.model_dump_json().encode(), digest_size=16)
    if drive is not None:
        segments, ranges, gains = drive.packed()
        for array in (segments, ranges, gains, drive.follows):
            found.update(np.ascontiguousarray(array).tobytes())
    return found.digest()
