"""The command `flexura study`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import flexura as fx
from flexura.optional import need

from .. import studies
from .options import Force, Json, ManoeuvreFile, Out, Rtol, stem
from .output import message, print_results, progress_bars, warn
from .results import results
from .study_control import study_control
from .study_measured import study_measured


def study(
    kind: Annotated[
        str,
        typer.Argument(metavar="KIND", help="payload, length-ratio, boundary, measured or control"),
    ],
    robot: Annotated[
        Path | None,
        typer.Argument(
            metavar="ROBOT",
            help="robot file (TOML), or the name of a shipped one, as rig; KIND measured: by "
            "default quanser-2dsfl; KIND control: rig or type-1-rr, by default both",
        ),
    ] = None,
    manoeuvre: ManoeuvreFile = None,
    out: Out = None,
    rtol: Rtol = 1e-6,
    values: Annotated[
        str | None,
        typer.Option(
            metavar="LOW:HIGH:COUNT",
            help="payloads [kg], length ratios L2/L1, or free lengths [m], as KIND asks",
        ),
    ] = None,
    keep: Annotated[
        str | None,
        typer.Option(
            help="of length-ratio: total (L1 + L2 is kept), first (L1), or density (L1 + L2 and "
            "the mass per length of link 1); default total"
        ),
    ] = None,
    channels: Annotated[
        bool, typer.Option("--channels", help="store the channels of all runs too")
    ] = False,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data", metavar="FOLDER", help="of measured: the folder of the measured step runs"
        ),
    ] = None,
    fit_on: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="of measured: the run to fit to; default lqg_step_10deg"),
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes; default: one a core")] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Study payload, link lengths, a sleeve, a measured robot, or control.

    It stores a table (Parquet) and a figure. KIND boundary: with and without a sleeve. KIND
    measured: simulations over published measurements, with a review of each run. KIND control:
    what PID, shapers, LQR, inversion and least time achieve, on rig or type-1-rr, by default both.

    \b
    Example: flexura study payload type-1-rr --values 0:0.2:11
    """
    if kind not in (known := (*studies.KINDS, "measured", "control")):
        raise fx.InputError(f"expected one of {', '.join(known)}", key="KIND", value=kind)
    if kind in known[-2:]:
        given = {"MANOEUVRE": manoeuvre, "--values": values, "--jobs": jobs}
        for key, value in given.items():
            if value is not None:
                raise fx.InputError(f"expected none with KIND {kind}", key=key, value=str(value))
        if channels:
            raise fx.InputError(f"expected none with KIND {kind}", key="--channels")
    if keep is not None and kind != "length-ratio":
        raise fx.InputError("expected with KIND length-ratio alone", key="--keep", value=keep)
    if kind == "measured":
        study_measured(
            robot or Path("quanser-2dsfl"), data, out, rtol, fit_on, force=force, json=json
        )
        return
    for key, value in (("--data", data), ("--fit-on", fit_on)):
        if value is not None:
            raise fx.InputError("expected with KIND measured alone", key=key, value=str(value))
    if kind == "control":
        study_control(robot, out, rtol, force=force, json=json)
        return
    if robot is None:
        raise fx.InputError("expected a robot file, or a shipped robot's name", key="ROBOT")
    described = fx.load(robot)
    need("matplotlib")
    asked = None if manoeuvre is None else fx.load_manoeuvre(manoeuvre, len(described.links))
    with results(out, f"study-{kind}", robot.stem, *stem(manoeuvre), force=force) as draft:
        with progress_bars(kind) as report:
            done = studies.run(
                kind,
                described,
                asked,
                values,
                keep=keep or "total",
                rtol=rtol,
                jobs=jobs,
                progress=lambda f: report(kind, f),
                channels=draft.folder / "runs" if channels else None,
            )
        names = [path.name for path in studies.save(done, draft.folder)]
        folder = draft.keep(interrupted=not done.complete)
    report_saved = [str(folder / name) for name in names]
    print_results(
        json, lambda: studies.table(done), lambda: studies.numbers(done) | {"stored": report_saved}
    )
    message(json, f"stored {folder}: {', '.join(names)}")
    if not done.complete:
        warn(f"interrupted after {len(done.rows)} runs, which are stored in {folder}")
        raise typer.Exit(130)
    if not any(row["complete"] for row in done.rows):
        raise typer.Exit(1)
