"""Predictive control of a robot with two flexible links: processor time of a tick, and what is left
of the motion, beside LQG."""

from __future__ import annotations

import gc
import time
from typing import Any

import numpy as np

import flexura as fx
from flexura.signals import polynomial, step

END, T_END, LIMIT = (0.8, -0.5), 0.3, np.array([2.0, 0.4])  # rad, s, N m
INTERVALS, BETA_S, MODES = 20, 2e-3, 2
CASES = ((500.0, 1, 2.0), (1000.0, 8, 1.0))  # rate, spread, required: ms of 99.9 % of the ticks
SHARE = 0.1  # required: at most, of LQG's residual
COMMON: dict[str, Any] = {"limit": LIMIT, "disturbance": [0.05, 0.02], "damping": 0.02}


def two_links(modes: int = 0) -> fx.Robot:
    """The robot of type I with damped links, with so many modes of each link; 0: its mesh."""
    data = fx.load("type-1-rr").to_dict()
    for link in data["link"]:
        link["damping"] = {"beta_s": BETA_S}
        link |= {"modes": modes} if modes else {}
    return fx.Robot.from_dict(data)


def residual(run: fx.Run, robot: fx.Robot) -> float:
    """Largest distance of the tip from its end after the motion [m]."""
    x, y, _ = fx.tip_pose(robot, fx.static(robot, joints=list(END)))
    off = np.hypot(run["tip/x"] - x, run["tip/y"] - y)
    return float(off[run.t >= T_END].max())


class Timed:
    """A law whose ticks are timed, in seconds of its thread."""

    def __init__(self, law: Any) -> None:
        self.law, self.times = law, list[float]()

    def __call__(
        self,
        t: float,
        position: Any,
        velocity: Any,
        tip: Any,
        *,
        tip_deflections: Any,
        sensors: Any,
    ) -> Any:
        """The forces of a tick."""
        begun = time.thread_time()
        out = self.law(t, position, velocity, tip, tip_deflections=tip_deflections, sensors=sensors)
        self.times.append(time.thread_time() - begun)
        return out


def best_lqg(plant: fx.Robot, t: np.ndarray) -> float:
    """The smallest residual of LQG designs, under steps and under the same motion [m]."""
    best = np.inf
    for signal in (step, lambda end: polynomial(end, T_END)):
        for deflection in (0.005, 0.02, 0.05):
            for position in (0.005, 0.02):
                for share in (0.5, 3.0):
                    law, _ = fx.lqg(
                        two_links(MODES),
                        [signal(end) for end in END],
                        share * LIMIT,
                        500.0,
                        position=position,
                        deflection=deflection,
                        follow="tips",
                        **COMMON,
                    )
                    run = fx.simulate(plant, t, law, rtol=1e-5)
                    best = min(best, residual(run, plant) if run.complete else np.inf)
    return best


def timed(rate: float, spread: int, rounds: int) -> tuple[np.ndarray, fx.Run, int]:
    """The ticks of runs of one controller.

    Args:
        rate: ticks a second.
        spread: ticks over which the linearisation is spread.
        rounds: runs, all alike.

    Returns:
        Processor times of the ticks but the first, which linearises everything, (rounds, ticks)
            [s]; the last Run; programs without a solution.
    """
    plant, t = two_links(), np.linspace(0, 0.6, 301)
    sampled = fx.nmpc(
        two_links(MODES),
        [polynomial(end, T_END) for end in END],
        3 * LIMIT,
        rate,
        intervals=INTERVALS,
        spread=spread,
        position=0.005,
        deflection=0.05,
        deflection_limit=0.05,
        speed_limit=8.0,
        **COMMON,
    )
    law: Any = sampled.function
    times = []
    gc.collect()
    gc.freeze()
    for _ in range(rounds):
        watched = Timed(law)
        run = fx.simulate(plant, t, fx.Sampled(watched, rate))
        times.append(watched.times[1:])
    gc.unfreeze()
    return np.array(times), run, law.failures


def measure(rounds: int) -> list[dict[str, Any]]:
    """Time the ticks of runs at both rates, and compare the residuals.

    Args:
        rounds: runs at each rate.

    Returns:
        Rows: rate, spread, intervals, ticks, their median and percentiles [ms], the 99.9th
            percentile of each tick's least time in all runs, which other work on the machine does
            not change, what is required, residuals of both [mm].
    """
    plant, t, rows = two_links(), np.linspace(0, 0.6, 301), []
    lqg = best_lqg(plant, t)
    for rate, spread, most in CASES:
        times, run, failures = timed(rate, spread, rounds)
        median, high, highest = 1e3 * np.percentile(times, (50, 99, 99.9))
        rows.append(
            {
                "rate_Hz": rate,
                "spread": spread,
                "intervals": INTERVALS,
                "ticks": times.size,
                "median_ms": float(median),
                "p99_ms": float(high),
                "p999_ms": float(highest),
                "least_p999_ms": float(1e3 * np.percentile(times.min(axis=0), 99.9)),
                "required_ms": most,
                "failures": failures,
                "residual_mm": 1e3 * residual(run, plant),
                "lqg_residual_mm": 1e3 * lqg,
            }
        )
    return rows
