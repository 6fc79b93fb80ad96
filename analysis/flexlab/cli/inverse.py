"""The command `flexura inverse`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import flexura as fx
from flexura.io import FILE

from ..studies.drive_requirements import efforts
from . import tables
from .internal_forces import force_tables
from .options import Force, InternalForces, Json, MaxSteps, Out, RobotFile, Rtol, Start, WallTime
from .output import load_request, print_results, report_saved, simulate_asked
from .results import results


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
    method: Annotated[str, typer.Option(help="auto, explicit, implicit or exponential")] = "auto",
    max_steps: MaxSteps = None,
    wall_time: WallTime = None,
    force: Force = False,
    start: Start = None,
    internal_forces: InternalForces = False,
    json: Json = False,
) -> None:
    """Compute the forces and torques that a manoeuvre's motions take.

    Every joint follows its motion exactly. Gains and forces of the manoeuvre file are ignored.

    \b
    Example: flexura inverse rig rig-inverse-law
    """
    system, asked = load_request(robot, manoeuvre, start=start)
    motions = [joint.motion for joint in asked.drive.joints]
    for i, (motion, link) in enumerate(zip(motions, system.robot.links, strict=True), 1):
        if motion is None and not link.joint.locked:
            raise fx.InputError(
                "missing: inverse dynamics needs a motion of every joint",
                key=f"joint[{i}].motion",
                file=str(manoeuvre),
            )
    try:
        drive = asked.prescribed().drive
    except fx.InputError as error:
        raise error.in_file(str(manoeuvre)) from None
    with results(out, "inverse", robot.stem, manoeuvre.stem, force=force) as draft:
        run = simulate_asked(
            system,
            asked,
            drive,
            "inverse",
            rtol=rtol,
            method=method,
            max_steps=max_steps,
            wall_time=wall_time,
            internal_forces=internal_forces,
        )
        run.save(draft.folder)
        folder = draft.keep(interrupted=run.stopped)
    rows = efforts(run) if len(run) > 1 else []
    print_results(
        json,
        lambda: [tables.effort_table(rows, run), *force_tables(run)],
        lambda: (
            tables.run_json(run) | {"drives": [vars(r) for r in rows], "run": str(folder / FILE)}
        ),
    )
    report_saved(run, folder, json)
