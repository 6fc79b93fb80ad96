"""Times of the stepper's pulses: the firmware's code for joint 2, replayed on the knots.

A report gives the number of pulses every 2 ms, so that the time of a pulse is uncertain by 1 ms.
Each such error is an impulse of one microstep (0.6 mm at the tip) x 1 ms. Hundreds of them make the
strip vibrate by half a millimetre.

Knots and settings determine the pulses in open loop. In closed loop they do so if joint 2's
controller uses its own pulses only (`feedback_2`, `kf_2_rad_s_m`, `kg_2_rad_m` are 0). The core
compiles the firmware's trajectory player, PID and step generator (model/core/control/board_pulses).
The reports' numbers tell whether the replay holds.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.control import board_pulses

from ...board.protocol.declaration import CONFIG, CONTROL_HZ, Mode
from ...board.protocol.player import Knots

TICK_COUNTS = 2000  # of the step timer
REPORT_TOLERANCE_S = 1e-4  # to a report: a pulse there may be in it or not
_FIELDS = {
    Mode.position: ("position_1", "position_2", "velocity_1", "velocity_2"),
    Mode.open_loop: ("", "", "voltage", "rate"),
}

_OTHER_FEEDBACK = ("feedback_2", "kf_2_rad_s_m", "kg_2_rad_m")


def pulses_of_run(run: fx.Run) -> tuple[np.ndarray, np.ndarray] | None:
    """Times and angles of joint 2's pulses in a run.

    Returns:
        Times (P,) [s] and the angle from each time on (P,) [rad], the first at the run's start.
            None if the metadata lack the knots, if the controller uses other measurements, or if a
            report contradicts the pulses.
    """
    meta = run.meta
    settings, spec = meta.get("settings"), meta.get("knots")
    if not settings or not spec or "joint/2/pulses" not in run:
        return None
    knots = Knots(
        Mode(spec["mode"]),
        spec["period_log2"],
        {name: np.array(v) for name, v in spec["columns"].items()},
    )
    if knots.mode is Mode.position and any(settings[name] for name in _OTHER_FEEDBACK):
        return None
    there = np.isfinite(run["joint/2/pulses"])
    t, per_rad = run.t[there], settings["stepper_steps_per_rad"]
    seen = np.round(run["joint/2/pulses"][there] * per_rad)
    at, up = planned_pulses(knots, settings, int(seen[0]), round(CONTROL_HZ * float(t[-1])) + 1)
    count = seen[0] + np.concatenate([[0], np.cumsum(up)])
    given = lambda late: count[np.searchsorted(at, t + late)]
    unsure = float(meta.get("start_uncertainty_s", 0.0))
    for late in {0.0, -unsure, unsure}:  # the start is known to half a tick
        earlier, later = given(late - REPORT_TOLERANCE_S), given(late + REPORT_TOLERANCE_S)
        if ((seen >= np.minimum(earlier, later)) & (seen <= np.maximum(earlier, later))).all():
            return np.concatenate([[run.t[0]], at - late]), count / per_rad
    return None


def planned_pulses(
    knots: Knots, settings: dict[str, float], given: int, ticks: int
) -> tuple[np.ndarray, np.ndarray]:
    """The pulses that the firmware plans.

    Args:
        knots: the knots that were sent.
        settings: the board's settings, by name; others have their defaults.
        given: pulses before the start.
        ticks: number of control ticks.

    Returns:
        Times after the start (P,) [s] and directions (P,), 1 or -1.
    """
    values = [settings.get(name, item.default) for name, item in CONFIG.items()]
    zeros = np.zeros(len(knots), dtype=np.int64)
    rows = np.column_stack([knots.columns.get(name, zeros) for name in _FIELDS[knots.mode]])
    counts, directions = board_pulses(
        values, rows, knots.period_log2, given, ticks, open_loop=knots.mode is Mode.open_loop
    )
    return counts / (TICK_COUNTS * CONTROL_HZ), directions
