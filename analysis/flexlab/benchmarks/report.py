"""The benchmark's tables: 80 columns, no digit cut."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from .scaling import MAX_GROWTH
from .timing import geometric_mean

WIDTH = 80
Rows = list[dict[str, Any]]


def figure(value: float) -> str:
    """A number of three digits, without a power of ten."""
    return f"{value:#.3g}".rstrip(".") if value < 1000 else f"{value:.0f}"


def small(value: float) -> str:
    """An error, in as few characters as show its size."""
    return f"{value:.0e}".replace("e-0", "e-")


def spread(of: dict[str, Any] | None) -> str:
    """The median ratio of a row's entry, "-" if there is none."""
    return "-" if of is None else figure(of["ratio"]["median"])


def motions(rows: Rows) -> Table:
    """Table of the motions: ratios, best method, tolerance, error, times, default."""
    table = _table(
        "name", "auto", "quartiles", "best", "method", "rtol", "error", "ms", "Exudyn", "default"
    )
    for row in rows:
        default = row.get("default", {})
        usual = f"{figure(default['ms'])} {small(default['error'])}" if "ms" in default else "fails"
        if "best" not in row:
            table.add_row(row["name"], "-", "", "-", "", "", "", "", "", usual if default else "")
            continue
        best, auto = row["best"], row.get("auto")
        low_high = (
            ""
            if auto is None
            else f"{figure(auto['ratio']['low'])}-{figure(auto['ratio']['high'])}"
        )
        table.add_row(
            row["name"],
            spread(auto),
            low_high,
            spread(best),
            best["took"][:3],
            small(best["rtol"]),
            small(best["error"]),
            figure(best["ms"]),
            figure(row["exudyn"]["ms"]),
            usual,
        )
    return table


def summary(rows: Rows) -> str:
    """Geometric mean and worst ratio of the motions, failures, and missed requirements."""
    lines = []
    for name, title in (("auto", "auto"), ("best", "best by hand")):
        ratios = {
            row["name"]: row[name]["ratio"]["median"]
            for row in rows
            if name in row and "exudyn" in row
        }
        if ratios:
            worst = min(ratios, key=lambda each: ratios[each])
            mean = geometric_mean(list(ratios.values()))
            lines.append(
                f"{title}: geometric mean {figure(mean)} of {len(ratios)}, worst "
                f"{figure(ratios[worst])} ({worst})"
            )
    lines += [f"{row['name']}: {row['failed']}" for row in rows if "failed" in row]
    lines += [f"{row['name']}: {row['note']}" for row in rows if "note" in row]
    for row in rows:
        if row["asked"] and "best" in row:
            lines.append(f"{row['name']}: best {spread(row['best'])}, asked {figure(row['asked'])}")
    return "\n".join(lines)


def statics(rows: Rows) -> Table:
    """Table of statics and frequencies."""
    table = _table("name", "ratio", "quartiles", "asked", "apart", "ms", "Exudyn")
    for row in rows:
        asked = "" if row["asked"] is None else figure(row["asked"])
        if "auto" not in row:
            table.add_row(row["name"], "-", "", asked, "", "", "")
            continue
        found = row["auto"]
        quartiles = f"{figure(found['ratio']['low'])}-{figure(found['ratio']['high'])}"
        numbers = (small(found["error"]), figure(found["ms"]), figure(row["exudyn"]["ms"]))
        table.add_row(row["name"], spread(found), quartiles, asked, *numbers)
    return table


def populations(rows: Rows) -> Table:
    """Table of a robot's share of a population against one run of Exudyn."""
    table = _table("population", "us a robot", "ratio", "quartiles", "asked")
    for row in rows:
        r = row["ratio"]
        table.add_row(
            row["what"],
            figure(row["us"]),
            figure(r["median"]),
            f"{figure(r['low'])}-{figure(r['high'])}",
            figure(row["asked"]),
        )
    return table


