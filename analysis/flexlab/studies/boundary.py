"""Boundary conditions: a link that slides through a sleeve (Pb), is held in it at fixed free
lengths, or has no sleeve at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import flexura as fx
from flexura.signals import Drive, JointDrive, Manoeuvre, harmonic

from .sweep import Case, Finding, Row

CLAIM = "displacements with a joint Pb are smaller than without it (type III)"
SLIDING, FIXED, WITHOUT = "sliding", "fixed", "without Pb"


def values(robot: fx.Robot) -> tuple[float, float, int]:
    """Lowest, highest, count of the fixed free lengths [m], of the last Pb's link."""
    i = _sleeved(robot)
    length, low = robot.links[i].length_m, 0.25 * robot.links[i].length_m
    if (
        i + 1 < len(robot.links) and robot.links[i + 1].joint.type == "Pa"
    ):  # a slider on this link stays ahead of the sleeve
        low = max(low, length - robot.links[i + 1].joint.start + 0.02)
    return low, length, 7


def cases(robot: fx.Robot, manoeuvre: Manoeuvre | None, lengths_m: np.ndarray) -> list[Case]:
    """The last joint Pb sliding, fixed at each of the free lengths (and at its start), and the
    whole link clamped at its end.

    All other joints do the same in all cases; by default harmonic motions, exactly followed. The
    later window is the second half.
    """
    i = _sleeved(robot)
    link = robot.links[i]
    asked = manoeuvre or _motions(robot, i)
    if not 0 < lengths_m[0] <= lengths_m[-1] <= link.length_m * (1 + 1e-12):
        raise fx.InputError(
            f"expected free lengths above 0, up to {link.length_m:g} m",
            key="values",
            value=lengths_m.tolist(),
        )
    drives = list(asked.drive.joints)
    drives[i] = JointDrive()
    held = replace(asked, drive=Drive(tuple(drives)))
    half = asked.duration_s / 2
    out = [Case({"case": SLIDING, "free_length_m": link.joint.start}, robot, asked, i + 1, half)]
    inner = [
        d for d in np.unique([*lengths_m, link.joint.start]) if d < link.length_m * (1 - 1e-12)
    ]
    for d, name in [*((float(d), FIXED) for d in inner), (link.length_m, WITHOUT)]:
        data = robot.to_dict()
        joint = data["link"][i]["joint"]
        joint.pop("limits_m", None)
        joint |= {"start_m": d, "locked": True}
        out.append(
            Case({"case": name, "free_length_m": d}, fx.Robot.from_dict(data), held, i + 1, half)
        )
    return out


def finding(rows: list[Row]) -> Finding:
    """The sliding link's largest deflection in the later window against that of the whole link
    without a sleeve."""
    by_case = {
        name: [row for row in rows if row["case"] == name] for name in (SLIDING, FIXED, WITHOUT)
    }
    if not by_case[SLIDING] or not by_case[WITHOUT]:
        return Finding(CLAIM, None, "the sliding case or the one without a sleeve is missing", {})
    sliding, without = by_case[SLIDING][0], by_case[WITHOUT][0]
    if not without["later_m"] > 1e-9:
        return Finding(CLAIM, None, "these motions do not bend the link behind the sleeve", {})
    ratio = sliding["later_m"] / without["later_m"]
    moved, free = 1e3 * sliding["later_m"], 1e3 * without["later_m"]
    words = f"sliding {moved:.3g} mm, without a sleeve {free:.3g} mm: {100 * ratio:.3g} % of it"
    numbers = {"sliding_m": sliding["later_m"], "without_m": without["later_m"], "ratio": ratio}
    at_start = [
        row
        for row in by_case[FIXED]
        if abs(row["free_length_m"] - sliding["free_length_m"]) < 1e-12
    ]
    if at_start:
        numbers["fixed_at_start_m"] = at_start[0]["later_m"]
        words += (
            f"; fixed at the mean free length, {sliding['free_length_m']:g} m, "
            f"{1e3 * at_start[0]['later_m']:.3g} mm"
        )
    return Finding(CLAIM, bool(ratio < 1), words, {name: float(v) for name, v in numbers.items()})


def _sleeved(robot: fx.Robot) -> int:
    """The link, from 0, behind the last sleeve. Raises InputError where there is none, or it is
    rigid."""
    found = [i for i, link in enumerate(robot.links) if link.joint.type == "Pb" and link.flexible]
    if not found:
        raise fx.InputError(
            "expected a robot with a flexible link behind a joint Pb",
            key="link.joint.type",
            value=robot.structure,
        )
    return found[-1]


def _motions(robot: fx.Robot, sleeved: int) -> Manoeuvre:
    """1 Hz: the sleeve by d = start - A cos, A = start / 5; the others by sines of pi/6 rad or 12
    mm, inside their limits."""
    motions: list[fx.Signal | None] = []
    limits = fx.assemble(robot).limits
    for i, link in enumerate(robot.links):
        start = link.joint.start
        room = min(start - limits[i, 0], limits[i, 1] - start)
        if link.joint.locked:
            motions.append(None)
        elif i == sleeved:
            motions.append(harmonic(-min(0.2 * start, 0.9 * room), 1.0, 0.0, start))
        else:
            size = np.pi / 6 if link.joint.type == "R" else 0.012
            motions.append(harmonic(min(size, 0.9 * room), 1.0, -np.pi / 2, start))
    return Manoeuvre(
        "sines of the joints, a cosine of the sleeve, 1 Hz", 2.0, 0.002, Drive.prescribed(*motions)
    )
