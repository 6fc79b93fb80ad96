"""The command `flexura simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx

from ..studies import parameter_sweep
from ..tuning.closed_loop import controller_from_file
from . import tables
from .options import Json, ManoeuvreFile, Out, RobotFile, Rtol
from .output import default_folder, prepare, progress_bars, say, show, stored


def simulate(
    robot: RobotFile,
    manoeuvre: ManoeuvreFile = None,
    out: Out = None,
    rtol: Rtol = 1e-6,
    method: Annotated[str, typer.Option(help="auto, explicit, implicit or exponential")] = "auto",
    controller: Annotated[
        Path | None,
        typer.Option(
            metavar="GAINS",
            help="gains file (TOML): a sampled controller follows the manoeuvre's motions",
        ),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW:HIGH:COUNT",
            help="many robots: numbers of the file, in all combinations",
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="with --vary: a Dask scheduler, tcp://...")
    ] = None,
    json: Json = False,
) -> None:
    """Simulate a robot natively and store the run; with --vary, a population that goes on where it
    was stopped.

    \b Example: flexura simulate model/robots/rig.toml model/manoeuvres/rig-step.toml --controller
    model/controllers/rig.toml And: flexura simulate model/robots/rig.toml
    model/manoeuvres/rig-inverse-law.toml And: flexura simulate model/robots/rig.toml --vary
    payload.mass_kg=0:0.1:101 --vary link.2.length_m=0.2:0.3:11
    """
    system, asked = prepare(robot, manoeuvre)
    if vary:
        _simulate_many(
            system.robot,
            asked,
            vary,
            out or default_folder("simulate-many", robot),
            rtol,
            method,
            scheduler,
            json,
        )
        return
    if scheduler is not None:
        raise fx.InputError(
            "expected together with --vary: one robot is simulated here",
            key="--scheduler",
            value=scheduler,
        )

    drive = controller_from_file(system, asked, controller) if controller else asked.drive
    with progress_bars("native") as report:
        run = fx.simulate(
            system, asked.t, drive, rtol=rtol, method=method, progress=lambda f: report("native", f)
        )
    run.meta["manoeuvre"] = asked.name
    folder = out or default_folder("simulate", robot)
    path = run.save(folder)
    show(json, lambda: tables.run_table(run), lambda: tables.run_json(run) | {"run": str(path)})
    stored(run, path, json)


def _simulate_many(
    robot: Any,
    asked: Any,
    vary: list[str],
    folder: Path,
    rtol: float,
    method: str,
    scheduler: str | None,
    json: bool,
) -> None:

    with progress_bars("robots") as report:
        done, chosen = parameter_sweep.simulate(
            robot,
            asked,
            vary,
            folder,
            rtol=rtol,
            method=method,
            scheduler=scheduler,
            progress=lambda f: report("robots", f),
        )
    if not done.complete:
        typer.echo(
            f"interrupted after {len(done.robots)} of {done.count} robots; the same command goes "
            f"on",
            err=True,
        )
        raise typer.Exit(130)
    found = parameter_sweep.numbers(done, chosen, folder)
    show(json, lambda: parameter_sweep.table(found), lambda: found)
    say(json, f"stored {folder}")
