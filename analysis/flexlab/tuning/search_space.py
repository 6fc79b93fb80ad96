"""The free settings of a controller, their bounds, and gains at points of the unit cube.

[free]
kp_1_V_m = [100, 20000]                                   # one sign: logarithmic scale
kg_2_rad_m = { low = -2, high = 2, scale = "linear" }     # through 0: linear
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import (
    DEFLECTION,
    DERIVATIVE,
    GAINS,
    LIMIT,
    NAMES,
    OBSERVER,
    SETPOINT,
    SLEW,
    Gains,
    design_setting,
    filter_coefficient,
)
from flexura.errors import InputError
from flexura.io import meant, read_toml
from flexura.signals import is_finite

COLUMNS = {name: k for k, name in enumerate(GAINS)} | {
    "limit": LIMIT,
    "slew": SLEW,
    "setpoint_Hz": SETPOINT,
    "observer_Hz": OBSERVER,
}
_JOINT_FILTERS = {"setpoint_Hz": 1, "observer_Hz": 2}  # ticks between their steps
_FILTERS = {"derivative_Hz": DERIVATIVE, "deflection_Hz": DEFLECTION}  # of all joints
SCALES = ("log", "linear")


@dataclass(frozen=True)
class FreeGain:
    """A free setting, by its name in a gains file, with its bounds in the file's unit."""

    name: str
    low: float
    high: float
    scale: str

    def from_unit_interval(self, u: np.ndarray) -> np.ndarray:
        """The setting at places u (B,) between 0 and 1.

        low + (high - low) u, or low (high / low)^u on a logarithmic scale.
        """
        u = np.clip(u, 0.0, 1.0)
        if self.scale == "linear":
            return self.low + (self.high - self.low) * u
        return self.low * (self.high / self.low) ** u

    def to_unit_interval(self, value: float) -> float:
        """Place of a value between its bounds, 0 to 1; the nearer bound if it is outside."""
        if self.scale == "linear":
            return float(np.clip((value - self.low) / (self.high - self.low), 0.0, 1.0))
        ratio = value / self.low
        return (
            0.0
            if ratio <= 0
            else float(np.clip(np.log(ratio) / np.log(self.high / self.low), 0.0, 1.0))
        )


def free_gain(name: str, low: Any, high: Any, scale: str | None = None) -> FreeGain:
    """A free setting.

    Args:
        name: as in a gains file.
        low: lower bound, in the file's unit.
        high: upper bound.
        scale: "log" or "linear"; by default logarithmic, unless 0 lies between the bounds.

    Raises:
        InputError: the name is unknown, or the bounds do not fit.
    """
    if name not in NAMES and name not in _FILTERS and not design_setting(name):
        near = meant(name, [*NAMES, *_FILTERS])
        hint = f"did you mean {near}?" if near else "for example kp_1_N_m_rad"
        expected = f"expected a setting of a gains file; {hint}"
        raise InputError(expected, key=f"free.{name}", value=name)
    if not (is_finite(low) and is_finite(high) and low < high):
        raise InputError(
            "expected two finite numbers, LOW below HIGH", key=f"free.{name}", value=[low, high]
        )
    if scale not in (None, *SCALES):
        raise InputError("expected log or linear", key=f"free.{name}.scale", value=scale)
    if scale == "log" and low * high <= 0:
        expected = "expected bounds of one sign and without 0 for a logarithmic scale"
        raise InputError(expected, key=f"free.{name}", value=[low, high])
    if any(field in ("delay_s", "encoder") for _, _, field in NAMES.get(name, ())):
        raise InputError("expected a gain, a limit or a filter", key=f"free.{name}", value=name)
    return FreeGain(name, float(low), float(high), scale or ("log" if low * high > 0 else "linear"))


def read(path: Path) -> list[FreeGain]:
    """Read the table [free] of a TOML file.

    Raises:
        InputError: names file, key, value and what was expected.
    """
    data = read_toml(path)
    try:
        for key in data:
            if key != "free":
                raise InputError("an unknown key; known here: free", key=key, value=data[key])
        table = data.get("free")
        if not isinstance(table, dict) or not table:
            raise InputError("missing: expected a table [free] of bounds", key="free", value=table)
        return [_entry(name, entry) for name, entry in table.items()]
    except InputError as error:
        raise error.in_file(str(path)) from None


def _entry(name: str, entry: Any) -> FreeGain:
    if isinstance(entry, list) and len(entry) == 2:
        return free_gain(name, entry[0], entry[1])
    if isinstance(entry, dict) and {"low", "high"} <= set(entry) <= {"low", "high", "scale"}:
        return free_gain(name, entry["low"], entry["high"], entry.get("scale"))
    expected = "expected [low, high] or { low, high, scale }"
    raise InputError(expected, key=f"free.{name}", value=entry)


