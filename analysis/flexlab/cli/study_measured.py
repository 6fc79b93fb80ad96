"""`flexura study measured`: simulations over the measurements of a robot."""

from __future__ import annotations

import json as json_
from dataclasses import asdict
from pathlib import Path
from typing import Any

import flexura as fx
from flexura.io import write_bytes, write_text
from flexura.io.drawing import attempted
from flexura.optional import need

from ..review import write_review
from ..runs.formatting import number, percent
from ..runs.table import Table
from ..studies.measured import Measured, measured, numbers
from ..studies.measured_figure import png
from ..studies.measured_fit import MeasuredFit, angle_per_strain, measured_fit
from ..studies.measured_fit import numbers as measured_fit_numbers
from ..studies.measured_loop import Loop, closed_loop
from .output import message, print_results, progress_bars
from .results import results


def study_measured(
    robot: Path,
    data: Path | None,
    out: Path | None,
    rtol: float,
    fit_on: str | None = None,
    *,
    force: bool,
    json: bool,
) -> None:
    """Simulate all measured step runs of a folder, fit the robot to one of them, and store figure,
    reviews, runs, the fitted robot and figures."""
    if data is None:
        raise fx.InputError(
            "expected the folder of the measured runs; docs/guide/measured.md says where they are",
            key="--data",
        )
    described = fx.load(robot)
    angle_per_strain(described)
    need("matplotlib", "rerun")
    with results(out, "study-measured", robot.stem, force=force) as draft:
        with progress_bars("measured", "fit") as report:
            found = measured(described, data, rtol=rtol, progress=lambda f: report("measured", f))
            fit = measured_fit(described, found, fit_on, lambda f: report("fit", f))
            loop = closed_loop(fit, data)
        names = ["measured.json", "measured.png", "identified.toml"]
        told: dict[str, Any] = {
            "robot": described.name,
            "runs": numbers(found),
            "identified": measured_fit_numbers(fit),
            "closed_loop": None if loop is None else asdict(loop),
        }
        write_text(draft.folder / names[0], json_.dumps(told, indent=1) + "\n")
        fx.save(fit.found.robot, draft.folder / names[2])
        for m in found:
            m.experiment.save(draft.folder / m.name / "experiment")
            m.simulation.save(draft.folder / m.name / "simulation")
            write_review(draft.folder / m.name / "review.rrd", [m.simulation, m.experiment])
            names.append(f"{m.name}/review.rrd")
        with attempted(names[1]):
            drawn = png(described, found, fit)
        write_bytes(draft.folder / names[1], drawn)
        folder = draft.keep()
    stored = [str(folder / name) for name in names]
    print_results(
        json,
        lambda: [table(described, found), fitted_table(fit, loop)],
        lambda: told | {"stored": stored},
    )
    message(json, f"stored {folder}: {', '.join(names)}")


def table(robot: fx.Robot, found: list[Measured]) -> Table:
    """One row a run."""
    heads = ("run", "measured [Hz]", "hub held [Hz]", "deviation", "hub as measured [Hz]")
    out = Table(f"{robot.name}: measured", (*heads, "deviation", "RMS of peak"), ("run",))
    for m in found:
        out.add(
            m.name.removesuffix("_run01"),
            number(m.ring_Hz),
            number(m.held_Hz),
            percent(m.held_deviation),
            number(m.simulated_Hz),
            percent(m.simulated_deviation),
            percent(m.rms_of_peak),
        )
    out.notes.append("frequencies of the ring later than 1.5 s; RMS deviation of the strain gauge")
    return out


def fitted_table(fit: MeasuredFit, loop: Loop | None) -> Table:
    """One row a run, by the robot that was fitted to one of them."""
    heads = ("run", "measured [Hz]", "predicted [Hz]", "deviation", "RMS of peak")
    out = Table(f"fitted to {fit.name}, hub as measured", heads, ("run",))
    for p in fit.runs:
        out.add(
            p.name.removesuffix("_run01"),
            number(p.ring_Hz),
            number(p.simulated_Hz),
            percent(p.deviation),
            percent(p.rms_of_peak),
        )
    for q in fit.found.quantities:
        out.notes.append(
            f"{q.name} = {number(q.value)} {q.unit}, 95 %: {number(q.low)} to {number(q.high)}"
        )
    if loop is not None:
        out.notes.append(
            f"closed loop under the maker's LQR, RMS of peak: hub {percent(loop.hub)}, gauge "
            f"{percent(loop.gauge)}, current {percent(loop.current)}"
        )
    out.notes.append("the gauge's filter is the maker's: second order, 2 Hz, damping ratio 0.9")
    return out
