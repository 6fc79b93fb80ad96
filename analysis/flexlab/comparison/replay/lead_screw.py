"""A carriage from its motor's voltage: the nut with static friction, the carriage behind backlash.

    m s'' = F - c s' - f sign s'       moving; f: Coulomb friction
    s'' = 0                            at rest, if |F| <= f_0, the static friction
    x = min(max(x, s - b/2), s + b/2)  carriage behind the nut, backlash b

F is the voltage's force, m the rotor's reflected mass and what it carries over the efficiency of
screw and gear. While the nut crosses the backlash, both frictions lose the rail's part. The
equations are solved exactly over steps of constant F and f (`STEP_S`). The encoder sees s.

Two assumptions: the strip's vibration does not move s (1 N against a rotor of 100 kg), and the rail
brakes the carriage whenever the nut does not push it (true up to some 2 m/s^2).
"""

from __future__ import annotations

import math

import numpy as np

from flexura.signals import Signal

from ...rig.axes import Guide
from ...rig.plant.motor import JointLine

STEP_S = 2.5e-4
FLANK_TOLERANCE = 1e-9  # of the play


def backlash(guide: Guide, friction: float = 1.0) -> float:
    """A drive's backlash, and how far the joint's friction presses it into its flanks [m or rad].

    Args:
        guide: the joint's own friction and play.
        friction: factor on its Coulomb friction.
    """
    return guide.backlash + 2 * friction * guide.coulomb / guide.contact_stiffness


def nut_and_carriage(
    t: np.ndarray, force: Signal, line: JointLine, mass_kg: float, play_m: float, start_m: float
) -> np.ndarray:
    """Integrate nut and carriage from rest, the nut in the middle of its backlash.

    Args:
        t: evenly spaced times (T,) [s].
        force: the force of the motor's voltage on the nut [N].
        line: joint 1 as a linear motor.
        mass_kg: all that moves at the nut, as `JointLine.moved` has it.
        play_m: backlash from flank to flank [m].
        start_m: position at the start [m].

    Returns:
        Nut position [m], its speed [m/s], and carriage position [m], (3, T).
    """
    out = np.empty((3, len(t)))
    half, rate, step = play_m / 2, line.viscous / mass_kg, float(t[1] - t[0])
    decay = math.exp(-rate * step)
    travel = (1 - decay) / rate
    nut = carriage = start_m
    speed = 0.0
    for k, at in enumerate(t):
        out[:, k] = nut, speed, carriage
        F = force(at + step / 2)[0]
        direction = math.copysign(1.0, speed or F)
        released_N = (
            0.0 if direction * (nut - carriage) >= half - FLANK_TOLERANCE * play_m else line.guide
        )
        if speed == 0.0 and abs(F) <= line.static - released_N:
            continue
        final = (F - direction * (line.coulomb - released_N)) / line.viscous
        after = final + (speed - final) * decay
        if after * direction >= 0.0:
            nut += final * step + (speed - final) * travel
            speed = after
        else:  # stops within the step, and may start again in the next
            nut += final * math.log(1 - speed / final) / rate + speed / rate
            speed = 0.0
        carriage = min(max(carriage, nut - half), nut + half)
    return out


def backlash_output(nut_m: np.ndarray, play_m: float) -> np.ndarray:
    """Carriage positions (T,) [m] behind a nut with backlash.

    Args:
        nut_m: positions of the nut (T,) [m]; it starts in the middle of the backlash.
        play_m: backlash from flank to flank [m].
    """
    x = np.empty(len(nut_m))
    at, half = nut_m[0], play_m / 2
    for k, nut in enumerate(nut_m):
        at = min(max(at, nut - half), nut + half)
        x[k] = at
    return x
