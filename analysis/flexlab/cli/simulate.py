"""The command `flexura simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx
from flexura.io import FILE

from ..identification.vibration.shapers import read_shaper, shaped
from ..studies import parameter_sweep
from ..tuning.closed_loop import (
    controller_from_file,
    references,
    unused_forces,
    with_references,
)
from . import tables
from .internal_forces import force_tables
from .options import (
    Force,
    InternalForces,
    Json,
    ManoeuvreFile,
    MaxSteps,
    Out,
    Prescribed,
    RobotFile,
    Rtol,
    ShaperFile,
    Start,
    WallTime,
    stem,
)
from .output import (
    check_followed,
    load_request,
    message,
    print_results,
    progress_bars,
    report_saved,
    simulate_asked,
    warn,
)
from .results import continued, results


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
    prescribed: Prescribed = False,
    start: Start = None,
    shaper: ShaperFile = None,
    internal_forces: InternalForces = False,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW:HIGH:COUNT",
            help="vary a number of the robot file, of a load or of a payload; several are combined",
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="with --vary: a Dask scheduler, tcp://...")
    ] = None,
    max_steps: MaxSteps = None,
    wall_time: WallTime = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Simulate a robot, and store the run.

    With --vary it simulates a population of robots. The same command goes on where it was stopped,
    in the same folder: logs/population-ROBOT-MANOEUVRE without --out.

    \b
    Example: flexura simulate rig rig-inverse-law
    """
    if scheduler is not None and not vary:
        raise fx.InputError(
            "expected together with --vary: one robot is simulated here",
            key="--scheduler",
            value=scheduler,
        )
    if vary:
        refused = (
            ("--force", force, "a population goes on in its folder; remove that to begin anew"),
            (
                "--controller",
                controller,
                "a population has Drives alone, no controllers",
            ),
        )
        for key, given, why in refused:
            if given:
                raise fx.InputError(f"expected without --vary: {why}", key=key, value=str(given))
        _simulate_many(
            robot,
            manoeuvre,
            prescribed,
            start,
            shaper,
            vary,
            out,
            scheduler,
            json,
            {
                "rtol": rtol,
                "method": method,
                "internal_forces": internal_forces,
                "max_steps": max_steps,
                "wall_time": wall_time,
            },
        )
        return
    if controller and prescribed:
        raise fx.InputError(
            "expected without --prescribed", key="--controller", value=str(controller)
        )
    system, asked = load_request(robot, manoeuvre, prescribed, start)
    if shaper is not None:
        asked = shaped(asked, read_shaper(shaper))
    if not controller:
        check_followed(asked, manoeuvre, "call with --controller GAINS or --prescribed")
    drive = controller_from_file(system, asked, controller) if controller else asked.drive
    for i in unused_forces(asked, drive):
        warn(f"the manoeuvre's force of joint {i} is not used: the controller does not take it")
    with results(out, "simulate", robot.stem, *stem(manoeuvre), force=force) as draft:
        run = simulate_asked(
            system,
            asked,
            drive,
            "native",
            rtol=rtol,
            method=method,
            max_steps=max_steps,
            wall_time=wall_time,
            internal_forces=internal_forces,
        )
        if isinstance(drive, fx.Sampled):  # of a designed controller
            run = with_references(run, references(system, asked))
        run.save(draft.folder)
        folder = draft.keep(interrupted=run.stopped)
    print_results(
        json,
        lambda: [tables.run_table(run), *force_tables(run)],
        lambda: tables.run_json(run) | {"run": str(folder / FILE)},
    )
    report_saved(run, folder, json)


def _simulate_many(
    robot: Path,
    manoeuvre: Path | None,
    prescribed: bool,
    start: str | None,
    shaper: Path | None,
    vary: list[str],
    out: Path | None,
    scheduler: str | None,
    json: bool,
    options: dict[str, Any],
) -> None:
    parameter_sweep.ranges(vary)  # the count is refused before anything is computed
    system, asked = load_request(robot, manoeuvre, prescribed, start)
    check_followed(asked, manoeuvre, "call with --prescribed")
    if shaper is not None:
        asked = shaped(asked, read_shaper(shaper))
    batch, chosen = parameter_sweep.grid(system.robot, vary, asked, str(robot))
    folder = continued(out, "population", robot.stem, *stem(manoeuvre), mark="population.json")
    with progress_bars("robots") as report:
        done = fx.simulate(
            batch,
            asked.t,
            asked.drive,
            start=asked.start,
            loads=asked.loads,
            payloads=asked.payloads,
            folder=folder,
            scheduler=scheduler,
            progress=lambda f: report("robots", f),
            **options,
        )
    if not done.complete:
        warn(
            f"interrupted after {len(done.robots)} of {done.count} robots; "
            f"the same command goes on in {folder}"
        )
        raise typer.Exit(130)
    found = parameter_sweep.numbers(done, chosen, folder)
    print_results(json, lambda: parameter_sweep.tables(found), lambda: found)
    message(json, f"stored {folder}; the same command goes on in it")
    if set(found["ended"]) != {"done"}:
        raise typer.Exit(1)
