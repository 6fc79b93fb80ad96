"""The 10 s open-loop excitation that an identification needs.

    0.0 to 0.3 s   rest: noise of the flex sensor
    0.3 to 4.2 s   joint 2 near 0, the strip across the rail's forces: strokes excite the first
                   mode, a chirp passes the second; the carriage moves at many speeds: friction
    4.2 to 5.4 s   joint 2 turns until the strip stands across the rail
    5.4 to 9.0 s   the carriage sweeps through the first mode in strokes of some tenths of a
                   millimetre: backlash
    9.0 to 10 s    free vibration: damping

Motors that turn their joints take turns in such strokes and sweeps through both modes.

Frequencies and rates follow from the nominal robot, so that a strip of another length is excited as
well.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import flexura as fx

from ..rig import RigSetup
from .plan import Plan, forward

DURATION_S = 9.0  # and one second of rest at the end
STEP_S = 0.008  # of the board's knots
CHIRP = (0.4, 4.0)  # [s], with the strip along the rail
STROKE_RAD_S, CHIRP_RAD_S = 0.5, 0.9
TURN_RAD, TURN_S, TURN_AT_S = 1.2, 1.2, 4.2
SWEEP = (5.4, 8.9)
STROKE_V, SWEEP_V = (3.0, 6.0), 2.8
# of motors that turn their joints: a voltage is a speed, and the second mode takes more of it
SWEEP_TURNING_V, FAST_V = 2.2, 9.0
# the board's limit in this experiment: a jump of the rate by a microstep is harmless
ACCELERATION_RAD_S2 = 500.0


def plan(setup: RigSetup, settings: dict[str, float]) -> Plan:
    """The plan of the excitation, whatever the rig's limit of a stepper's acceleration.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
    """
    if setup.rig.stepper:
        settings = settings | {"acceleration_max_2_rad_s2": ACCELERATION_RAD_S2}
    return forward(setup, settings, profile(setup))


def profile(setup: RigSetup) -> dict[str, Any]:
    """Tables of a profile for `flexura bench forward`: what each drive gets.

    Args:
        setup: the rig.
    """
    first, second = fx.frequencies(fx.assemble(setup.robot), joints="locked")[:2]
    t = np.arange(round(DURATION_S / STEP_S)) * STEP_S
    hold = lambda values: {
        "kind": "piecewise",
        "at_s": t.round(6).tolist(),
        "value": values.round(6).tolist(),
    }
    out = {"name": "excitation for the identification", "duration_s": DURATION_S}
    if setup.rig.screw:
        return out | {
            "voltage_V": hold(_voltage(t, first)),
            "rate_rad_s": hold(_rate(t, first, second)),
        }
    keys = ("voltage_V", "rate_rad_s" if setup.rig.stepper else "voltage_2_V")[: setup.rig.joints]
    # the joints take turns: each moves while the others hold
    length = (SWEEP[1] - CHIRP[0]) / len(keys)
    for k, key in enumerate(keys):
        begin = CHIRP[0] + k * length
        course = (
            _rate(t, first, second)
            if key == "rate_rad_s"
            else _turning(t, begin, begin + length, first, second)
        )
        out[key] = hold(course)
    return out


def _turning(t: np.ndarray, a: float, b: float, first_Hz: float, second_Hz: float) -> np.ndarray:
    """Voltage of a motor that turns its joint, from a to b [s]: strokes, then both modes."""
    third = (b - a) / 3
    strokes = STROKE_V[1] * np.cos(2 * np.pi * 1.0 * (t - a)) * _window(t, a, a + third)
    low = _chirp(t, a + third, a + 2 * third, 0.78 * first_Hz, 1.18 * first_Hz)
    high = _chirp(t, a + 2 * third, b, 0.8 * second_Hz, 1.1 * second_Hz)
    sweep = SWEEP_TURNING_V * np.cos(2 * np.pi * low) * _window(t, a + third, a + 2 * third)
    fast = FAST_V * np.cos(2 * np.pi * high) * _window(t, a + 2 * third, b)
    return strokes + sweep + fast


def _voltage(t: np.ndarray, first_Hz: float) -> np.ndarray:
    a, b = CHIRP
    part = np.clip((t - a) / (b - a), 0, 1)
    strokes = (
        (STROKE_V[0] + (STROKE_V[1] - STROKE_V[0]) * part)
        * np.sin(2 * np.pi * (0.8 + 0.35 * part) * (t - a))
        * _window(t, a, b)
    )
    a, b = SWEEP
    sweep = (
        SWEEP_V
        * np.sin(2 * np.pi * _chirp(t, a, b, 0.78 * first_Hz, 1.18 * first_Hz))
        * _window(t, a, b)
    )
    return strokes + sweep


def _rate(t: np.ndarray, first_Hz: float, second_Hz: float) -> np.ndarray:
    a, b = CHIRP
    middle = (a + b) / 2
    chirp = np.where(
        t < middle,
        _chirp(t, a, middle, 0.78 * second_Hz, 1.06 * second_Hz),
        _chirp(t, middle, b, 1.06 * second_Hz, 0.78 * second_Hz),
    )
    rate = CHIRP_RAD_S * np.sin(2 * np.pi * chirp) * _window(t, a, b)
    # its beginning and its end ring together
    rate += STROKE_RAD_S * _window(t, a, a + 1.5 / first_Hz)
    s = np.clip((t - TURN_AT_S) / TURN_S, 0, 1)
    return rate + TURN_RAD / TURN_S * 30 * (s * (1 - s)) ** 2  # d/ds (10 s^3 - 15 s^4 + 6 s^5)


def _chirp(t: np.ndarray, a: float, b: float, low_Hz: float, high_Hz: float) -> np.ndarray:
    """Phase in turns of an oscillation whose frequency rises linearly between a and b [s]."""
    s = np.clip(t, a, b) - a
    return low_Hz * s + (high_Hz - low_Hz) * s**2 / (2 * (b - a))


def _window(t: np.ndarray, a: float, b: float) -> np.ndarray:
    return np.where((t >= a) & (t < b), 1.0, 0.0)
