"""The flex sensor's calibration: known tip deflections and the readings beside them, fitted by the firmware's cubic.

    w = c1 x + c2 x^2 + c3 x^3,  x = reading - zero        least squares in w, zero the root of the fitted cubic

The covariance of zero, c1, c2 and c3 follows from the residuals' variance by the delta method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from flexura.errors import InputError
from flexura.explain import explain
from flexura.files import read_toml, write_toml

from ..board.emulated import Plant
from ..board.link import Link
from ..rig import Bench
from ..rig.description import Calibration, tip_per_bend
from ..rig.drives import Drives
from .measure import ADC_V, reading

SETTLE_S, LOOK_S = 0.1, 0.4
TIPS_M = tuple(float(w) for w in np.linspace(-0.02, 0.02, 9))  # held one after the other
LEAST = 6  # points: four unknowns, and something left to judge them by


@dataclass(frozen=True)
class Fit:
    """The calibration, with its covariance; `residual_m` is the standard deviation of what the cubic leaves."""

    calibration: Calibration
    readings: np.ndarray
    tips_m: np.ndarray
    residual_m: float


def fit(readings: np.ndarray, tips_m: np.ndarray) -> Fit:
    """Least squares; readings (n,) are fractions of full scale, n at least 6. Raises InputError where they tell nothing.

    A highest term within two standard deviations of 0 is left out: what the readings don't tell is not made up.
    """
    r, w = np.asarray(readings, dtype=float), np.asarray(tips_m, dtype=float)
    if len(r) < LEAST or len(np.unique(r)) < LEAST:
        raise InputError(
            f"expected at least {LEAST} deflections with as many different readings", key="deflections", value=len(r)
        )
    for degree in (3, 2, 1):
        found = _fit(r, w, degree)
        values = found.calibration.model_dump(exclude={"covariance"})
        highest, variance = values[f"c{degree}_m"], np.array(found.calibration.covariance)[degree, degree]
        if abs(highest) > 2 * np.sqrt(variance):
            break
    return found


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
        jacobian[:, k] = (_expanded(b + h, centre, scale) - _expanded(b - h, centre, scale)) / (2 * h[k])
    covariance = jacobian @ spread @ jacobian.T
    zero, c1, c2, c3 = (float(v) for v in _expanded(b, centre, scale))
    rows = ((covariance + covariance.T) / 2).tolist()
    return Fit(Calibration(zero=zero, c1_m=c1, c2_m=c2, c3_m=c3, covariance=rows), r, w, float(np.sqrt(variance)))


def _expanded(b: np.ndarray, centre: float, scale: float) -> np.ndarray:
    """(zero, c1, c2, c3) of the polynomial b in (r - centre) / scale: its root nearest to the middle, its expansion there."""
    roots = np.roots(b[::-1])
    real = roots[np.abs(roots.imag) < 1e-9].real
    if not len(real):
        raise InputError("expected deflections to both sides: the fitted curve has no zero", key="deflections")
    z = real[np.argmin(np.abs(real))]
    b = np.append(b, np.zeros(4 - len(b)))
    c = np.array([b[1] + 2 * b[2] * z + 3 * b[3] * z**2, b[2] + 3 * b[3] * z, b[3]])
    return np.array([centre + scale * z, *(c / scale ** np.arange(1, 4))])


def measure(link: Link, tips_m: tuple[float, ...], hold: Callable[[float], float]) -> tuple[np.ndarray, np.ndarray]:
    """(readings, deflections) of the strip held at each of `tips_m`; `hold(w)` holds it there and says where it really is [m]."""
    link.connect()
    readings, held = [], []
    for asked in tips_m:
        held.append(hold(asked))
        link.run(SETTLE_S)
        link.telemetry()
        link.run(LOOK_S)
        readings.append(float(reading(link.telemetry()["flex"]).mean()))
    return np.array(readings), np.array(held)


def held_by(plant: Plant, bench: Bench) -> Callable[[float], float]:
    """Holds an emulated strip deflected: the plant does it, or, where the strip is always straight, its sensor reads as if."""
    flex = bench.rig.flex

    def hold(tip_m: float) -> float:
        if isinstance(plant, Drives):
            ohm = flex.straight_ohm + flex.ohm_per_rad * tip_m / tip_per_bend(bench)
            plant.flex_V = ADC_V * flex.divider_ohm / (ohm + flex.divider_ohm)
            return tip_m
        held: Callable[[float], float] = plant.hold_tip  # type: ignore[attr-defined]
        return held(tip_m)

    return hold


def write(found: Fit, path: Path) -> None:
    """As a TOML file that `--calibration` takes, and whose content may stand in a rig file as flex.calibration."""
    write_toml(path, found.calibration.model_dump(mode="json"))


def read(path: Path) -> Calibration:
    """A calibration file. Raises InputError, naming file, key, value and what was expected."""
    data = read_toml(path)
    try:
        return Calibration.model_validate(data)
    except ValidationError as error:
        raise explain(error, Calibration, data, str(path)) from None
