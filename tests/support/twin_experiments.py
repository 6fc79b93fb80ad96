"""Experiments for tests, with the channels of the bench: the Exudyn twin moved by the rig's own
drive equations, then measured.

What differs from the robot file is stated; positions are quantised as the encoders', the tip
deflection gets the flex sensor's resolution and noise; some samples are lost. They are emulated,
and say so.
"""

import math
from pathlib import Path

import numpy as np

import flexura as fx
from flexlab.rig import load
from flexlab.rig.axes import motor_axes
from flexlab.rig.plant.motor import motor_data
from flexura import twin
from flexura.io import Run

RIG = Path(__file__).parents[2] / "firmware" / "rig.toml"
RATE_HZ, FLEX_V_M = 200.0, -2.7


def robot(bench, rotor, stiffness=1.0, payload=1.0):
    data = bench.robot.to_dict()
    carriage, strip = data["link"]
    strip["young_modulus_Pa"] *= stiffness
    data["payload"]["mass_kg"] *= payload
    carriage["joint"]["rotor_mass_kg"] = rotor
    return fx.Robot.from_dict(data)


def profiles(kind):
    """Voltage (t, position, velocity) and pulses (t), set-points (t) of both joints."""
    w = 2 * math.pi
    if kind == "inverse":
        law = lambda t: 0.012 * math.sin(w * t)
        volts = lambda t, x, v: 2000 * (law(t) - x) + 90 * 0.012 * w * math.cos(w * t)
        turn = lambda t: math.pi / 6 * math.sin(w * t)
        return volts, turn, (law, turn)
    volts = lambda t, x, v: 6.0 * (0.1 <= t < 0.6) - 6.0 * (0.8 <= t < 1.3)
    cycloid = lambda u: u - math.sin(w * u) / w
    turn = lambda t: (
        0.6 * (cycloid(min(max(t - 0.1, 0) / 0.5, 1.0)) - cycloid(min(max(t - 1.0, 0) / 0.4, 1.0)))
    )
    return volts, turn, (lambda t: math.nan, turn)


def experiment(
    kind="inverse", rig=RIG, seconds=2.0, seed=1, noise_m=2e-4, lost=0.01, emulated=True, **differs
):
    """A Run of the bench's form; `differs`: factors of `robot`."""
    bench = load(rig)
    figures = more = bench.rig
    data, r = motor_data(motor_axes(figures)[0]), figures.screw.lead_m / (2 * math.pi)
    volts, turn, points = profiles(kind)
    teeth = figures.stepper.full_steps_per_turn / 4

    def drive(t, position, velocity, tip):
        """The parts' own equations, no inductance, tanh friction: nothing is condensed to a line or
        a spring."""
        u = limited(volts(t, position[0], velocity[0]))
        u = math.copysign(max(abs(u) - more.driver.dead_zone_V, 0.0), u)
        turns = velocity[0] / r
        way = math.tanh(velocity[0] / 1e-3)
        torque = data.constant_N_m_A * (u - data.constant_N_m_A * turns) / data.resistance_ohm
        torque -= (
            way * (data.friction_N_m + more.screw.coulomb_friction_N_m)
            + more.screw.viscous_friction_N_m_s * turns
        )
        rail = (
            way * more.carriage.coulomb_friction_N
            + more.carriage.viscous_friction_N_s_m * velocity[0]
        )
        rail /= data.gear_efficiency * figures.screw.efficiency
        hold = figures.stepper.holding_torque_N_m * math.sin(teeth * (turn(t) - position[1]))
        detent = more.stepper.detent_torque_N_m * math.sin(4 * teeth * position[1])
        return [torque / r - rail, hold - detent - more.stepper.damping_N_m_s * velocity[1]]

    # what gear and screw lose of the force that accelerates the carriage
    carried = fx.assemble(robot(bench, rotor=0.0, **differs))
    lost_kg = carried.mass(carried.start())[0, 0] * (
        1 / (data.gear_efficiency * figures.screw.efficiency) - 1
    )
    true = robot(bench, rotor=data.inertia_kg_m2 / r**2 + lost_kg, **differs)
    t = np.arange(round(seconds * RATE_HZ) + 1) / RATE_HZ
    moved = twin.simulate(true, t, drive, step_s=1e-3)
    assert moved.complete
    rng = np.random.default_rng(seed)
    quantised = lambda y, step: np.round(y / step) * step
    x, q = moved["joint/1/position"], moved["joint/2/position"]
    acting = np.array(
        [limited(volts(*k)) for k in zip(t, x, moved["joint/1/velocity"], strict=True)]
    )
    late_s = 5e-4  # a tick's middle
    tip = quantised(moved["link/2/tip_deflection"] + rng.normal(0, noise_m, len(t)), 2e-4)
    angle, length = quantised(q, 2 * math.pi / 2400), bench.robot.links[1].length_m
    at = quantised(x, 0.008 / 640)
    channels = {
        "joint/1/position": at,
        "joint/2/position": angle,
        "joint/1/velocity": moved["joint/1/velocity"],
        "joint/2/velocity": moved["joint/2/velocity"],
        "joint/1/reference": np.array([points[0](s) for s in t]),
        "joint/2/reference": np.array([points[1](s) for s in t]),
        "joint/1/voltage": np.interp(t + late_s, t, acting),
        "joint/2/pulses": np.array([turn(s) for s in t]),
        "link/2/tip_deflection": tip,
        "link/2/flex_voltage": 3.0 + FLEX_V_M * tip,
        "tip/x": at + 0.1 + length * np.cos(angle) - tip * np.sin(angle),
        "tip/y": length * np.sin(angle) + tip * np.cos(angle),
    }
    gone = rng.random(len(t)) < lost
    gone[[0, -1]] = False
    for values in channels.values():
        values[gone] = np.nan
    units = {name: unit(name) for name in channels}
    label = "emulated experiment" if emulated else "experiment"
    meta = {
        "source": "experiment",
        "kind": "experiment",
        "emulated": emulated,
        "label": label,
        "experiment": kind,
        "program": "Exudyn twin, quantised",
        "robot": bench.robot.to_dict(),
        "rig": as_driven(figures),
        "firmware": {"version": "1.0", "declaration": "0123abcd"},
        "host_version": "0.1.0",
        "seed": seed,
        "complete": True,
        "started": "2026-11-24T11:00:00+00:00",
        "events": [{"t": 0.0, "text": "execute", "level": "INFO"}],
    }
    return Run(t, channels, units, meta), moved


def as_driven(rig):
    """The rig's tables as these equations have it: without play and inductance, and nothing holds
    the motor more at rest than when it slides."""
    tables = rig.model_dump(mode="json")
    tables["motor"]["inductance_H"] = 1e-12
    tables["carriage"]["backlash_m"] = 0.0
    tables["motor"]["starts_at_V"] = 0.1
    return tables


def limited(volts):
    return min(max(volts, -12.0), 12.0)


def unit(name):
    kind, number, what = (name.split("/") + [""])[:3]
    if what.endswith("voltage"):
        return "V"
    base = "rad" if kind == "joint" and number == "2" else "m"
    return base + ("/s" if what == "velocity" else "")
