"""The command `flexura identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx

from ..comparison import table as compared
from ..identification import files, output
from ..identification.identify_rig import identify as identified
from ..runs.of_robot import check_own
from .identify_robot import asked_of, identify_asked
from .options import ForceFile, Json
from .output import message, print_results, progress_bars, warn
from .results import counted, file_result


def identify(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="[ROBOT] RUN...",
            help="folder of a rig's experiment, best from flexura bench excite; or with --fit a "
            "robot file and runs of that robot",
        ),
    ],
    fit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY[=START]",
            help="what to fit: a number of the robot file, or CHANNEL.gain, .offset, .delay_s, "
            ".cutoff_Hz, .cutoff_ratio",
        ),
    ] = None,
    fix: Annotated[
        list[str] | None, typer.Option(metavar="KEY=VALUE", help="what is known besides the file")
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            metavar="CHANNEL",
            help="what moves a joint, as joint/1/drive or 1:CHANNEL; default: its measured "
            "position, else its drive",
        ),
    ] = None,
    channels: Annotated[
        list[str] | None,
        typer.Option(
            "--channel",
            metavar="CHANNEL",
            help="what is compared; default: sensors, tip deflections, positions that are not "
            "inputs",
        ),
    ] = None,
    controller: Annotated[
        Path | None,
        typer.Option(metavar="GAINS", help="gains file of the controller that was at work"),
    ] = None,
    from_s: Annotated[float | None, typer.Option(help="compare from then on [s]")] = None,
    to_s: Annotated[float | None, typer.Option(help="compare until then [s]")] = None,
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
            "default robot.toml in RUN/identified-1, -2, ...; with --fit a report FILE-report.json",
        ),
    ] = None,
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Identify physical parameters from an experiment.

    Of a rig it finds stiffness, damping, payload, friction, play and the sensor's gain, each with
    its 95 % interval. It writes a new robot file and a new rig file.

    With --fit it takes any robot and any runs of it, and fits what is named: flexura identify
    my.toml logs/swing --fit payload.mass_kg --fit link.1.damping.beta_s

    \b
    Example: flexura identify logs/excite
    """
    asked = asked_of(paths, fit or [])
    if asked is not None:
        if by is not None:
            raise fx.InputError("expected without --fit", key="--by", value=by)
        identify_asked(
            asked,
            fix=fix or [],
            inputs=inputs or [],
            channels=channels or [],
            controller=controller,
            span=(from_s, to_s),
            check=check,
            out=out,
            force=force,
            json=json,
        )
        return
    for key, given in (
        ("--fix", fix),
        ("--input", inputs),
        ("--channel", channels),
        ("--controller", controller),
        ("--from-s", from_s),
        ("--to-s", to_s),
    ):
        if given is not None and given != []:
            raise fx.InputError("expected together with --fit", key=key, value=str(given))
    run = paths[0]
    experiment = fx.Run.read(run)
    check_own(experiment, str(run))
    if by is not None and check is None:
        raise fx.InputError("expected together with --check", key="--by", value=by)
    other = None if check is None else fx.Run.read(check)
    home = run if run.is_dir() else run.parent
    path = out or counted(home / "identified", folder=True) / "robot.toml"
    with (
        file_result(path, force=force or out is None, suffix=".toml"),
        file_result(files.beside(path), force=force or out is None),
    ):
        try:
            with progress_bars("joints", "strip") as report:
                found = identified(experiment, report)
        except fx.InputError as error:
            raise error if error.file else error.in_file(str(run)) from None
        judged = None if other is None else output.check(found, other, by or "commanded")
        paths, missing = files.save(found, experiment, path, overwrite=force)
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
