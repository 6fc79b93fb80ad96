"""The curves that a review, a figure and an animation draw, from a run's channels; plain numpy.

A flexible link: the line through the deflections at its nine stations, as `bending` finds it,
placed in the link's hub frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..quantities import STATIONS
from .bending import POINTS, inextensible
from .outline import Outline, outlines, shortens

if TYPE_CHECKING:
    from ..run import Run


@dataclass(frozen=True)
class Curves:
    """Shapes of one run at its frames, in the base frame [m]; y up. A frame without a value is NaN.

    `index` (F,) samples of the run; `undeformed` (F, flexible links, 2, 2), `deformed` (F, flexible
    links, POINTS, 2); `rigid` (F, rigid links, 2, 2); `pins` (F, R joints, 2); `sliders` (F, P
    joints, 5, 2), closed rectangles; `tip` (F, 2); `trace` (K, 2), the tip's path; `rail` (2, 2) or
    None.
    """

    index: np.ndarray
    undeformed: np.ndarray
    deformed: np.ndarray
    rigid: np.ndarray
    pins: np.ndarray
    sliders: np.ndarray
    tip: np.ndarray
    trace: np.ndarray
    rail: np.ndarray | None


def has_shapes(run: Run) -> bool:
    """Whether the run's channels say where its links are.

    Args:
        run: the run.

    Returns:
        True if they do.
    """
    links = len(outlines(run.meta))
    poses = (f"link/{i}/{part}" for i in range(1, links + 1) for part in ("x", "y", "angle"))
    return (
        links > 0
        and all(name in run for name in poses)
        and bool(np.isfinite(run["link/1/x"]).any())
    )


def curves(run: Run, index: np.ndarray, size: float) -> Curves:
    """The shapes of a robot at some samples.

    Args:
        run: the run.
        index: samples (F,).
        size: half the length of a slider's mark [m].

    Returns:
        The curves.
    """
    links = outlines(run.meta)
    undeformed, deformed, rigid, pins, sliders = [], [], [], [], []
    end = np.zeros((len(index), 2))
    for i, link in enumerate(links, start=1):
        pose = np.stack([run[f"link/{i}/{part}"][index] for part in ("x", "y", "angle")], axis=1)
        straight = place(pose, np.array([[0.0, 0.0], [link.length_m, 0.0]])[None])
        if link.flexible:
            undeformed.append(straight)
            deformed.append(place(pose, bent(run, i, link, index)))
        elif link.length_m > 0:
            rigid.append(straight)
        end = deformed[-1][:, -1] if link.flexible else straight[:, -1]
        if link.joint == "R":
            pins.append(pose[:, :2])
        else:
            sliders.append(place(*slider(run, i, link, pose, index, size)))
    tip = (
        np.stack([run["tip/x"][index], run["tip/y"][index]], axis=1)
        if "tip/x" in run and "tip/y" in run
        else end
    )
    trace = tip[np.isfinite(tip).all(axis=1)]
    f = len(index)
    return Curves(
        index,
        stack(undeformed, f, 2),
        stack(deformed, f, POINTS),
        stack(rigid, f, 2),
        np.stack(pins, axis=1) if pins else np.zeros((f, 0, 2)),
        stack(sliders, f, 5),
        tip,
        trace,
        rail(run, links[0], size),
    )


def bent(run: Run, i: int, link: Outline, index: np.ndarray) -> np.ndarray:
    """The curve of a link in its hub's frame.

    Args:
        run: the run.
        i: number of the link.
        link: its outline.
        index: samples (F,).

    Returns:
        Points (F, POINTS, 2) [m]; straight where the run has no stations.
    """
    x = np.linspace(0.0, link.length_m, POINTS)
    names = [f"link/{i}/deflection/{k}" for k in range(STATIONS)]
    if not all(name in run for name in names):
        straight = np.stack([x, np.zeros(POINTS)], axis=1)
        return np.broadcast_to(straight, (len(index), POINTS, 2)).copy()
    known = np.stack([run[name][index] for name in names], axis=1)
    slope = run[f"link/{i}/tip_slope"][index] if f"link/{i}/tip_slope" in run else None
    if shortens(run.meta):
        return inextensible(known, slope, link.length_m)
    from scipy.interpolate import CubicSpline

    at, there = np.linspace(0.0, link.length_m, STATIONS), np.isfinite(known).all(axis=1)
    zero = np.zeros(len(known))
    tip = (2, zero) if slope is None else (1, np.where(np.isfinite(slope), slope, 0.0))
    spline = CubicSpline(at, np.where(there[:, None], known, 0.0).T, bc_type=((1, zero), tip))
    w = np.where(there[:, None], spline(x).T, np.nan)
    return np.stack([np.broadcast_to(x, w.shape), w], axis=2)


def slider(
    run: Run, i: int, link: Outline, pose: np.ndarray, index: np.ndarray, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """The pose (F, 3) of the rectangle that marks a Pa's hub or a Pb's sleeve, and its corners (1,
    5, 2)."""
    at = pose.copy()
    if (
        link.joint == "Pa"
    ):  # the hub lies along the previous link, link i leaves it at the fixed angle
        at[:, 2] -= link.angle_rad
    else:  # the sleeve is where link i passes, d before the end of the link
        name = f"joint/{i}/position"
        behind = link.length_m - (run[name][index] if name in run else link.length_m)
        at[:, 0] += behind * np.cos(at[:, 2])
        at[:, 1] += behind * np.sin(at[:, 2])
    a, b = size, 0.6 * size
    return at, np.array([[[-a, -b], [a, -b], [a, b], [-a, b], [-a, -b]]])


def place(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (F or 1, n, 2) of a moving frame with pose (F, 3) [m, m, rad] in the base frame, (F,
    n, 2)."""
    c, s = np.cos(pose[:, 2])[:, None], np.sin(pose[:, 2])[:, None]
    x, y = points[..., 0], points[..., 1]
    return np.stack([pose[:, :1] + c * x - s * y, pose[:, 1:2] + s * x + c * y], axis=2)


