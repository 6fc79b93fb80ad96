"""How fast the solver is on this machine, and how busy the board: `make bench`, or python -m flexlab.bench [--json].

Ratios of programs measured side by side (`sidebyside.py`), each beside what is asked of it. Errors are the largest difference of
a tip deflection from each program's own converged model, relative to its largest value.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from rich.console import Console
from rich.table import Table

from . import baseline, crowd, scaling, sidebyside, sliders, twolink

ROUNDS = 7
GROWTH = 2.3  # asked: at most, at the large end of links

WORKS = {
    "type IV, 2 s bang-bang": baseline.cases,
    "RR with two flexible links, 2 s bang-bang": twolink.cases,
    "RPa, all unknowns, 0.8 s": lambda: sliders.cases("type-2-rpa"),
    "PbR, all unknowns, 0.8 s": lambda: sliders.cases("type-7-pbr"),
}


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


def against(rows: list[dict[str, Any]], title: str) -> Table:
    """Ratios with their spread beside what is asked."""
    table = Table(title=title, title_justify="left")
    for name in ("", "time", "error", "times as fast", "quartiles", "asked"):
        table.add_column(name, justify="right" if name else "left", no_wrap=True)
    for row in rows:
        took = f"{1e3 * row['wall_s']:.3g} ms" if "wall_s" in row else f"{row['us']:.4g} us"
        error = f"{row['error']:.1e}" if "error" in row else ""
        asked = "" if row["asked"] is None else f"{row['asked']:.0f}"
        quartiles = f"{row['low']:.0f} ... {row['high']:.0f}"
        table.add_row(row.get("case") or row["what"], took, error, f"{row['ratio']:.0f}", quartiles, asked)
    return table


def growing(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="one evaluation of the equations of motion", title_justify="left")
    for name in ("", "number", "time", "times that of half as many", "asked, at most"):
        table.add_column(name, justify="right" if name else "left")
    for k, row in enumerate(rows):
        last = row["what"].startswith("links") and (k + 1 == len(rows) or rows[k + 1]["what"] != row["what"])
        ratio = "" if row["ratio"] is None else f"{row['ratio']:.2f}"
        table.add_row(row["what"], str(row["count"]), f"{row['us']:.3g} us", ratio, f"{GROWTH}" if last else "")
    return table


def main() -> None:
    works = {title: sidebyside.measure(cases(), ROUNDS) for title, cases in WORKS.items()}
    many, growth, board = crowd.measure(), scaling.measure(), board_rows()
    if "--json" in sys.argv[1:]:
        emulated = {name: value for name, _, value in board}
        print(json.dumps({"solver": works, "population": many, "growth": growth, "emulated board": emulated}, indent=1))
        return
    console = Console(width=120)
    for title, rows in works.items():
        console.print(against(rows, f"{title}, one core, {ROUNDS} rounds"))
    title = f"{crowd.ROBOTS} different type IV robots, the same manoeuvre, 2 modes: a robot's share against one Exudyn run"
    console.print(against(many, title))
    console.print(growing(growth))
    table = Table("", "emulated board", title="the board under its hardest load, emulated", title_justify="left")
    for name, text, _ in board:
        table.add_row(name, text)
    console.print(table)


if __name__ == "__main__":
    main()
