"""A batch: many robots of one topology with different numbers, made one at a time when they are
needed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import array, whole
from ..robot import Robot, robot_of
from ..signals import Drive, acts
from ..system import RobotLike
from .rows import Rows, good, joined, one, varied

Item = tuple[Robot, Drive | None]  # None: the drive that all share


@dataclass(frozen=True)
class Share:
    """Some robots of a batch in their order; `first` is the number of the first, from 0.

    `groups`: the numbers, from 0 within the share, of robots that have the same counts, and their
    rows. `acting`: what is varied of loads and payloads, by key.
    """

    first: int
    robots: Sequence[Robot]
    drives: Sequence[Drive | None]
    groups: list[tuple[np.ndarray, Rows]]
    acting: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.drives)

    @property
    def digests(self) -> list[bytes]:
        """16 bytes a robot that tell it and its drive from any other."""
        out = [b""] * len(self)
        alike = self.robots[0] if isinstance(self.robots, _Varied) else None
        for members, rows in self.groups:
            for j, k in enumerate(members):
                robot, own = alike or self.robots[k], list(self.values(k).values())
                out[k] = _digest(rows, j, robot, self.drives[k], own)
        return out

    def values(self, k: int) -> dict[str, float]:
        """What is varied of the loads and payloads of robot k, from 0 within the share, by key."""
        return {key: float(column[k]) for key, column in self.acting.items()}


@dataclass(frozen=True)
class Batch:
    """`count` robots, each with its own drive or with the one that `simulate` is given; robots are
    counted from 1 in messages.

    `source` is what they come from: an iterable of Robot or (Robot, Drive), or a function (k,
    random) of the number k from 0 and a numpy Generator of its own, which gives one: the same one
    whatever is simulated before, elsewhere, or not at all.
    """

    source: Iterable[object] | Callable[[int, np.random.Generator], object]
    count: int
    seed: int = 0

    def __repr__(self) -> str:
        keys = ", ".join(self.varied)
        return f"Batch: {self.count} robots" + (f", which differ in {keys}" if keys else "")

    @staticmethod
    def of(
        robots: Iterable[object] | Callable[[int, np.random.Generator], object],
        count: int | None = None,
        seed: int = 0,
    ) -> Batch:
        """A Batch of robots that are given one by one.

        Args:
            robots: an iterable of Robot or (Robot, Drive), or a function (k, random) that makes
                robot k. A generator is good for one simulation, a list or a function for any
                number.
            count: number of robots; needed where `robots` has no length.
            seed: of `random`, one generator a robot.

        Returns:
            The Batch.

        Raises:
            InputError: an argument is not what is expected.
        """
        if count is None:
            if not isinstance(robots, Sized):
                raise InputError("missing: expected how many robots there are", key="count")
            count = len(robots)
        count = whole(count, "count", 1, "expected a whole number of robots, 1 or more")
        if not callable(robots) and not isinstance(robots, Iterable):
            raise InputError(
                "expected robots, or a function (k, random) that makes one",
                key="robots",
                value=robots,
            )
        return Batch(robots, count, whole(seed, "seed", 0))

    @staticmethod
    def vary(robot: RobotLike, changes: Mapping[str, ArrayLike]) -> Batch:
        """One robot with some values varied.

        Args:
            robot: a Robot, or the path or name of a robot file.
            changes: arrays of values (B,), all of one length, by keys as in `Robot.replace`:
                {"payload.mass_kg": (B,)}; and of the loads and changes of the payload that
                `simulate` is given, counted from 1: {"load.1.force_N.2": (B,), "payload.1.at_s":
                (B,)}.

        Returns:
            A Batch of B robots.

        Raises:
            InputError: an unknown key, arrays of different lengths, or a value that is not finite.
        """
        robot = robot_of(robot)
        if not isinstance(changes, Mapping):
            raise InputError(
                "expected a dictionary of keys and values", key="changes", value=changes
            )
        columns = {
            key: np.atleast_1d(array(values, "changes", f"expected finite numbers of {key}"))
            for key, values in changes.items()
        }
        counts = {len(values) for values in columns.values()}
        if len(counts) != 1 or counts == {0}:
            raise InputError(
                "expected one or more keys with equally many values, at least one",
                key="changes",
                value=sorted(counts),
            )
        for key, values in columns.items():
            if not acts(key):
                _check_key(robot, key, values)
        return Batch(_Varied(robot, columns), counts.pop())

    @property
    def varied(self) -> dict[str, np.ndarray]:
        """The values (B,) of what `vary` varied, by key; empty for other batches."""
        return dict(self.source.columns) if isinstance(self.source, _Varied) else {}

    @property
    def base(self) -> Robot | None:
        """The robot that `vary` began with; None for other batches."""
        return self.source.robot if isinstance(self.source, _Varied) else None

    def __iter__(self) -> Iterator[Item]:
        """The robots in their order, each checked against the first one's topology."""
        first: tuple[Any, ...] | None = None
        k = -1
        for k, given in enumerate(self._given()):
            if k >= self.count:
                raise InputError(f"expected {self.count} robots, but there are more", key="robots")
            robot, drive = given if isinstance(given, tuple) and len(given) == 2 else (given, None)
            if not isinstance(robot, Robot) or not (drive is None or isinstance(drive, Drive)):
                raise InputError(
                    "expected a Robot or (Robot, Drive)", key=f"robots[{k + 1}]", value=given
                )
            shape = topology(robot)
            first = first or shape
            if shape != first:
                raise InputError(
                    "expected robots of one topology, as the first: joint types, elements, modes, "
                    "locks",
                    key=f"robots[{k + 1}]",
                    value=robot.structure,
                )
            yield robot, drive
        if k + 1 < self.count:
            raise InputError(
                f"expected {self.count} robots, but there are only {k + 1}", key="robots"
            )

    def shares(self, size: int) -> Iterator[Share]:
        """The robots in shares; those of `vary` as rows of numbers, without making them.

        Args:
            size: number of robots in a share.

        Yields:
            The shares, in the order of the robots.
        """
        source = self.source
        loaded = {key: values for key, values in self.varied.items() if acts(key)}
        own = lambda k: {key: values[k : k + size] for key, values in loaded.items()}
        if isinstance(source, _Varied) and source.quick:
            for k in range(0, self.count, size):
                part = _Varied(
                    source.robot,
                    {key: values[k : k + size] for key, values in source.columns.items()},
                )
                rows = varied(part.robot, part.of_robot, len(part))
                assert rows is not None
                groups = [(np.arange(len(part)), rows)]
                yield Share(k, part, [None] * len(part), groups, own(k))
            return
        items, first = iter(self), 0
        while some := list(islice(items, size)):
            robots = [robot for robot, _ in some]
            drives = [drive for _, drive in some]
            yield Share(first, robots, drives, _grouped(robots), own(first))
            first += len(some)

    def _given(self) -> Iterator[Any]:
        if callable(self.source):
            return (
                self.source(k, np.random.default_rng([self.seed, k])) for k in range(self.count)
            )
        return iter(self.source)


