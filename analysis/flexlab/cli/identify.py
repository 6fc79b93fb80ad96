"""The command `flexura identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx

from ..comparison import table as compared
from ..identification import files, output
from ..identification.identify import identify as identified
from .output import progress_bars, say, show


def identify(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="folder of an experiment; best of flexura bench excite"),
    ],
    check: Annotated[
        Path | None,
        typer.Option(
            "--check",
            metavar="RUN2",
            help="another experiment of the same rig, to judge the result by",
        ),
    ] = None,
    by: Annotated[
        str, typer.Option(help="how RUN2 is simulated: commanded, reference or measured")
    ] = "commanded",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE.toml",
            help="robot file to write; the rig's stands beside it, FILE-rig.toml",
        ),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="print JSON instead of tables, for scripts")
    ] = False,
) -> None:
    """Stiffness, damping, payload, friction, play and sensor from an experiment, with intervals;
    new robot and rig files.

    \b
    Example: flexura identify logs/excite --check logs/inverse
    """
    experiment = fx.Run.read(run)
    other = None if check is None else fx.Run.read(check)
    try:
        with progress_bars("joint 1", "strip") as report:
            found = identified(experiment, report)
        paths = files.save(
            found,
            experiment,
            out or (run if run.is_dir() else run.parent) / "identified" / "robot.toml",
        )
    except fx.InputError as error:
        raise error if error.file else error.in_file(str(run)) from None
    data: dict[str, Any] = output.numbers(found, experiment) | {
        "stored": [str(path) for path in paths]
    }
    judged = None if other is None else output.check(found, other, by)
    if judged is not None:
        data["check"] = {
            name: compared.numbers(c)
            for name, c in zip(("files", "identified"), judged, strict=True)
        }
    show(json, lambda: output.table(found, experiment), lambda: data)
    if judged is not None and not json:
        for comparison in map(compared.table, judged):
            show(False, lambda made=comparison: made, dict)  # type: ignore[misc]
    say(json, f"stored {', '.join(map(str, paths))}")
