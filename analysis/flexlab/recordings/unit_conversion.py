"""Conversion of the board's reports to physical quantities.

    q = counts / (counts for 1 m or 1 rad),   pulses = steps / stepper_steps_per_rad
    r = sum of the conversions / (adc_samples 1024)
    w = c1 x + c2 x^2 + c3 x^3,  x = r - zero

A report that did not arrive is NaN in every channel, and so is what depends on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..board.protocol.declaration import ADC_SAMPLES, CONTROL_HZ, Mode, State
from ..board.protocol.player import FRACTION, JOINTS, VOLT_UNIT_V, Knots
from ..rig.board_axes import BoardAxis, board_axes
from ..rig.sensors import Calibration

ADC_COUNTS, ADC_V = 1024, 5.0
# reports in the window of the velocity's local cubic: -3 dB at some 36 Hz, no phase lag
VELOCITY_WINDOW = 21
DEFLECTION_SENSORS = ("flex", "strain_gauge")


def units_of(axes: Sequence[BoardAxis], strip: int, sensor: str) -> dict[str, str]:
    """The channels of an experiment and their units, in their order.

    Args:
        axes: the joints.
        strip: number of the link that has the sensor.
        sensor: kind of the sensor: "flex", "strain_gauge", "accelerometer", or "" for none.
    """
    out = {f"joint/{axis.number}/position": axis.unit for axis in axes}
    out |= {f"joint/{axis.number}/velocity": f"{axis.unit}/s" for axis in axes}
    out |= {f"joint/{axis.number}/reference": axis.unit for axis in axes}
    out |= {axis.command: axis.command_unit for axis in axes}
    if sensor in DEFLECTION_SENSORS:
        out |= {f"link/{strip}/tip_deflection": "m", f"link/{strip}/tip_deflection_std": "m"}
    if sensor:
        out[voltage_channel(strip, sensor)] = "V"
    if sensor == "accelerometer":
        out["sensor/accelerometer"] = "m/s^2"
    return out


def voltage_channel(strip: int, sensor: str) -> str:
    """The channel of the sensor's voltage."""
    return f"link/{strip}/{sensor}_voltage"


@dataclass(frozen=True)
class Sensor:
    """The calibrated sensor of a link.

    `zero`: today's reading of the straight strip, the mean of `reports` reports. `noise`: standard
    deviation of one report. `kind`: its table in the rig file, "" for no sensor. `strip`: number of
    its link. `V_s2_per_m`: of an accelerometer.
    """

    calibration: Calibration
    zero: float
    noise: float = 0.0
    reports: int = 1
    kind: str = "flex"
    strip: int = 2
    V_s2_per_m: float = 1.0

    def tip(self, r: np.ndarray) -> np.ndarray:
        """Tip deflection [m] of readings (fractions of full scale)."""
        c, x = self.calibration, np.asarray(r) - self.zero
        return ((c.c3_m * x + c.c2_m) * x + c.c1_m) * x

    def tip_std(self, r: np.ndarray) -> np.ndarray:
        """Standard deviation of the tip deflection [m], by propagation of errors.

        var w = (dw/dx)^2 (var r + var zero) + a C a^T with a = (x, x^2, x^3) and C the covariance
        of c1, c2, c3. Noise and resolution make var r and var zero. Without a covariance of the
        calibration, C is 0; the run's metadata say so.
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


def flex_reading(flex: np.ndarray) -> np.ndarray:
    """Fraction of full scale from the sum of a tick's conversions."""
    return np.asarray(flex, dtype=float) / (ADC_SAMPLES * ADC_COUNTS)


