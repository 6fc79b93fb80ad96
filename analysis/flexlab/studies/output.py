"""What a study leaves: a table, JSON, a Parquet file of all its rows, and a figure."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from flexura.io import room_for_arrow, sealed_parquet, write_bytes
from flexura.io.drawing import LETTERS, attempted, plain, saved
from flexura.optional import load

from ..runs.formatting import number
from ..runs.table import Cell, Styled, Table, text
from .boundary import FIXED, SLIDING, WITHOUT
from .sweep import Row, Study

_HEADS = {
    "payload_kg": "payload [g]",
    "ratio": "L2/L1",
    "L1_m": "L1 [mm]",
    "L2_m": "L2 [mm]",
    "case": "case",
    "free_length_m": "free [mm]",
}


def table(study: Study) -> Table:
    """The study as a table.

    Args:
        study: the study.

    Returns:
        One row a case, and the finding below.
    """
    own = [key for key in study.rows[0] if key in _HEADS] if study.rows else []
    every = dict.fromkeys(key for row in study.rows for key in row)
    peaks = [key for key in every if key.startswith("joint_")]
    heads = [_HEADS[key] for key in own] + ["f1 [Hz]"]
    heads += [f"largest w{study.link} [mm]", f"later w{study.link} [mm]"]
    heads += [
        f"drive {key.split('_')[1]} [{key.split('_peak_')[1].replace('_', ' ')}]" for key in peaks
    ]
    title = f"{study.robot.name or 'robot'}: {study.name}; {study.about}"
    out = Table(title, heads, ("case",))
    for row in study.rows:
        cells: list[Cell] = [
            str(row[key]) if key == "case" else number((1.0 if key == "ratio" else 1e3) * row[key])
            for key in own
        ]
        if not row["complete"]:
            place = ", ".join(f"{_HEADS[key]} {text(c)}" for key, c in zip(own, cells, strict=True))
            out.notes.append(f"failed at {place}: {row['error']}")
            cells += [number(row.get("first_frequency_Hz", np.nan)), Styled("failed", "red")]
            out.add(*cells, *[""] * (len(heads) - len(cells)))
            continue
        cells += [
            number(row["first_frequency_Hz"]),
            number(1e3 * row["max_m"]),
            number(1e3 * row["later_m"], missing=""),
        ]
        out.add(*cells, *(number(row[key]) for key in peaks))
    since = "the last change of the drives" if study.name == "payload" else "half of the time"
    out.notes.append(
        f"f1: lowest frequency at the start, joints locked; w{study.link}: tip deflection of link "
        f"{study.link}, its largest in the whole run, and later: from {since} on"
    )
    out.notes += verdict(study).split("\n")
    return out


def verdict(study: Study) -> str:
    """The finding in words."""
    said = {True: "REPRODUCED", False: "NOT reproduced", None: "cannot say"}[
        study.finding.reproduced
    ]
    return f"finding: {study.finding.claim}\n{said}: {study.finding.words}"


def numbers(study: Study) -> dict[str, Any]:
    """The study for JSON.

    Args:
        study: the study.

    Returns:
        Finding and rows.
    """
    clean = lambda v: None if isinstance(v, float) and not np.isfinite(v) else v
    found = study.finding
    return {
        "study": study.name,
        "robot": study.robot.name,
        "about": study.about,
        "link": study.link,
        "complete": study.complete,
        "finding": {
            "claim": found.claim,
            "reproduced": found.reproduced,
            "words": found.words,
            **found.numbers,
        },
        "rows": [{key: clean(v) for key, v in row.items()} for row in study.rows],
    }


def save(study: Study, folder: Path) -> list[Path]:
    """Write study.parquet, study.png and study.svg, each as a whole.

    Args:
        study: the study.
        folder: where to.

    Returns:
        Their paths.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    room_for_arrow()
    about = {key: v for key, v in numbers(study).items() if key != "rows"} | {
        "robot_file": study.robot.to_dict()
    }
    names = list(dict.fromkeys(key for row in study.rows for key in row))
    columns = {name: [row.get(name) for row in study.rows] for name in names}
    sink = pa.BufferOutputStream()
    pq.write_table(
        pa.table(columns).replace_schema_metadata({"flexura_study": json.dumps(about)}),
        sink,
        compression="zstd",
        write_page_checksum=True,
    )
    paths = [folder / f"study.{kind}" for kind in ("parquet", "png", "svg")]
    write_bytes(paths[0], sealed_parquet(sink.getvalue().to_pybytes()))
    for path in paths[1:]:
        with attempted(path.name):
            drawn = saved(figure(study), path.suffix[1:], dpi=150)
        write_bytes(path, drawn)
    return paths


