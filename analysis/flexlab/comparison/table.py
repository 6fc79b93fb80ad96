"""What a comparison leaves: a table, JSON, and a folder with the simulation, report and review."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.io import EMULATED, emulated

from ..runs.formatting import percent
from ..runs.table import Table
from .measures import RESPONSE_LEVEL, Comparison

_FAR = 0.2  # of a joint's peak
HEADS = ("quantity", "peak", "largest deviation", "at [s]", "of the peak", "RMS", "dissertation")


DRIVEN = {
    "commanded": "driven by the voltage and the pulses that were commanded",
    "reference": "follows the set-points exactly, as the dissertation's own",
    "measured": "follows the encoders",
}


def title(c: Comparison) -> str:
    """The title of a comparison.

    Args:
        c: the comparison.

    Returns:
        The robot and the two runs' names.
    """
    name = c.simulation.meta.get("robot", {}).get("name") or "robot"
    return f"{name}: {c.names[0]} against {c.names[1]}" + (
        f", {c.experiment_kind}" if c.experiment_kind else ""
    )


def rows(c: Comparison) -> list[tuple[str, ...]]:
    """The table's cells, HEADS above them: the same in the terminal, the page and the PDF."""
    out: list[tuple[str, ...]] = [
        (
            d.quantity,
            _size(d.peak, d.unit),
            _size(d.max, d.unit),
            _seconds(d.at_s),
            percent(d.max_relative, 3),
            percent(d.rms_relative, 3),
            _published(d.published_percent),
        )
        for d in c.differences
    ]
    for r in c.responses:
        took = f"{_seconds(r.experiment_s)}, {_seconds(r.simulation_s)} s"
        delayed = "-" if np.isnan(r.delay_s) else f"delay {1e3 * r.delay_s:.1f} ms"
        out.append(
            (f"{r.quantity}: response time", "", took, "", percent(abs(r.relative), 3), delayed, "")
        )
    if c.responses:
        worst = percent(c.worst_response, 3)
        out.append(
            (
                "worse response time",
                "",
                "",
                "",
                worst,
                "",
                _published(c.published_response_percent),
            )
        )
    return out


def notes(c: Comparison) -> list[str]:
    """What a reader must know beside the numbers."""
    both = tuple(zip(c.names, (c.simulation, c.experiment), strict=True))
    lines = [
        f"{name}: {EMULATED.removeprefix('emulated: ')}" for name, run in both if emulated(run)
    ]
    if way := c.simulation.meta.get("driven_by"):
        lines.append(f"simulation {DRIVEN[way]} (--by {way})")
    truth = c.experiment.meta.get("truth", {}).get("factors", {})
    if way and any(factor != 1 for factor in truth.values()):
        lines.append(
            "the emulated rig is not quite its files, as a real one: friction, damping, payload "
            "and sensor are others; flexura bench excite and flexura identify find them"
        )
    far = any(d.max_relative > _FAR for d in c.differences if d.channel.startswith("joint/"))
    if way == "commanded" and far:
        lines.append(
            "voltages alone do not tell where friction stops a joint: --by measured moves the "
            "joints as they were measured, and flexura identify finds the friction"
        )
    published = any(d.published_percent is not None for d in c.differences)
    lines.append(
        "deviation: second minus first, of the first run's peak"
        + ("; the dissertation's figures are of its own rig" if published else "")
    )
    for name, run in both:
        if shift := run.meta.get("shift_s"):
            lines.append(f"{name}: {shift:.6g} s added to its times")
    if c.responses:
        lines.append(
            f"response time: from t = 0 until {100 * RESPONSE_LEVEL:g} % of the largest distance "
            f"from the start is first covered, of the second run and of the first; "
            "delay: the shift in time that fits best"
        )
    if c.lost:
        lines.append(
            f"{c.lost} of {len(c.experiment)} samples are dropouts in at least one channel, and "
            f"are left out"
        )
    for name, run in both:
        if not run.complete:
            lines.append(f"{name}: ends at {run.t[-1]:.4g} s; what comes after is not compared")
    return lines


def table(c: Comparison) -> Table:
    """The table for the terminal."""
    out = Table(title(c), HEADS, ("quantity",))
    for k, row in enumerate(cells := rows(c)):
        out.add(*row)
        if k == len(c.differences) - 1 and k < len(cells) - 1:
            out.rule()
    out.notes += notes(c)
    return out


def numbers(c: Comparison) -> dict[str, Any]:
    """For JSON."""
    clean = lambda entry: {
        k: None
        if isinstance(v, float) and not np.isfinite(v)
        else float(v)
        if isinstance(v, np.floating)
        else v
        for k, v in vars(entry).items()
    }
    about = {
        name: {"called": own, "emulated": emulated(run), "complete": run.complete}
        | {
            k: run.meta[k]
            for k in ("label", "driven_by", "started", "seed", "firmware", "host_version")
            if k in run.meta
        }
        for name, own, run in (
            ("first", c.names[0], c.simulation),
            ("second", c.names[1], c.experiment),
        )
    }
    worst = c.worst_response
    return {
        "title": title(c),
        "emulated": emulated(c.experiment) or emulated(c.simulation),
        "experiment": c.experiment_kind,
        "runs": about,
        "deviations": [clean(d) for d in c.differences],
        "responses": [clean(r) for r in c.responses],
        "response_relative": worst if np.isfinite(worst) else None,
        "response_published_percent": c.published_response_percent,
        "dropouts": c.lost,
        "notes": notes(c),
    }


def _size(value: float, unit: str) -> str:
    if not np.isfinite(value):
        return "-"
    small = unit in ("m", "rad")
    return f"{1e3 * value:.3g} m{unit}" if small else f"{value:.3g} {unit}".removesuffix(" 1")


def _seconds(value: float) -> str:
    return "-" if not np.isfinite(value) else f"{value:.3f}"


def _published(value: float | None) -> str:
    return "" if value is None else f"{value:g} %"
