"""Ratio of the first two links' lengths, L2 / L1: how much does the behaviour change with it, and
where?"""

from __future__ import annotations

from typing import Any

import numpy as np

import flexura as fx
from flexura.signals import Drive, Manoeuvre, harmonic

from .sweep import Case, Finding, Row, last_flexible

CLAIM = (
    "the behaviour changes with the ratio of the lengths, mostly when the flexible link is "
    "longer than the rigid one (type IV)"
)
KEEP = {
    "total": "L1 + L2 kept",
    "first": "L1 kept",
    "density": "L1 + L2 kept, m1 = mu1 L1",  # where a rigid first link is given by its mass
}
MOSTLY = 0.6


def values(robot: fx.Robot) -> tuple[float, float, int]:
    """Lowest, highest, count; spaced evenly in the logarithm."""
    return 0.25, 4.0, 17


def cases(
    robot: fx.Robot, manoeuvre: Manoeuvre | None, ratios: np.ndarray, keep: str
) -> list[Case]:
    """One case a ratio L2 / L1, all along the same motions, by default the dissertation's inverse
    law exactly followed.

    Limits, starts and tapers that belong to a link scale with its length. Raises InputError for
    robots of one link.
    """
    if keep not in KEEP:
        raise fx.InputError(f"expected one of {', '.join(KEEP)}", key="keep", value=keep)
    if len(robot.links) < 2 or min(link.length_m for link in robot.links[:2]) <= 0:
        raise fx.InputError(
            "expected two links or more, the first two with a length above 0",
            key="link",
            value=len(robot.links),
        )
    if ratios[0] <= 0:
        raise fx.InputError("expected ratios above 0", key="values", value=float(ratios[0]))
    asked = manoeuvre or _law(robot)
    first, second = (link.length_m for link in robot.links[:2])
    out = []
    for ratio in ratios.tolist():
        L1 = first if keep == "first" else (first + second) / (1 + ratio)
        place = {"ratio": ratio, "L1_m": L1, "L2_m": ratio * L1}
        changed = _with_lengths(robot, [L1, ratio * L1], keep)
        out.append(Case(place, changed, asked, last_flexible(robot), asked.duration_s / 2))
    return out


def finding(rows: list[Row]) -> Finding:
    """How much of the change of the largest deflection, |dw| summed over the ratios, happens where
    link 2 is the longer one."""
    r, w = np.array([row["ratio"] for row in rows]), np.array([row["later_m"] for row in rows])
    if not r[0] < 1 < r[-1]:
        return Finding(CLAIM, None, "the ratios do not reach to both sides of 1", {})
    at_one = float(np.interp(0.0, np.log(r), w))
    above = np.abs(np.diff(np.append(at_one, w[r > 1]))).sum()
    below = np.abs(np.diff(np.append(w[r < 1], at_one))).sum()
    share = float(above / (above + below))
    f = np.array([row["first_frequency_Hz"] for row in rows])
    words = (
        f"{100 * share:.3g} % of the change of the tip deflection happens at L2 > L1 "
        f"({1e3 * w[0]:.3g} mm at L2/L1 = {r[0]:g}, "
        f"{1e3 * at_one:.3g} mm at 1, {1e3 * w[-1]:.3g} mm at {r[-1]:g}; first frequency "
        f"{f[0]:.3g} to {f[-1]:.3g} Hz)"
    )
    numbers = {
        "share_above_1": share,
        "lowest_ratio_m": w[0],
        "ratio_1_m": at_one,
        "highest_ratio_m": w[-1],
    }
    return Finding(CLAIM, share >= MOSTLY, words, {name: float(v) for name, v in numbers.items()})


def _law(robot: fx.Robot) -> Manoeuvre:
    """Each joint as in the dissertation's inverse law: 12 mm or pi/6 rad at 1 Hz, around its
    start."""
    motions = [
        harmonic(np.pi / 6 if link.joint.type == "R" else 0.012, 1.0, -np.pi / 2, link.joint.start)
        for link in robot.links
    ]
    moved = [
        None if link.joint.locked else motion
        for link, motion in zip(robot.links, motions, strict=True)
    ]
    return Manoeuvre(
        "the dissertation's inverse law, exactly followed", 2.0, 0.005, Drive.prescribed(*moved)
    )


def _with_lengths(robot: fx.Robot, lengths: list[float], keep: str) -> fx.Robot:
    """The robot with other lengths of its first links, and all that is measured along them in
    proportion."""
    data = robot.to_dict()
    for i, new in enumerate(lengths):
        link, factor = data["link"][i], new / robot.links[i].length_m
        link["length_m"] = new
        for key in ("section", "mass_per_length_kg_m", "bending_stiffness_N_m2"):
            if isinstance(link.get(key), list):
                link[key] = [entry | {"at_m": entry["at_m"] * factor} for entry in link[key]]
        if "centre_of_mass_m" in link:
            link["centre_of_mass_m"] *= factor
        if (
            keep == "density" and i == 0 and "mass_kg" in link
        ):  # a uniform link: mass as L, inertia as L^3
            link["mass_kg"] *= factor
            link["inertia_kg_m2"] = link.get("inertia_kg_m2", 0.0) * factor**3
        for joint in _measured_along(data["link"], i):
            joint["start_m"] = joint.get("start_m", 0.0) * factor
            if "limits_m" in joint:
                joint["limits_m"] = [limit * factor for limit in joint["limits_m"]]
    return fx.Robot.from_dict(data)


def _measured_along(links: list[dict[str, Any]], i: int) -> list[dict[str, Any]]:
    """Joints whose position is measured along link i: its own Pb, the next one's Pa."""
    own, after = links[i]["joint"], links[i + 1]["joint"] if i + 1 < len(links) else {}
    return [joint for joint, kind in ((own, "Pb"), (after, "Pa")) if joint.get("type") == kind]
