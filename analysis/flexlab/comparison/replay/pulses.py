"""Times of the stepper's pulses: the firmware's arithmetic for joint 2, replayed on the knots.

A report gives the number of pulses every 2 ms, so that a pulse's time is uncertain by 1 ms. Each
such error is a blow of one microstep (0.6 mm at the tip) x 1 ms; hundreds of them make the strip
vibrate by half a millimetre.

If joint 2's controller uses its own pulses only (`feedback_2`, `kf_2_rad_s_m`, `kg_2_rad_m` are 0),
or in open loop, knots and settings determine the pulses. The arithmetic is that of the firmware,
bit for bit: cubics and set-point filter (trajectory_player.cpp), the controller in integers
(pid.cpp), and the pulses of its rate (step_generator.cpp). The reports' numbers tell whether that
holds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import flexura as fx

from ...board.protocol.declaration import CONTROL_HZ, Mode
from ...board.protocol.player import Knots

TICK_COUNTS = 2000  # of the step timer
STEP, THRESHOLD, STEPS_PER_TICK, MAX_RATE = 4096, 3072, 5, 16383
RATE_OF_STEP = 268435  # Q16, 1/4096 microsteps a tick in 1 microstep/s
REPORT_TOLERANCE_S = 1e-4  # to a report: a pulse there may be in it or not

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
        settings: the board's settings, by name.
        given: pulses before the start.
        ticks: number of control ticks.

    Returns:
        Times after the start (P,) [s] and directions (P,), 1 or -1.
    """
    controller = _Controller(settings)
    if knots.mode is Mode.position:
        course = _course(knots, controller.filter, ticks)
        before = int(knots.columns["position_2"][0])
    else:
        period = 2**knots.period_log2
        rates = np.repeat(knots.columns["rate"], period)[:ticks].tolist()
        course, before = iter(rates + [0] * (ticks - len(rates))), 0
    ahead, times, ups = 0, [], []  # microsteps / 4096: commanded position less pulses
    for tick, target in enumerate(course, 1):
        if knots.mode is Mode.position:
            rate = controller.update(
                target - (256 * given + (ahead >> 4)), _narrow(target - before)
            )
            before = target
        else:
            rate = controller.follow(RATE_OF_STEP * target >> 16)
        up = 1 if rate > 0 else -1
        offsets = _plan(abs(rate), up * ahead)
        given += up * len(offsets)
        ahead += rate - up * STEP * len(offsets)
        times += [(tick + 1 + offset / TICK_COUNTS) / CONTROL_HZ for offset in offsets]
        ups += [up] * len(offsets)
    return np.array(times), np.array(ups, dtype=int)


def _course(knots: Knots, filter_: int, ticks: int) -> Iterator[int]:
    """Joint 2's filtered set-point in each tick [microsteps / 256], as the firmware computes it."""
    log2, period = knots.period_log2, 2**knots.period_log2
    positions, speeds = knots.columns["position_2"].tolist(), knots.columns["velocity_2"].tolist()
    setpoint = positions[0]
    for tick in range(1, ticks + 1):
        k, part = divmod(tick, period)
        position = positions[min(k, len(positions) - 1)]
        if part and k < len(positions) - 1:
            way, v0, v1 = positions[k + 1] - position, speeds[k] << log2, speeds[k + 1] << log2
            s = part * (65536 >> log2)
            cubic = (v0 + v1 - 2 * way) * s >> 16
            square = (cubic + 3 * way - 2 * v0 - v1) * s >> 16
            position += (square + v0) * s >> 16
        setpoint += (position - setpoint) * filter_ >> 16 if filter_ else position - setpoint
        yield setpoint


class _Controller:
    """The firmware's PID of joint 2 on its own pulses; gains in fixed point, as on the board."""

    def __init__(self, settings: dict[str, float]) -> None:
        f = np.float32
        value = {name: f(number) for name, number in settings.items()}
        tick, unit = f(0.001), f(4096) * f(0.001)  # units of the rate in 1 microstep/s
        fixed = lambda x: int(x + f(-0.5 if x < 0 else 0.5))
        per_rad = value["stepper_steps_per_rad"]
        self.kp = fixed(value["kp_2_1_s"] * (unit / f(16) * f(2**16)))
        self.ki = fixed(value["ki_2_1_s2"] * (unit / f(16) * tick * f(2**32)))
        self.kd, self.kv = (fixed(value[name] * (f(4096) * f(256))) for name in ("kd_2", "kv_2"))
        self.limit = int(min(value["rate_max_2_rad_s"] * per_rad * unit + f(0.5), f(MAX_RATE)))
        self.slew = int(
            min(
                max(value["acceleration_max_2_rad_s2"] * per_rad * tick * unit + f(0.5), f(1)),
                f(MAX_RATE),
            )
        )
        cut = value["setpoint_2_Hz"]
        self.filter = (
            int(min(max((f(1) - np.exp(f(-6.2831853) * cut * tick)) * f(65536), f(1)), f(65535)))
            if cut > 0
            else 0
        )
        self.sum = self.output = 0

    def follow(self, wish: int) -> int:
        """Limit a wanted rate by rate and slew limits [microsteps / 4096 a tick]."""
        limited = min(max(_narrow(wish), -self.limit), self.limit)
        self.output = min(max(limited, self.output - self.slew), self.output + self.slew)
        return self.output

    def update(self, off: int, setpoint_rate: int) -> int:
        """One tick of the controller.

        Args:
            off: the error [microsteps / 256].
            setpoint_rate: rate of the set-point [microsteps / 256 a tick].

        Returns:
            The rate [microsteps / 4096 a tick].
        """
        error = _narrow(off >> 4)
        total = self.sum + self.ki * error
        if not -self.limit <= total >> 32 < self.limit:
            total = self.sum
        damped = self.kd * _narrow(setpoint_rate - (self.output >> 4)) if self.kd else 0
        wish = (total >> 16) + self.kp * error + damped + self.kv * setpoint_rate >> 16
        output, up = self.follow(wish), (error < 0) == (self.ki < 0)
        if not (wish > output and up) and not (wish < output and not up):
            self.sum = total
        return output


def _plan(pace: int, ahead: int) -> list[int]:
    """Counts of the step timer from a tick's beginning to each step, for a rising position."""
    over = ahead + pace - THRESHOLD
    if over < 0:
        return []
    count = min(over // STEP + 1, STEPS_PER_TICK)
    first = max(THRESHOLD - ahead, 0)
    if count == 1:
        return [_ratio(first, pace) * TICK_COUNTS >> 12]
    interval = _ratio(STEP, pace) * TICK_COUNTS >> 8
    at = first * interval >> 12
    return [at + k * interval >> 4 for k in range(count)]


def _ratio(part: int, whole: int) -> int:
    """part / whole as Q12, rounded down, at most 4095."""
    return min((part << 12) // whole, 4095)


def _narrow(value: int) -> int:
    return min(max(value, -32768), 32767)
