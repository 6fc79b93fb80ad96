"""Heads of columns: what is measured, and in which unit."""

from __future__ import annotations

import re

from ..quantities import CHANNELS, is_unit

_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]\s*")
_WORD = re.compile(r"(.*\S)\s+(?:in|/)\s+(\S+)")
_STROKE = re.compile(r"(.*[^\s/])\s*/\s*(\S+)")
# The end of a name that a program gives a column in a unit: `time_ms`, `joint/1/position_rad`.
_TAILS = tuple(
    (f"_{text.replace('^', '').replace('/', '_').replace(' ', '_')}", text)
    for text in (
        *(
            "rad/s^2",
            "deg/s^2",
            "mm/s^2",
            "m/s^2",
            "rad/s",
            "deg/s",
            "mm/s",
            "m/s",
            "N m",
            "kg m^2",
        ),
        *("mm", "um", "cm", "m", "deg", "mrad", "rad", "rev", "rpm", "ms", "us", "ns", "s", "sec"),
        *("mV", "V", "mA", "A", "mN", "kN", "N", "Nm", "J", "Hz", "degC", "K", "percent", "counts"),
        *("g", "kg", "Pa", "bar", "W", "1"),
    )
)
_NUMBERED = re.compile(r"(joint|link)[_/. ](\d+)[_/. ](?:deflection[_/. ](\d+)|(\w+))")
_PAIR = re.compile(r"(tip|energy|sensor)[_/. ](\w+)")
TIMES = ("time", "t", "zeit", "temps", "tiempo", "tempo", "timestamp", "x_value", "elapsed", "tout")


def parted(head: str) -> tuple[str, str]:
    """A head as name and unit: "Time [s]" is ("Time", "s"); the unit is "" if none is said."""
    plain = " ".join(head.split())
    if (found := _BRACKETS.fullmatch(plain)) and found[1]:
        return found[1], found[2]
    for pattern in (_WORD, _STROKE):
        found = pattern.fullmatch(plain)
        if found and known(plain) == "" and is_unit(found[2]):
            return found[1], found[2]
    for tail, text in _TAILS:
        if plain.endswith(tail) and len(plain) > len(tail):
            return plain.removesuffix(tail), text
    return plain, ""


def known(name: str) -> str:
    """The channel that a name stands for, or "": `joint_1_position` is joint/1/position."""
    plain = name.strip().strip("/")
    if any(channel.fits(plain) for channel in CHANNELS):
        return plain
    if found := _NUMBERED.fullmatch(plain):
        kind, number, station, rest = found.groups()
        spelt = f"{kind}/{number}/" + (f"deflection/{station}" if station else rest)
    elif found := _PAIR.fullmatch(plain):
        spelt = f"{found[1]}/{found[2]}"
    else:
        return ""
    return spelt if any(channel.fits(spelt) for channel in CHANNELS) else ""


def sensor(name: str) -> str:
    """The channel of a column that has no other."""
    return f"sensor/{re.sub(r'[^0-9A-Za-z_./-]+', '_', name).strip('_/') or 'column'}"
