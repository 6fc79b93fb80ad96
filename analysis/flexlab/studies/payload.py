"""Payload: the same drives with more and more to carry. Is there a payload that bends the last link
least?"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.signals import Manoeuvre

from ..crosscheck.default_manoeuvre import modest
from .sweep import Case, Finding, Row, last_flexible

CLAIM = "often a range of payload exists for which the elastic displacement is smallest (type I)"
DEEP = 0.05  # a dip counts where both sides rise by more than this, of the value in it
NEAR = 0.10  # its range: payloads that bend the link by at most this more


def values(robot: fx.Robot) -> tuple[float, float, int]:
    """Lowest, highest, count: up to ten times the robot's payload, or the mass of its last flexible
    link."""
    return 0.0, 10 * robot.payload.mass_kg or _mass(robot), 81


def cases(robot: fx.Robot, manoeuvre: Manoeuvre | None, payloads_kg: np.ndarray) -> list[Case]:
    """One case a payload [kg], all under the drives of the manoeuvre, by default a modest one of
    the robot as it is."""
    if payloads_kg[0] < 0:
        raise fx.InputError(
            "expected payloads of 0 or more in kilograms", key="values", value=float(payloads_kg[0])
        )
    asked = manoeuvre or modest(fx.assemble(robot))
    ends = [b for b in asked.drive.breaks if 0 < b < asked.duration_s]
    quiet = max(ends, default=np.inf)  # after the last change of the drives
    link = last_flexible(robot)
    return [
        Case({"payload_kg": m}, robot.replace({"payload.mass_kg": m}), asked, link, quiet)
        for m in payloads_kg.tolist()
    ]


def finding(rows: list[Row]) -> Finding:
    """The widest dip of the largest deflection over the payload, all others too; and of what is
    left after the drives."""
    m, largest = np.array([r["payload_kg"] for r in rows]), np.array([r["max_m"] for r in rows])
    found = _dips(m, largest)
    if not found:
        words = (
            f"the largest deflection has no dip deeper than {100 * DEEP:g} % between "
            f"{1e3 * m[0]:g} and {1e3 * m[-1]:g} g"
        )
        return Finding(CLAIM, False, words, {})
    (k, low, high), *others = found
    numbers = {
        "payload_kg": m[k],
        "from_kg": low,
        "to_kg": high,
        "max_m": largest[k],
        "peak_below_m": largest[:k].max(),
        "peak_above_m": largest[k:].max(),
        "dips": len(found),
    }
    g, mm = (
        (lambda name: f"{1e3 * numbers[name]:.3g}"),
        (lambda name: f"{1e3 * numbers[name]:.3g} mm"),
    )
    words = (
        f"least at {g('payload_kg')} g: {mm('max_m')}, within {100 * NEAR:g} % of it from "
        f"{g('from_kg')} to {g('to_kg')} g; "
        f"up to {mm('peak_below_m')} below and {mm('peak_above_m')} above"
    )
    if others:
        words += "; narrower dips: " + ", ".join(
            f"{1e3 * largest[j]:.3g} mm at {1e3 * m[j]:.3g} g" for j, _, _ in others
        )
    left = np.array([r["later_m"] for r in rows])
    if np.isfinite(left).all() and (dips := _dips(m, left)):
        j = dips[0][0]
        numbers |= {"residual_payload_kg": m[j], "residual_m": left[j]}
        words += (
            f"; what is left after the drives is least at {1e3 * m[j]:.3g} g: "
            f"{1e3 * left[j]:.3g} mm"
        )
    return Finding(CLAIM, True, words, {name: float(v) for name, v in numbers.items()})


def _dips(x: np.ndarray, y: np.ndarray) -> list[tuple[int, float, float]]:
    """Minima inside the range from which y rises on both sides by more than DEEP of its value
    there, before it falls below it.

    The widest first: its index, and from where to where y is at most NEAR above it.
    """
    from scipy.signal import find_peaks

    found, about = find_peaks(-y, prominence=0.0)
    deep = found[about["prominences"] > DEEP * y[found]]
    return sorted(((int(k), *_around(x, y, k)) for k in deep), key=lambda dip: dip[1] - dip[2])


def _around(x: np.ndarray, y: np.ndarray, k: int) -> tuple[float, float]:
    """Where y, linear between its points, is at most NEAR above y[k], around k."""
    most, ends = (1 + NEAR) * y[k], []
    for step, last in ((-1, 0), (1, len(x) - 1)):
        j = k
        while j != last and y[j + step] <= most:
            j += step
        inside = (
            x[j]
            if j == last
            else x[j] + (x[j + step] - x[j]) * (most - y[j]) / (y[j + step] - y[j])
        )
        ends.append(float(inside))
    return ends[0], ends[1]


def _mass(robot: fx.Robot) -> float:
    link = robot.links[last_flexible(robot) - 1]
    x = np.linspace(0, link.length_m, 201)
    return float(np.trapezoid(link.mass_per_length(x), x))
