"""Tables for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import flexura as fx

from ..runs.formatting import duration, finite, number, percent
from ..runs.table import Styled, Table

if TYPE_CHECKING:
    from ..crosscheck.crosscheck import Check
    from ..studies.drive_requirements import Effort
    from ..studies.transmission_zeros import Transmission


def check_table(check: Check) -> Table:
    """Deviation and the twin's own error per channel, and both run times."""
    table = Table(
        f"{check.simulation.meta.get('name') or 'robot'}: native against "
        f"{check.twin.meta['program']}",
        (
            "channel",
            "peak",
            "max deviation",
            "max / peak",
            "twin's own error",
            f"within {100 * check.tolerance:g} %",
        ),
        ("channel",),
    )
    for row in check.rows:
        own = check.own_error.get(row.channel)
        table.add(
            f"{row.channel} [{row.unit}]",
            number(row.peak),
            f"{row.max:.2e}",
            percent(row.max_relative),
            "" if own is None else percent(own),
            _VERDICTS[check.verdict(row.channel)],
        )
    native, other = check.simulation.meta["wall_s"], check.twin.meta["wall_s"]
    table.notes.append(
        f"run times: native {duration(native)}, twin {duration(other)} "
        f"({other / native:.0f} times as long)"
    )
    if check.own_error:
        table.notes.append(
            f"twin's own error: of its step of {number(check.twin.meta['step_s'], 3)} s, "
            "relative to the peak, from a run with another step"
        )
    elif not (check.simulation.complete and check.twin.complete):
        table.notes.append("twin's own error: not known, as a run did not come to its end")
    return table


_VERDICTS = {
    "within": Styled("yes", "green"),
    "beyond": Styled("no", "red"),
    "open": Styled("open", "yellow"),
}


def check_json(check: Check) -> dict[str, Any]:
    """A cross-check for JSON.

    Args:
        check: the cross-check.

    Returns:
        Deviations by channel, and both programs' run times.
    """
    rows = {
        row.channel: {k: finite(v) for k, v in vars(row).items() if k != "channel"}
        | {"twin_error_relative": check.own_error.get(row.channel)}
        for row in check.rows
    }
    runs = {
        name: {k: run.meta.get(k) for k in ("program", "wall_s", "steps", "step_s", "complete")}
        for name, run in (("simulation", check.simulation), ("twin", check.twin))
    }
    return {
        "passed": check.passed,
        "failed": check.failed,
        "open": check.open,
        "tolerance": check.tolerance,
        "channels": rows,
        "runs": runs,
    }


def run_table(run: fx.Run) -> Table:
    """What a run did: the range of its main channels, steps and the energy error."""
    table = Table(
        run.meta.get("name") or "run",
        ("channel", "start", "lowest", "highest", "end"),
        ("channel",),
    )
    for name in run:
        shown = not name.startswith(("link", "energy")) and "/reaction_" not in name
        if not (shown or name.endswith(("tip_deflection", "tip_slope"))):
            continue
        values = run[name]
        table.add(
            f"{name} [{run.units[name]}]",
            *(number(v, 5) for v in (values[0], values.min(), values.max(), values[-1])),
        )
    about = run.meta
    table.notes.append(
        f"{about['structure']}, {about['unknowns']} unknowns, {run.t[-1] - run.t[0]:g} s simulated "
        f"in {duration(about['wall_s'])}; {_solved(about)}"
    )
    return table


def _solved(about: dict[str, Any]) -> str:
    return (
        f"{about['method']}, {about['steps']} steps, rtol {about['rtol']:g}, "
        f"energy error {about['energy_error']:.1e}; start: {about['start']}"
    )


def effort_table(rows: list[Effort], run: fx.Run) -> Table:
    """What each drive has to give, and how exact the calculation was."""
    heads = ("peak", "at", "RMS", "peak speed", "peak power", "energy in", "net energy")
    table = Table(
        f"{run.meta.get('name') or 'robot'}: drives of {run.meta['manoeuvre'] or 'the motion'}",
        ("drive", *heads),
        ("drive",),
    )
    for row in rows:
        table.add(
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
    if bent:
        table.notes.append(f"largest tip deflection: {', '.join(bent)}")
    table.notes.append(f"simulated in {duration(run.meta['wall_s'])}; {_solved(run.meta)}")
    return table


def run_json(run: fx.Run) -> dict[str, Any]:
    """A run for JSON.

    Args:
        run: the run.

    Returns:
        Metadata, and of each channel unit, start, end and extremes.
    """
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
        "channels": {n: {k: finite(x) for k, x in c.items()} for n, c in channels.items()},
    }


def frequency_tables(
    locked: np.ndarray, free: np.ndarray, name: str, zeros: list[Transmission]
) -> list[Table]:
    """Natural frequencies, and transmission zeros where they are given."""
    table = Table(
        f"{name}: natural frequencies", ("mode", "joints locked [Hz]", "joints free [Hz]")
    )
    for k in range(max(len(locked), len(free))):
        table.add(str(k + 1), *(number(f[k], 5) if k < len(f) else "" for f in (locked, free)))
    if len(locked):
        table.notes.append(
            "frequencies near the highest of a mesh are the mesh's: more elements show which stay"
        )
    return [table, *([_zero_table(zeros)] if zeros else [])]


def _zero_table(rows: list[Transmission]) -> Table:
    heads = ("drive", "output", "output at rest at [Hz]", "right half plane [1/s]")
    table = Table("transmission zeros", heads, heads)
    for row in rows:
        still = ", ".join(f"{f:.4g}" for f in row.notches_Hz[:4]) or "-"
        slow = (
            ", ".join(
                f"{z.real:.4g}" + (f" ± {z.imag:.4g} i" if z.imag else "") for z in row.unstable[:3]
            )
            or "-"
        )
        cells = (still, slow) if row.zeros is not None else ("not moved", "")
        table.add(row.drive, row.output, *cells)
    table.notes.append(
        "A zero in the right half plane limits feedback of that output: it cannot be faster."
    )
    return table