def ticks_of_reports(
    reports: np.ndarray, numbers: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Ticks of all reports that the board made, and which of them arrived.

    A missing report gets a tick evenly between its neighbours.

    Args:
        reports: the reports that arrived (n,).
        numbers: their numbers (n,), modulo 2^16; None: all arrived.

    Returns:
        Ticks (T,) and indices (n,) of the reports that arrived.
    """
    ticks = reports["tick"].astype(float)
    if numbers is None or len(numbers) < 2:
        return ticks, np.arange(len(ticks))
    ahead = np.maximum(np.mod(np.diff(numbers), 1 << 16), 1)
    # no more reports than ticks: the board counts anew
    ahead = np.minimum(ahead, np.maximum(np.diff(ticks), 1)).astype(int)
    arrived = np.concatenate([[0], np.cumsum(ahead)])
    return np.interp(np.arange(arrived[-1] + 1), arrived, ticks), arrived


def channels_of_reports(
    reports: np.ndarray,
    mode: Mode,
    settings: dict[str, float],
    sensor: Sensor,
    numbers: np.ndarray | None = None,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The channels of one session's reports.

    Args:
        reports: the reports (n,), ascending in time.
        mode: the mode of the experiment.
        settings: the board's settings, by name.
        sensor: the calibrated sensor.
        numbers: the reports' numbers, as in `ticks_of_reports`.

    Returns:
        Ticks (T,), and the channels of `units_of`, (T,) each.
    """
    ticks, arrived = ticks_of_reports(reports, numbers)

    def at_ticks(values: np.ndarray) -> np.ndarray:
        out = np.full(len(ticks), np.nan)
        out[arrived] = values
        return out

    axes = board_axes(settings)
    half_V = settings["supply_divider"] * ADC_V / ADC_COUNTS / 2  # a conversion rounds down
    # the board reports duty times the supply in its settings; a motor gets duty times the actual
    # supply
    supply = (reports["supply"] / 1000 + half_V) / settings["supply_V"]
    tracked = (reports["state"] == State.running) & (mode is Mode.position)
    r = flex_reading(reports["flex"])
    out = {}
    for axis in axes:
        n = axis.number
        setpoint = reports[f"setpoint_{n}"] / (FRACTION * axis.setpoints)
        out[f"joint/{n}/position"] = at_ticks(reports[f"position_{n}"] / axis.counts)
        out[f"joint/{n}/reference"] = at_ticks(np.where(tracked, setpoint, np.nan))
        if axis.kind == "motor":
            volts = reports["voltage" if n == 1 else "voltage_2"] * VOLT_UNIT_V
            out[axis.command] = at_ticks(volts * supply)
        else:
            out[axis.command] = at_ticks(reports["steps"] / axis.setpoints)
        out[f"joint/{n}/velocity"] = velocity(ticks / CONTROL_HZ, out[f"joint/{n}/position"])
    link = f"link/{sensor.strip}"
    if sensor.kind in DEFLECTION_SENSORS:
        out[f"{link}/tip_deflection"] = at_ticks(sensor.tip(r))
        out[f"{link}/tip_deflection_std"] = at_ticks(sensor.tip_std(r))
    if sensor.kind:
        out[voltage_channel(sensor.strip, sensor.kind)] = at_ticks(ADC_V * r)
    if sensor.kind == "accelerometer":
        measured = ADC_V * (r - sensor.zero) / sensor.V_s2_per_m
        out["sensor/accelerometer"] = at_ticks(measured)
    return ticks, {name: out[name] for name in units_of(axes, sensor.strip, sensor.kind)}


def velocity(t: np.ndarray, position: np.ndarray, samples: int = VELOCITY_WINDOW) -> np.ndarray:
    """Velocity by a local cubic: Savitzky-Golay filter, Anal. Chem. 36 (1964) 1627.

    Ends and the sides of a gap use the nearest full window. Pieces shorter than a window have no
    velocity (NaN).

    Args:
        t: times (T,) [s].
        position: positions (T,), NaN if missing.
        samples: length of the window, an odd number.

    Returns:
        Velocities (T,).
    """
    out = np.full(len(position), np.nan)
    present = np.flatnonzero(np.isfinite(position))
    half = samples // 2
    for piece in np.split(present, np.flatnonzero(np.diff(present) > 1) + 1):
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


def planned_setpoints(knots: Knots, settings: dict[str, float]) -> np.ndarray:
    """The set-points that the board makes of the knots in each tick after the start.

    Position: cubics through the knots, then the set-point filter y += a (x - y). Open loop: each
    knot holds for a period.

    Args:
        knots: the knots.
        settings: the board's settings, by name.

    Returns:
        (K, 2) in the units of the reports' set-points.
    """
    period = 2**knots.period_log2
    if knots.mode is Mode.open_loop:
        # joint 2 has one of the two drives; knots of older recordings have no voltage_2
        second = np.asarray(knots.columns["rate"]) + np.asarray(knots.columns.get("voltage_2", 0))
        both = np.stack([np.asarray(knots.columns["voltage"]), second], axis=1)
        return np.repeat(both.astype(float), period, axis=0)
    from scipy.interpolate import CubicHermiteSpline
    from scipy.signal import lfilter

    at = np.arange(len(knots)) * period
    out = []
    for number in JOINTS:
        position, speed = (
            np.asarray(knots.columns[f"{name}_{number}"], dtype=float)
            for name in ("position", "velocity")
        )
        if len(knots) == 1:
            return np.array([[float(knots.columns[f"position_{n}"][0]) for n in JOINTS]])
        course = CubicHermiteSpline(at, position, speed)(np.arange(1, at[-1] + 1))
        if cut := settings[f"setpoint_{number}_Hz"]:
            a = 1 - np.exp(-2 * np.pi * cut / CONTROL_HZ)
            course = lfilter([a], [1, a - 1], course - position[0]) + position[0]
        out.append(course)
    return np.stack(out, axis=1)


def start_tick(
    reports: np.ndarray, knots: Knots, settings: dict[str, float]
) -> tuple[float, float] | None:
    """The tick of t = 0.

    Reports are some ticks apart, so that the first report of Running leaves a choice; the
    set-points decide it. Drives that hold for a period may leave two ticks that fit alike; the
    result is then half a tick from both.

    Returns:
        The tick and its uncertainty [s]; None if the board never ran.
    """
    running = np.flatnonzero(reports["state"] == State.running)
    if not len(running):
        return None
    first = running[0]
    latest = int(reports["tick"][first])  # reported before its first tick was over
    earliest = int(reports["tick"][first - 1]) if first else latest - 2
    course = planned_setpoints(knots, settings)
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