def growths(rows: Rows) -> Table:
    """Table of an evaluation's time over links and elements."""
    table = _table("one evaluation", "number", "us", "times that of half as many", "at most")
    for row in rows:
        times = "" if row["times"] is None else f"{row['times']:.2f}"
        table.add_row(
            row["what"],
            str(row["count"]),
            figure(row["us"]),
            times,
            f"{MAX_GROWTH}" if times else "",
        )
    return table


def predictions(rows: Rows) -> Table:
    """Table of the ticks of predictive control, and of what is left of its motion."""
    table = _table(
        "predictive control",
        "spread",
        "median ms",
        "99.9 %",
        "least",
        "at most",
        "left mm",
        "LQG mm",
    )
    for row in rows:
        numbers = (row[f"{what}_ms"] for what in ("median", "p999", "least_p999", "required"))
        left = (row["residual_mm"], row["lqg_residual_mm"])
        table.add_row(
            f"{row['rate_Hz']:.0f} Hz, {row['intervals']} intervals",
            str(row["spread"]),
            *(figure(x) for x in (*numbers, *left)),
        )
    return table


def environments(rows: Rows) -> Table:
    """Table of the environment for learning: times real time, and the error of its steps."""
    table = _table(
        "robots that learn", "x real time", "of 2 cores", "at least", "error mm", "largest"
    )
    for row in rows:
        speed = (row["times_real_time"], row["of_two_processors"], row["required"])
        error = (row["median_error_mm"], row["largest_error_mm"])
        table.add_row(f"{row['robots']}, {row['name']}", *(figure(x) for x in (*speed, *error)))
    return table


def boards(rows: list[tuple[str, str, float]]) -> Table:
    """Table of the emulated board's load."""
    table = _table("emulated board under its hardest load", "")
    for name, text, _ in rows:
        table.add_row(name, text)
    return table


def accuracies(rows: Rows) -> Table:
    """Table of errors in multiples of the tolerance, by problem."""
    tolerances = [each["rtol"] for each in rows[0]["errors"]]
    table = _table(
        "error / rtol, auto", *(small(rtol) for rtol in tolerances), "default", "scale m"
    )
    for row in rows:
        cells = [_times(each) for each in row["errors"]]
        default = row["default"]
        usual = small(default["error"]) if default.get("error") is not None else "fails"
        table.add_row(
            row["name"] + (" *" if row["undamped"] else ""), *cells, usual, figure(row["scale"])
        )
    return table


def time_parts(rows: Rows) -> Table:
    """Table of what a motion's time goes into, and of how fast it could be at most."""
    table = _table(
        "time of auto", "method", "passes", "ms", "of passes", "function", "ratio", "at most"
    )
    for row in rows:
        if "ms" not in row:
            table.add_row(row["name"], "fails")
            continue
        parts = [
            f"{row[part] / row['ms']:.0%}" if row[part] else ""
            for part in ("evaluations_ms", "function_ms")
        ]
        ratios = [figure(row["ratio"]), figure(row["ratio_at_most"])]
        table.add_row(
            row["name"],
            row["method"][:3],
            str(row["evaluations"]),
            figure(row["ms"]),
            *parts,
            *ratios,
        )
    return table


def passes(rows: Rows) -> Table:
    """Table of evaluations at each error, by method."""
    errors = [each["error"] for each in rows[0]["passes"]]
    table = _table("passes at error", "method", *(small(error) for error in errors))
    for row in rows:
        for method in row["methods"]:
            cells = [each["passes"].get(method) for each in row["passes"]]
            table.add_row(
                row["name"], method, *("-" if cell is None else str(cell) for cell in cells)
            )
    return table


def _times(each: dict[str, Any]) -> str:
    return "fails" if each["error"] is None else figure(each["error"] / each["rtol"])


def _table(*columns: str) -> Table:
    """A table without a frame: first column left, others right; long cells are folded."""
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    for k, name in enumerate(columns):
        table.add_column(name, justify="right" if k else "left", overflow="fold")
    return table


def show(*parts: Table | str) -> None:
    """Print tables and lines."""
    console = Console(width=WIDTH, highlight=False, soft_wrap=False)
    for part in parts:
        console.print(part)
        console.print()
