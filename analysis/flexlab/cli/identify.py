"""The command `flexura identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx

from ..comparison import table as compared
from ..identification import files, output
from ..identification.identify import identify as identified
from .options import ForceFile, Json
from .output import message, print_results, progress_bars, warn
from .results import counted, file_result


def identify(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="folder of an experiment, best from flexura bench excite"
        ),
    ],
    check: Annotated[
        Path | None,
        typer.Option(
            "--check",
            metavar="RUN2",
            help="another experiment of the same rig, which judges the result",
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(help="how RUN2 is simulated: commanded (default), reference or measured"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE.toml",
            help="robot file to write, with the rig's beside it as FILE-rig.toml; "
            "default robot.toml in RUN/identified-1, -2, ...",
        ),
    ] = None,
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Identify physical parameters from an experiment.

    It finds stiffness, damping, payload, friction, play and the sensor's gain, each with its 95 %
    interval. It writes a new robot file and a new rig file.

    \b
    Example: flexura identify logs/excite
    """
    experiment = fx.Run.read(run)
    if by is not None and check is None:
        raise fx.InputError("expected together with --check", key="--by", value=by)
    other = None if check is None else fx.Run.read(check)
    home = run if run.is_dir() else run.parent
    path = out or counted(home / "identified", folder=True) / "robot.toml"
    with (
        file_result(path, force=force or out is None),
        file_result(files.beside(path), force=force or out is None),
    ):
        try:
            with progress_bars("joints", "strip") as report:
                found = identified(experiment, report)
        except fx.InputError as error:
            raise error if error.file else error.in_file(str(run)) from None
        judged = None if other is None else output.check(found, other, by or "commanded")
        paths, missing = files.save(found, experiment, path)
    data: dict[str, Any] = output.numbers(found, experiment) | {
        "stored": [str(path) for path in paths],
        "not_stored": missing,
    }
    if judged is not None:
        data["check"] = {
            name: compared.numbers(c)
            for name, c in zip(("files", "identified"), judged, strict=True)
        }
    print_results(
        json,
        lambda: [output.table(found, experiment), *map(compared.table, judged or ())],
        lambda: data,
    )
    for sentence in missing:
        warn(sentence)
    message(json, f"stored {', '.join(map(str, paths))}")
