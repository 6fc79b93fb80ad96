"""Rotation raises the natural frequencies of a link.

Equation (41): the bias, which has the centrifugal forces. In units of EI / (m L^4), with the
squares g of the speed and l of the frequency, small vibrations in the plane of rotation obey

    w'''' = (g / 2) ((1 - x^2) w')' + (l + g) w,    w = w' = 0 at x = 0,  w'' = w''' = 0 at x = 1.

Its solutions are power series. The linear line, `stiffening = false`, lacks the term in g / 2, so
that l = l0 - g. It has no first mode beyond the speed 3.516.
"""

import numpy as np
from scipy.optimize import brentq

import flexura as fx
from comparison import Comparison

SPEEDS, TERMS = (2.0, 3.0, 6.0), 80


def mismatch(square: float, g: float) -> float:
    """The determinant of w'' and w''' at x = 1 for the two solutions that vanish at x = 0."""
    ends = []
    for first in (2, 3):
        w = np.zeros(TERMS + 4)
        w[first] = 1.0
        for n in range(TERMS):
            right = (
                g / 2 * ((n + 2) * (n + 1) * w[n + 2] - n * (n + 1) * w[n]) + (square + g) * w[n]
            )
            w[n + 4] = right / ((n + 1) * (n + 2) * (n + 3) * (n + 4))
        n = np.arange(TERMS + 4)
        ends.append([np.sum(n * (n - 1) * w), np.sum(n * (n - 1) * (n - 2) * w)])
    return np.linalg.det(ends)


def exact(number: int, g: float) -> float:
    """A natural frequency; rotation leaves the squares of the first two in these intervals."""
    low, high = ((1.0, 100.0), (100.0, 1500.0))[number - 1]
    return np.sqrt(brentq(mismatch, low, high, args=(g,), xtol=1e-10))


def link(stiffening: bool) -> fx.System:
    table = {"length_m": 1.0, "elements": 16, "modes": 8, "joint": {"type": "R"}}
    table |= {"mass_per_length_kg_m": 1.0, "bending_stiffness_N_m2": 1.0}
    return fx.assemble(fx.Robot.from_dict({"link": [table], "stiffening": stiffening}))


def found(system: fx.System, speed: float) -> np.ndarray:
    """The first two frequencies [rad/s] at a speed [rad/s]."""
    rates = np.zeros(system.n)
    rates[system.joint_rows] = speed
    return 2 * np.pi * fx.frequencies(system, q=np.zeros(system.n), qd=rates)[:2]


show = Comparison(__doc__, bound=5e-5)
for speed in SPEEDS:
    for number, value in enumerate(found(link(True), speed), 1):
        show.add(f"speed {speed:g}: frequency {number}", value, exact(number, speed**2))
for speed in SPEEDS[:2]:
    value = found(link(False), speed)[0]
    show.add(
        f"speed {speed:g}, linear line: frequency 1", value, np.sqrt(exact(1, 0.0) ** 2 - speed**2)
    )

if show.plot:
    axes = show.axes("speed, in sqrt(EI / m) / L²", "first frequency, in sqrt(EI / m) / L²")
    speeds, slow = np.linspace(0, 6, 25), np.linspace(0, exact(1, 0.0), 100)
    axes.plot(speeds, [exact(1, speed**2) for speed in speeds], "C0", label="power series")
    axes.plot(slow, np.sqrt(slow[-1] ** 2 - slow**2), "C1", label="without the term in g / 2")
    axes.plot(
        range(7), [found(link(True), speed)[0] for speed in range(7)], "C0o", label="exact line"
    )
    axes.plot(
        range(4), [found(link(False), speed)[0] for speed in range(4)], "C1o", label="linear line"
    )
show.end()
