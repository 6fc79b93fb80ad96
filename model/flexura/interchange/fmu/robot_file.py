"""The robot of an FMU as its library reads it: model/fmi/robot_file.hpp has the format."""

from __future__ import annotations

import numpy as np

from ...io import STATIONS
from ...system import System
from ...system.constants import payload, rows
from .variables import sensors

MAGIC = b"flexura1"


def robot_file(system: System, token: str, in_equilibrium: bool, rtol: float) -> bytes:
    """The file `resources/robot.bin`.

    Args:
        system: the robot.
        token: of the model description that it belongs to.
        in_equilibrium: whether it starts in static equilibrium; else with straight links.
        rtol: relative tolerance.

    Returns:
        Its content.
    """
    counts, numbers, material, lumps = rows(system.robot)
    shown, name = sensors(system), token.encode()
    head = [len(name), len(counts), len(material), len(lumps), system.n]
    head += [len(shown), STATIONS, int(in_equilibrium), 0]
    parts = [np.array(head, dtype="<i8"), counts.astype("<i8"), numbers, material, lumps]
    parts += [np.array(system.robot.gravity_m_s2), payload(system.robot), system.limits]
    parts.append(np.array([rtol]))
    for sensor in shown:
        weighted = sensor.weights is not None
        parts.append(np.array([weighted, sensor.link, sensor.at_m], dtype=float))
        parts.append(np.zeros(system.n) if sensor.weights is None else sensor.weights)
    raw = [np.ascontiguousarray(p, p.dtype if p.dtype.kind == "i" else "<f8") for p in parts]
    padded = name + b"\0" * (-len(name) % 8)
    return b"".join([MAGIC, raw[0].tobytes(), padded, *(p.tobytes() for p in raw[1:])])