def from_option(text: str) -> FreeGain:
    """A free setting from NAME=LOW:HIGH of the command line.

    Raises:
        InputError: the text has another form.
    """
    name, _, bounds = text.partition("=")
    try:
        low, high = map(float, bounds.split(":"))
    except ValueError:
        raise InputError(
            "expected NAME=LOW:HIGH, for example kp_1_V_m=100:20000", key="--free", value=text
        ) from None
    return free_gain(name.strip(), low, high)


def default_bounds(gains: Gains) -> list[FreeGain]:
    """Every gain of a file that is not 0, from a tenth to ten times its value."""
    out = []
    for name, value in gains.settings.items():
        if value != 0.0 and name in NAMES and NAMES[name][0][2] in GAINS:
            out.append(free_gain(name, min(value / 10, value * 10), max(value / 10, value * 10)))
    return out


def settings(free_gains: Sequence[FreeGain], points: np.ndarray) -> np.ndarray:
    """Values (B, d) of the free settings at points (B, d) of the unit cube."""
    return np.column_stack([f.from_unit_interval(points[:, k]) for k, f in enumerate(free_gains)])


def named(free_gains: Sequence[FreeGain], values: np.ndarray) -> dict[str, float]:
    """The values (d,) by the names of the free settings."""
    return {f.name: float(v) for f, v in zip(free_gains, values, strict=True)}


AT_BOUND = 0.005  # of the range, on its scale: nearer counts as at the bound


def at_bounds(free_gains: Sequence[FreeGain], values: Mapping[str, float]) -> list[str]:
    """A sentence for each setting whose value is at a bound of its range."""
    out = []
    for f in free_gains:
        place = f.to_unit_interval(values[f.name])
        for bound, word, near in ((f.low, "lower", place), (f.high, "upper", 1.0 - place)):
            if near <= AT_BOUND:
                out.append(
                    f"{f.name} is at its {word} bound, {bound:g}: a wider range may give a better "
                    "result"
                )
    return out


def rows(
    free_gains: Sequence[FreeGain], values: np.ndarray, controller: fx.Controller, base: np.ndarray
) -> np.ndarray:
    """Rows of `Controller.gains` with free settings.

    Args:
        free_gains: the free settings.
        values: their values (B, d).
        controller: the controller.
        base: its own gains (N, 23).

    Returns:
        (B, N, 23).
    """
    out, period = np.repeat(base[None], len(values), axis=0), 1 / controller.rate_Hz
    for k, f in enumerate(free_gains):
        column = values[:, k]
        if f.name in _FILTERS:
            smooth = [
                filter_coefficient(v, period * (2 if f.name == "deflection_Hz" else 1))
                for v in column
            ]
            out[:, :, _FILTERS[f.name]] = np.array(smooth)[:, None]
            continue
        i, _, field = NAMES[f.name][0]
        out[:, i, COLUMNS[field]] = (
            [filter_coefficient(v, _JOINT_FILTERS[field] * period) for v in column]
            if field in _JOINT_FILTERS
            else column
        )
    return out


def check(free_gains: Sequence[FreeGain], gains: Gains) -> None:
    """Check free settings against a controller.

    Raises:
        InputError: a setting is not one of its joints and outputs, or occurs twice.
    """
    kinds = gains.kinds
    if not free_gains:
        raise InputError("expected at least one free setting", key="free")
    for k, f in enumerate(free_gains):
        known = f.name in _FILTERS or any(
            i < len(kinds) and kind in ("", kinds[i]) for i, kind, _ in NAMES.get(f.name, ())
        )
        if not known:
            expected = f"expected a setting of joints whose outputs are {', '.join(kinds)}"
            raise InputError(expected, key=f"free.{f.name}", value=f.name)
        if f.name in [other.name for other in free_gains[:k]]:
            raise InputError("expected each setting once", key=f"free.{f.name}", value=f.name)
        if f.low <= 0 and (
            f.name in _FILTERS
            or any(field in ("limit", "slew", *_JOINT_FILTERS) for _, _, field in NAMES[f.name])
        ):
            raise InputError("expected bounds above 0", key=f"free.{f.name}", value=[f.low, f.high])


def spec(free_gains: Sequence[FreeGain]) -> Mapping[str, Any]:
    """The free settings as the table [free] of a file."""
    return {f.name: {"low": f.low, "high": f.high, "scale": f.scale} for f in free_gains}
