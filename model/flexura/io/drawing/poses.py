"""Where the links of a run are when its channels don't say: from its joints and tip deflections.

A measurement has joint positions and, for each flexible link, at most the tip deflection. The
bending line between hub and tip is then taken as that of a cantilever loaded at its tip, w(s) =
w_tip (3 xi^2 - xi^3) / 2 with xi = s / L; a Pb's link is straight inside and behind its sleeve.
Kinematics as in the dissertation, table 2.1.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from ..quantities import STATIONS
from .outline import Outline, outlines, shortens

if TYPE_CHECKING:
    from ..run import Run

STEEPEST = 0.999  # sine of the largest angle: readings of a sensor may ask for more
_GAUSS = np.polynomial.legendre.leggauss(8)


def with_poses(run: Run) -> tuple[Run, bool]:
    """The run with the poses and deflections of its links, and whether they had to be computed.

    Args:
        run: unchanged if it lacks joint positions or a robot.

    Returns:
        The run, with further channels if so, and True if there are any.
    """
    links = outlines(run.meta)
    if not links or len(run) == 0:
        return run, False
    numbers = range(1, len(links) + 1)
    if all(f"link/{i}/{part}" in run for i in numbers for part in ("x", "y", "angle")):
        return run, False
    if not all(f"joint/{i}/position" in run for i in numbers):
        return run, False
    shortening = shortens(run.meta)
    added: dict[str, np.ndarray] = {}
    x, y, angle = np.zeros((3, len(run)))
    previous: tuple[Outline, np.ndarray, np.ndarray] | None = (
        None  # the link, its free length and its tip deflection
    )
    for i, link in enumerate(links, start=1):
        d = run[f"joint/{i}/position"]
        if previous is not None:
            along = d if link.joint == "Pa" else np.full(len(run), previous[0].length_m)
            along, w, slope = bending(along, *previous, shortening)
            x, y = (
                x + along * np.cos(angle) - w * np.sin(angle),
                y + along * np.sin(angle) + w * np.cos(angle),
            )
            angle = angle + slope
        elif link.joint == "Pa":
            x = x + d
        angle = angle + (d if link.joint == "R" else link.angle_rad)
        free = np.full(len(run), link.length_m)
        if link.joint == "Pb":
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
                    np.full(len(run), k * link.length_m / (STATIONS - 1)), *previous, shortening
                )[1]
    if previous is not None and "tip/x" not in run:
        along, w, _ = bending(np.full(len(run), previous[0].length_m), *previous, shortening)
        added["tip/x"] = x + along * np.cos(angle) - w * np.sin(angle)
        added["tip/y"] = y + along * np.sin(angle) + w * np.cos(angle)
    added = {name: values for name, values in added.items() if name not in run}
    units = {name: "rad" if name.endswith("/angle") else "m" for name in added}
    return dataclasses.replace(run, channels=run.channels | added, units=run.units | units), True


def bending(
    x: np.ndarray, link: Outline, free: np.ndarray, tip: np.ndarray, shortening: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place along the hub's tangent [m], deflection [m] and angle [rad] at the arc length x (T,) of
    a link bent over its last `free` (T,) m to the tip deflection `tip` (T,).

    `shortening`: the sine of the angle is w', and the place the integral of its cosine.
    """
    length = np.maximum(free, 1e-12)
    xi = np.clip((x - (link.length_m - free)) / length, 0.0, 1.0)
    w = tip * (3 * xi**2 - xi**3) / 2
    steepness = lambda at: np.clip(tip / length * (3 * at - 1.5 * at**2), -STEEPEST, STEEPEST)
    if not shortening:
        return x, w, steepness(xi)
    lost = sum(
        weight / 2 * (1 - np.sqrt(1 - steepness(xi * (1 + node) / 2) ** 2))
        for node, weight in zip(*_GAUSS, strict=True)
    )
    return x - xi * length * lost, w, np.arcsin(steepness(xi))
