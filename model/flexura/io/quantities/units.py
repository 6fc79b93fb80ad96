"""Units as loggers write them, and their SI units.

A unit is a product of symbols with prefixes and exponents: `mm`, `deg/s`, `m/s^2`, `N m`, `µs`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...errors import InputError

G = 9.80665  # m/s^2, standard gravity
TURN = 2 * np.pi

# metre, kilogram, second, ampere, kelvin, radian
Dimension = tuple[int, int, int, int, int, int]

_NAMES: dict[Dimension, str] = {
    (0, 0, 0, 0, 0, 0): "1",
    (1, 0, 0, 0, 0, 0): "m",
    (0, 1, 0, 0, 0, 0): "kg",
    (0, 0, 1, 0, 0, 0): "s",
    (0, 0, 0, 1, 0, 0): "A",
    (0, 0, 0, 0, 1, 0): "K",
    (0, 0, 0, 0, 0, 1): "rad",
    (0, 0, -1, 0, 0, 0): "Hz",
    (1, 0, -1, 0, 0, 0): "m/s",
    (1, 0, -2, 0, 0, 0): "m/s^2",
    (1, 0, -3, 0, 0, 0): "m/s^3",
    (0, 0, -1, 0, 0, 1): "rad/s",
    (0, 0, -2, 0, 0, 1): "rad/s^2",
    (1, 1, -2, 0, 0, 0): "N",
    (2, 1, -2, 0, 0, 0): "N m",
    (-1, 1, -2, 0, 0, 0): "Pa",
    (2, 1, -3, 0, 0, 0): "W",
    (2, 1, -3, -1, 0, 0): "V",
    (2, 1, -3, -2, 0, 0): "ohm",
    (0, 1, -2, -1, 0, 0): "T",
    (0, 0, 1, 1, 0, 0): "C",
    (0, 1, -2, 0, 0, 0): "N/m",
    (2, 1, -2, 0, 0, -1): "N m/rad",
    (2, 1, 0, 0, 0, 0): "kg m^2",
    (2, 0, 0, 0, 0, 0): "m^2",
}
_DIMENSIONS = {name: dimension for dimension, name in _NAMES.items()}
_DIMENSIONS["J"] = _DIMENSIONS["N m"]
_BASE = ("m", "kg", "s", "A", "K", "rad")

_PREFIXES = {
    "p": 1e-12,
    "n": 1e-9,
    "u": 1e-6,
    "m": 1e-3,
    "c": 1e-2,
    "d": 1e-1,
    "k": 1e3,
    "M": 1e6,
    "G": 1e9,
}
# Symbols that take a prefix, each with those that sensors have: "Mm" and "Grad" are something else.
_PREFIXED = {
    "m": "pnumcdk",
    "s": "pnumcd",
    "A": "pnumk",
    "K": "numcd",
    "rad": "num",
    "Hz": "umkMG",
    "N": "numcdkM",
    "Pa": "numkMG",
    "W": "pnumkMG",
    "V": "pnumk",
    "ohm": "umkMG",
    "T": "pnum",
    "C": "pnum",
    "J": "numkMG",
}
# Units that are read in two ways, in lower case, and these ways.
_AMBIGUOUS = {
    **dict.fromkeys(("grad", "grads", "grade", "grades"), ("deg", "gon")),
    **{f"ms{power}": ("m/s", "1/ms") for power in ("-1", "^-1", "**-1", "^(-1", "**(-1")},
}
# Other symbols: a number of an SI unit.
_OTHERS: dict[str, tuple[float, str]] = {
    "1": (1.0, "1"),
    "%": (1e-2, "1"),
    "percent": (1e-2, "1"),
    "permille": (1e-3, "1"),
    "ppm": (1e-6, "1"),
    "ustrain": (1e-6, "1"),
    "ue": (1e-6, "1"),
    "strain": (1.0, "1"),
    **dict.fromkeys(("count", "counts", "cts", "tick", "ticks", "LSB", "digits"), (1.0, "1")),
    **dict.fromkeys(("pulse", "pulses", "imp", "step", "steps", "-", "bool"), (1.0, "1")),
    **dict.fromkeys(("deg", "degree", "degrees", "°", "grad°"), (np.pi / 180, "rad")),
    **dict.fromkeys(("arcmin",), (np.pi / 10800, "rad")),
    **dict.fromkeys(("arcsec",), (np.pi / 648000, "rad")),
    **dict.fromkeys(("gon",), (np.pi / 200, "rad")),
    **dict.fromkeys(("rev", "revs", "turn", "turns", "revolution"), (TURN, "rad")),
    **dict.fromkeys(("revolutions", "U", "cycles", "tr"), (TURN, "rad")),
    **dict.fromkeys(("rpm", "RPM", "1/min", "U/min", "r/min"), (TURN / 60, "rad/s")),
    **dict.fromkeys(("min-1", "min^-1", "min**-1"), (TURN / 60, "rad/s")),
    **dict.fromkeys(("radian", "radians"), (1.0, "rad")),
    "mdeg": (1e-3 * np.pi / 180, "rad"),
    "dps": (np.pi / 180, "rad/s"),
    "g": (G, "m/s^2"),
    "mg": (1e-3 * G, "m/s^2"),
    "g0": (G, "m/s^2"),
    "gn": (G, "m/s^2"),
    "G": (G, "m/s^2"),
    "gram": (1e-3, "kg"),
    "kg": (1.0, "kg"),
    "kgf": (G, "N"),
    "lbf": (4.4482216152605, "N"),
    "in": (0.0254, "m"),
    "inch": (0.0254, "m"),
    "ft": (0.3048, "m"),
    "mil": (2.54e-5, "m"),
    "micron": (1e-6, "m"),
    **dict.fromkeys(("metre", "metres", "meter", "meters"), (1.0, "m")),
    **dict.fromkeys(("sec", "secs", "second", "seconds", "Sekunden"), (1.0, "s")),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), (1e-3, "s")),
    **dict.fromkeys(("usec", "microsecond", "microseconds"), (1e-6, "s")),
    **dict.fromkeys(("nsec", "nanosecond", "nanoseconds"), (1e-9, "s")),
    **dict.fromkeys(("min", "minute", "minutes"), (60.0, "s")),
    **dict.fromkeys(("h", "hour", "hours"), (3600.0, "s")),
    **dict.fromkeys(("volt", "volts", "Volt", "Volts"), (1.0, "V")),
    **dict.fromkeys(("amp", "amps", "ampere", "Amp", "Amps"), (1.0, "A")),
    **dict.fromkeys(("newton", "Newton", "newtons"), (1.0, "N")),
    **dict.fromkeys(("day", "days"), (86400.0, "s")),
    "psi": (6894.757293168, "Pa"),
    "ksi": (6894757.293168, "Pa"),
    "bar": (1e5, "Pa"),
    "mbar": (1e2, "Pa"),
    "gauss": (1e-4, "T"),
    "Ω": (1.0, "ohm"),
    "Nm": (1.0, "N m"),
    "mNm": (1e-3, "N m"),
    "cNm": (1e-2, "N m"),
    "kNm": (1e3, "N m"),
    "Ncm": (1e-2, "N m"),
    "Nmm": (1e-3, "N m"),
    **dict.fromkeys(("lbf ft", "lb-ft", "ft-lb", "lbf-ft", "ft-lbf"), (1.3558179483314, "N m")),
    **dict.fromkeys(("lbf in", "lb-in", "in-lb", "lbf-in", "in-lbf"), (0.1129848290276, "N m")),
    **dict.fromkeys(("ozf in", "oz-in", "oz in", "ozf-in"), (0.00706155181422, "N m")),
    "kgf cm": (G * 1e-2, "N m"),
    "Wh": (3600.0, "J"),
}
_CELSIUS = ("degC", "°C", "℃", "Celsius", "celsius", "deg C", "C°", "deg_C")
_FAHRENHEIT = ("degF", "°F", "deg F", "Fahrenheit", "deg_F")
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³", "-0123")
_FACTOR = re.compile(r"(.+?)\s*(?:(?:\^|\*\*)\s*\(?([+-]?\d+)\)?|(?<=[A-Za-z])([+-]?[1-4]))?")


@dataclass(frozen=True)
class Unit:
    """A unit: value in `si` = factor x value + offset."""

    si: str
    factor: float = 1.0
    offset: float = 0.0

    def to_si(self, values: np.ndarray) -> np.ndarray:
        """Convert; a division by a whole number is exact to the last digit.

        Args:
            values: (T,) in this unit.

        Returns:
            (T,) in the SI unit.
        """
        if self.factor == 1.0 and self.offset == 0.0:
            return values
        whole = round(1 / self.factor) if 0 < self.factor < 1 else 0
        exact = whole > 0 and abs(whole * self.factor - 1) < 1e-15
        scaled = values / whole if exact else values * self.factor
        return scaled + self.offset if self.offset else scaled


@lru_cache(maxsize=1000)
def unit(text: str) -> Unit | None:
    """A unit by what a logger calls it.

    Args:
        text: for example "mm", "[deg/s]", "m/s²", "degC", "%".

    Returns:
        None for a text that is no unit, or an ambiguous one.
    """
    plain = _plain(text)
    if plain in _CELSIUS:
        return Unit("K", 1.0, 273.15)
    if plain in _FAHRENHEIT:
        return Unit("K", 5 / 9, 459.67 * 5 / 9)
    if plain in _OTHERS or plain in _DIMENSIONS:
        factor, name = _OTHERS.get(plain, (1.0, plain))
        return Unit(name, factor)
    return _product(plain)


def readings(text: str) -> tuple[str, ...]:
    """The units that an ambiguous one may be.

    Args:
        text: as a logger writes it.

    Returns:
        For example "deg" and "gon" of "Grad"; none of any other text.
    """
    return _AMBIGUOUS.get(_plain(text).lower(), ())


def check_unit(text: str, key: str, file: str = "") -> None:
    """Refuse an ambiguous unit.

    Args:
        text: as a logger writes it.
        key: whose unit it is, for the message.
        file: where it stands.

    Raises:
        InputError: by what it may be.
    """
    if may := readings(text):
        expected = f"it may be {' or '.join(may)}: expected one of these"
        raise InputError(expected, key=key, value=text, file=file)


def is_unit(text: str) -> bool:
    """Whether a text is a unit, perhaps an ambiguous one.

    Args:
        text: as a logger writes it.

    Returns:
        True if it is.
    """
    return unit(text) is not None or bool(readings(text))


def _plain(text: str) -> str:
    """A unit without brackets and with the letters of ASCII."""
    plain = text.strip().strip("[]()").strip().translate(_SUPERSCRIPTS)
    return plain.replace("µ", "u").replace("μ", "u").replace("′", "'")


def _product(text: str) -> Unit | None:
    """A product and quotient of symbols; what stands behind a stroke is divided by."""
    above, *below = text.replace("·", " ").replace("⋅", " ").split("/")
    factor, dimension, symbols = 1.0, np.zeros(6, int), 0
    for sign, part in [(1, above), *((-1, part) for part in below)]:
        for token in re.split(r"(?<!\*)\*(?!\*)|\s+", part.strip(" ()")):
            if token == "" or (token == "1" and sign == 1):
                continue
            found = _symbol(token)
            if found is None:
                return None
            size, own, power = found
            factor *= size ** (sign * power)
            dimension += sign * power * np.array(own)
            symbols += 1
    if symbols == 0:
        return None
    key = tuple(int(x) for x in dimension)
    single = text.strip()
    name = "J" if single.endswith("J") and key == _DIMENSIONS["J"] else _name(key)  # type: ignore[arg-type]
    return Unit(name, factor)


def _symbol(token: str) -> tuple[float, Dimension, int] | None:
    """Size, dimension and exponent of one symbol."""
    matched = _FACTOR.fullmatch(token)
    if matched is None:
        return None
    name, power = matched[1], int(matched[2] or matched[3] or 1)
    if name in _OTHERS:
        factor, base = _OTHERS[name]
        return factor, _DIMENSIONS[base], power
    if name in _PREFIXED:
        return 1.0, _DIMENSIONS[name], power
    if name == "ms" and power != 1:  # "ms-2" is m/s^2 in the field; no sensor has another power
        return (1.0, _DIMENSIONS["m/s^2"], 1) if power == -2 else None
    if name[:1] and name[:1] in _PREFIXED.get(name[1:], ""):
        return _PREFIXES[name[0]], _DIMENSIONS[name[1:]], power
    return None


def _name(dimension: Dimension) -> str:
    """The name of an SI unit; of one without a name, its product of base units."""
    if dimension in _NAMES:
        return _NAMES[dimension]
    parts = zip(_BASE, dimension, strict=True)
    return " ".join(base if n == 1 else f"{base}^{n}" for base, n in parts if n)


def suffix(text: str) -> str:
    """A unit as the end of a column's name.

    Args:
        text: the unit.

    Returns:
        For example `m_s2` of "m/s^2".
    """
    plain = text.replace("^", "").replace("%", "percent").replace("°", "deg")
    return re.sub(r"\W+", "_", plain).strip("_") or "unit"


def converted(
    channels: Mapping[str, np.ndarray], units: Mapping[str, str]
) -> tuple[dict[str, np.ndarray], dict[str, str], dict[str, str]]:
    """Channels in SI units.

    Args:
        channels: values (T,) by name.
        units: by the same names.

    Returns:
        Channels, their SI units, and the units that were replaced. A unit that is not known stays.
    """
    values, names, replaced = dict(channels), dict(units), {}
    for name, text in units.items():
        known = unit(text)
        if known is not None and known.si != text:
            values[name] = known.to_si(np.asarray(values[name], dtype=float))
            names[name] = known.si
            replaced[name] = text
    return values, names, replaced
