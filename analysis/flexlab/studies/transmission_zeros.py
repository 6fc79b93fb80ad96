"""Transmission zeros from each drive to its own joint and to the robot's tip: what feedback of that
output has to live with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx


@dataclass(frozen=True)
class Transmission:
    """The zeros [1/s] from a drive to an output, by magnitude; None where the drive does not move
    that output."""

    drive: str
    output: str
    zeros: np.ndarray | None

    @property
    def notches_Hz(self) -> np.ndarray:
        """Frequencies at which the output stays at rest, ascending: zeros on the imaginary axis or
        near it, |s|/(2 pi)."""
        return self._pick(lambda z: (z.imag > 0) & (np.abs(z.real) < 0.1 * np.abs(z)))

    @property
    def unstable(self) -> np.ndarray:
        """Zeros well inside the right half plane [1/s], by real part: no feedback of this output
        can be faster."""
        found = self._pick(lambda z: (z.imag >= 0) & (z.real >= 0.1 * np.abs(z)), whole=True)
        return found[np.argsort(found.real)]

    def _pick(self, test: Any, whole: bool = False) -> np.ndarray:
        z = (
            np.zeros(0, dtype=complex)
            if self.zeros is None
            else self.zeros[np.abs(self.zeros) > 1e-7 * np.abs(self.zeros).max(initial=0)]
        )
        z = z[test(z)]
        return z if whole else np.sort(np.abs(z)) / (2 * np.pi)

    def numbers(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "drive": self.drive,
            "output": self.output,
            "reached": self.zeros is not None,
            "notches_Hz": self.notches_Hz.tolist(),
            "right_half_plane_1_s": [[z.real, z.imag] for z in self.unstable],
        }


def transmission(linear: fx.StateSpace) -> list[Transmission]:
    """Every drive to its own joint, to tip/x and to tip/y."""
    rows = []
    for drive in linear.inputs:
        for output in (drive.replace("drive", "position"), "tip/x", "tip/y"):
            try:
                rows.append(Transmission(drive, output, linear.zeros(drive, output)))
            except fx.InputError:  # to first order this drive does not move it
                rows.append(Transmission(drive, output, None))
    return rows
