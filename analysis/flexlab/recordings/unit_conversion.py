"""From what the board reports to physical quantities, each with the conversion written beside it.

    d1 = counts / motor_counts_per_m         theta2 = counts / stepper_counts_per_rad     pulses =
    steps / stepper_steps_per_rad r = sum of the conversions / (adc_samples 1024)       w = c1 x +
    c2 x^2 + c3 x^3,  x = r - zero

A report that did not arrive is NaN in every channel, and so is what depends on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..board.protocol.declaration import ADC_SAMPLES, CONTROL_HZ, Mode, State
from ..board.protocol.player import FRACTION, Knots
from ..rig.description import Calibration

ADC_COUNTS, ADC_V = 1024, 5.0
SMOOTH = (
    21  # reports in the window of the velocity's local cubic: -3 dB at some 36 Hz, no phase lag
)
UNITS = {
    "joint/1/position": "m",
    "joint/2/position": "rad",
    "joint/1/velocity": "m/s",
    "joint/2/velocity": "rad/s",
    "joint/1/reference": "m",
    "joint/2/reference": "rad",
    "joint/1/voltage": "V",
    "joint/2/pulses": "rad",
    "link/2/tip_deflection": "m",
    "link/2/tip_deflection_std": "m",
    "link/2/flex_voltage": "V",
}


@dataclass(frozen=True)
class Sensor:
    """The flex sensor as calibrated: `zero` is the straight strip's reading today, the mean of so
    many `reports`, `noise` the standard deviation of one."""

    calibration: Calibration
    zero: float
    noise: float = 0.0
    reports: int = 1

    def tip(self, r: np.ndarray) -> np.ndarray:
        """Tip deflection [m] of readings (fractions of full scale)."""
        c, x = self.calibration, np.asarray(r) - self.zero
        return ((c.c3_m * x + c.c2_m) * x + c.c1_m) * x

    def tip_std(self, r: np.ndarray) -> np.ndarray:
        """Its standard deviation [m] by propagation: noise and resolution of the reading, of the
        zero, and the calibration's own.

        var w = (dw/dx)^2 (var r + var zero) + a C a^T with a = (x, x^2, x^3), C the covariance of
        c1, c2, c3; a calibration without a covariance adds nothing, which the run's metadata say.
        """
        c, x = self.calibration, np.asarray(r) - self.zero
        slope = (3 * c.c3_m * x + 2 * c.c2_m) * x + c.c1_m
        resolution = 1 / ADC_COUNTS**2 / 12
        variance = slope**2 * (self.noise**2 * (1 + 1 / self.reports) + 2 * resolution)
        if c.covariance is not None:
            a = np.stack([x, x**2, x**3], axis=-1)
            variance = variance + np.einsum(
                "...i,ij,...j->...", a, np.array(c.covariance)[1:, 1:], a
            )
        return np.sqrt(variance)


def reading(flex: np.ndarray) -> np.ndarray:
    """Fraction of full scale from the sum of a tick's conversions."""
    return np.asarray(flex, dtype=float) / (ADC_SAMPLES * ADC_COUNTS)


