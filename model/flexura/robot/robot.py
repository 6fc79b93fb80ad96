"""The robot: a frozen, validated description in SI units, read from and written to a TOML file.

Every key carries its unit. Whatever is absurd (a modulus in GPa, a negative mass, an unknown key)
is refused with the file, the key, the value and what was expected. `docs/reference` has
every key.
"""

from __future__ import annotations

import logging
import os
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationError, model_validator

from ..errors import InputError, WrongValue
from ..io import (
    FORMAT,
    Tables,
    changed,
    check_format,
    explain,
    find,
    index_of,
    path_of,
    read_toml,
    refuse_taken,
    summary,
    write_toml,
)
from ..io.quantities import note_turns
from .damping import rayleigh
from .joint import KEYS, key_of
from .link import LEAST_FREE, Link
from .old_keys import renamed
from .payload import Payload
from .suitability import check_masses, check_stretch
from .table import BOUNDS, Table, name

MAX_LINKS = 256
_log = logging.getLogger("flexura")


class Robot(Table):
    """A serial planar chain of rigid and flexible links with joints R, Pa and Pb. Frozen; SI
    units."""

    name: str = name("the robot's")
    gravity_m_s2: tuple[float, float] = Field(
        (0.0, 0.0),
        strict=False,
        description="gravity in the base frame, two numbers [x, y] in m/s^2, y up, "
        f"{BOUNDS['gravity_m_s2']}",
    )
    stiffening: bool = Field(True, description="true, or false for the dissertation's linear model")
    sliding: Literal["continuous", "nodal"] = Field(
        "continuous",
        description='"continuous" or "nodal", the dissertation\'s node-by-node Pa and Pb',
    )
    link: list[Link] = Field(
        min_length=1, max_length=MAX_LINKS, description=f"1 to {MAX_LINKS} tables [[link]]"
    )
    payload: Payload = Field(
        default_factory=Payload,
        description="a table { mass_kg, inertia_kg_m2, centre_of_mass_m }",
    )
    format: int = Field(
        FORMAT, ge=1, le=FORMAT, description=f"the file's format, a whole number up to {FORMAT}"
    )

    @model_validator(mode="after")
    def _starts_on_its_links(self) -> Robot:
        for i, link in enumerate(self.link):
            low, high = self.travel(i)
            joint, key = link.joint, f"link[{i + 1}].joint"
            where = (
                f"between {low:g} and {high:g} m, the ends of link "
                f"{i if joint.type == 'Pa' else i + 1}"
            )
            if joint.type == "Pa" and low == high:
                raise WrongValue(
                    f"link[{i}].length_m",
                    0.0,
                    f"a length above 0: link {i + 1} slides on this link",
                )
            if not low <= joint.start <= high:
                free = "the free length at the start, " if joint.type == "Pb" else "a start "
                raise WrongValue(f"{key}.{joint.key('start')}", joint.start, free + where)
            if joint.limits is not None and not (
                low <= joint.limits[0] and joint.limits[1] <= high
            ):
                raise WrongValue(
                    f"{key}.{joint.key('limits')}", list(joint.limits), f"limits {where}"
                )
            if joint.type == "Pa" and i > 0 and self.link[i - 1].joint.type == "Pb":
                exit_m = self.link[i - 1].length_m - self.link[i - 1].joint.start
                if joint.start < exit_m:
                    ahead = f"a start ahead of the sleeve of link {i}, at {exit_m:g} m or more"
                    raise WrongValue(f"{key}.{joint.key('start')}", joint.start, ahead)
        return self

    @model_validator(mode="after")
    def _says_turns(self) -> Robot:
        for i, link in enumerate(self.link, 1):
            joint = link.joint
            if joint.type == "R":
                note_turns(f"link[{i}].joint.start_rad", joint.start)
                note_turns(f"link[{i}].joint.limits_rad", *(joint.limits or (0.0,)))
                note_turns(f"link[{i}].joint.spring.rest_rad", joint.spring_rest)
        return self

    @model_validator(mode="after")
    def _suits(self) -> Robot:
        check_masses(self.link, self.payload)
        check_stretch(self.link, self.payload, self.gravity_m_s2)
        for i, link in enumerate(self.link):
            if link.damping.by_ratio and not link.flexible:
                key = "ratio" if link.damping.ratios is None else "ratios"
                where = f"link[{i + 1}].damping.{key}"
                value = getattr(link.damping, key)
                raise WrongValue(where, value, "none: a rigid link has no modes")
            try:
                self.rayleigh(i)
            except WrongValue as error:
                where = f"link[{i + 1}].{error.key}"
                raise WrongValue(where, error.value, error.expected) from None
        return self

    @model_validator(mode="after")
    def _sensors(self) -> Robot:
        seen: set[str] = set()
        for i, link in enumerate(self.link, 1):
            for k, sensor in enumerate(link.sensor, 1):
                key = f"link[{i}].sensor[{k}].name"
                if sensor.name in seen:
                    raise WrongValue(key, sensor.name, "another name for each sensor of the robot")
                if self.nodal:
                    expected = 'none: a robot with sliding = "nodal" has no sensors'
                    raise WrongValue(key, sensor.name, expected)
                seen.add(sensor.name)
        return self

    @model_validator(mode="after")
    def _whole_meshes(self) -> Robot:
        if self.sliding == "nodal":
            for i, link in enumerate(self.link):
                slides = link.joint.type == "Pb" or (i + 1 < len(self.link) and self.rides(i + 1))
                if link.modes is not None and slides:
                    raise WrongValue(
                        f"link[{i + 1}].modes",
                        link.modes,
                        'absent with sliding = "nodal", which goes by its nodes',
                    )
        return self

    def rayleigh(self, i: int) -> tuple[float, float]:
        """The damping of a link, D = alpha M + beta K (26).

        Args:
            i: number of the link, from 0.

        Returns:
            alpha [1/s] and beta [s], given or by damping ratios.
        """
        return rayleigh(self.link[i], self.payload if i + 1 == len(self.link) else None)

    def rides(self, i: int) -> bool:
        """Whether a joint slides along a flexible link.

        Args:
            i: number of the joint, from 0.

        Returns:
            True for a Pa whose link before is flexible.
        """
        return i > 0 and self.link[i].joint.type == "Pa" and self.link[i - 1].flexible

    @property
    def nodal(self) -> bool:
        """Whether something slides node by node: `sliding`, and a flexible link in a sleeve or
        under a slider."""
        sleeved = any(link.joint.type == "Pb" and link.flexible for link in self.link)
        return self.sliding == "nodal" and (
            sleeved or any(self.rides(i) for i in range(len(self.link)))
        )

    def travel(self, i: int) -> tuple[float, float]:
        """How far a joint can go on its links.

        Args:
            i: number of the joint, from 0.

        Returns:
            The lowest and the highest position [m]; infinite for R and for a Pa on the base.
        """
        link = self.link[i]
        if link.joint.type == "Pb":
            return (LEAST_FREE * link.length_m if link.flexible else 0.0), link.length_m
        if link.joint.type == "Pa" and i > 0:
            return 0.0, self.link[i - 1].length_m
        return -np.inf, np.inf

    @property
    def links(self) -> list[Link]:
        """The links, from the base outwards."""
        return self.link

    @property
    def structure(self) -> str:
        """The joint types from the base outwards, for example "PaR"."""
        return "".join(link.joint.type for link in self.link)

    @property
    def start(self) -> np.ndarray:
        """Joint positions at the start, (links,) in m or rad."""
        return np.array([link.joint.start for link in self.link])

    @classmethod
    def from_dict(cls, data: Tables, *, file: str = "") -> Robot:
        """A robot from the tables of a robot file.

        Keys of 0.1 without a unit, as `start`, are read as those of today, and the logger "flexura"
        names the new ones.

        Args:
            data: the tables.
            file: name of their file, for messages.

        Returns:
            The Robot.

        Raises:
            InputError: a wrong value; it names file, key, value and what was expected.
        """
        if isinstance(data, dict):
            check_format(data, file)
        elif not isinstance(data, cls):
            expected = "expected the tables of a robot file"
            raise InputError(expected, key="data", value=data, file=file)
        data, old = renamed(data)
        if old:
            keys = ", ".join(f"{each.path} is {each.new}" for each in old)
            how = f"; to rename them: flexura migrate {file}" if file else ""
            _log.warning("%skeys of 0.1: %s now%s", f"{file}: " if file else "", keys, how)
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise explain(error, cls, data, file) from None

    def __repr__(self) -> str:
        return summary.text(*self._summary())

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        return summary.html(*self._summary())

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        x, y = self.gravity_m_s2
        rows = [("payload", f"{self.payload.mass_kg:g} kg"), ("gravity", f"({x:g}, {y:g}) m/s^2")]
        if not self.stiffening:
            rows.append(("model", "linear, without stiffening"))
        for i, link in enumerate(self.links, 1):
            kind = f"flexible, {link.elements} elements" if link.flexible else "rigid"
            modes = f", {link.modes} modes" if link.modes else ""
            name = f" ({link.name})" if link.name else ""
            rows.append(
                (f"link {i}", f"{link.joint.type}, {link.length_m:g} m, {kind}{modes}{name}")
            )
        return f"Robot: {self.name or 'without a name'}, {self.structure}", rows

    def to_dict(self) -> Tables:
        """The tables of a robot file, without the keys that have their default value."""
        return self.model_dump(mode="json", exclude_defaults=True, exclude_none=True)

    def replace(self, changes: Tables) -> Robot:
        """A robot with some values changed.

        Args:
            changes: values by key, links counted from 1: {"payload.mass_kg": 0.1,
                "link.2.length_m": 0.4}. "joint.2." is short for "link.2.joint.".

        Returns:
            The new Robot; this one stays.

        Raises:
            InputError: an unknown key, or a wrong value.
        """
        if not isinstance(changes, dict):
            raise InputError("expected values by key", key="changes", value=changes)
        changes = {self._todays_path(path, changes): value for path, value in changes.items()}
        # says what is wrong in a file's words
        try:
            return Robot.model_validate(changed(self, changes))
        except ValidationError:
            return Robot.from_dict(changed(self.to_dict(), changes))

    def value(self, key: str) -> float:
        """One number of the robot.

        Args:
            key: as in `replace`, for example "payload.mass_kg".

        Returns:
            The value, in the unit of the key.

        Raises:
            InputError: the robot has no number there.
        """
        found: Any = self
        for part in self._todays_path(key, {}).split("."):
            try:
                found = (
                    found[index_of(found, part, key)]
                    if isinstance(found, list | tuple)
                    else getattr(found, part)
                )
            except (AttributeError, InputError):
                found = None
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise InputError(
                "expected the key of a number that the robot has, as payload.mass_kg", key=key
            )
        return float(found)

    def _todays_path(self, path: str, changes: Tables) -> str:
        """`link.2.joint.start_rad` of `link.2.joint.start` and of `joint.2.start`; any other path
        as it is."""
        if not isinstance(path, str):
            expected = "expected the key of a value, as payload.mass_kg"
            raise InputError(expected, key="key", value=path)
        if path.startswith("joint."):
            path = ".".join(["link", *path.split(".")[1:2], "joint", *path.split(".")[2:]])
        parts = path.split(".")
        if len(parts) != 4 or parts[0] != "link" or parts[2] != "joint" or parts[3] not in KEYS:
            return path
        number = index_of(self.link, parts[1], path)
        kind = changes.get(f"link.{parts[1]}.joint.type", self.link[number].joint.type)
        return ".".join([*parts[:3], key_of(parts[3], kind)])


