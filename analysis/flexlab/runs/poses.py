"""Where the links of a run are when its channels don't say: from its joints and tip deflections.

A measurement has joint positions and, for each flexible link, at most the tip deflection. The
bending line between hub and tip is then taken as that of a cantilever loaded at its tip, w(x) =
w_tip (3 xi^2 - xi^3) / 2 with xi = x / L; a Pb's link is straight inside and behind its sleeve.
Kinematics as in the dissertation, table 2.1.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from flexura.io import STATIONS, Run
from flexura.robot import Link, Robot


def with_poses(run: Run) -> tuple[Run, bool]:
    """The run with the poses and deflections of its links, and whether they had to be computed;
    unchanged if it lacks joints."""
    tables = run.meta.get("robot")
    if not tables or len(run) == 0:
        return run, False
    robot = Robot.from_dict(tables)
    numbers = range(1, len(robot.links) + 1)
    if all(f"link/{i}/{part}" in run for i in numbers for part in ("x", "y", "angle")):
        return run, False
    if not all(f"joint/{i}/position" in run for i in numbers):
        return run, False
    added: dict[str, np.ndarray] = {}
    x, y, angle = np.zeros((3, len(run)))
    previous: tuple[Link, np.ndarray, np.ndarray] | None = (
        None  # the link, its free length and its tip deflection
    )
    for i, link in enumerate(robot.links, start=1):
        d = run[f"joint/{i}/position"]
        if previous is not None:
            along = d if link.joint.type == "Pa" else np.full(len(run), previous[0].length_m)
            w, slope = bending(along, *previous)
            x, y = (
                x + along * np.cos(angle) - w * np.sin(angle),
                y + along * np.sin(angle) + w * np.cos(angle),
            )
            angle = angle + slope
        elif link.joint.type == "Pa":
            x = x + d
        angle = angle + (d if link.joint.type == "R" else link.joint.angle_rad)
        free = np.full(len(run), link.length_m)
        if link.joint.type == "Pb":
            x, y = x + (d - link.length_m) * np.cos(angle), y + (d - link.length_m) * np.sin(angle)
            free = d
        tip = (
            run.channels.get(f"link/{i}/tip_deflection", np.zeros(len(run)))
            if link.flexible
            else np.zeros(len(run))
        )
        previous = (link, free, tip)
        added |= {f"link/{i}/x": x, f"link/{i}/y": y, f"link/{i}/angle": angle}
        if link.flexible:
            for k in range(STATIONS):
                added[f"link/{i}/deflection/{k}"] = bending(
                    np.full(len(run), k * link.length_m / (STATIONS - 1)), *previous
                )[0]
    last, _, w = previous if previous else (None, x, x)
    if last is not None and "tip/x" not in run:
        added["tip/x"] = x + last.length_m * np.cos(angle) - w * np.sin(angle)
        added["tip/y"] = y + last.length_m * np.sin(angle) + w * np.cos(angle)
    added = {name: values for name, values in added.items() if name not in run}
    units = {name: "rad" if name.endswith("/angle") else "m" for name in added}
    return dataclasses.replace(run, channels=run.channels | added, units=run.units | units), True


def bending(
    x: np.ndarray, link: Link, free: np.ndarray, tip: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Deflection [m] and slope [rad] at x (T,) of a link bent over its last `free` (T,) m to the
    tip deflection `tip` (T,)."""
    length = np.maximum(free, 1e-12)
    xi = np.clip((x - (link.length_m - free)) / length, 0.0, 1.0)
    return tip * (3 * xi**2 - xi**3) / 2, tip * (6 * xi - 3 * xi**2) / (2 * length)