def _grouped(robots: Sequence[Robot]) -> list[tuple[np.ndarray, Rows]]:
    """The rows of robots, those of the same counts together."""
    members: dict[bytes, list[int]] = {}
    parts = [one(robot) for robot in robots]
    for k, part in enumerate(parts):
        members.setdefault(part.topology, []).append(k)
    return [(np.array(group), joined([parts[k] for k in group])) for group in members.values()]


@dataclass(frozen=True)
class _Varied(Sequence[Robot]):
    """A robot with values from columns of numbers, again and again; made when it is asked for."""

    robot: Robot
    columns: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __getitem__(self, k: Any) -> Any:
        if not -len(self) <= k < len(self):
            raise IndexError(k)
        return self.robot.replace({key: float(values[k]) for key, values in self.of_robot.items()})

    @cached_property
    def of_robot(self) -> dict[str, np.ndarray]:
        """The columns of the robot's own numbers; the others are of loads and payloads."""
        return {key: values for key, values in self.columns.items() if not acts(key)}

    @cached_property
    def quick(self) -> bool:
        """Whether rows of numbers can be made without the robots."""
        some = {key: values[:1] for key, values in self.of_robot.items()}
        plain = not self.robot.nodal and good(self.robot, self.of_robot)
        return plain and varied(self.robot, some, 1) is not None


def _check_key(robot: Robot, key: str, values: np.ndarray) -> None:
    """Refuse a key that the robot has not: none of its values is possible there."""
    first: InputError | None = None
    for value in {values[0], values[len(values) // 2], values[-1]}:
        try:
            robot.replace({key: float(value)})
            return
        except InputError as error:
            first = first or error
    if first is not None:
        raise InputError(first.expected, key=f"changes[{key!r}]", value=first.value)


def topology(robot: Robot) -> tuple[Any, ...]:
    """What robots of one batch share: a tuple (joint type, elements, modes, locked) a link, and
    whether links stiffen and slide node by node."""
    return (
        robot.stiffening,
        robot.nodal,
        *((k.joint.type, k.elements, k.modes, k.joint.locked) for k in robot.links),
    )


def digest(robot: Robot, drive: Drive | None) -> bytes:
    """16 bytes that tell this robot and drive from any other: of all numbers, to the last bit."""
    return _digest(one(robot), 0, robot, drive)


def _digest(
    rows: Rows, k: int, robot: Robot, drive: Drive | None, acting: Sequence[float] = ()
) -> bytes:
    kind = bytes([robot.stiffening + 2 * robot.nodal])
    sensors = repr([link.sensor for link in robot.links if link.sensor]).encode()
    own = kind + sensors + np.array(acting, dtype=float).tobytes()
    found = hashlib.blake2b(rows.contents(k) + own, digest_size=16)
    if drive is not None:
        segments, ranges, gains = drive.packed()
        for array in (segments, ranges, gains, drive.follows):
            found.update(np.ascontiguousarray(array).tobytes())
    return found.digest()