def rows(reports: np.ndarray, numbers: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """(ticks of all reports that the board made (T,), which of them arrived (n,)), by the reports'
    `numbers` (n,), modulo 2^16.

    A report that did not arrive is given a tick evenly between its neighbours'. Without numbers all
    are taken to have arrived.
    """
    ticks = reports["tick"].astype(float)
    if numbers is None or len(numbers) < 2:
        return ticks, np.arange(len(ticks))
    ahead = np.maximum(np.mod(np.diff(numbers), 1 << 16), 1)
    ahead = np.minimum(ahead, np.maximum(np.diff(ticks), 1)).astype(
        int
    )  # no more reports than ticks: the count began anew
    place = np.concatenate([[0], np.cumsum(ahead)])
    return np.interp(np.arange(place[-1] + 1), place, ticks), place


def channels(
    reports: np.ndarray,
    mode: Mode,
    settings: dict[str, float],
    sensor: Sensor,
    numbers: np.ndarray | None = None,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Ticks (T,) and the channels of UNITS (T,) of one session's reports, which ascend in time;
    `numbers` as in `rows`."""
    ticks, place = rows(reports, numbers)

    def spread(values: np.ndarray) -> np.ndarray:
        out = np.full(len(ticks), np.nan)
        out[place] = values
        return out

    per_m, per_rad, per_step = (
        settings[name]
        for name in ("motor_counts_per_m", "stepper_counts_per_rad", "stepper_steps_per_rad")
    )
    half_V = settings["supply_divider"] * ADC_V / ADC_COUNTS / 2  # a conversion rounds down
    tracked = (reports["state"] == State.running) & (mode is Mode.position)
    r = reading(reports["flex"])
    out = {
        "joint/1/position": spread(reports["position_1"] / per_m),
        "joint/2/position": spread(reports["position_2"] / per_rad),
        "joint/1/reference": spread(
            np.where(tracked, reports["setpoint_1"] / (FRACTION * per_m), np.nan)
        ),
        "joint/2/reference": spread(
            np.where(tracked, reports["setpoint_2"] / (FRACTION * per_step), np.nan)
        ),
        # the board's figure is its duty times the supply it was told of; the motor gets the duty of
        # the supply there is
        "joint/1/voltage": spread(
            reports["voltage"] / 1000 * ((reports["supply"] / 1000 + half_V) / settings["supply_V"])
        ),
        "joint/2/pulses": spread(reports["steps"] / per_step),
        "link/2/tip_deflection": spread(sensor.tip(r)),
        "link/2/tip_deflection_std": spread(sensor.tip_std(r)),
        "link/2/flex_voltage": spread(ADC_V * r),
    }
    for number in (1, 2):
        out[f"joint/{number}/velocity"] = velocity(
            ticks / CONTROL_HZ, out[f"joint/{number}/position"]
        )
    return ticks, {name: out[name] for name in UNITS}


def velocity(t: np.ndarray, position: np.ndarray, samples: int = SMOOTH) -> np.ndarray:
    """Derivative at t (T,) of the cubic that fits `samples` (odd) values about each, least squares.

    Where the times are even this is the filter of Savitzky and Golay, Anal. Chem. 36 (1964) 1627.
    Ends and the sides of a gap use the nearest full window; pieces shorter than that have no
    velocity (NaN).
    """
    out = np.full(len(position), np.nan)
    there = np.flatnonzero(np.isfinite(position))
    half = samples // 2
    for piece in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1):
        if len(piece) < samples:
            continue
        at, y = t[piece], position[piece]
        first = np.clip(np.arange(len(piece)) - half, 0, len(piece) - samples)
        window = first[:, None] + np.arange(samples)
        scale = float(at[-1] - at[0]) / (len(at) - 1) * half
        powers = ((at[window] - at[:, None]) / scale)[..., None] ** np.arange(4)
        values = y[window] - y[:, None]
        squares, right = (
            np.einsum("nwi,nwj->nij", powers, powers),
            np.einsum("nwi,nw->ni", powers, values),
        )
        out[piece] = np.linalg.solve(squares, right[..., None])[:, 1, 0] / scale
    return out


def commanded(knots: Knots, settings: dict[str, float]) -> np.ndarray:
    """What the board makes of the knots in each tick after the start, (K, 2) in the units of the
    reports' set-points.

    Position: cubics through the knots, then the set-point filter y += a (x - y). Open loop: each
    knot holds for a period.
    """
    period = 2**knots.period_log2
    if knots.mode is Mode.open_loop:
        return np.repeat(
            np.stack([knots.columns["voltage"], knots.columns["rate"]], axis=1).astype(float),
            period,
            axis=0,
        )
    from scipy.interpolate import CubicHermiteSpline
    from scipy.signal import lfilter

    at = np.arange(len(knots)) * period
    out = []
    for number in (1, 2):
        position, speed = (
            np.asarray(knots.columns[f"{name}_{number}"], dtype=float)
            for name in ("position", "velocity")
        )
        if len(knots) == 1:
            return np.repeat(
                [[float(knots.columns[f"position_{n}"][0]) for n in (1, 2)]], 1, axis=0
            )
        course = CubicHermiteSpline(at, position, speed)(np.arange(1, at[-1] + 1))
        if cut := settings[f"setpoint_{number}_Hz"]:
            a = 1 - np.exp(-2 * np.pi * cut / CONTROL_HZ)
            course = lfilter([a], [1, a - 1], course - position[0]) + position[0]
        out.append(course)
    return np.stack(out, axis=1)


def start_tick(
    reports: np.ndarray, knots: Knots, settings: dict[str, float]
) -> tuple[float, float] | None:
    """The tick of t = 0 and how far it may be wrong [s]; None when the board never ran.

    Reports are some ticks apart, so that the first report of Running leaves a choice; the
    set-points in the reports decide it. Drives that hold for a period of knots may leave two ticks
    that fit alike: then it is half a tick from both.
    """
    running = np.flatnonzero(reports["state"] == State.running)
    if not len(running):
        return None
    first = running[0]
    latest = int(reports["tick"][first])  # told before the first tick of it was over
    earliest = int(reports["tick"][first - 1]) if first else latest - 2
    course = commanded(knots, settings)
    seen = reports[running]
    said = np.stack([seen["setpoint_1"], seen["setpoint_2"]], axis=1).astype(float)
    scale = np.abs(course).max(axis=0) + 1.0
    misfit = {}
    for start in range(max(earliest, latest - 2000), latest + 1):
        k = seen["tick"].astype(np.int64) - start - 1
        inside = (k >= 0) & (k < len(course))
        misfit[start] = (
            float((((said[inside] - course[k[inside]]) / scale) ** 2).sum())
            if inside.any()
            else np.inf
        )
    best = min(misfit.values())
    alike = [start for start, m in misfit.items() if m <= best + 1e-12]
    return (alike[0] + alike[-1]) / 2, (alike[-1] - alike[0]) / 2 / CONTROL_HZ
