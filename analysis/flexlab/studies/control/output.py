"""What `flexura study control` leaves: a table, JSON, a Parquet file and a figure."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexura.io import sealed_parquet, write_bytes
from flexura.io.drawing import attempted, saved
from flexura.optional import load

from ...runs.formatting import finite, number
from ...runs.table import Table
from .figure import FONT, figure
from .judgement import PAYLOADS, Judged
from .methods import LEFT
from .tasks import Task

Study = Mapping[str, tuple[Task, list[Judged]]]
OFF = f"{100 * (max(PAYLOADS) - 1):.0f} %"


def table(task: Task, judged: list[Judged]) -> Table:
    """One row a method.

    Args:
        task: the task.
        judged: its methods.

    Returns:
        The table.
    """
    units = ["N m" if link.joint.type == "R" else "N" for link in task.robot.links]
    heads = ["method", "tip error [mm]", "time [s]", "residual [mm]"]
    heads += [f"drive {i} [{unit}]" for i, unit in enumerate(units, 1)]
    heads += ["error, other payload [mm]", "residual, other payload [mm]"]
    out = Table(f"{task.robot.name}: what each method achieves", heads, ("method",))
    for row in judged:
        one = row.nominal
        out.add(
            row.method,
            number(1e3 * one.error_m, 3, missing=""),
            number(one.time_s, 3, missing="never"),
            number(1e3 * one.residual_m, 3),
            *(number(x, 3) for x in one.peak),
            number(1e3 * row.worst("error_m"), 3, missing=""),
            number(1e3 * row.worst("residual_m"), 3),
        )
    out.notes += _notes(task) + [row.about for row in judged if row.about]
    return out


def _notes(task: Task) -> list[str]:
    way = ", ".join(f"{a:g} to {b:.4g}" for a, b in zip(task.start, task.end, strict=True))
    lines = [
        f"joints {way} [m or rad] in {task.duration_s:g} s; the drives of all methods saturate at "
        f"{', '.join(f'{x:.3g}' for x in task.limits)}",
        f"bang-bang and least time leave {100 * LEFT:.0f} % of these limits to the PD beside them",
        "tip error: from the rigid robot's tip on the method's own set-points, at every instant",
        "time: from the first drive until the tip stays within 1 % of its way from its end",
        f"other payload: the worse of {OFF} less and more, with the same method",
    ]
    return lines


def _rows(study: Study) -> list[dict[str, Any]]:
    return [
        {
            "robot": name,
            "method": row.method,
            "payload_factor": factor,
            "tip_error_m": finite(one.error_m),
            "time_s": finite(one.time_s),
            "residual_m": one.residual_m,
            "peak_drive_1": one.peak[0],
            "peak_drive_2": one.peak[1],
        }
        for name, (_, judged) in study.items()
        for row in judged
        for factor, one in zip(PAYLOADS, row.figures, strict=True)
    ]


def numbers(study: Study) -> dict[str, Any]:
    """The study for JSON.

    Args:
        study: by robot, its task and methods.

    Returns:
        The tasks, and one row a robot, method and payload.
    """
    tasks = {
        name: {
            "start": list(task.start),
            "end": list(task.end),
            "duration_s": task.duration_s,
            "drive_limits": task.limits.tolist(),
            "about": [row.about for row in judged if row.about],
        }
        for name, (task, judged) in study.items()
    }
    return {"study": "control", "tasks": tasks, "rows": _rows(study)}


def save(study: Study, folder: Path) -> list[Path]:
    """Write study.parquet and the figure as PNG, SVG and PDF, each as a whole.

    Args:
        study: by robot, its task and methods.
        folder: where to.

    Returns:
        Their paths.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = _rows(study)
    columns = {key: [row[key] for row in rows] for key in rows[0]}
    about = {key: value for key, value in numbers(study).items() if key != "rows"}
    about["robot_files"] = {name: task.robot.to_dict() for name, (task, _) in study.items()}
    sink = pa.BufferOutputStream()
    pq.write_table(
        pa.table(columns).replace_schema_metadata({"flexura_study": json.dumps(about)}),
        sink,
        compression="zstd",
        write_page_checksum=True,
    )
    paths = [folder / f"study.{kind}" for kind in ("parquet", "png", "svg", "pdf")]
    write_bytes(paths[0], sealed_parquet(sink.getvalue().to_pybytes()))
    with attempted("the study's figure"):
        drawing = figure(study)
    for path in paths[1:]:
        with attempted(path.name), load("matplotlib").rc_context(FONT):
            drawn = saved(drawing, path.suffix[1:], dpi=300)
        write_bytes(path, drawn)
    return paths
