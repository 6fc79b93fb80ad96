"""What an identification comes to: a table, a robot file, a rig file with the sensor's calibration. All files or none."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx

from ..compare.measures import Comparison, compare
from ..experiment import calibrate
from ..experiment.measure import ADC_V, Sensor
from ..rig.description import Calibration, Rig
from ..rig.motor import motor_data
from .identify import Identified
from .strip import changed

POINTS = 400  # of the simulated course that the calibration is fitted to


@dataclass(frozen=True)
class Quantity:
    """One figure: what the files say, what was found, its 95 % interval; `known` false where the interval tells nothing new."""

    name: str
    unit: str
    nominal: float
    estimate: float
    low: float
    high: float

    @property
    def spread(self) -> float:
        """Half the interval's width relative to the estimate."""
        return (self.high - self.low) / 2 / abs(self.estimate)


def quantities(found: Identified) -> list[Quantity]:
    """The table's rows."""
    nominal, more = found.nominal, found.nominal.more
    strip = nominal.robot.links[1]
    flex, stepper = nominal.rig.flex.ohm_per_rad, nominal.rig.stepper.holding_torque_N_m
    rows = [
        ("bending stiffness", "N m^2", "stiffness", float(strip.bending_stiffness(np.zeros(1))[0])),
        ("damping beta", "s", "damping", strip.damping.beta_s),
        ("payload", "kg", "payload", nominal.robot.payload.mass_kg),
        ("flex sensor", "ohm/rad", "flex_gain", flex),
        ("stepper's holding torque", "N m", "holding", stepper),
    ]
    out = [_row(name, unit, found.strip, key, value, value) for name, unit, key, value in rows]
    out.append(_row("backlash", "m", found.strip, "backlash_m", more.carriage.backlash_m, 1.0))
    out.append(_row("flex sensor's delay", "s", found.strip, "delay_s", 0.0, 1.0))
    out.append(_row("joint 1: Coulomb friction", "N", found.carriage, "coulomb_N", nominal.line.coulomb_N, 1.0))
    out.append(_row("joint 1: viscous, with back-EMF", "N s/m", found.carriage, "viscous_N_s_m", nominal.line.viscous_N_s_m, 1.0))
    return out


def _row(name: str, unit: str, found: Any, key: str, nominal: float, scale: float) -> Quantity:
    low, high = found.interval(key)
    return Quantity(name, unit, nominal, scale * found.values[key], scale * low, scale * high)


def robot(found: Identified) -> fx.Robot:
    """The robot with the stiffness, damping and payload that were found."""
    return changed(found.nominal.robot, found.strip.values)


def rig(found: Identified) -> Rig:
    """The rig with the friction, play, holding torque and calibration that were found.

    Friction is one factor on all of motor, screw and rail, which a voltage and a speed cannot tell apart: f = F_c / F_c,nominal.
    A motor with more friction takes more current without load and turns slower; its constant and its gear stay what they are,
    I_0' = f I_0, n_0' = n_0 (U_0 - R I_0') / (U_0 - R I_0), M_s' = M_s (I_s - I_0') / (I_s - I_0).
    """
    old = found.nominal.rig
    more, motor = found.nominal.more, old.motor
    f = found.carriage.values["coulomb_N"] / found.nominal.line.coulomb_N
    data = motor_data(old, more.motor)
    current = f * motor.no_load_current_A
    emf = lambda i: motor.rated_voltage_V - data.resistance_ohm * i
    tables = old.model_dump(mode="json", exclude_none=True)
    tables["motor"] |= {
        "no_load_current_A": current,
        "no_load_speed_rpm": motor.no_load_speed_rpm * emf(current) / emf(motor.no_load_current_A),
        "stall_torque_N_m": motor.stall_torque_N_m
        * (motor.stall_current_A - current)
        / (motor.stall_current_A - motor.no_load_current_A),
    }
    values = found.strip.values
    tables["stepper"]["holding_torque_N_m"] *= values["holding"]
    tables["flex"] |= {
        "ohm_per_rad": old.flex.ohm_per_rad * values["flex_gain"], "calibration": calibration(found).model_dump(exclude_none=True)
    }  # fmt: skip
    emulated = tables["emulated"]
    emulated.pop("truth", None)  # factors on the old figures
    emulated["motor"]["starts_at_V"] *= f
    for table, name in (("screw", "coulomb_friction_N_m"), ("carriage", "coulomb_friction_N")):
        emulated[table][name] *= f
    for table, name in (("screw", "viscous_friction_N_m_s"), ("carriage", "viscous_friction_N_s_m")):
        emulated[table][name] *= f
    emulated["carriage"]["backlash_m"] = values["backlash_m"]
    return Rig.model_validate(tables)


def calibration(found: Identified) -> Calibration:
    """The firmware's cubic through the simulated course of reading and tip deflection: a calibration without a ruler.

    Its covariance is that of the gain: a strip that bends more under the same reading.
    """
    data, values = found.data, found.strip.values
    run = data.simulate(values)
    readings, tips = data.voltage(run, values | {"delay_s": 0.0}) / ADC_V, run["link/2/tip_deflection"]
    some = np.linspace(0, len(tips) - 1, POINTS).astype(int)
    fitted = calibrate.fit(readings[some], tips[some]).calibration
    c = np.array([0.0, fitted.c1_m, fitted.c2_m, fitted.c3_m])
    spread = np.array(fitted.covariance) + np.outer(c, c) * found.strip.deviation("flex_gain") ** 2
    return fitted.model_copy(update={"covariance": spread.tolist()})


def described_anew(experiment: fx.Run, found: Identified) -> fx.Run:
    """An experiment of this rig with the files that were found: its tip deflection is that of the new calibration."""
    made = rig(found)
    assert made.flex.calibration is not None
    rest = experiment.meta.get("rest") or {"zero": made.flex.calibration.zero}
    sensor = Sensor(made.flex.calibration, **rest)
    reading = experiment["link/2/flex_voltage"] / ADC_V
    channels = experiment.channels | {
        "link/2/tip_deflection": sensor.tip(reading), "link/2/tip_deflection_std": sensor.tip_std(reading)
    }  # fmt: skip
    units = experiment.units | {"link/2/tip_deflection_std": "m"}
    meta = experiment.meta | {"robot": robot(found).to_dict(), "rig": made.model_dump(mode="json")}
    return dataclasses.replace(experiment, channels=channels, units=units, meta=meta)


def check(found: Identified, other: fx.Run, by: str = "commanded") -> tuple[Comparison, Comparison]:
    """Another experiment of the same rig beside its simulation: by the files as they were, and by what was found."""
    from ..compare.driven import simulate

    anew = described_anew(other, found)
    return compare(simulate(other, by), other), compare(simulate(anew, by), anew)



