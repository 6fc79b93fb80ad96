"""How fast the solver is on this machine, and how busy the board: `make bench`, or python -m flexlab.bench [--json].

Ratios of programs measured side by side: every round times each of them once, in turn, so that whatever else the machine does
hits all alike. Errors are the largest difference of the tip deflection from each program's own converged model, relative to its
largest value.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table

import flexura as fx

from . import baseline, crowd, scaling
from .baseline import Result

ROUNDS = 15
BASE = "Exudyn, 5 ANCF elements, tuned"

Case = tuple[str, Callable[[], Result], np.ndarray]


def cases() -> list[Case]:
    """What is timed: a name, the run, and the converged tip deflection it is compared with."""
    fine = fx.assemble(baseline.robot(12))
    converged = baseline.native(fine, 1e-10).tip_deflection
    exact = baseline.exudyn(16, 1e-4).tip_deflection
    out: list[Case] = [(BASE, baseline.exudyn, exact)]
    for name, elements, modes, rtol, method in (
        ("native, 2 modes", 12, 2, 1e-3, "explicit"),
        ("native, 3 modes", 12, 3, 1e-3, "explicit"),
        ("native, 3 modes, accurate", 12, 3, 1e-6, "explicit"),
        ("native, all unknowns of 5 elements", 5, None, 1.5e-5, "implicit"),
    ):
        system = fx.assemble(baseline.robot(elements, modes))
        out.append((name, lambda s=system, r=rtol, m=method: baseline.native(s, r, m), converged))  # type: ignore[misc]
    return out


def measure(rounds: int = ROUNDS) -> list[dict[str, float | str]]:
    """One row a case: median wall time [s], error, median ratio to Exudyn, and the ratio's quartiles over the rounds."""
    todo = cases()
    for _, run, _ in todo:
        run()  # compiled, loaded, warm
    walls = np.array([[run().wall_s for _, run, _ in todo] for _ in range(rounds)])
    ratios = walls[:, :1] / walls
    rows: list[dict[str, float | str]] = []
    for k, (name, run, reference) in enumerate(todo):
        error = np.abs(run().tip_deflection - reference).max() / np.abs(reference).max()
        low, middle, high = np.percentile(ratios[:, k], (25, 50, 75))
        row = {
            "wall_s": float(np.median(walls[:, k])),
            "error": float(error),
            "ratio": middle,
            "ratio_low": low,
            "ratio_high": high,
        }
        rows.append({"case": name} | row)
    return rows


def board_rows() -> list[tuple[str, str, float]]:
    """What the board's processor does under its hardest load, emulated: a name, the value in words, the number in SI units."""
    from .board import load
    from .board.simulator import CLOCK_HZ
    from .flash import RIG, build
    from .rig import load as load_rig

    elf, rig = build(), load_rig(RIG)
    found, most = load.measure(elf, rig), load.measure(elf, rig, every_term=True)
    fast, alone = sorted((load.experiment(elf, rig) for _ in range(3)), key=lambda both: both[0] / both[1])[1]
    period, longest, every = CLOCK_HZ / 1000, found.control_longest, most.control_longest
    jitter = max(found.period_most - period, period - found.period_least)

    def us(cycles: float) -> str:
        return f"{1e6 * cycles / CLOCK_HZ:.1f} us"

    return [
        ("encoder edges at the peak, missed", f"{found.edges_most_per_s:.0f} 1/s, {found.missed}", found.edges_most_per_s),
        ("steps at the peak", f"{found.steps_most_per_s:.0f} 1/s", found.steps_most_per_s),
        ("control tick, jitter", f"{us(period)} +- {us(jitter)}", jitter / CLOCK_HZ),
        ("control interrupt, longest with what interrupts it", f"{us(longest)} = {found.control_share:.1%}", longest / CLOCK_HZ),
        ("the same, every term of the controllers on", f"{us(every)} = {most.control_share:.1%}", every / CLOCK_HZ),
        ("control interrupt, longest by itself", us(found.control_own), found.control_own / CLOCK_HZ),
        ("control interrupt, mean", us(found.control_mean), found.control_mean / CLOCK_HZ),
        ("processor in interrupts", f"{found.interrupts_share:.1%}", found.interrupts_share),
        ("flash", f"{found.flash} of {load.FLASH_BYTES} bytes", found.flash),
        ("RAM, static", f"{found.ram_static} bytes", found.ram_static),
        ("RAM, deepest stack", f"{found.stack_most} bytes; {found.ram_share:.1%} of {load.RAM_BYTES} in all", found.stack_most),
        ("emulator, alone", f"{found.times_real_time_alone:.1f} x real time", found.times_real_time_alone),
        ("emulator, with light drives and host", f"{found.times_real_time:.1f} x real time", found.times_real_time),
        ("emulated experiment, with the rig's plant", f"{fast:.1f} x real time, {fast / alone:.0%} of alone", fast / alone),
    ]


def main() -> None:
    rows, many, growth, board = measure(), crowd.measure(), scaling.measure(), board_rows()
    if "--json" in sys.argv[1:]:
        emulated = {name: value for name, _, value in board}
        print(json.dumps({"solver": rows, "population": many, "growth": growth, "emulated board": emulated}, indent=1))
        return
    table = Table(title=f"type IV, {baseline.DURATION_S:g} s bang-bang, one core, {ROUNDS} rounds", title_justify="left")
    for name in ("", "time", "error of the tip deflection", "times as fast", "quartiles"):
        table.add_column(name, justify="left" if not name else "right", no_wrap=True)
    for row in rows:
        quartiles = f"{row['ratio_low']:.0f} ... {row['ratio_high']:.0f}"
        table.add_row(
            str(row["case"]), f"{1e3 * float(row['wall_s']):.3g} ms", f"{row['error']:.1e}", f"{row['ratio']:.0f}", quartiles
        )
    console = Console(width=110)
    console.print(table)
    table = Table(title=f"{crowd.ROBOTS} different type IV robots, the same manoeuvre, 3 modes", title_justify="left")
    for name in ("", "time a robot", "times as fast as one Exudyn run"):
        table.add_column(name, justify="right" if name else "left")
    for part in many:
        table.add_row(part["what"], f"{part['us']:.4g} us", f"{1e6 * float(rows[0]['wall_s']) / part['us']:.0f}")
    console.print(table)
    table = Table(title="one evaluation of the equations of motion", title_justify="left")
    for name in ("", "number", "time", "times that of half as many"):
        table.add_column(name, justify="left" if not name else "right")
    for part in growth:
        ratio = "" if part["ratio"] is None else f"{part['ratio']:.2f}"
        table.add_row(part["what"], str(part["count"]), f"{part['us']:.3g} us", ratio)
    console.print(table)
    table = Table("", "emulated board", title="the board under its hardest load, emulated", title_justify="left")
    for name, text, _ in board:
        table.add_row(name, text)
    console.print(table)


if __name__ == "__main__":
    main()
