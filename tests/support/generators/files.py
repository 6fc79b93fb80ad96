"""Random well-formed manoeuvre, gains and rig files."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

GAINS = {  # names of a joint's gains by its output, with {} its number
    "motor": ("kp_{}_V_m", "ki_{}_V_m_s", "kd_{}_V_s_m", "kf_{}_V_m", "voltage_max_{}_V"),
    "stepper": ("kp_{}_1_s", "ki_{}_1_s2", "kd_{}", "kf_{}_rad_s_m", "rate_max_{}_rad_s"),
    "force": ("kp_{}_N_m", "ki_{}_N_m_s", "kd_{}_N_s_m", "kf_{}_N_m", "force_max_{}_N"),
    "torque": ("kp_{}_N_m_rad", "ki_{}_N_m_rad_s", "kd_{}_N_m_s_rad", "torque_max_{}_N_m"),
}


def size(rng: np.random.Generator, low: float = -6, high: float = 6) -> float:
    """A number of either sign, of any order of magnitude between these powers of ten."""
    return float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(low, high))


def signal(rng: np.random.Generator, smooth: bool = False) -> dict[str, Any]:
    """The table of a signal; `smooth`: one that neither jumps in position nor in velocity."""
    kinds = ("cycloid", "polynomial", "trapezoidal", "constant")
    more = ("step", "harmonic", "ramp", "piecewise", "table", "bang_bang")
    kind = str(rng.choice(kinds if smooth else kinds + more))
    span, at = float(10 ** rng.uniform(-3, 2)), float(rng.choice([0.0, rng.uniform(0, 10)]))
    if kind == "constant":
        return {"kind": kind, "value": size(rng)}
    if kind == "step":
        return {"kind": kind, "value": size(rng), "at_s": at}
    if kind == "harmonic":
        return {"kind": kind, "amplitude": size(rng), "frequency_Hz": 1 / span}
    if kind in ("piecewise", "table"):
        count = int(rng.integers(2, 20))
        key, other = ("at_s", "value") if kind == "piecewise" else ("t_s", "y")
        times = np.cumsum(rng.uniform(0.01, 1, count)).tolist()
        return {"kind": kind, key: [0.0, *times], other: rng.normal(size=count + 1).tolist()}
    if kind == "bang_bang":
        return {"kind": kind, "amplitude": size(rng), "duration_s": span}
    out = {"kind": kind, "end": size(rng, -6, 4), "duration_s": span, "at_s": at}
    return out | ({"rise_s": span * float(rng.uniform(0.1, 0.5))} if kind == "trapezoidal" else {})


def manoeuvre(rng: np.random.Generator, joints: int) -> dict[str, Any]:
    """The tables of a manoeuvre file."""
    tables = []
    for _ in range(joints):
        which = int(rng.integers(4))
        if which == 0:
            tables.append({"force": signal(rng)})
        elif which == 1:
            tables.append({"motion": signal(rng, smooth=True), "prescribed": True})
        elif which == 2:
            gains = {key: float(10 ** rng.uniform(-6, 6)) for key in ("kp", "kd")}
            tables.append({"motion": signal(rng)} | gains)
        else:
            tables.append({})
    duration = float(10 ** rng.uniform(-3, 4))
    return {
        "name": "generated",
        "duration_s": duration,
        "output_step_s": duration / float(rng.integers(1, 1000)),
        "joint": tables,
    }


def gains(rng: np.random.Generator, joints: int) -> dict[str, Any]:
    """The tables of a gains file."""
    controller: dict[str, float] = {"rate_Hz": float(rng.choice([100.0, 1000.0, 5000.0]))}
    outputs = []
    for i in range(1, joints + 1):
        kind = str(rng.choice(list(GAINS)))
        for name in GAINS[kind]:
            if name.startswith("kp") or rng.random() < 0.6:
                value = float(10 ** rng.uniform(-6, 6))
                controller[name.format(i)] = value
        outputs.append({"kind": kind})
        if kind == "motor":
            outputs[-1] |= {
                "force_per_V": float(10 ** rng.uniform(-3, 3)),
                "damping": float(10 ** rng.uniform(-3, 4)),
            }
    return {"controller": controller, "output": outputs}


def rig(rng: np.random.Generator, shipped: dict[str, Any], share: float = 0.2) -> dict[str, Any]:
    """The tables of a rig file like the shipped one, each number off by up to a share of itself."""
    out = copy.deepcopy(shipped)

    def vary(table: dict[str, Any]) -> None:
        for key, value in table.items():
            if isinstance(value, dict):
                vary(value)
            elif isinstance(value, float) and rng.random() < 0.5:
                table[key] = value * float(rng.uniform(1 - share, 1))

    vary(out)
    return out
