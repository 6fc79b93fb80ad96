"""What an identification comes to, as a table and for scripts; another experiment of the same rig
to judge it by."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table

import flexura as fx

from ..comparison.measures import Comparison, compare
from ..comparison.replay.simulate_experiment import simulate
from ..runs.labels import EMULATED, called, emulated
from .estimate import Found
from .files import described_anew
from .identify import Identified


@dataclass(frozen=True)
class Quantity:
    """One figure: what the files say, what was found, its 95 % interval."""

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


def _row(name: str, unit: str, found: Found, key: str, nominal: float, scale: float) -> Quantity:
    low, high = found.interval(key)
    return Quantity(name, unit, nominal, scale * found.values[key], scale * low, scale * high)


def check(found: Identified, other: fx.Run, by: str = "commanded") -> tuple[Comparison, Comparison]:
    """Another experiment of the same rig beside its simulation: by the files as they were, and by
    what was found."""
    anew = described_anew(other, found)
    return compare(simulate(other, by), other), compare(simulate(anew, by), anew)


def table(found: Identified, experiment: fx.Run) -> Table:
    """The table for the terminal."""
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
    """For JSON."""
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
