"""A robot in one of its natural modes, as a Run."""

from __future__ import annotations

import numpy as np

from ...io import STATIONS, Run
from ..system import System

FRAMES = 60  # of a period
STEP = 1e-6  # of a shape, to see how far it moves the robot


def moving_run(
    system: System, q: np.ndarray, shape: np.ndarray, hertz: float, most: float, periods: int
) -> Run:
    """The robot at q + a sin(2 pi f t) x.

    Args:
        system: of the robot.
        q: the configuration (n,) about which it moves.
        shape: x (n,).
        hertz: f [Hz]; 0: one swing in a second.
        most: how far what moves most, of the tips of links [m] and the joints [m or rad], goes.
        periods: how many.
    """
    frequency = hertz if hertz > 0 else 1.0
    t = np.linspace(0.0, periods / frequency, FRAMES * periods + 1)
    a = most / max(_moved(system, q, shape), 1e-300)
    wave = 2 * np.pi * frequency
    states = q + a * np.sin(wave * t)[:, None] * shape
    rates = a * wave * np.cos(wave * t)[:, None] * shape
    seen = system.observe(np.ascontiguousarray(states), np.ascontiguousarray(rates))
    channels: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for i, (row, link) in enumerate(zip(system.joint_rows, system.robot.links, strict=True), 1):
        unit = "rad" if link.joint.type == "R" else "m"
        channels |= {f"joint/{i}/position": states[:, row], f"joint/{i}/velocity": rates[:, row]}
        units |= {f"joint/{i}/position": unit, f"joint/{i}/velocity": f"{unit}/s"}
    names = observed_units(system)
    channels |= {name: np.ascontiguousarray(x) for name, x in zip(names, seen.T, strict=True)}
    meta = {
        "source": "simulation",
        "program": "flexura",
        "name": f"{system.robot.name or 'robot'}, mode at {hertz:.4g} Hz",
        "robot": system.robot.to_dict(),
        "complete": True,
        "events": [],
    }
    return Run(t, channels, units | names, meta)


def observed_units(system: System) -> dict[str, str]:
    """Names and units of the columns of `System.observe`."""
    units: dict[str, str] = {}
    for i, link in enumerate(system.robot.links, 1):
        units |= {f"link/{i}/x": "m", f"link/{i}/y": "m", f"link/{i}/angle": "rad"}
        if link.flexible:
            units |= {f"link/{i}/tip_deflection": "m", f"link/{i}/tip_slope": "rad"}
            units |= {f"link/{i}/deflection/{k}": "m" for k in range(STATIONS)}
    units |= {"tip/x": "m", "tip/y": "m"}
    return units | {f"energy/{name}": "J" for name in ("kinetic", "strain", "potential")}


def _moved(system: System, q: np.ndarray, shape: np.ndarray) -> float:
    """How far x moves the joints and the tips of the links, the most of them."""
    h = STEP / max(float(np.abs(shape).max()), 1e-300)
    far = float(np.abs(shape[system.joint_rows]).max(initial=0.0))
    for i, link in enumerate(system.robot.links, 1):
        ends = [np.array(system.line(x, i, [link.length_m])[:2]) for x in (q + h * shape, q)]
        far = max(far, float(np.linalg.norm(ends[0] - ends[1])) / h)
    return far
