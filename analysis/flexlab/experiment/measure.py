"""From what the board reports to physical quantities, each with the conversion written beside it.

    d1 = counts / motor_counts_per_m         theta2 = counts / stepper_counts_per_rad     pulses = steps / stepper_steps_per_rad
    r = sum of the conversions / (adc_samples 1024)       w = c1 x + c2 x^2 + c3 x^3,  x = r - zero

A report that did not arrive is NaN in every channel, and so is what depends on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..board.declaration import ADC_SAMPLES, CONTROL_HZ, Mode, State
from ..board.player import FRACTION, Knots
from ..rig.description import Calibration

ADC_COUNTS, ADC_V = 1024, 5.0
SMOOTH_S = 0.042  # window of the velocity's local cubic: -3 dB at some 36 Hz, no phase lag
UNITS = {
    "joint/1/position": "m", "joint/2/position": "rad", "joint/1/velocity": "m/s", "joint/2/velocity": "rad/s",
    "joint/1/reference": "m", "joint/2/reference": "rad", "joint/1/voltage": "V", "joint/2/pulses": "rad",
    "link/2/tip_deflection": "m", "link/2/tip_deflection_std": "m", "link/2/flex_voltage": "V",
}  # fmt: skip


@dataclass(frozen=True)
class Sensor:
    """The flex sensor as calibrated: `zero` is the straight strip's reading today, the mean of so many `reports`, `noise` the
    standard deviation of one."""

    calibration: Calibration
    zero: float
    noise: float = 0.0
    reports: int = 1

    def tip(self, r: np.ndarray) -> np.ndarray:
        """Tip deflection [m] of readings (fractions of full scale)."""
        c, x = self.calibration, np.asarray(r) - self.zero
        return ((c.c3_m * x + c.c2_m) * x + c.c1_m) * x

    def tip_std(self, r: np.ndarray) -> np.ndarray:
        """Its standard deviation [m] by propagation: noise and resolution of the reading, of the zero, and the calibration's own.

        var w = (dw/dx)^2 (var r + var zero) + a C a^T with a = (x, x^2, x^3), C the covariance of c1, c2, c3; a calibration
        without a covariance adds nothing, which the run's metadata say.
        """
        c, x = self.calibration, np.asarray(r) - self.zero
        slope = (3 * c.c3_m * x + 2 * c.c2_m) * x + c.c1_m
        resolution = 1 / ADC_COUNTS**2 / 12
        variance = slope**2 * (self.noise**2 * (1 + 1 / self.reports) + 2 * resolution)
        if c.covariance is not None:
            a = np.stack([x, x**2, x**3], axis=-1)
            variance = variance + np.einsum("...i,ij,...j->...", a, np.array(c.covariance)[1:, 1:], a)
        return np.sqrt(variance)


def reading(flex: np.ndarray) -> np.ndarray:
    """Fraction of full scale from the sum of a tick's conversions."""
    return np.asarray(flex, dtype=float) / (ADC_SAMPLES * ADC_COUNTS)


