"""What the person at the bench sees: the self-test, a live table while the experiment runs, and the
result.

Always with the board's label, which says whether it is emulated.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..board.protocol.declaration import Flag, Mode, State
from ..board.protocol.player import FRACTION, VOLT_UNIT_V
from ..experiment.plan import Plan
from ..experiment.run_experiment import ExperimentResult
from ..experiment.stop_requests import KEYS_HELP
from ..recordings.flex_calibration import Fit
from ..recordings.unit_conversion import DEFLECTION_SENSORS, Sensor, flex_reading
from ..rig import Check
from ..rig.board_axes import board_axes
from ..rig.checks import scale_of
from ..runs.formatting import number
from ..runs.table import Styled, Table


def heading(label: str, emulated: bool, experiment: str) -> str:
    """The title of everything that is shown of an experiment."""
    return f"{experiment} on the {label}{': no hardware is touched' if emulated else ''}"


def selftest_table(findings: list[Check], title: str) -> Table:
    """One row a test of the board: what was found and what was expected."""
    heads = ("", "found", "expected")
    out = Table(f"self-test: {title}", ("passed", *heads), heads)
    for f in findings:
        passed = Styled("ok", "green") if f.passed else Styled("failed", "red")
        out.add(passed, f.what, f.found, f.expected)
    return out


@contextmanager
def live(plan: Plan, sensor: Sensor, title: str) -> Iterator[Callable[[np.ndarray, float], None]]:
    """A table and a progress bar on a terminal's stderr that follow the newest report; nothing
    elsewhere."""
    if not sys.stderr.isatty():
        yield lambda reports, part: None
        return
    from rich.console import Console
    from rich.live import Live

    with Live(console=Console(stderr=True), refresh_per_second=8, transient=True) as shown:

        def observe(reports: np.ndarray, part: float) -> None:
            if len(reports):
                shown.update(live_table(reports[-1], part, plan, sensor, title))

        yield observe


def live_table(report: Any, part: float, plan: Plan, sensor: Sensor, title: str) -> Any:
    """One report as it stands, with what is over of the experiment."""
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.table import Table as Drawing
    from rich.text import Text

    out = Drawing(
        title=Text(title), title_justify="left", caption=KEYS_HELP, caption_justify="left"
    )
    for name in ("", "position", "set-point", "drive"):
        out.add_column(name, justify="left" if not name else "right", min_width=14)
    tracked = plan.knots.mode is Mode.position and report["state"] == State.running
    for axis in board_axes(plan.settings):
        n = axis.number
        factor, unit, _ = scale_of(axis)
        digits = 2 if unit == "mm" else 4
        wanted = factor * report[f"setpoint_{n}"] / FRACTION / axis.setpoints
        if axis.kind == "motor":
            drive = f"{report['voltage' if n == 1 else 'voltage_2'] * VOLT_UNIT_V:.2f} V"
        else:
            drive = f"{report['rate'] / axis.setpoints:.3f} rad/s"
        out.add_row(
            f"joint {n}",
            f"{factor * report[f'position_{n}'] / axis.counts:.{digits}f} {unit}",
            f"{wanted:.{digits}f} {unit}" if tracked else "",
            drive,
        )
    if sensor.kind in DEFLECTION_SENSORS:
        tip = float(sensor.tip(flex_reading(report["flex"])))
        out.add_row("tip deflection", f"{1e3 * tip:.2f} mm")
    limited = ", voltage at its limit" if report["flags"] >> Flag.saturated & 1 else ""
    out.add_row(
        "board",
        State(report["state"]).name + limited,
        f"{report['buffered']} waiting",
        f"{report['supply'] / 1000:.2f} V",
    )
    return Group(out, ProgressBar(total=1.0, completed=part, width=64))


def result_table(done: ExperimentResult) -> Table:
    """The range of every channel, how well set-points were followed, and what the line lost."""
    run = done.run
    about = run.meta
    title = heading(about["label"], about["emulated"], about["experiment"])
    heads = ("lowest", "highest", "max error", "RMS error", "lag")
    out = Table(title, ("channel", *heads), ("channel",))
    for name, row in numbers(run).items():
        cells = [_short(row[key]) for key in ("lowest", "highest", "error_max", "error_rms")]
        late = run.meta["delays"].get(name)
        lag = f"{1e3 * late['seconds']:.1f} ± {1e3 * late['std']:.1f} ms" if late else ""
        out.add(f"{name} [{run.units[name]}]", *cells, lag)
    line = about["line"]
    out.notes.append(
        f"{run.t[-1]:.3f} s, {line['reports']} reports, {line['missing']} missing, "
        f"{line['bad_frames']} bad frames; "
        f"firmware {about['firmware']['version']} ({about['firmware']['declaration']}); "
        f"{done.ended.text}"
    )
    return out


def calibration_table(found: Fit, label: str) -> Table:
    """The deflections that were held, the readings, what the cubic makes of them, and its
    coefficients."""
    sensor = Sensor(found.calibration, found.calibration.zero)
    heads = ("held [mm]", "reading", "by the cubic [mm]")
    out = Table(f"calibration of the flex sensor on the {label}", heads)
    for w, r in zip(found.tips_m, found.readings, strict=True):
        out.add(f"{1e3 * w:.2f}", f"{r:.5f}", f"{1e3 * float(sensor.tip(r)):.2f}")
    spread = np.sqrt(np.diag(np.array(found.calibration.covariance)))
    names = ("zero", "c1_m", "c2_m", "c3_m")
    values = (
        f"{n} = {getattr(found.calibration, n):.4g} ± {s:.2g}"
        for n, s in zip(names, spread, strict=True)
    )
    out.notes += [", ".join(values), f"residual {1e3 * found.residual_m:.2f} mm"]
    return out


def calibration_numbers(found: Fit) -> dict[str, Any]:
    """The same for scripts."""
    points = {"held_m": found.tips_m.tolist(), "readings": found.readings.tolist()}
    return {
        "calibration": found.calibration.model_dump(mode="json"),
        "residual_m": found.residual_m,
    } | points


def numbers(run: Any) -> dict[str, dict[str, float | None]]:
    """The same by channel, for scripts; None where there is no number."""
    out = {}
    for name in run:
        values = run[name][np.isfinite(run[name])]
        if not len(values):
            continue
        lag = run.meta["delays"].get(name, {})
        row: dict[str, float | None] = {
            "lowest": float(values.min()),
            "highest": float(values.max()),
            "end": float(values[-1]),
        }
        row |= {
            "error_max": None,
            "error_rms": None,
            "lag_s": lag.get("seconds"),
            "lag_std_s": lag.get("std"),
        }
        reference = name.replace("position", "reference")
        if reference != name and reference in run:
            error = (run[reference] - run[name])[np.isfinite(run[reference] - run[name])]
            if len(error):
                row |= {
                    "error_max": float(np.abs(error).max()),
                    "error_rms": float(np.sqrt(np.mean(error**2))),
                }
        out[name] = row
    return out


def _short(value: float | None) -> str:
    return "" if value is None else number(value)
