"""The gains file of a controller that is designed from the robot: `type = "lqg"` or `"mpc"`.

[controller]
type = "lqg"
rate_Hz = 500.0
modes = 2                            # of each flexible link, in the design
measure = ["joint/1/position", "sensor/gauge"]
effort_1_N_m = 0.5
position_1_rad = 0.02
torque_max_1_N_m = 1.0

[controller.noise]
"joint/1/position" = 1e-4
"sensor/gauge" = 1e-6
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ...errors import InputError
from ...io import MOST_HZ, meant, write_toml
from ...robot import Robot
from ...signals import PLAUSIBLE, Signal, is_plausible
from ..linear_quadratic.lqg_design import lqg
from ..predictive import nmpc
from ..sampled import Sampled

TYPES = ("lqg", "mpc")
LEAST = 1e-12  # of a number that must be above 0
UNLIMITED = 1e12  # of a joint without a limit beside others with one [N, N m, m/s, rad/s]
# of a joint: the argument, and the units for one that turns and one that slides
JOINT = {
    "effort": ("effort", "N_m", "N"),
    "position": ("position", "rad", "m"),
    "disturbance": ("disturbance", "N_m", "N"),
    "torque_max": ("limit", "N_m", ""),
    "force_max": ("limit", "", "N"),
    "speed_max": ("speed_limit", "rad_s", "m_s"),
}
OF_ALL = {
    "deflection_m": "deflection",
    "damping_s": "damping",
    "deflection_max_m": "deflection_limit",
    "horizon_s": "horizon_s",
}
COUNTS = {"intervals": "intervals", "spread": "spread", "modes": ""}
OF_DESIGN = ("effort", "noise", "measure", "rate_Hz", "intervals", "horizon_s", "spread")
OF_MPC = ("speed_max", "deflection_max_m", "horizon_s", "intervals", "spread")
_NAME = re.compile(rf"({'|'.join(JOINT)})_([1-9])_([a-zA-Z_]+)")


@dataclass(frozen=True)
class Designed:
    """A controller's design by its settings: numbers by the names of the file, with units.

    Attributes:
        kind: "lqg" or "mpc".
        settings: rate_Hz, efforts, deviations, limits, ...
        measure: names of the measurements; None: the default of `flexura.lqg`.
        noise: standard deviations by measurement; None: 1e-4 of each.
        follow: "tips" or "joints"; None: the default of `flexura.lqg` or `flexura.nmpc`.
        file: where it was read from.
    """

    kind: str
    settings: dict[str, float]
    measure: tuple[str, ...] | None = None
    noise: dict[str, float] | None = None
    follow: str | None = None
    file: str = field(default="", compare=False)

    def sampled(self, robot: Robot, references: Sequence[Signal]) -> Sampled:
        """The controller of a robot along references.

        Args:
            robot: the robot; the design keeps `modes` of each flexible link.
            references: one Signal a joint [m or rad].

        Returns:
            A Sampled.

        Raises:
            InputError: a joint has no effort or no such unit, or as `flexura.lqg`, `flexura.nmpc`.
        """
        try:
            return self._sampled(robot, references)
        except InputError as error:
            raise error if error.file else self._of_the_file(error) from None

    def _of_the_file(self, error: InputError) -> InputError:
        """An error of `flexura.lqg` or `flexura.nmpc` with the file's key and value."""
        argument, value = error.key, error.value
        if argument == "noise" and isinstance(value, str):
            argument, value = f"noise.{value}", (self.noise or {}).get(value)
        key, _, part = argument.partition(".")
        if key not in OF_DESIGN:
            return error.in_file(self.file)
        name = f"controller.{argument}"
        if key in self.settings:
            value = self.settings[key]
        elif key in ("effort", "noise") and not part:  # no single setting is at fault
            name = "controller"
        return InputError(error.expected, key=name, value=value, file=self.file)

    def _sampled(self, robot: Robot, references: Sequence[Signal]) -> Sampled:
        given: dict[str, Any] = {
            argument: self.settings[name]
            for name, argument in OF_ALL.items()
            if name in self.settings
        }
        given |= {
            argument: int(self.settings[name])
            for name, argument in COUNTS.items()
            if argument and name in self.settings
        }
        given |= {"measure": self.measure} if self.measure is not None else {}
        given |= {"noise": self.noise} if self.noise is not None else {}
        given |= {"follow": self.follow} if self.follow is not None else {}
        links = robot.links
        free = [i for i, link in enumerate(links) if not link.joint.locked]
        for word in JOINT:
            argument = JOINT[word][0]
            found = {i: self._of_joint(word, i, links[i].joint.type == "R") for i in free}
            if all(value is None for value in found.values()):
                continue
            every = argument in ("limit", "speed_limit")
            default = UNLIMITED if every else 1.0
            had = given.get(argument, [default] * len(links if every else free))
            places = free if every else list(range(len(free)))
            for place, i in zip(places, free, strict=True):
                had[place] = found[i] if found[i] is not None else had[place]
            given[argument] = had
        for i in free:
            unit = JOINT["effort"][1 if links[i].joint.type == "R" else 2]
            if f"effort_{i + 1}_{unit}" not in self.settings:
                expected = "missing: expected the effort of every joint that is free"
                raise InputError(expected, key=f"controller.effort_{i + 1}_{unit}")
        for name in self.settings:
            if (match := _NAME.fullmatch(name)) and int(match[2]) > len(links):
                expected = f"expected joints from 1 to {len(links)}"
                raise InputError(expected, key=f"controller.{name}", value=self.settings[name])
        rate, effort = self.settings.get("rate_Hz", 500.0), given.pop("effort")
        asked = (self._model(robot), references, effort, rate)
        return lqg(*asked, **given)[0] if self.kind == "lqg" else nmpc(*asked, **given)

    def _of_joint(self, word: str, i: int, turns: bool) -> float | None:
        """A joint's setting, None if the file has none. Raises InputError for another unit."""
        unit = JOINT[word][1 if turns else 2]
        out = None
        for name, value in self.settings.items():
            match = _NAME.fullmatch(name)
            if match and match[1] == word and int(match[2]) == i + 1:
                if match[3] == unit:
                    out = value
                    continue
                fit = JOINT["force_max" if word == "torque_max" and not turns else word][
                    1 if turns else 2
                ]
                expected = f"expected the unit of a joint that {'turns' if turns else 'slides'}"
                expected += f", {fit}" if fit else ""
                raise InputError(expected, key=f"controller.{name}", value=value)
        return out

    def _model(self, robot: Robot) -> Robot:
        """The robot of the design."""
        modes, data = int(self.settings.get("modes", 0)), robot.to_dict()
        for table, link in zip(data["link"], robot.links, strict=True):
            if modes and link.flexible:
                table["modes"] = min(modes, link.modes or 2 * link.elements)
        return Robot.from_dict(data)

    def limits(self, joints: int) -> list[float]:
        """The limits of the forces.

        Args:
            joints: how many the robot has.

        Returns:
            One a joint, infinite where there is none [N or N m].
        """
        out = [float("inf")] * joints
        for name, value in self.settings.items():
            match = _NAME.fullmatch(name)
            if match and JOINT[match[1]][0] == "limit" and int(match[2]) <= joints:
                out[int(match[2]) - 1] = value
        return out

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file.

        Args:
            path: where to; a file there is replaced as a whole.
        """
        write_toml(path, {"controller": self.table()})

    def table(self) -> dict[str, Any]:
        """The file's table [controller]."""
        table: dict[str, Any] = {"type": self.kind}
        for name, value in self.settings.items():
            table[name] = int(value) if name in COUNTS else value
        table |= {"follow": self.follow} if self.follow is not None else {}
        table |= {"measure": list(self.measure)} if self.measure is not None else {}
        table |= {"noise": self.noise} if self.noise is not None else {}
        return table


