"""The command `flexura inverse`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import flexura as fx

from ..studies.drive_requirements import efforts
from . import tables
from .options import Json, Out, RobotFile, Rtol
from .output import default_folder, prepare, progress_bars, show, stored


def inverse(
    robot: RobotFile,
    manoeuvre: Annotated[
        Path,
        typer.Argument(
            metavar="MANOEUVRE", help="manoeuvre file (TOML) with a motion for every joint"
        ),
    ],
    out: Out = None,
    rtol: Rtol = 1e-7,
    method: Annotated[str, typer.Option(help="auto, explicit or implicit")] = "auto",
    json: Json = False,
) -> None:
    """Inverse dynamics: the forces and torques that the manoeuvre's motions take, exactly followed;
    gains and forces are ignored.

    \b
    Example: flexura inverse model/robots/rig.toml model/manoeuvres/rig-inverse-law.toml
    """
    system, asked = prepare(robot, manoeuvre)
    motions = [joint.motion for joint in asked.drive.joints]
    for i, (motion, link) in enumerate(zip(motions, system.robot.links, strict=True), 1):
        if motion is None and not link.joint.locked:
            raise fx.InputError(
                "missing: inverse dynamics needs a motion of every joint",
                key=f"joint[{i}].motion",
                file=str(manoeuvre),
            )
    try:
        drive = fx.Drive.prescribed(*motions)
    except fx.InputError as error:
        raise error.in_file(str(manoeuvre)) from None
    with progress_bars("inverse") as report:
        run = fx.simulate(
            system,
            asked.t,
            drive,
            rtol=rtol,
            method=method,
            progress=lambda f: report("inverse", f),
        )
    run.meta["manoeuvre"] = asked.name
    folder = out or default_folder("inverse", robot)
    path = run.save(folder)
    rows = efforts(run)
    show(
        json,
        lambda: tables.effort_table(rows, run),
        lambda: tables.run_json(run) | {"drives": [vars(r) for r in rows], "run": str(path)},
    )
    stored(run, path, json)
