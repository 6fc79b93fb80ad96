"""When the stepper got each of its pulses: the firmware's own arithmetic for joint 2, replayed on
the knots that were sent.

A report has the pulses' number, every 2 ms. Between two of them a pulse may have come 1 ms sooner
or later than a line through the numbers says; each such error is a blow of one microstep (0.6 mm at
the tip) x 1 ms, and hundreds of them make the strip ring by half a millimetre. Where the controller
of joint 2 sees nothing but its own pulses and no strip (`feedback_2`, `kf_2_rad_s_m`, `kg_2_rad_m`
0), or there is none, the pulses follow from knots and settings alone: cubics and set-point filter
(player.cpp), the controller in integers (pid.cpp), and its rate's pulses (steps.cpp), bit for bit.
The reports' numbers tell whether that holds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import flexura as fx

from ...board.protocol.declaration import CONTROL_HZ, Mode
from ...board.protocol.player import Knots

TICK_COUNTS = 2000  # of the step timer
STEP, THRESHOLD, STEPS_PER_TICK, MOST = 4096, 3072, 5, 16383
RATE_OF_STEP = 268435  # Q16, 1/4096 microsteps a tick in 1 microstep/s
CLOSE_S = 1e-4  # to a report: a pulse there may be in it or not

_OWN = ("feedback_2", "kf_2_rad_s_m", "kg_2_rad_m")


def from_run(run: fx.Run) -> tuple[np.ndarray, np.ndarray] | None:
    """Times [s] of the pulses (P,), and joint 2's angle by them from each on (P,) [rad]; the first
    is the run's first sample.

    None where its metadata lack the knots, where the controller needs more than them, or where a
    report says otherwise.
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
    if knots.mode is Mode.position and any(settings[name] for name in _OWN):
        return None
    there = np.isfinite(run["joint/2/pulses"])
    t, per_rad = run.t[there], settings["stepper_steps_per_rad"]
    seen = np.round(run["joint/2/pulses"][there] * per_rad)
    at, up = pulses(knots, settings, int(seen[0]), round(CONTROL_HZ * float(t[-1])) + 1)
    count = seen[0] + np.concatenate([[0], np.cumsum(up)])
    given = lambda late: count[np.searchsorted(at, t + late)]
    unsure = float(meta.get("start_uncertainty_s", 0.0))
    for late in {0.0, -unsure, unsure}:  # the start may be half a tick from where it was put
        earlier, later = given(late - CLOSE_S), given(late + CLOSE_S)
        if ((seen >= np.minimum(earlier, later)) & (seen <= np.maximum(earlier, later))).all():
            return np.concatenate([[run.t[0]], at - late]), count / per_rad
    return None


def pulses(
    knots: Knots, settings: dict[str, float], given: int, ticks: int
) -> tuple[np.ndarray, np.ndarray]:
    """Times after the start (P,) [s] and directions (P,) of the pulses planned in so many ticks,
    `given` of them before."""
    controller = _Controller(settings)
    if knots.mode is Mode.position:
        course = _course(knots, controller.filter, ticks)
        before = int(knots.columns["position_2"][0])
    else:
        period = 2**knots.period_log2
        rates = np.repeat(knots.columns["rate"], period)[:ticks].tolist()
        course, before = iter(rates + [0] * (ticks - len(rates))), 0
    ahead, times, ups = 0, [], []  # microsteps / 4096: the position asked for less the pulses given
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
    """Joint 2's filtered set-point in each tick after the start, microsteps / 256: the cubics of
    `Player::cubic_tick`."""
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
    """`Pid` of joint 2 on its own pulses; gains as `make_scales` makes them, in single
    precision."""

    def __init__(self, settings: dict[str, float]) -> None:
        f = np.float32
        value = {name: f(number) for name, number in settings.items()}
        tick, unit = f(0.001), f(4096) * f(0.001)  # units of the rate in 1 microstep/s
        fixed = lambda x: int(x + f(-0.5 if x < 0 else 0.5))
        per_rad = value["stepper_steps_per_rad"]
        self.kp = fixed(value["kp_2_1_s"] * (unit / f(16) * f(2**16)))
        self.ki = fixed(value["ki_2_1_s2"] * (unit / f(16) * tick * f(2**32)))
        self.kd, self.kv = (fixed(value[name] * (f(4096) * f(256))) for name in ("kd_2", "kv_2"))
        self.limit = int(min(value["rate_max_2_rad_s"] * per_rad * unit + f(0.5), f(MOST)))
        self.slew = int(
            min(
                max(value["acceleration_max_2_rad_s2"] * per_rad * tick * unit + f(0.5), f(1)),
                f(MOST),
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
        """The output [microsteps / 4096 a tick] that limit and slew leave of a wish."""
        limited = min(max(_narrow(wish), -self.limit), self.limit)
        self.output = min(max(limited, self.output - self.slew), self.output + self.slew)
        return self.output

    def update(self, off: int, setpoint_rate: int) -> int:
        """One tick, from the error [microsteps / 256] and the set-point's rate [the same a
        tick]."""
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
    """The step timer's counts from the tick's begin to each step, as if the position rose:
    `Steps::plan`."""
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
    """part / whole as Q12, rounded down, of its 12 bits."""
    return min((part << 12) // whole, 4095)


def _narrow(value: int) -> int:
    return min(max(value, -32768), 32767)
