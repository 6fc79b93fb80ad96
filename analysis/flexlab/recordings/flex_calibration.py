"""The flex sensor's calibration: known tip deflections and the readings beside them, fitted by the
firmware's cubic.

    w = c1 x + c2 x^2 + c3 x^3,  x = reading - zero        least squares in w, zero the root of the
    fitted cubic

The covariance of zero, c1, c2 and c3 follows from the residuals' variance by the delta method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from flexura.errors import InputError
from flexura.io import explain, read_toml, write_toml

from ..board.emulator.emulated import Outputs, Sensors
from ..board.protocol.declaration import CONFIG
from ..board.protocol.session import Link
from ..rig import Bench
from ..rig.description import Calibration, tip_per_bend
from ..rig.plant.rigid_plant import Drives
from .unit_conversion import ADC_V, reading

SETTLE_S, LOOK_S = 0.1, 0.4
_UP = [float(w) for w in np.linspace(-0.02, 0.02, 9)]
TIPS_M = tuple(_UP + _UP[-2::-1])  # held one after the other, there and back: an even drift cancels
LEAST = 6  # points: four unknowns, and something left to judge them by


@dataclass(frozen=True)
class Fit:
    """The calibration, with its covariance; `residual_m` is the standard deviation of what the
    cubic leaves."""

    calibration: Calibration
    readings: np.ndarray
    tips_m: np.ndarray
    residual_m: float


def fit(readings: np.ndarray, tips_m: np.ndarray) -> Fit:
    """Least squares; readings (n,) are fractions of full scale, n at least 6. Raises InputError
    where they tell nothing.

    A highest term within two standard deviations of 0, or beyond what the board takes, is left out:
    what the readings don't tell is not made up. Raises InputError too where the board would not
    even take the straight line.
    """
    r, w = np.asarray(readings, dtype=float), np.asarray(tips_m, dtype=float)
    if len(r) < LEAST or len(np.unique(r)) < LEAST:
        raise InputError(
            f"expected at least {LEAST} deflections with as many different readings",
            key="deflections",
            value=len(r),
        )
    for degree in (3, 2, 1):
        found = _fit(r, w, degree)
        values = found.calibration.model_dump(exclude={"covariance"})
        highest, variance = (
            values[f"c{degree}_m"],
            np.array(found.calibration.covariance)[degree, degree],
        )
        beyond = [name for name, value in values.items() if not _taken(name, value)]
        if not beyond and abs(highest) > 2 * np.sqrt(variance):
            return found
    if beyond:
        item, name = CONFIG[f"flex_{beyond[0]}"], beyond[0]
        expected = (
            f"expected deflections that give the board a value between {item.least:g} and "
            f"{item.greatest:g}"
        )
        raise InputError(expected, key=name, value=values[name])
    return found


def _taken(name: str, value: float) -> bool:
    item = CONFIG[f"flex_{name}"]
    return item.least <= value <= item.greatest


def _fit(r: np.ndarray, w: np.ndarray, degree: int) -> Fit:
    centre, scale = r.mean(), np.ptp(r) / 2
    A = np.vander((r - centre) / scale, degree + 1, increasing=True)
    b, *_ = np.linalg.lstsq(A, w, rcond=None)
    left = w - A @ b
    variance = float(left @ left) / (len(r) - degree - 1)
    spread = variance * np.linalg.inv(A.T @ A)
    jacobian = np.empty((4, degree + 1))
    for k in range(degree + 1):
        h = np.zeros(degree + 1)
        h[k] = 1e-6 * np.abs(b).max()
        jacobian[:, k] = (_expanded(b + h, centre, scale) - _expanded(b - h, centre, scale)) / (
            2 * h[k]
        )
    covariance = jacobian @ spread @ jacobian.T
    zero, c1, c2, c3 = (float(v) for v in _expanded(b, centre, scale))
    rows = ((covariance + covariance.T) / 2).tolist()
    return Fit(
        Calibration(zero=zero, c1_m=c1, c2_m=c2, c3_m=c3, covariance=rows),
        r,
        w,
        float(np.sqrt(variance)),
    )


def _expanded(b: np.ndarray, centre: float, scale: float) -> np.ndarray:
    """(zero, c1, c2, c3) of the polynomial b in (r - centre) / scale: its root nearest to the
    middle, its expansion there."""
    roots = np.roots(b[::-1])
    real = roots[np.abs(roots.imag) < 1e-9].real
    if not len(real):
        raise InputError(
            "expected deflections to both sides: the fitted curve has no zero", key="deflections"
        )
    z = real[np.argmin(np.abs(real))]
    b = np.append(b, np.zeros(4 - len(b)))
    c = np.array([b[1] + 2 * b[2] * z + 3 * b[3] * z**2, b[2] + 3 * b[3] * z, b[3]])
    return np.array([centre + scale * z, *(c / scale ** np.arange(1, 4))])


def measure(
    link: Link, tips_m: tuple[float, ...], hold: Callable[[float], float]
) -> tuple[np.ndarray, np.ndarray]:
    """(readings, deflections) of the strip held at each of `tips_m`; `hold(w)` holds it there and
    says where it really is [m]."""
    link.connect()
    readings, held = [], []
    for asked in tips_m:
        held.append(hold(asked))
        link.run(SETTLE_S)
        link.telemetry()
        link.run(LOOK_S)
        readings.append(float(reading(link.telemetry()["flex"]).mean()))
    return np.array(readings), np.array(held)


class Held:
    """An emulated rig whose strip is held deflected by a force at its tip (see
    `board.emulated.Plant`): `tip_m` says how far.

    The sensor is the plant's own, with its noise, drift and nonlinearity, bent as the cantilever
    is; `Drives` has none, and reads what the sensor's data say.
    """

    def __init__(self, plant: Any, bench: Bench) -> None:
        self._plant, self._flex, self._tip_per_bend = plant, bench.rig.flex, tip_per_bend(bench)
        self.tip_m = 0.0

    def hold(self, tip_m: float) -> float:
        self.tip_m = tip_m
        return tip_m

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        sensors: Sensors = self._plant.advance(seconds, outputs)
        sensors.flex_V = self._voltage(self.tip_m / self._tip_per_bend)
        return sensors

    def _voltage(self, bend_rad: float) -> float:
        if not isinstance(self._plant, Drives):
            return float(self._plant.flex.sample(bend_rad))
        ohm = self._flex.straight_ohm + self._flex.ohm_per_rad * bend_rad
        return ADC_V * self._flex.divider_ohm / (ohm + self._flex.divider_ohm)


def write(found: Fit, path: Path) -> None:
    """As a TOML file that `--calibration` takes, and whose content may stand in a rig file as
    flex.calibration."""
    write_toml(path, found.calibration.model_dump(mode="json"))


def read(path: Path) -> Calibration:
    """A calibration file. Raises InputError, naming file, key, value and what was expected."""
    data = read_toml(path)
    try:
        return Calibration.model_validate(data)
    except ValidationError as error:
        raise explain(error, Calibration, data, str(path)) from None
