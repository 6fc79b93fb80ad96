"""Joint 1 by its motor's voltage: the nut by the motor's line with static friction, the carriage
behind the nut's play.

    m s'' = F - c s' - f sign s'            f: Coulomb friction; at rest s stays as long as |F| <=
    f_0, static friction x = min(max(x, s - b/2), s + b/2)       both frictions less the rail's part
    while the nut crosses the play b

with F the voltage's force, m of rotor and carriage. Solved exactly over steps of constant F and f
(`STEP_S`). The encoder sees s. The strip's vibration does nothing to s: it pulls with a newton at a
rotor of a hundred kilogrammes. That the rail brakes the carriage wherever the nut doesn't push it
is true up to some 2 m/s^2.
"""

from __future__ import annotations

import math

import numpy as np

from flexura.signals import Signal

from ...rig.emulation import EmulatedCarriage
from ...rig.plant.motor import JointLine

STEP_S = 2.5e-4
AT_FLANK = 1e-9  # of the play


def play(carriage: EmulatedCarriage, friction: float = 1.0) -> float:
    """The nut's play [m] and how far rail friction, by this factor, presses it into its flanks."""
    return (
        carriage.backlash_m
        + 2 * friction * carriage.coulomb_friction_N / carriage.contact_stiffness_N_m
    )


def driven(
    t: np.ndarray, force: Signal, line: JointLine, mass_kg: float, play_m: float, start_m: float
) -> np.ndarray:
    """Nut [m], its speed [m/s] and carriage [m], (3, T) at even t (T,) [s] from rest on, the nut in
    the middle of its play.

    `mass_kg`: all that moves, the rotor's reflected mass with it.
    """
    out = np.empty((3, len(t)))
    half, rate, step = play_m / 2, line.viscous_N_s_m / mass_kg, float(t[1] - t[0])
    kept = math.exp(-rate * step)
    way = (1 - kept) / rate
    nut = carriage = start_m
    speed = 0.0
    for k, at in enumerate(t):
        out[:, k] = nut, speed, carriage
        F = force(at + step / 2)[0]
        ahead = math.copysign(1.0, speed or F)
        off = 0.0 if ahead * (nut - carriage) >= half - AT_FLANK * play_m else line.rail_N
        if speed == 0.0 and abs(F) <= line.static_N - off:
            continue
        final = (F - ahead * (line.coulomb_N - off)) / line.viscous_N_s_m
        after = final + (speed - final) * kept
        if after * ahead >= 0.0:
            nut += final * step + (speed - final) * way
            speed = after
        else:  # stops within the step, and may start again in the next
            nut += final * math.log(1 - speed / final) / rate + speed / rate
            speed = 0.0
        carriage = min(max(carriage, nut - half), nut + half)
    return out


def behind(nut_m: np.ndarray, play_m: float) -> np.ndarray:
    """The carriage's places (T,) [m] behind a nut at (T,) with that play from flank to flank, in
    its middle at the start."""
    x = np.empty(len(nut_m))
    at, half = nut_m[0], play_m / 2
    for k, nut in enumerate(nut_m):
        at = min(max(at, nut - half), nut + half)
        x[k] = at
    return x
