"""Limits of a motion: drives and speeds of joints, deflections of tips."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...io import Run, Tables, array, number

KEPT = 1e-3  # of a limit: what a motion may exceed it by
LIMITED = {"drive": "drive", "velocity": "speed", "tip_deflection": "deflection_m"}  # by channel


@dataclass(frozen=True)
class Limits:
    """Largest drives and speeds of joints (links,) and deflection of tips [m]; infinity: none."""

    drive: np.ndarray
    speed: np.ndarray
    deflection_m: float

    @property
    def of_states(self) -> bool:
        """Whether a speed or a deflection is limited, and not the drives alone."""
        return bool(np.isfinite(self.speed).any() or np.isfinite(self.deflection_m))

    def shares(self, run: Run) -> dict[str, np.ndarray]:
        """Drives, speeds and deflections (T,) of a Run in shares of their limits, by channel."""
        of = [(f"joint/{i}/drive", most) for i, most in enumerate(self.drive, 1)]
        of += [(f"joint/{i}/velocity", most) for i, most in enumerate(self.speed, 1)]
        of += [(name, self.deflection_m) for name in run if name.endswith("/tip_deflection")]
        return {name: np.abs(run[name]) / most for name, most in of if np.isfinite(most)}

    def nearest(self, run: Run) -> tuple[str, float]:
        """The channel of a Run that comes nearest to its limit or exceeds it most, and the share of
        the limit that it reaches."""
        peaks = {name: float(share.max()) for name, share in self.shares(run).items()}
        name = max(peaks, key=peaks.__getitem__)
        return name, peaks[name]

    def excess(self, run: Run) -> float:
        """The largest share of a limit by which a Run exceeds it; below 0: it keeps all."""
        return self.nearest(run)[1] - 1.0

    def tightened(self, run: Run, by: Limits) -> Limits:
        """Limits of speeds and deflections that are lower by what a Run exceeds those of `by`."""
        peaks = {name: float(share.max()) for name, share in by.shares(run).items()}
        less = {name: peak + KEPT / 2 for name, peak in peaks.items() if peak > 1 + KEPT / 2}
        count = len(self.speed)
        speed = [less.get(f"joint/{i}/velocity", 1.0) for i in range(1, count + 1)]
        bend = max((x for key, x in less.items() if key.endswith("deflection")), default=1.0)
        return replace(self, speed=self.speed / speed, deflection_m=self.deflection_m / bend)

    def exceeded(self, run: Run) -> list[Tables]:
        """Events of the limits that a Run exceeds by more than the share `KEPT`."""
        out: list[Tables] = []
        for name, share in self.shares(run).items():
            k = int(share.argmax())
            if share[k] > 1 + KEPT:
                size = abs(float(run[name][k]))
                text = f"{name} reaches {size:.4g}, beyond its limit {size / share[k]:.4g}"
                at = float(run.t[k])
                out.append({"t": at, "level": "WARN", "name": "limit_exceeded", "text": text})
        return out


def read_limits(limits: Any, joints: int) -> Limits:
    """The limits of a table with "drive", "speed" and "deflection_m".

    Args:
        limits: the table; a number stands for all joints.
        joints: their number.

    Returns:
        The Limits.

    Raises:
        InputError: a key or a value is not what is expected.
    """
    known = tuple(LIMITED.values())
    if not isinstance(limits, Mapping):
        raise InputError(f"expected a table with {', '.join(known)}", key="limits", value=limits)
    for key in limits:
        if key not in known:
            text = f"an unknown key; known: {', '.join(known)}"
            raise InputError(text, key=f"limits.{key}", value=limits[key])
    if "drive" not in limits:
        raise InputError("missing: expected the largest drives, one a joint", key="limits.drive")
    found = {}
    for key in ("drive", "speed"):
        if key not in limits or limits[key] is None:
            found[key] = np.full(joints, np.inf)
            continue
        expected = f"expected {joints} numbers above 0, one a joint"
        given = array(limits[key], f"limits.{key}", expected)
        if given.size not in (1, joints) or not np.all(given > 0):
            raise InputError(expected, key=f"limits.{key}", value=limits[key])
        found[key] = np.broadcast_to(given.ravel(), (joints,)).astype(float)
    bend = limits.get("deflection_m")
    most = np.inf if bend is None else number(bend, "limits.deflection_m")
    if not most > 0:
        raise InputError("expected a length above 0", key="limits.deflection_m", value=bend)
    return Limits(found["drive"], found["speed"], most)
