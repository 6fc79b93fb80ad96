"""Robots that controllers move, and the controller of one."""

from __future__ import annotations

import flexura as fx
from flexura import signals
from robots import beam, rigid, system

TICK = 1e-3  # s


def cart(mass: float = 2.0, **keys) -> fx.System:
    return system(rigid(0.0, mass, 0.0, 0.0, "Pa"), **keys)


def rig(**strip) -> fx.System:
    """Type IV with two modes."""
    carriage = rigid(0.1, 0.6, 0.05, 5e-4, "Pa")
    link = beam(
        0.3, 0.157, 0.3333, 4, modes=2, damping={"beta_s": 2e-4}, rotor_inertia=1e-3, **strip
    )
    return system(carriage, link, payload=0.02)


def rig_controller(**motor) -> fx.Controller:
    """Steps of both joints of `rig`; `motor` are further gains of joint 1."""
    return fx.Controller(
        (
            fx.PID(
                signals.step(0.05),
                fx.Motor(13.0, 120.0),
                kp=300,
                limit=6,
                setpoint_Hz=2.0,
                **motor,
            ),
            fx.PID(
                signals.step(0.4),
                fx.Stepper(20.0, 0.01),
                kp=20,
                limit=6,
                slew=60,
                setpoint_Hz=2.0,
                delay_s=TICK,
            ),
        )
    )
