"""What a cross-check compares: the channels of every comparison, sensors, and internal forces.

Internal forces have a row a joint and a row a link and kind, with the largest deviation along the
link. A force is judged by the largest force in the robot, a moment by the largest moment: what is
next to none has no size of its own. The first time is left out: what jumps there has to run along
the twin's beam as a wave.
"""

from __future__ import annotations

import re

import numpy as np

from flexura.io import Run

from ..runs.deviation import Deviation, compared, deviation, deviations

_JOINT = re.compile(r"(joint/\d+)/reaction_moment")
_LINK = re.compile(r"(link/\d+/(?:bending_moment|shear_force|axial_force))/0")
_FORCES = re.compile(r"joint/\d+/reaction_[xy]|link/\d+/(?:shear|axial)_force/\d+")
_MOMENTS = re.compile(r"joint/\d+/reaction_moment|link/\d+/bending_moment/\d+")


def rows(first: Run, second: Run) -> list[Deviation]:
    """The deviations of the second run from the first.

    Args:
        first: the native run.
        second: the twin's.

    Returns:
        One a row of the table.
    """
    sensors = [
        name
        for name in first
        if name.startswith("sensor/") and name in second and first.units[name] == second.units[name]
    ]
    out = deviations(first, second, compared(first, second) + sensors)
    for name, parts in _internal(first, second).items():
        unit, size = first.units[parts[0]], _size(first, second, name, parts)
        peak = _largest(first, _FORCES if unit == "N" else _MOMENTS)
        most = float(size.max()) if len(size) else np.nan
        rms = float(np.sqrt(np.mean(size**2))) if len(size) else np.nan
        share = 1 / peak if peak > 0 else np.nan
        out.append(Deviation(name, unit, most, rms, most * share, rms * share, peak))
    return out


def values(first: Run, second: Run, name: str) -> np.ndarray:
    """The deviation of a row's channel over the times that both runs have.

    Args:
        first: a run.
        second: another.
        name: of the row.

    Returns:
        In the row's unit (K,); of internal forces its size.
    """
    parts = _internal(first, second).get(name)
    if parts is None:
        return deviation(first, second, name)[1]
    return _size(first, second, name, parts)


def _internal(first: Run, second: Run) -> dict[str, list[str]]:
    """The channels of each row of internal forces that both runs have."""
    out: dict[str, list[str]] = {}
    for found in filter(None, map(_JOINT.fullmatch, first)):
        out[f"{found[1]}/reaction"] = [f"{found[1]}/reaction_{axis}" for axis in "xy"]
        out[f"{found[1]}/reaction_moment"] = [found[0]]
    for found in filter(None, map(_LINK.fullmatch, first)):
        out[found[1]] = [name for name in first if name.rpartition("/")[0] == found[1]]
    return {name: parts for name, parts in out.items() if set(parts) <= set(second)}


def _size(first: Run, second: Run, name: str, parts: list[str]) -> np.ndarray:
    """The length of a reaction's deviation, or the largest along a link (K,)."""
    found = np.abs([deviation(first, second, part)[1][1:] for part in parts])
    return np.hypot(*found) if name.endswith("/reaction") else found.max(axis=0)


def _largest(run: Run, pattern: re.Pattern[str]) -> float:
    """The largest magnitude in all channels of a kind."""
    sizes = [
        np.nanmax(np.abs(run[name][1:]), initial=0.0) for name in run if pattern.fullmatch(name)
    ]
    return float(max(sizes, default=0.0))