def grid(reports: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(ticks on an even grid that holds every report, each report's place in it); places left over are missing reports."""
    ticks = reports["tick"].astype(np.int64)
    step = int(np.gcd.reduce(np.diff(ticks))) if len(ticks) > 1 else 1
    even = np.arange(ticks[0], ticks[-1] + 1, step)
    return even, (ticks - ticks[0]) // step


def channels(
    reports: np.ndarray, mode: Mode, settings: dict[str, float], sensor: Sensor
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Ticks (T,) and the channels of UNITS (T,) of one session's reports, which ascend in time."""
    ticks, place = grid(reports)

    def spread(values: np.ndarray) -> np.ndarray:
        out = np.full(len(ticks), np.nan)
        out[place] = values
        return out

    per_m, per_rad, per_step = (
        settings[name] for name in ("motor_counts_per_m", "stepper_counts_per_rad", "stepper_steps_per_rad")
    )
    tracked = (reports["state"] == State.running) & (mode is Mode.position)
    r = reading(reports["flex"])
    out = {
        "joint/1/position": spread(reports["position_1"] / per_m),
        "joint/2/position": spread(reports["position_2"] / per_rad),
        "joint/1/reference": spread(np.where(tracked, reports["setpoint_1"] / (FRACTION * per_m), np.nan)),
        "joint/2/reference": spread(np.where(tracked, reports["setpoint_2"] / (FRACTION * per_step), np.nan)),
        # the board's figure is its duty times the supply it was told of; the motor gets the duty of the supply there is
        "joint/1/voltage": spread(reports["voltage"] / 1000 * (reports["supply"] / 1000 / settings["supply_V"])),
        "joint/2/pulses": spread(reports["steps"] / per_step),
        "link/2/tip_deflection": spread(sensor.tip(r)),
        "link/2/tip_deflection_std": spread(sensor.tip_std(r)),
        "link/2/flex_voltage": spread(ADC_V * r),
    }
    spacing = float(ticks[1] - ticks[0]) / CONTROL_HZ if len(ticks) > 1 else 1.0 / CONTROL_HZ
    for number in (1, 2):
        out[f"joint/{number}/velocity"] = velocity(out[f"joint/{number}/position"], spacing)
    return ticks, {name: out[name] for name in UNITS}


def velocity(position: np.ndarray, spacing_s: float, window_s: float = SMOOTH_S) -> np.ndarray:
    """Derivative of a local cubic (Savitzky and Golay, Anal. Chem. 36 (1964) 1627) that lies evenly about each sample.

    Samples beside a gap use what there is on their side of it; pieces shorter than the window have no velocity (NaN).
    """
    from scipy.signal import savgol_filter

    window = max(5, 2 * round(window_s / spacing_s / 2) + 1)
    out = np.full(len(position), np.nan)
    there = np.flatnonzero(np.isfinite(position))
    for piece in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1):
        if len(piece) >= window:
            out[piece] = savgol_filter(position[piece], window, 3, deriv=1, delta=spacing_s, mode="interp")
    return out


def commanded(knots: Knots, settings: dict[str, float]) -> np.ndarray:
    """What the board makes of the knots in each tick after the start, (K, 2) in the units of the reports' set-points.

    Position: cubics through the knots, then the set-point filter y += a (x - y). Open loop: each knot holds for a period.
    """
    period = 2**knots.period_log2
    if knots.mode is Mode.open_loop:
        return np.repeat(np.stack([knots.columns["voltage"], knots.columns["rate"]], axis=1).astype(float), period, axis=0)
    from scipy.interpolate import CubicHermiteSpline
    from scipy.signal import lfilter

    at = np.arange(len(knots)) * period
    out = []
    for number in (1, 2):
        position, speed = (np.asarray(knots.columns[f"{name}_{number}"], dtype=float) for name in ("position", "velocity"))
        if len(knots) == 1:
            return np.repeat([[float(knots.columns[f"position_{n}"][0]) for n in (1, 2)]], 1, axis=0)
        course = CubicHermiteSpline(at, position, speed)(np.arange(1, at[-1] + 1))
        if cut := settings[f"setpoint_{number}_Hz"]:
            a = 1 - np.exp(-2 * np.pi * cut / CONTROL_HZ)
            course = lfilter([a], [1, a - 1], course - position[0]) + position[0]
        out.append(course)
    return np.stack(out, axis=1)


def start_tick(reports: np.ndarray, knots: Knots, settings: dict[str, float]) -> tuple[float, float] | None:
    """The tick of t = 0 and how far it may be wrong [s]; None when the board never ran.

    Reports are some ticks apart, so that the first report of Running leaves a choice; the set-points in the reports decide it.
    Drives that hold for a period of knots may leave two ticks that fit alike: then it is half a tick from both.
    """
    running = np.flatnonzero(reports["state"] == State.running)
    if not len(running):
        return None
    first = running[0]
    latest = int(reports["tick"][first]) - 1
    earliest = int(reports["tick"][first - 1]) if first else latest - 1
    course = commanded(knots, settings)
    seen = reports[running]
    said = np.stack([seen["setpoint_1"], seen["setpoint_2"]], axis=1).astype(float)
    scale = np.abs(course).max(axis=0) + 1.0
    misfit = {}
    for start in range(max(earliest, latest - 2000), latest + 1):
        k = seen["tick"].astype(np.int64) - start - 1
        inside = (k >= 0) & (k < len(course))
        misfit[start] = float((((said[inside] - course[k[inside]]) / scale) ** 2).sum()) if inside.any() else np.inf
    best = min(misfit.values())
    alike = [start for start, m in misfit.items() if m <= best + 1e-12]
    return (alike[0] + alike[-1]) / 2, (alike[-1] - alike[0]) / 2 / CONTROL_HZ
