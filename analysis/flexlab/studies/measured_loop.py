"""A measured robot in closed loop: its fitted model under the maker's LQR, beside the measurement.

The law is that of `lqr_full_10deg.mat`, 500 times a second: current = K1 (reference - state), with
the state (hub angle, gauge, and their rates). Rates come from filters of second order, 40 Hz for
the hub (`wcf`) and that of the gauge for its own. The torque is 8.925 N m/A. The hub's friction is
the data sheet's. Stage 2 swings in the measurement; here it is locked straight.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import flexura as fx
from flexura import signals

from .measured import GAUGE
from .measured_fit import FILTER, MeasuredFit

FILE = "lqr_full_10deg.mat"
RATE_HZ = 500.0
TORQUE_N_M_A = 8.925
HUB_HZ = 40.0


@dataclass(frozen=True)
class Loop:
    """RMS deviations of the closed loop by the largest measured values: `hub`, `gauge`,
    `current`."""

    hub: float
    gauge: float
    current: float


@dataclass(frozen=True)
class _Log:
    """The measured part with currents: t (T,), reference, states (T, 4), current, gains (4,)."""

    t: np.ndarray
    reference: np.ndarray
    states: np.ndarray
    current: np.ndarray
    gains: np.ndarray


def closed_loop(fit: MeasuredFit, data: Path) -> Loop | None:
    """Simulate the closed loop.

    Args:
        fit: the fitted robot.
        data: folder with `lqr_full_10deg.mat`.

    Returns:
        How far it is off; None without that file.

    Raises:
        InputError: a damaged file, or a simulation that does not end.
    """
    path = data / FILE
    if not path.is_file():
        return None
    log = _read(path)
    start = {"link.1.joint.start_rad": float(log.states[0, 0])}
    robot = fit.found.robot.replace(start)
    per_m = _strain_by_deflection(fit.found.robot) * fit.found.values[f"{GAUGE}.gain"]
    law = _Law(log, per_m, float(log.states[0, 0]))
    run = fx.simulate(robot, log.t, fx.Sampled(law, RATE_HZ)).uninterrupted()
    if not run.complete:
        raise fx.InputError("the simulation of the closed loop did not end", file=str(path))
    gauge, current = np.array(law.said[: len(log.t)]).T
    return Loop(
        _off(run["joint/1/position"], log.states[:, 0]),
        _off(gauge, log.states[: len(gauge), 1]),
        _off(current, log.current[: len(current)]),
    )


class _Law:
    """The controller, with its filters' states."""

    def __init__(self, log: _Log, gauge_per_m: float, hub: float) -> None:
        self.log, self.gauge_per_m = log, gauge_per_m
        self.gauge = _Filter(FILTER[f"{GAUGE}.cutoff_Hz"], FILTER[f"{GAUGE}.cutoff_ratio"], 0.0)
        self.hub = _Filter(HUB_HZ, FILTER[f"{GAUGE}.cutoff_ratio"], hub)
        self.said: list[tuple[float, float]] = []

    def __call__(
        self, t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float
    ) -> list[float]:
        k = min(len(self.said), len(self.log.t) - 1)
        gauge, gauge_rate = self.gauge.next(self.gauge_per_m * tip_deflection)
        _, hub_rate = self.hub.next(float(position[0]))
        state = np.array([position[0], gauge, hub_rate, gauge_rate])
        wanted = np.array([self.log.reference[k], 0.0, 0.0, 0.0])
        current = float(self.log.gains @ (wanted - state))
        self.said.append((gauge, current))
        return [TORQUE_N_M_A * current]


class _Filter:
    """A low-pass filter of second order at the controller's rate, whose input is held."""

    def __init__(self, cutoff_Hz: float, ratio: float, start: float) -> None:
        from scipy.signal import cont2discrete

        w = 2 * np.pi * cutoff_Hz
        A = np.array([[0.0, 1.0], [-w * w, -2 * ratio * w]])
        whole = (A, np.array([[0.0], [w * w]]), np.eye(2), np.zeros((2, 1)))
        self.A, self.B = cont2discrete(whole, 1 / RATE_HZ)[:2]
        self.z = np.array([start, 0.0])

    def next(self, y: float) -> tuple[float, float]:
        """The filtered value and its rate, a tick later."""
        self.z = self.A @ self.z + self.B[:, 0] * y
        return float(self.z[0]), float(self.z[1])


def _strain_by_deflection(robot: fx.Robot) -> float:
    """Strain of the gauge by tip deflection, of a strip that swings in its first mode [1/m]."""
    t = np.linspace(0.0, 2.0, 501)
    swing = fx.Drive.prescribed(signals.cycloid(0.3, 0.4))
    run = fx.simulate(robot, t, swing).uninterrupted()
    w, strain = run["link/1/tip_deflection"], run[GAUGE]
    return float(strain @ w / (w @ w))


def _read(path: Path) -> _Log:
    from scipy.io import loadmat

    try:
        made = loadmat(path, squeeze_me=True, struct_as_record=False)
        measured, reference = made["stage1_X1_meas"], made["stage1_X1_ref"]
        currents = np.asarray(made["data_Im1"], dtype=float)
        first = int(np.argmin(np.abs(measured.time - currents[0, 0])))
        part = slice(first, first + len(currents))
        return _Log(
            np.arange(len(currents)) / RATE_HZ,
            np.asarray(reference.signals.values[part, 0], dtype=float),
            np.asarray(measured.signals.values[part], dtype=float),
            currents[:, 1],
            np.asarray(made["K1"], dtype=float),
        )
    except (OSError, KeyError, AttributeError, IndexError, ValueError, TypeError) as error:
        raise fx.InputError(
            f"expected stage1_X1_meas, stage1_X1_ref, data_Im1 and K1: {error}", file=str(path)
        ) from None


def _off(y: np.ndarray, measured: np.ndarray) -> float:
    return float(np.sqrt(np.mean((y - measured) ** 2)) / np.abs(measured).max())