def figure(study: Study) -> Any:
    """The study's figure, a matplotlib Figure: the deflection over what was varied."""
    with load("matplotlib").rc_context(LETTERS):
        return _drawn(study)


def _drawn(study: Study) -> Any:
    drawing = load("matplotlib.figure").Figure(figsize=(7.5, 5), layout="constrained")
    axes = drawing.subplots()
    rows = [row for row in study.rows if row["complete"]]
    {"payload": _payload, "length-ratio": _length_ratio, "boundary": _boundary}[study.name](
        axes, rows, study
    )
    axes.set_ylabel(f"tip deflection of link {study.link} [mm]")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper center" if study.name == "length-ratio" else "best")
    axes.set_title(
        plain("\n".join([study.robot.name, *study.about.split("; ")])),
        fontsize="medium",
        loc="left",
    )
    return drawing


def _payload(axes: Any, rows: list[Row], study: Study) -> None:
    x = _column(rows, "payload_kg")
    axes.plot(x, _column(rows, "max_m"), "o-", color="C0", markersize=4, label="largest")
    later = _column(rows, "later_m")
    if np.isfinite(later).any():
        axes.plot(x, later, "s-", color="C1", markersize=4, label="largest after the drives")
    found = study.finding.numbers
    if found:
        axes.axvspan(
            1e3 * found["from_kg"],
            1e3 * found["to_kg"],
            color="C0",
            alpha=0.12,
            label="within 10 % of the least",
        )
    axes.set_xlabel("payload [g]")


def _length_ratio(axes: Any, rows: list[Row], study: Study) -> None:
    x = [row["ratio"] for row in rows]
    axes.plot(x, _column(rows, "max_m"), "o-", color="C0", markersize=4, label="largest")
    axes.plot(
        x,
        _column(rows, "later_m"),
        "s-",
        color="C1",
        markersize=4,
        label="largest in the second half",
    )
    axes.axvline(1.0, color="0.5", linewidth=1)
    axes.set_xscale("log")
    ticks = [t for t in (0.1, 0.25, 0.5, 1, 2, 4, 10) if x and x[0] <= t <= x[-1]]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.set_xlabel("L2 / L1")
    other = axes.twinx()
    other.plot(x, [row["first_frequency_Hz"] for row in rows], ":", color="0.4")
    other.set_ylim(bottom=0)
    other.set_ylabel("first frequency, joints locked [Hz] (dotted)", color="0.4")


def _boundary(axes: Any, rows: list[Row], study: Study) -> None:
    fixed = [row for row in rows if row["case"] in (FIXED, WITHOUT)]
    axes.plot(
        _column(fixed, "free_length_m"),
        _column(fixed, "later_m"),
        "o-",
        color="C0",
        markersize=4,
        label="fixed free length",
    )
    for name, mark, colour in ((SLIDING, "D", "C1"), (WITHOUT, "s", "C3")):
        one = [row for row in rows if row["case"] == name]
        axes.plot(
            _column(one, "free_length_m"),
            _column(one, "later_m"),
            mark,
            color=colour,
            markersize=8,
            label=f"{name}",
        )
        for row in one:
            at = (1e3 * row["free_length_m"], 1e3 * row["later_m"])
            axes.annotate(
                f"{at[1]:.3g} mm", at, xytext=(-8, 4), textcoords="offset points", ha="right"
            )
    axes.set_xlabel("free length [mm] (sliding: its mean)")


def _column(rows: list[Row], key: str) -> np.ndarray:
    return 1e3 * np.array([row[key] for row in rows], dtype=float)
