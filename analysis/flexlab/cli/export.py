"""The command `flexura export`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexura.errors import InputError
from flexura.io import FILE, Run, write_bytes

from ..runs.export import as_csv, as_mcap, as_tdms
from ..runs.labels import called
from .options import ForceFile, Json
from .output import say, show
from .results import file_result

if TYPE_CHECKING:
    from flexura.io import Run


def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="folder of a run, or its run.parquet")],
    to: Annotated[
        str, typer.Option("--to", help="csv, parquet, tdms (LabVIEW) or mcap (ROS 2, Foxglove)")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="default: run.FORMAT in the run's folder"),
    ] = None,
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Write a run in another program's format.

    The file has all numbers, units and metadata.

    \b
    Example: flexura export logs/first --to csv
    """
    writers = forms()
    if to not in writers:
        raise InputError(f"expected one of {', '.join(writers)}", key="--to", value=to)
    read = Run.read(run)
    target = out or (run if run.is_dir() else run.parent) / f"run.{to}"
    source = run / FILE if run.is_dir() else run
    if target.exists() and target.samefile(source):
        raise InputError("the run itself: expected another file", key="--out", value=str(target))
    with file_result(target, force=force):
        write_bytes(target, writers[to](read))
    about = {
        "file": str(target),
        "called": called(read),
        "emulated": bool(read.meta.get("emulated")),
        "rows": len(read),
    }
    if json:
        show(True, lambda: None, lambda: about)
    say(
        json, f"{called(read)}: {len(read)} rows, {len(read.channels)} channels", f"stored {target}"
    )


def forms() -> dict[str, Callable[[Run], bytes]]:
    """What writes each format."""
    return {
        "csv": as_csv.write,
        "parquet": lambda run: run.parquet(),
        "tdms": as_tdms.write,
        "mcap": as_mcap.write,
    }
