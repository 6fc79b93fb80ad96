"""What can be fitted: numbers of the robot file, and what a channel does to a quantity.

A number of the robot has its key as in `Robot.replace`: `payload.mass_kg`. A channel has

    CHANNEL.gain         reading of a unit of the simulated quantity; of an input force by reading
    CHANNEL.offset       added to the reading
    CHANNEL.delay_s      how much later than the quantity the channel is
    CHANNEL.cutoff_Hz    of a low-pass filter of second order before the reading
    CHANNEL.cutoff_ratio its damping ratio

for example `sensor/strain_gauge.gain`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import flexura as fx
from flexura.robot import BOUNDS, Bounds

from ..estimate import Parameter

WIDEST = 20.0  # a value is sought between the first one's 20th part and its twentyfold
STEP = 1e-3  # of a value, for differences
COUNTS = ("elements", "modes", "format")  # whole numbers of a robot file
OF_CHANNELS = {
    "gain": Bounds(0, math.inf, signed=True),
    "offset": Bounds(0, math.inf, signed=True),
    "delay_s": Bounds(0, 1.0, signed=True),
    "cutoff_Hz": Bounds(1e-6, 1e6),
    "cutoff_ratio": Bounds(1e-3, 100),
}
CUTOFF_RATIO = math.sqrt(0.5)  # of a filter whose ratio is not given
# how a key's end reads as a unit, the longest end first
ENDS = {
    "N_m_s_rad": "N m s/rad",
    "N_m_rad": "N m/rad",
    "N_s_m": "N s/m",
    "N_m2": "N m^2",
    "kg_m2": "kg m^2",
    "kg_m3": "kg/m^3",
    "kg_m": "kg/m",
    "m_s2": "m/s^2",
    "N_m": "N m",
    "1_s": "1/s",
    "m4": "m^4",
    "m2": "m^2",
    "Pa": "Pa",
    "kg": "kg",
    "rad": "rad",
    "Hz": "Hz",
    "N": "N",
    "m": "m",
    "s": "s",
}


@dataclass(frozen=True)
class Unknown:
    """One quantity to fit.

    `file`: its value in the robot file, or what a channel does by itself. `channel`, `what`: of a
    channel; empty for the robot's. `least`: below it the value is 0.
    """

    parameter: Parameter
    unit: str
    file: float
    channel: str = ""
    what: str = ""
    least: float = -math.inf

    def physical(self, scaled: float) -> float:
        """The value in its unit, from the search's."""
        value = self.parameter.to_physical(scaled)
        return value if value >= self.least else 0.0

    @property
    def name(self) -> str:
        """Its key."""
        return self.parameter.name

    @property
    def stiffness(self) -> bool:
        """Whether frequencies rise with it: the search begins on a grid of these."""
        last = self.name.rpartition(".")[2]
        return not self.channel and ("stiffness" in last or last == "young_modulus_Pa")


def of_channel(key: str) -> tuple[str, str]:
    """The channel of a key and what is meant of it; two empty texts for a robot's key."""
    channel, _, what = key.rpartition(".")
    return (channel, what) if what in OF_CHANNELS and "/" in channel else ("", "")


def assigned(text: str, option: str) -> tuple[str, float | None]:
    """Key and value of KEY=VALUE; None without a value.

    Raises:
        InputError: the value is no finite number.
    """
    key, equals, value = text.partition("=")
    if not equals:
        return key.strip(), None
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise fx.InputError("expected KEY=VALUE with a finite number", key=option, value=text)
    return key.strip(), number


def unknown_of_robot(robot: fx.Robot, key: str, start: float | None) -> Unknown:
    """A number of the robot file.

    Args:
        robot: the robot.
        key: as in `Robot.replace`.
        start: where the search begins; None: the file's value.

    Raises:
        InputError: no such number, or one that gives the search nothing to begin with.
    """
    name = next((part for part in reversed(key.split(".")) if not part.isdigit()), key)
    if name in COUNTS:
        raise fx.InputError(
            f"expected a quantity: {name} is a count, which a robot file has and no run tells",
            key=key,
        )
    # a table that the file does not have, as a transmission, is new
    value = (robot if start is None else robot.replace({key: start})).value(key)
    bounds = BOUNDS.get(name, Bounds(1e-12, 1e15))
    try:
        file = robot.value(key)
    except fx.InputError:
        file = math.nan
    if bounds.signed:
        size = max(abs(value), 0.05)
        edges = (max(-10 * size, -bounds.high), min(10 * size, bounds.high))
        parameter = Parameter(key, value, STEP * size, edges, factor=False)
    elif value <= 0:
        raise fx.InputError(
            f"the file says 0: expected a value to begin with, as {key}=0.001", key=key
        )
    elif name in ("ratio", "ratios") or (bounds.zero and "stiffness" not in name):
        least = 0.0 if bounds.zero else bounds.low  # a link may have next to no damping
        edges = (least, min(WIDEST * value, bounds.high))
        parameter = Parameter(key, value, STEP * value, edges, factor=False)
    else:
        edges = (max(value / WIDEST, bounds.low, 1e-300), min(WIDEST * value, bounds.high))
        parameter = Parameter(key, value, STEP, edges)
    robot.replace({key: value * (1 + STEP)})
    return Unknown(parameter, unit_of(name), file, least=-math.inf if bounds.signed else bounds.low)


def unknown_of_channel(key: str, start: float | None, unit: str, size: float, own: str) -> Unknown:
    """What a channel does to its quantity.

    Args:
        key: CHANNEL.WHAT.
        start: where the search begins; None: what a plain channel does.
        unit: of the channel.
        size: how far its values go.
        own: unit of the simulated quantity.

    Raises:
        InputError: the search has nothing to begin with.
    """
    channel, what = of_channel(key)
    plain = {"gain": 1.0, "offset": 0.0, "delay_s": 0.0, "cutoff_ratio": CUTOFF_RATIO}
    value = plain.get(what) if start is None else start
    if value is None or (what == "gain" and start is None and unit != own):
        raise fx.InputError(f"expected a value to begin with, as {key}=1", key=key)
    file = plain.get(what, math.nan)
    if what in ("cutoff_Hz", "cutoff_ratio"):
        if value <= 0:
            raise fx.InputError("expected a value above 0", key=key, value=value)
        parameter = Parameter(key, value, STEP, (value / WIDEST, value * WIDEST))
        return Unknown(parameter, "Hz" if what == "cutoff_Hz" else "1", file, channel, what)
    scale = {"gain": abs(value) or 1.0, "offset": size, "delay_s": 0.01}[what]
    reach = {"gain": WIDEST, "offset": 10.0, "delay_s": 50.0}[what] * scale
    edges = (value - reach, value + reach)
    # the reading is linear in gain and offset
    parameter = Parameter(key, value, STEP * scale, edges, factor=False)
    gain = "1" if unit == own else f"({unit})/({own})"
    units = {"gain": gain, "offset": unit, "delay_s": "s"}
    return Unknown(parameter, units[what], file, channel, what)


def unit_of(name: str) -> str:
    """The unit at the end of a key; "1" for none."""
    if name.startswith("stiffness_") and name.endswith("_N_m"):
        return "N/m"
    return next((unit for end, unit in ENDS.items() if name.endswith(f"_{end}")), "1")


def check_once(keys: Mapping[str, object] | list[str], option: str) -> None:
    """Raises InputError for a key that is given twice."""
    every = list(keys)
    twice = next((key for key in every if every.count(key) > 1), None)
    if twice:
        raise fx.InputError("expected each key once", key=option, value=twice)
