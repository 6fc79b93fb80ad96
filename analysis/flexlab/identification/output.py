"""Results of an identification as a table and as JSON, and their validation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table

import flexura as fx

from ..comparison.measures import Comparison, compare
from ..comparison.replay.simulate_experiment import simulate_experiment
from ..runs.labels import EMULATED, called, emulated
from .estimate import Estimate
from .files import with_identified_files
from .identify import Identified


@dataclass(frozen=True)
class Quantity:
    """One parameter: nominal value, estimate, and 95 % interval, in `unit`."""

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
    nominal, more = found.nominal, found.nominal.emulated
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
    out.append(
        _row(
            "joint 1: Coulomb friction",
            "N",
            found.carriage,
            "coulomb_N",
            nominal.line.coulomb_N,
            1.0,
        )
    )
    out.append(
        _row(
            "joint 1: viscous, with back-EMF",
            "N s/m",
            found.carriage,
            "viscous_N_s_m",
            nominal.line.viscous_N_s_m,
            1.0,
        )
    )
    return out


def _row(name: str, unit: str, found: Estimate, key: str, nominal: float, scale: float) -> Quantity:
    low, high = found.interval(key)
    return Quantity(name, unit, nominal, scale * found.values[key], scale * low, scale * high)


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
    out = Table(
        title=f"identified from: {called(experiment)}, {experiment.meta.get('label', '')}",
        title_justify="left",
    )
    for head in ("quantity", "unit", "file", "estimate", "95 % interval", "+-"):
        out.add_column(
            head, justify="left" if head in ("quantity", "unit") else "right", no_wrap=True
        )
    for q in quantities(found):
        out.add_row(
            q.name,
            q.unit,
            f"{q.nominal:.4g}",
            f"{q.estimate:.4g}",
            f"{q.low:.4g} to {q.high:.4g}",
            f"{100 * q.spread:.2g} %",
        )
    rms = np.sqrt(np.mean(found.strip.residuals**2, axis=1))
    notes = [
        f"residuals / noise: flex sensor {rms[0]:.2f}, joint 2 {rms[1]:.2f}",
        "intervals: noise (Newey-West), mesh, strip's mass to 0.5 %, payload's radius of gyration "
        "to 5.6 mm, nut's give to half",
    ]
    out.caption, out.caption_justify = (
        "\n".join(([EMULATED] if emulated(experiment) else []) + notes),
        "left",
    )
    return out


def numbers(found: Identified, experiment: fx.Run) -> dict[str, Any]:
    """The results for JSON.

    Args:
        found: the identification.
        experiment: the run that it used.
    """
    clean = lambda value: float(value) if math.isfinite(value) else None
    rows = {
        q.name: {"unit": q.unit}
        | {key: clean(getattr(q, key)) for key in ("nominal", "estimate", "low", "high")}
        for q in quantities(found)
    }
    about = {"emulated": emulated(experiment), "label": experiment.meta.get("label", "")}
    return about | {
        "quantities": rows,
        "evaluations": found.strip.evaluations + found.carriage.evaluations,
    }
