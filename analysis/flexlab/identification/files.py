"""Files of an identification: the robot, and the rig with the flex sensor's calibration."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.errors import InputError
from flexura.io import find, write_toml

from ..recordings import flex_calibration
from ..recordings.strip_sensor import sensor_of_session
from ..recordings.unit_conversion import ADC_V, voltage_channel
from ..rig.axes import Friction, MotorAxis, motor_axes
from ..rig.description import Rig
from ..rig.plant.motor import resistance
from ..rig.sensors import Calibration
from ..rig.toml_table import named_file
from .identify_rig import Identified
from .strip import with_parameters

CALIBRATION_POINTS = 400  # of the simulated course that the calibration is fitted to


def robot(found: Identified) -> fx.Robot:
    """The robot with the identified stiffness, damping and payload."""
    return with_parameters(found.nominal.robot, found.strip.values)


def with_identified_friction(old: Rig, factors: Mapping[int, Friction]) -> dict[str, Any]:
    """The rig file's tables with the friction of each motor and its joint times their factors.

    A motor with more friction takes more
    current without load and turns slower; its constant and gear stay the same: I_0' = f I_0, n_0' =
    n_0 (U_0 - R I_0') / (U_0 - R I_0), M_s' = M_s (I_s - I_0') / (I_s - I_0).

    Args:
        old: the rig.
        factors: f of each joint with a motor, by its number.
    """
    tables = old.model_dump(mode="json", exclude_none=True)
    for axis in motor_axes(old):
        motor, (factor, own_factor) = axis.motor, factors[axis.number]
        before, after = motor.no_load_current_A, factor * motor.no_load_current_A
        emf = lambda current, motor=motor: motor.rated_voltage_V - resistance(motor) * current
        left = lambda current, motor=motor: motor.stall_current_A - current
        tables[axis.table] |= {
            "no_load_current_A": after,
            "no_load_speed_rpm": motor.no_load_speed_rpm * emf(after) / emf(before),
            "stall_torque_N_m": motor.stall_torque_N_m * left(after) / left(before),
        }
        both = {axis.table: factor, guide_table(old, axis): own_factor}
        for table, times in (both if axis.turns else both | {"screw": factor}).items():
            for name in tables[table]:
                if name == "starts_at_V" or name.startswith(("coulomb_", "viscous_")):
                    tables[table][name] *= times
    return tables


def guide_table(rig: Rig, axis: MotorAxis) -> str:
    """The table with a joint's own friction and backlash."""
    if rig.screw and axis.number == 1:
        return "carriage"
    return "bearing" if axis.number == 1 else "bearing_2"


def rig(found: Identified) -> Rig:
    """The rig with the identified friction, backlash, contacts, holding torque and calibration."""
    nominal, values = found.nominal, found.strip.values
    tables = with_identified_friction(nominal.rig, found.friction)
    if nominal.rig.stepper:
        tables["stepper"]["holding_torque_N_m"] *= values["holding"]
    if nominal.rig.flex:
        tables["flex"]["ohm_per_rad"] *= values["sensor_gain"]
    else:
        tables["strain_gauge"]["V_per_strain"] *= values["sensor_gain"]
    sensor = "flex" if nominal.rig.flex else "strain_gauge"
    tables[sensor]["calibration"] = calibration(found).model_dump(exclude_none=True)
    for axis in nominal.axes:
        own = tables[guide_table(nominal.rig, axis)]
        own[f"backlash_{axis.unit}"] *= values.get("backlash", 1.0)
        for name in own:
            if name.startswith("contact_stiffness"):
                own[name] *= values.get("contact", 1.0)
    # factors on figures that are no more
    tables.get("emulated", {}).pop("truth", None)
    return Rig.model_validate(tables)


def calibration(found: Identified) -> Calibration:
    """The firmware's cubic fitted to simulated readings and tip deflections.

    No ruler is needed. The covariance contains that of the gain: a strip that bends more under the
    same reading.
    """
    data, values = found.data, found.strip.values
    run = data.simulate(values)
    readings, tips = (
        data.voltage(run, values | {"delay_s": 0.0}) / ADC_V,
        run[f"link/{data.link}/tip_deflection"],
    )
    some = np.linspace(0, len(tips) - 1, CALIBRATION_POINTS).astype(int)
    fitted = flex_calibration.fit(readings[some], tips[some]).calibration
    c = np.array([0.0, fitted.c1_m, fitted.c2_m, fitted.c3_m])
    spread = (
        np.array(fitted.covariance) + np.outer(c, c) * found.strip.deviation("sensor_gain") ** 2
    )
    return fitted.model_copy(update={"covariance": spread.tolist()})


def with_identified_files(experiment: fx.Run, found: Identified) -> fx.Run:
    """An experiment of this rig with the identified files; its tip deflection is recalibrated.

    Args:
        experiment: the run.
        found: the identification.
    """
    made = rig(found)
    table = made.flex or made.strain_gauge
    assert table is not None and table.calibration is not None
    session = experiment.meta | {"calibration": table.calibration.model_dump(mode="json")}
    sensor = sensor_of_session(session)
    reading = experiment[voltage_channel(sensor.strip, sensor.kind)] / ADC_V
    tip = f"link/{sensor.strip}/tip_deflection"
    channels = experiment.channels | {
        tip: sensor.tip(reading),
        f"{tip}_std": sensor.tip_std(reading),
    }
    units = experiment.units | {f"{tip}_std": "m"}
    meta = experiment.meta | {"robot": robot(found).to_dict(), "rig": made.model_dump(mode="json")}
    return dataclasses.replace(experiment, channels=channels, units=units, meta=meta)


def save(
    found: Identified, experiment: fx.Run, path: Path, *, overwrite: bool = False
) -> tuple[list[Path], list[str]]:
    """Write the robot file, and the rig file beside it (NAME-rig.toml).

    Args:
        found: the identification.
        experiment: the run; its metadata name the rig's manoeuvre.
        path: the robot file.
        overwrite: whether files that are there may be replaced.

    Returns:
        The files, and a sentence for what could not be written. The rig file names a manoeuvre
        file. An experiment from another computer may have its manoeuvre there.
    """
    write_toml(path, robot(found).to_dict(), new=not overwrite)
    place = beside(path)
    rig_file = Path(str(experiment.meta.get("rig_file", "")))
    manoeuvre = named_file(rig_file, found.nominal.rig.manoeuvre)
    try:
        there = find(manoeuvre, "manoeuvres").is_file()
    except InputError:
        there = False
    if not there:
        return [path], [
            f"{place} is not written: its manoeuvre {manoeuvre} is not on this computer"
        ]
    if isinstance(manoeuvre, Path):
        manoeuvre = os.path.relpath(manoeuvre, path.parent)
    tables = rig(found).model_dump(mode="json", exclude_none=True)
    tables["robot"], tables["manoeuvre"] = path.name, manoeuvre
    write_toml(place, tables, new=not overwrite)
    return [path, place], []


def beside(path: Path) -> Path:
    """The rig file's place beside the robot file `path`."""
    return path.with_name(f"{path.stem}-rig.toml")