def design_setting(name: str, kind: str = "mpc") -> bool:
    """Whether a gains file of a designed controller may have a number of this name.

    Args:
        name: a key of the table [controller].
        kind: "lqg" or "mpc".

    Returns:
        True if it may.
    """
    match = _NAME.fullmatch(name)
    known = name == "rate_Hz" or name in OF_ALL or name in COUNTS
    known = known or bool(match and match[3] in JOINT[match[1]][1:])
    return known and (kind == "mpc" or not (name in OF_MPC or name.startswith("speed_max")))


def read_design(data: dict[str, Any], file: str) -> Designed:
    """The design of a gains file with a type.

    Args:
        data: the file's tables.
        file: its name.

    Raises:
        InputError: it names key, value and what was expected.
    """
    for key in data:
        if key != "controller":
            expected = "an unknown key of a designed controller; known here: controller"
            raise InputError(expected, key=key, value=data[key])
    table = dict(data["controller"])
    kind = table.pop("type")
    if kind not in TYPES:
        raise InputError(f"expected one of {', '.join(TYPES)}", key="controller.type", value=kind)
    follow, measure, noise = (table.pop(name, None) for name in ("follow", "measure", "noise"))
    if follow not in (None, "tips", "joints"):
        raise InputError("expected tips or joints", key="controller.follow", value=follow)
    if measure is not None and not (
        isinstance(measure, list) and measure and all(isinstance(x, str) for x in measure)
    ):
        expected = "expected names of measurements, as joint/1/position or sensor/NAME"
        raise InputError(expected, key="controller.measure", value=measure)
    if noise is not None and not isinstance(noise, dict):
        expected = "expected a table [controller.noise] of standard deviations by measurement"
        raise InputError(expected, key="controller.noise", value=noise)
    for name, value in (noise or {}).items():
        if not (is_plausible(value) and value >= LEAST):
            expected = "expected a number from 1e-12 to 1e12"
            raise InputError(expected, key=f"controller.noise.{name}", value=value)
    for name, value in table.items():
        _check_setting(name, value, kind)
    numbers = {name: float(value) for name, value in table.items()}
    spread = {name: float(value) for name, value in noise.items()} if noise is not None else None
    return Designed(
        kind, numbers, None if measure is None else tuple(measure), spread, follow, file
    )


def _check_setting(name: str, value: Any, kind: str) -> None:
    key = f"controller.{name}"
    if not design_setting(name, kind):
        words = [f"{w}_1_{u}" for w, (_, *units) in JOINT.items() for u in units if u]
        known = [*words, *OF_ALL, *COUNTS, "rate_Hz"]
        near = meant(name, [each for each in known if design_setting(each, kind)])
        hint = f"; did you mean {near}?" if near else ""
        raise InputError(f'an unknown setting of type = "{kind}"{hint}', key=key, value=value)
    if not is_plausible(value):
        raise InputError(f"expected {PLAUSIBLE}", key=key, value=value)
    if name in COUNTS and (isinstance(value, float) or value < (0 if name == "modes" else 1)):
        raise InputError("expected a whole number", key=key, value=value)
    if name != "damping_s" and name not in COUNTS and not value >= LEAST:
        raise InputError("expected a number from 1e-12 to 1e12", key=key, value=value)
    if name == "rate_Hz" and not value <= MOST_HZ:
        raise InputError("expected a rate of at most 1e6 Hz", key=key, value=value)
    if name == "damping_s" and value < 0:
        raise InputError("expected a number of 0 or more", key=key, value=value)
