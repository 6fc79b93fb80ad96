"""Calibration of the flex sensor: the firmware's cubic fitted to known tip deflections.

    w = c1 x + c2 x^2 + c3 x^3,  x = reading - zero

A cubic in the reading is fitted by least squares in w; zero is its root. The covariance of zero,
c1, c2 and c3 follows from the residuals' variance by the delta method.
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
from ..rig import RigSetup
from ..rig.configuration import tip_per_bend, tip_per_curvature
from ..rig.plant.strip_sensor import StripSensor
from ..rig.sensors import Calibration
from .unit_conversion import flex_reading

SETTLE_S, SAMPLE_S = 0.1, 0.4
_RISING = [float(w) for w in np.linspace(-0.02, 0.02, 9)]
TIPS_M = tuple(_RISING + _RISING[-2::-1])  # there and back: a linear drift cancels
MIN_POINTS = 6  # four unknowns, and some residuals


@dataclass(frozen=True)
class Fit:
    """A calibration with its covariance, the points, and the residuals' standard deviation [m]."""

    calibration: Calibration
    readings: np.ndarray
    tips_m: np.ndarray
    residual_m: float


def fit(readings: np.ndarray, tips_m: np.ndarray) -> Fit:
    """Fit a calibration by least squares.

    The highest term is left out if it is within two standard deviations of 0, or if the board does
    not accept it.

    Args:
        readings: fractions of full scale (n,), n at least MIN_POINTS.
        tips_m: tip deflections (n,) [m].

    Raises:
        InputError: too few different readings, or the board does not accept the straight line.
    """
    r, w = np.asarray(readings, dtype=float), np.asarray(tips_m, dtype=float)
    if len(r) < MIN_POINTS or len(np.unique(r)) < MIN_POINTS:
        raise InputError(
            f"expected at least {MIN_POINTS} deflections with as many different readings",
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
        beyond = [name for name, value in values.items() if not _within_board_range(name, value)]
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


def _within_board_range(name: str, value: float) -> bool:
    item = CONFIG[f"flex_{name}"]
    return item.least <= value <= item.greatest


def _fit(r: np.ndarray, w: np.ndarray, degree: int) -> Fit:
    centre, scale = r.mean(), np.ptp(r) / 2
    A = np.vander((r - centre) / scale, degree + 1, increasing=True)
    b, *_ = np.linalg.lstsq(A, w, rcond=None)
    residual = w - A @ b
    variance = float(residual @ residual) / (len(r) - degree - 1)
    parameter_covariance = variance * np.linalg.inv(A.T @ A)
    jacobian = np.empty((4, degree + 1))
    for k in range(degree + 1):
        h = np.zeros(degree + 1)
        h[k] = 1e-6 * np.abs(b).max()
        jacobian[:, k] = (
            _expand_at_root(b + h, centre, scale) - _expand_at_root(b - h, centre, scale)
        ) / (2 * h[k])
    covariance = jacobian @ parameter_covariance @ jacobian.T
    zero, c1, c2, c3 = (float(v) for v in _expand_at_root(b, centre, scale))
    rows = ((covariance + covariance.T) / 2).tolist()
    return Fit(
        Calibration(zero=zero, c1_m=c1, c2_m=c2, c3_m=c3, covariance=rows),
        r,
        w,
        float(np.sqrt(variance)),
    )


def _expand_at_root(b: np.ndarray, centre: float, scale: float) -> np.ndarray:
    """Expand a polynomial b in (r - centre) / scale at its root nearest to the centre.

    Returns:
        (zero, c1, c2, c3).
    """
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
    """Measure readings of the strip held at given deflections.

    Args:
        link: the session with the board.
        tips_m: deflections to hold [m].
        hold: holds the strip at a deflection and returns the actual one [m].

    Returns:
        Readings and actual deflections [m], (n,) each.
    """
    link.connect()
    readings, actual = [], []
    for target in tips_m:
        actual.append(hold(target))
        link.run(SETTLE_S)
        link.telemetry()
        link.run(SAMPLE_S)
        readings.append(float(flex_reading(link.telemetry()["flex"]).mean()))
    return np.array(readings), np.array(actual)


class DeflectedPlant:
    """An emulated rig whose strip is held deflected by a force at its tip (`board.emulated.Plant`).

    The sensor is the plant's own, with noise, drift and nonlinearity. A `RigidPlant` has none; its
    sensor follows the data sheet. `tip_m` is the deflection [m].

    Raises:
        InputError: the rig has no deflection sensor.
    """

    def __init__(self, plant: Any, setup: RigSetup) -> None:
        rig = setup.rig
        if rig.strain_gauge:
            self._tip = tip_per_curvature(setup, rig.strain_gauge)
        elif rig.flex:
            self._tip = tip_per_bend(setup)
        else:
            raise InputError(
                "expected a rig with a flex sensor or a strain gauge", key="RIG", file=setup.file
            )
        self._plant, self.tip_m = plant, 0.0
        quiet = StripSensor(rig.sensor, None, np.random.default_rng(0), 1.0)
        self._voltage = plant.sensor.sample if hasattr(plant, "sensor") else quiet.voltage

    def hold(self, tip_m: float) -> float:
        """Hold the tip at a deflection [m]; returns it."""
        self.tip_m = tip_m
        return tip_m

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        """Advance the plant, its flex voltage replaced by that of the held strip."""
        sensors: Sensors = self._plant.advance(seconds, outputs)
        sensors.flex_V = float(self._voltage(self.tip_m / self._tip))
        return sensors


def write(found: Fit, path: Path) -> None:
    """Write a calibration as a TOML file.

    `--calibration` takes it; its content may stand in a rig file as flex.calibration.
    """
    write_toml(path, found.calibration.model_dump(mode="json"))


def read(path: Path) -> Calibration:
    """Read a calibration file.

    Raises:
        InputError: names file, key, value and what was expected.
    """
    data = read_toml(path)
    try:
        return Calibration.model_validate(data)
    except ValidationError as error:
        raise explain(error, Calibration, data, str(path)) from None
