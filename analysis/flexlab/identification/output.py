"""Results of an identification as a table and as JSON, and their validation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx
from flexura.io import EMULATED, called, emulated

from ..comparison.measures import Comparison, compare
from ..comparison.replay.simulate_experiment import simulate_experiment
from ..rig.axes import MotorAxis
from ..runs.formatting import finite, number, percent
from ..runs.table import Table
from .estimate import Estimate
from .files import with_identified_files
from .identify_rig import Identified
from .strip import BEARING

CONTRADICTS = 0.2  # of a viscous part: further off, data sheet and run do not agree


@dataclass(frozen=True)
class Quantity:
    """One parameter: nominal value, estimate and 95 % interval, in `unit`; `key`: its name in the
    search."""

    key: str
    name: str
    unit: str
    nominal: float
    estimate: float
    low: float
    high: float

    @property
    def spread(self) -> float:
        """Half the interval's width, relative to the estimate."""
        return (self.high - self.low) / 2 / abs(self.estimate)


def quantities(found: Identified) -> list[Quantity]:
    """The rows of the table."""
    nominal = found.nominal
    rig, strip = nominal.rig, nominal.robot.links[-1]
    rows = [
        ("bending stiffness", "N m^2", "stiffness", float(strip.bending_stiffness(np.zeros(1))[0])),
        ("damping beta", "s", "damping", strip.damping.beta_s),
        ("payload", "kg", "payload", nominal.robot.payload.mass_kg),
    ]
    if rig.flex:
        rows.append(("flex sensor", "ohm/rad", "sensor_gain", rig.flex.ohm_per_rad))
    if rig.strain_gauge:
        rows.append(("strain gauge", "V", "sensor_gain", rig.strain_gauge.V_per_strain))
    if rig.stepper:
        rows.append(("stepper's holding torque", "N m", "holding", rig.stepper.holding_torque_N_m))
    rows += [
        (_of("backlash", axis, len(nominal.axes)), axis.unit, "backlash", axis.guide.backlash)
        for axis in nominal.axes
        if "backlash" in {u.name for u in found.strip.parameters}
    ]
    rows += [
        (
            _of("contact stiffness", axis, len(nominal.axes)),
            f"{axis.force_unit}/{axis.unit}",
            "contact",
            axis.guide.contact_stiffness,
        )
        for axis in nominal.axes
        if "contact" in {u.name for u in found.strip.parameters}
    ]
    rows += [
        (_of("bearing's friction", axis, len(nominal.axes)), "N m", BEARING, axis.guide.coulomb)
        for axis in nominal.axes
        if BEARING in {u.name for u in found.strip.parameters}
    ]
    out = [_row(name, unit, found.strip, key, value, value) for name, unit, key, value in rows]
    out.append(_row("sensor's delay", "s", found.strip, "delay_s", 0.0, 1.0))
    for axis in nominal.axes:
        n, line, estimate = axis.number, nominal.lines[axis.number], found.joints[axis.number]
        whose = "motor's Coulomb friction" if axis.turns else "Coulomb friction"
        name, per = f"joint {n}: {whose}", f"{axis.force_unit} s/{axis.unit}"
        key = f"joint_{n}_coulomb"
        out.append(_row(name, axis.force_unit, estimate, "coulomb", line.coulomb, 1.0, key))
        name, key = f"joint {n}: viscous, with back-EMF", f"joint_{n}_viscous"
        out.append(_row(name, per, estimate, "viscous", line.viscous, 1.0, key))
    return out


def _of(name: str, axis: MotorAxis, count: int) -> str:
    """The name of a joint's quantity; a rig with one motor needs no number."""
    return name if count == 1 else f"joint {axis.number}: {name}"


def _row(
    name: str, unit: str, found: Estimate, key: str, nominal: float, scale: float, said: str = ""
) -> Quantity:
    low, high = found.interval(key)
    value = scale * found.values[key]
    return Quantity(said or key, name, unit, nominal, value, scale * low, scale * high)


def check(found: Identified, other: fx.Run, by: str = "commanded") -> tuple[Comparison, Comparison]:
    """Compare another experiment of the same rig with its simulation.

    Args:
        found: the identification.
        other: the other experiment.
        by: as in `simulate_experiment`.

    Returns:
        The comparison by the nominal files, and by the identified ones.
    """
    identified = with_identified_files(other, found)
    return compare(simulate_experiment(other, by), other), compare(
        simulate_experiment(identified, by), identified
    )


def table(found: Identified, experiment: fx.Run) -> Table:
    """The table for the terminal.

    Args:
        found: the identification.
        experiment: the run that it used.
    """
    label = experiment.meta.get("label")
    out = Table(
        f"identified from: {called(experiment)}" + (f", {label}" if label else ""),
        ("quantity", "unit", "file", "estimate", "low", "high", "+-"),
        ("quantity", "unit"),
    )
    for q in quantities(found):
        out.add(
            q.name,
            q.unit,
            *(number(x) for x in (q.nominal, q.estimate, q.low, q.high)),
            percent(q.spread),
        )
    rms = np.sqrt(np.mean(found.strip.residuals**2, axis=1))
    out.notes += [EMULATED] if emulated(experiment) else []
    out.notes += [
        f"residuals / noise: sensor {rms[0]:.2f}"
        + (f", joint 2 {rms[1]:.2f}" if len(rms) > 1 else ""),
        "low, high: the 95 % interval, from noise (Newey-West), mesh, the strip's mass to 0.5 %, "
        "the payload's radius of gyration to 5.6 mm, a nut's give to half",
    ]
    out.notes += at_bounds(found) + contradictions(found)
    return out


def at_bounds(found: Identified) -> list[str]:
    """A sentence for each figure that is at the bound of its search: its interval says nothing."""
    names = {q.key: q.name for q in quantities(found)}
    parts = [("", found.strip)] + [(f"joint_{n}_", part) for n, part in found.joints.items()]
    return [
        f"{names.get(prefix + unknown.name, unknown.name)}: at the {word} bound of the search; its "
        "value is not known"
        for prefix, part in parts
        for unknown, word in part.at_bounds()
    ]


def contradictions(found: Identified) -> list[str]:
    """A sentence for each motor whose back-EMF is not that of its data sheet.

    Nearly all of the viscous part is back-EMF, which the data sheet has. An encoder with other
    pulses, another lead or another gear scales it.
    """
    return [
        f"{q.name}: {q.estimate / q.nominal:.3g} times what the files say, and nearly all of it is "
        "the motor's back-EMF: the encoder's pulses, the lead, the gear ratio or the motor's data "
        "in the rig file contradict the run"
        for q in quantities(found)
        if q.key.endswith("_viscous") and abs(q.estimate / q.nominal - 1) > CONTRADICTS
    ]


def numbers(found: Identified, experiment: fx.Run) -> dict[str, Any]:
    """For JSON."""
    return {
        "emulated": emulated(experiment),
        "label": experiment.meta.get("label", ""),
        "parameters": [
            {"name": q.name, "unit": q.unit, "file": finite(q.nominal), "value": finite(q.estimate)}
            | {"low": finite(q.low), "high": finite(q.high)}
            for q in quantities(found)
        ],
        "at_bounds": at_bounds(found),
        "contradictions": contradictions(found),
        "evaluations": found.strip.evaluations
        + sum(part.evaluations for part in found.joints.values()),
    }