def rail(run: Run, link: Outline, size: float) -> np.ndarray | None:
    """Both ends (2, 2) of the line on which a first joint Pa slides: its limits and its travel, and
    a little more."""
    if link.joint != "Pa":
        return None
    travel = run["link/1/x"][np.isfinite(run["link/1/x"])]
    reach = [*travel[[travel.argmin(), travel.argmax()]], *link.limits] if len(travel) else [0.0]
    return np.array([[min(reach) - 1.5 * size, 0.0], [max(reach) + 1.5 * size, 0.0]])


def extent(runs: list[Run]) -> tuple[np.ndarray, np.ndarray]:
    """The corners of everything that moves in the runs, with a margin.

    Args:
        runs: the runs.

    Returns:
        The lower left and the upper right corner (2,) [m].
    """
    seen = []
    for run in runs:
        c = curves(run, np.unique(np.linspace(0, len(run) - 1, 400).astype(int)), 0.0)
        parts = [
            c.undeformed,
            c.deformed,
            c.rigid,
            c.pins,
            c.sliders,
            c.tip,
            *([c.rail] if c.rail is not None else []),
        ]
        seen += [part.reshape(-1, 2) for part in parts]
    points = np.concatenate(seen)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        return np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    low, high = points.min(axis=0), points.max(axis=0)
    reach = max(float((high - low).max()), 1e-3)
    # an arm that hardly turns still gets a picture, not a slit
    spare = np.maximum(0.08 * reach, (0.4 * reach - (high - low)) / 2)
    foot = 0.12 * float((high - low + 2 * spare)[1])  # the scale bar and its label go below the arm
    return low - spare - [0.0, foot], high + spare


def grid(low: np.ndarray, high: np.ndarray) -> tuple[float, np.ndarray]:
    """A square grid that covers the picture and as much again on every side.

    Args:
        low: lower left corner (2,) [m].
        high: upper right corner (2,) [m].

    Returns:
        A round spacing [m], and the lines (n, 2, 2) [m].
    """
    rough = float(max(high - low)) / 4.5
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(power * max(m for m in (1.0, 2.0, 5.0) if m * power <= rough * 1.0001))
    wide = high - low
    a, b = np.floor((low - wide) / step).astype(int), np.ceil((high + wide) / step).astype(int)
    (x0, y0), (x1, y1) = a * step, b * step
    upright = [[[k * step, y0], [k * step, y1]] for k in range(a[0], b[0] + 1)]
    level = [[[x0, k * step], [x1, k * step]] for k in range(a[1], b[1] + 1)]
    return step, np.array(upright + level)


def stack(parts: list[np.ndarray], frames: int, points: int) -> np.ndarray:
    """Parts (F, points, 2) along a new second axis; without any, an axis of length 0."""
    return np.stack(parts, axis=1) if parts else np.zeros((frames, 0, points, 2))
