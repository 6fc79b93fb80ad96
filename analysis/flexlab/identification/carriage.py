"""Joint 1: its friction from voltage and motor speed.

The motor turns a reflected mass of a hundred kilogrammes; the strip hardly moves it, so that joint
1 is identified by itself:

    (m + J/r^2) v' = F_V u(t - tau) - c v - F_c tanh(v / v_0)        natively simulated, a rigid
    body on a rail; fitted in v

tau is the time from a voltage's report to its current. Slower than 5 mm/s static friction may hold,
and for 2 mm after it has turned round the nut crosses its play and drives no rail: this line has
neither, and v is not looked at there.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.errors import InputError
from flexura.signals import COLUMNS, Signal

from ..comparison.replay.lead_screw import behind
from ..comparison.replay.simulate_experiment import held
from ..comparison.replay.smoothing import known, resolution
from ..recordings.unit_conversion import velocity
from ..rig.plant.motor import JointLine
from .estimate import Found, Unknown, estimate

SLIDES_M_S, CLEAR_M = 5e-3, 2e-3
LEAST = 200  # samples that slide
VOLTAGE_DOUBT = (
    0.005  # the supply is known through a divider of resistors, the motor's constant from its data
)
MEMORY_S = 0.4


def fit(
    experiment: fx.Run, robot: fx.Robot, line: JointLine, dead_zone_V: float, rtol: float = 1e-5
) -> Found:
    """Coulomb friction [N], viscous coefficient with the back-EMF [N s/m] and delay [s]. Raises
    InputError where it rests."""
    t, x = known(experiment.t, experiment["joint/1/position"], "joint/1/position")
    times, volts = known(experiment.t, experiment["joint/1/voltage"], "joint/1/voltage")
    drive = held(
        times, line.force_N_V * np.sign(volts) * np.maximum(np.abs(volts) - dead_zone_V, 0.0)
    )
    measured = velocity(t, x)
    clear = np.abs(x - behind(x, CLEAR_M)) > 0.49 * CLEAR_M
    weight = np.where(clear & (np.abs(measured) > SLIDES_M_S), 1 / _noise(t, x), 0.0)
    if (weight > 0).sum() < LEAST:
        expected = (
            f"expected at least {LEAST} samples faster than {SLIDES_M_S:g} m/s and "
            f"{CLEAR_M:g} m after a turn"
        )
        raise InputError(expected, key="joint/1/position", value=int((weight > 0).sum()))

    def model(values: dict[str, float]) -> np.ndarray:
        force = drive.segments * np.where(np.arange(COLUMNS) == 1, values.get("voltage", 1.0), 1.0)
        force[:, 0] += values["voltage_delay_s"]
        run = fx.simulate(_rail(robot, line, values), t, fx.Drive.force(Signal(force)), rtol=rtol)
        return np.nan_to_num((velocity(t, run["joint/1/position"]) - measured) * weight)[None, :]

    unknowns = (
        Unknown("coulomb_N", line.coulomb_N, 0.01, (line.coulomb_N / 10, 10 * line.coulomb_N)),
        Unknown(
            "viscous_N_s_m",
            line.viscous_N_s_m,
            0.01,
            (line.viscous_N_s_m / 10, 10 * line.viscous_N_s_m),
        ),
        Unknown("voltage_delay_s", 1e-3, 2e-4, (-5e-3, 0.02), factor=False),
    )
    found = estimate(model, unknowns, round(MEMORY_S / float(np.median(np.diff(t)))))
    return found.doubted(model(found.values | {"voltage": 1 + VOLTAGE_DOUBT}) - found.residuals)


def _rail(robot: fx.Robot, line: JointLine, values: dict[str, float]) -> fx.System:
    """The carriage alone, with all that it carries, from 0 and without limits."""
    system = fx.assemble(robot)
    moved = float(system.mass(system.start())[0, 0]) - robot.links[0].joint.rotor_inertia
    joint = {
        "type": "Pa",
        "rotor_mass_kg": line.reflected_mass_kg,
        "viscous_friction_N_s_m": values["viscous_N_s_m"],
        "coulomb_friction_N": values["coulomb_N"],
    }
    body = {"length_m": 0.0, "elements": 0, "mass_kg": moved, "joint": joint}
    return fx.assemble(fx.Robot.from_dict({"name": "carriage alone", "link": [body]}))


def _noise(t: np.ndarray, x: np.ndarray) -> float:
    """The standard deviation of a velocity by the position's resolution alone [m/s]."""
    random = np.random.default_rng(0)
    white = (resolution(x) or 1e-6) / np.sqrt(12) * random.standard_normal(len(t))
    return float(np.std(velocity(t, white)))