def load(path: str | os.PathLike[str]) -> Robot:
    """Read a robot file (TOML).

    Args:
        path: the file's path, or the name of a robot that comes with flexura, for example "rig".

    Returns:
        The Robot.

    Raises:
        InputError: no such file or robot, or a wrong value; it names file, key, value and what was
            expected.
    """
    found = find(path, "robots")
    data = read_toml(found)
    if "link" not in data and "duration_s" in data:
        raise InputError("a manoeuvre file: expected a robot file", file=os.fspath(found))
    return Robot.from_dict(data, file=os.fspath(found))


def robot_of(robot: Any, key: str = "robot") -> Robot:
    """The Robot of what a function was given.

    Args:
        robot: a Robot, the path or name of a robot file, or a System.
        key: name of the argument.

    Returns:
        The Robot.

    Raises:
        InputError: it is something else, or the file is wrong.
    """
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, str | os.PathLike):
        return load(robot)
    described = None if isinstance(robot, type) else getattr(robot, "robot", None)
    if isinstance(described, Robot):
        return described
    expected = "expected a Robot, a System, or the path or name of a robot file"
    raise InputError(expected, key=key, value=robot)


def save(robot: Robot, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a robot file (TOML) that `load` reads back to an equal robot.

    Args:
        robot: the robot, or a System of it.
        path: where to.
        overwrite: whether a file that is there already may be replaced, as a whole.

    Raises:
        InputError: a file is there already, its name does not end with .toml, or it cannot be
            written.
    """
    described, target = robot_of(robot), path_of(path, "path")
    if not overwrite:
        refuse_taken(target)
    write_toml(target, {"format": FORMAT} | described.to_dict(), new=not overwrite)
