"""Tables for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group
from rich.table import Table

import flexura as fx

if TYPE_CHECKING:
    from ..crosscheck.crosscheck import Check
    from ..studies.drive_requirements import Effort
    from ..studies.transmission_zeros import Transmission


def check_table(check: Check) -> Table:
    """Deviation per channel, and both run times."""
    tolerance = 100 * check.tolerance
    table = Table(
        title=(
            f"{check.simulation.meta.get('name') or 'robot'}: native against "
            f"{check.twin.meta['program']}"
        ),
        title_justify="left",
    )
    for name in (
        "channel",
        "peak",
        "max deviation",
        "RMS deviation",
        "max / peak",
        "RMS / peak",
        f"within {tolerance:g} %",
    ):
        table.add_column(name, justify="left" if name == "channel" else "right", no_wrap=True)
    failed = set(check.failed)
    for row in check.rows:
        verdict = "[red]no" if row.channel in failed else "[green]yes"
        table.add_row(
            f"{row.channel} \\[{row.unit}]",
            f"{row.peak:.4g}",
            f"{row.max:.2e}",
            f"{row.rms:.2e}",
            _percent(row.max_relative),
            _percent(row.rms_relative),
            verdict,
        )
    native, other = check.simulation.meta["wall_s"], check.twin.meta["wall_s"]
    table.caption = (
        f"run times: native {_time(native)}, twin {_time(other)} "
        f"({other / native:.0f} "
        f"times as long)"
    )
    table.caption_justify = "left"
    return table


def check_json(check: Check) -> dict[str, Any]:
    rows = {
        row.channel: {k: _finite(v) for k, v in vars(row).items() if k != "channel"}
        for row in check.rows
    }
    runs = {
        name: {k: run.meta.get(k) for k in ("program", "wall_s", "steps", "complete")}
        for name, run in (("simulation", check.simulation), ("twin", check.twin))
    }
    return {
        "passed": check.passed,
        "failed": check.failed,
        "tolerance": check.tolerance,
        "channels": rows,
        "runs": runs,
    }


def run_table(run: fx.Run) -> Table:
    """What a run did: the range of its main channels, steps and the energy error."""
    table = Table(title=run.meta.get("name") or "run", title_justify="left")
    for name in ("channel", "start", "lowest", "highest", "end"):
        table.add_column(name, justify="left" if name == "channel" else "right", no_wrap=True)
    for name in run:
        if name.startswith(("link", "energy")) and not name.endswith(
            ("tip_deflection", "tip_slope")
        ):
            continue
        values = run[name]
        table.add_row(
            f"{name} \\[{run.units[name]}]",
            *(f"{v:.5g}" for v in (values[0], values.min(), values.max(), values[-1])),
        )
    about = run.meta
    table.caption = (
        f"{about['structure']}, {about['unknowns']} unknowns, {run.t[-1] - run.t[0]:g} s simulated "
        f"in {_time(about['wall_s'])}; "
        f"{about['method']}, {about['steps']} steps, rtol {about['rtol']:g}, energy error "
        f"{about['energy_error']:.1e}"
    )
    table.caption_justify = "left"
    return table


def effort_table(rows: list[Effort], run: fx.Run) -> Table:
    """What each drive has to give, and how exact the calculation was."""
    table = Table(
        title=(
            f"{run.meta.get('name') or 'robot'}: drives of {run.meta['manoeuvre'] or 'the motion'}"
        ),
        title_justify="left",
    )
    for name in (
        "drive",
        "peak",
        "at",
        "RMS",
        "peak speed",
        "peak power",
        "energy in",
        "net energy",
    ):
        table.add_column(name, justify="left" if name == "drive" else "right", no_wrap=True)
    for row in rows:
        table.add_row(
            f"joint {row.joint}",
            f"{row.peak:.4g} {row.unit}",
            f"{row.peak_at_s:.4g} s",
            f"{row.rms:.4g} {row.unit}",
            f"{row.peak_speed:.3g} {row.speed_unit}",
            f"{row.peak_power_W:.3g} W",
            f"{row.energy_in_J:.4g} J",
            f"{row.energy_net_J:.4g} J",
        )
    bent = [
        f"link {n.split('/')[1]} {1e3 * np.abs(run[n]).max():.3g} mm"
        for n in run
        if n.endswith("tip_deflection")
    ]
    table.caption = (
        f"largest tip deflection: {', '.join(bent) or 'none'}; {_time(run.meta['wall_s'])}, "
        f"{run.meta['steps']} steps, "
        f"rtol {run.meta['rtol']:g}, energy error {run.meta['energy_error']:.1e}"
    )
    table.caption_justify = "left"
    return table


def run_json(run: fx.Run) -> dict[str, Any]:
    about = {k: v for k, v in run.meta.items() if k not in ("robot", "drive")}
    channels = {
        n: {
            "unit": run.units[n],
            "start": v[0],
            "lowest": v.min(),
            "highest": v.max(),
            "end": v[-1],
        }
        for n, v in run.channels.items()
    }
    return about | {
        "end_s": float(run.t[-1]),
        "channels": {n: {k: _finite(x) for k, x in c.items()} for n, c in channels.items()},
    }


def frequency_tables(
    locked: np.ndarray, free: np.ndarray, name: str, zeros: list[Transmission]
) -> Group:
    """Natural frequencies, and transmission zeros where they are given."""
    table = Table(title=f"{name}: natural frequencies", title_justify="left")
    table.add_column("mode", justify="right")
    table.add_column("joints locked \\[Hz]", justify="right")
    table.add_column("joints free \\[Hz]", justify="right")
    for k in range(max(len(locked), len(free))):
        table.add_row(str(k + 1), *(f"{f[k]:.5g}" if k < len(f) else "" for f in (locked, free)))
    return Group(table, *([_zero_table(zeros)] if zeros else []))


def _zero_table(rows: list[Transmission]) -> Table:
    table = Table(title="transmission zeros", title_justify="left")
    for name in ("drive", "output", "output at rest at \\[Hz]", "right half plane \\[1/s]"):
        table.add_column(name, no_wrap=True)
    for row in rows:
        still = ", ".join(f"{f:.4g}" for f in row.notches_Hz[:4]) or "-"
        slow = (
            ", ".join(
                f"{z.real:.4g}" + (f" ± {z.imag:.4g} i" if z.imag else "") for z in row.unstable[:3]
            )
            or "-"
        )
        table.add_row(
            row.drive, row.output, *((still, slow) if row.zeros is not None else ("not moved", ""))
        )
    table.caption = (
        "a zero in the right half plane: feedback of that output cannot be faster than it"
    )
    table.caption_justify = "left"
    return table


def _percent(value: float) -> str:
    return "-" if not np.isfinite(value) else f"{100 * value:.2g} %"


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _finite(value: Any) -> Any:
    return (
        None
        if isinstance(value, float | np.floating) and not np.isfinite(value)
        else value
        if isinstance(value, str)
        else float(value)
    )
