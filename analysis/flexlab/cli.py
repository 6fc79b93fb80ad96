"""The command `flexura`. Only typer is imported here: each command imports what it uses when it runs."""

from __future__ import annotations

import gc
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from .compare.command import compare
from .demo_command import demo
from .experiment import command as bench
from .export.command import export
from .identification.command import identify
from .terminal import default_folder, events, interrupted, prepare, progress_bars, say, show, stored
from .tuning.command import tune

app = typer.Typer(
    name="flexura",
    help="Planar robots with flexible links: simulate, cross-check, review. One robot file describes the robot.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

app.command()(compare)
app.command()(demo)
app.command()(export)
app.command()(identify)
app.command()(tune)
app.add_typer(bench.app)

RobotFile = Annotated[Path, typer.Argument(metavar="ROBOT", help="robot file (TOML), for example model/robots/rig.toml")]
ManoeuvreFile = Annotated[
    Path | None,
    typer.Argument(metavar="MANOEUVRE", help="manoeuvre file (TOML); without one, a modest back and forth of every joint"),
]
RigFile = Annotated[Path | None, typer.Argument(metavar="RIG", help="rig file (TOML); default firmware/rig.toml")]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="FOLDER", help="where to leave the results; default logs/<command>-<robot>")
]
Json = Annotated[bool, typer.Option("--json", help="print JSON instead of tables, for scripts")]
Rtol = Annotated[float, typer.Option(help="relative tolerance of the native solver")]


@app.command()
def simulate(
    robot: RobotFile, manoeuvre: ManoeuvreFile = None, out: Out = None, rtol: Rtol = 1e-6,
    method: Annotated[str, typer.Option(help="auto, explicit, implicit or exponential")] = "auto",
    controller: Annotated[
        Path | None, typer.Option(metavar="GAINS", help="gains file (TOML): a sampled controller follows the manoeuvre's motions")
    ] = None,
    vary: Annotated[
        list[str] | None, typer.Option(metavar="KEY=LOW:HIGH:COUNT", help="many robots: numbers of the file, in all combinations")
    ] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help="with --vary: a Dask scheduler, tcp://...")] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Simulate a robot natively and store the run; with --vary, a population that goes on where it was stopped.

    \b
    Example: flexura simulate model/robots/rig.toml model/manoeuvres/rig-step.toml --controller model/controllers/rig.toml
    And: flexura simulate model/robots/rig.toml model/manoeuvres/rig-inverse-law.toml
    And: flexura simulate model/robots/rig.toml --vary payload.mass_kg=0:0.1:101 --vary link.2.length_m=0.2:0.3:11
    """
    import flexura as fx

    system, asked = prepare(robot, manoeuvre)
    if vary:
        _simulate_many(system.robot, asked, vary, out or default_folder("simulate-many", robot), rtol, method, scheduler, json)
        return
    if scheduler is not None:
        raise fx.InputError("expected together with --vary: one robot is simulated here", key="--scheduler", value=scheduler)
    from . import tables
    from .controlled import controlled

    drive = controlled(system, asked, controller) if controller else asked.drive
    with progress_bars("native") as report:
        run = fx.simulate(system, asked.t, drive, rtol=rtol, method=method, progress=lambda f: report("native", f))
    run.meta["manoeuvre"] = asked.name
    folder = out or default_folder("simulate", robot)
    path = run.save(folder)
    show(json, lambda: tables.run_table(run), lambda: tables.run_json(run) | {"run": str(path)})
    stored(run, path, json)


def _simulate_many(
    robot: Any, asked: Any, vary: list[str], folder: Path, rtol: float, method: str, scheduler: str | None, json: bool
) -> None:
    from . import varying

    with progress_bars("robots") as report:
        done, chosen = varying.simulate(
            robot, asked, vary, folder, rtol=rtol, method=method, scheduler=scheduler, progress=lambda f: report("robots", f)
        )
    if not done.complete:
        typer.echo(f"interrupted after {len(done.robots)} of {done.count} robots; the same command goes on", err=True)
        raise typer.Exit(130)
    found = varying.numbers(done, chosen, folder)
    show(json, lambda: varying.table(found), lambda: found)
    say(json, f"stored {folder}")


@app.command()
def inverse(
    robot: RobotFile,
    manoeuvre: Annotated[Path, typer.Argument(metavar="MANOEUVRE", help="manoeuvre file (TOML) with a motion for every joint")],
    out: Out = None, rtol: Rtol = 1e-7,
    method: Annotated[str, typer.Option(help="auto, explicit or implicit")] = "auto", json: Json = False,
) -> None:  # fmt: skip
    """Inverse dynamics: the forces and torques that the manoeuvre's motions take, exactly followed; gains and forces are ignored.

    \b
    Example: flexura inverse model/robots/rig.toml model/manoeuvres/rig-inverse-law.toml
    """
    import flexura as fx

    from . import tables
    from .effort import efforts

    system, asked = prepare(robot, manoeuvre)
    motions = [joint.motion for joint in asked.drive.joints]
    for i, (motion, link) in enumerate(zip(motions, system.robot.links, strict=True), 1):
        if motion is None and not link.joint.locked:
            raise fx.InputError(
                "missing: inverse dynamics needs a motion of every joint", key=f"joint[{i}].motion", file=str(manoeuvre)
            )
    try:
        drive = fx.Drive.prescribed(*motions)
    except fx.InputError as error:
        raise error.in_file(str(manoeuvre)) from None
    with progress_bars("inverse") as report:
        run = fx.simulate(system, asked.t, drive, rtol=rtol, method=method, progress=lambda f: report("inverse", f))
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


@app.command()
def frequencies(
    robot: RobotFile,
    zeros: Annotated[
        bool, typer.Option("--zeros", help="also the transmission zeros from each drive to its joint and the tip")
    ] = False,
    json: Json = False,
) -> None:
    """Natural frequencies at the start, joints locked and free.

    \b
    Example: flexura frequencies model/robots/two-link-arm.toml --zeros
    """
    import flexura as fx

    from . import tables
    from .zeros import transmission

    described = fx.load(robot)
    system = fx.assemble(described)
    locked, free = (fx.frequencies(system, joints=joints) for joints in ("locked", "free"))
    rows = transmission(fx.linearize(system)) if zeros else []
    title = described.name or robot.stem
    found = {"locked_Hz": locked.tolist(), "free_Hz": free.tolist()}
    show(
        json,
        lambda: tables.frequency_tables(locked, free, title, rows),
        lambda: found | ({"zeros": [row.numbers() for row in rows]} if zeros else {}),
    )


@app.command()
def study(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="payload, length-ratio or boundary")],
    robot: RobotFile, manoeuvre: ManoeuvreFile = None, out: Out = None, rtol: Rtol = 1e-6,
    values: Annotated[str | None, typer.Option(metavar="LOW:HIGH:COUNT", help="payloads [kg], ratios, lengths [m]")] = None,
    keep: Annotated[str, typer.Option(help="lengths: total (L1 + L2), first (L1), density (total, m1 = mu1 L1)")] = "total",
    channels: Annotated[bool, typer.Option("--channels", help="store the channels of all runs too")] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes; default: one a core")] = None, json: Json = False,
) -> None:  # fmt: skip
    """The dissertation's studies on any robot: payload, ratio of link lengths, with and without a sleeve; table, figure, Parquet.

    \b
    Example: flexura study payload model/robots/type-1-rr.toml model/manoeuvres/type-1-bang-bang.toml --values 0:0.2:41
    """
    import flexura as fx

    from . import study as studies

    described = fx.load(robot)
    asked = None if manoeuvre is None else fx.load_manoeuvre(manoeuvre, len(described.links))
    folder = out or default_folder(f"study-{kind}", robot)
    with progress_bars(kind) as report:
        done = studies.run(
            kind, described, asked, values, keep=keep, rtol=rtol, jobs=jobs, progress=lambda f: report(kind, f),
            channels=folder / "runs" if channels else None,
        )  # fmt: skip
    stored = [str(path) for path in studies.save(done, folder)]
    show(json, lambda: studies.table(done), lambda: studies.numbers(done) | {"stored": stored})
    say(json, f"stored {', '.join(stored)}")
    if not done.complete:
        typer.echo(f"interrupted after {len(done.rows)} runs, which are stored", err=True)
        raise typer.Exit(130)


@app.command()
def crosscheck(
    robot: Annotated[Path | None, typer.Argument(metavar="ROBOT", help="robot file (TOML); or --all")] = None,
    manoeuvre: ManoeuvreFile = None, out: Out = None, rtol: Rtol = 1e-7,
    beam: Annotated[str, typer.Option(help="ancf (Euler-Bernoulli) or ge (geometrically exact, with shear)")] = "ancf",
    tolerance: Annotated[float, typer.Option(min=0.0, help="largest deviation allowed, relative to each channel's peak")] = 0.01,
    all_: Annotated[bool, typer.Option("--all", help="the dissertation's nine structures: one table, one review")] = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Simulate a robot natively and in Exudyn, and compare; exit status 1 when a channel deviates by more than the tolerance.

    \b
    Example: flexura crosscheck model/robots/rig.toml model/manoeuvres/rig-inverse-law.toml --tolerance 0.005
    """
    from flexura.errors import InputError

    from . import crosscheck as cross
    from . import tables

    if all_ or robot is None:
        if not all_ or robot is not None:
            raise InputError("expected a robot file, or --all without one", key="ROBOT", value=robot and str(robot))
        _crosscheck_all(out or Path("logs/crosscheck-all"), json)
        return
    system, asked = prepare(robot, manoeuvre)
    with progress_bars("native", "twin") as report:
        check = cross.crosscheck(system.robot, asked, beam=beam, rtol=rtol, tolerance=tolerance, progress=report)
    folder = out or default_folder("crosscheck", robot)
    review = cross.save(check, folder)
    show(json, lambda: tables.check_table(check), lambda: tables.check_json(check) | {"review": str(review)})
    for run in (check.simulation, check.twin):
        events(run)
    say(json, f"stored {folder}", f"look at it: flexura review {folder / 'simulation'} {folder / 'twin'}")
    if not check.passed:
        if check.failed:
            typer.echo(f"beyond the tolerance of {100 * tolerance:g} %: {', '.join(check.failed)}", err=True)
        raise typer.Exit(130 if interrupted(check.simulation) or interrupted(check.twin) else 1)


def _crosscheck_all(folder: Path, json: bool) -> None:
    from . import nine
    with progress_bars("all nine") as report:
        rows = nine.crosscheck_nine(progress=lambda f: report("all nine", f))
    recording = nine.save(rows, folder)
    show(json, lambda: nine.table(rows), lambda: nine.numbers(rows) | {"review": str(recording)})
    say(json, f"stored {folder}", f"look at it: flexura review {recording}")
    if not all(row.passed for row in rows):
        raise typer.Exit(1)


@app.command()
def review(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN [RUN]", help="one or two folders of runs; or a review, .rrd")],
    save: Annotated[
        Path | None, typer.Option(metavar="FILE.rrd", help="write the review to this file instead of opening it")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="draw the review into this file, without a screen")
    ] = None,
    time_s: Annotated[float | None, typer.Option(help="the picture's instant; default: the largest tip deflection")] = None,
) -> None:
    """Look at one run, or at two of them side by side, in Rerun.

    \b
    Example: flexura review logs/demo/simulation logs/demo/twin --picture review.png
    """
    import flexura as fx

    from . import review as rerun

    if len(runs) > 2:
        raise fx.InputError("expected one or two runs", key="RUN", value=[str(r) for r in runs])
    if runs[0].suffix == ".rrd" and len(runs) == 1 and save is None:
        target = runs[0]
    else:
        read = [fx.Run.read(folder) for folder in runs]
        beside = (runs[0] if runs[0].is_dir() else runs[0].parent) / "review.rrd"
        target = save or (picture.with_suffix(".rrd") if picture else beside)
        rerun.write_review(target, read)
        typer.echo(f"stored {target}")
    if picture is not None:
        rerun.picture(target, picture, time_s=time_s)
        typer.echo(f"stored {picture}")
    if save is None and picture is None:
        rerun.open_viewer(target)


@app.command()
def flash(
    rig: RigFile = None,
    port: Annotated[str | None, typer.Option(metavar="DEVICE", help="serial port; default: the one that is a Mega 2560")] = None,
    emulated: Annotated[bool, typer.Option("--emulated", help="into an emulated board instead: no hardware is touched")] = False,
    configure: Annotated[bool, typer.Option("--configure", help="write the rig's constants, store them, compare")] = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Build the firmware, load it into the board, wait for its first good frame, read back version and settings.

    \b
    Example: flexura flash --emulated --configure
    """
    from . import flash as loader
    from .rig import load

    done = loader.flash(load(rig or loader.RIG), port, emulated, configure, say=lambda text: say(json, text))
    show(json, lambda: loader.table(done), lambda: loader.data(done))
    if done.differing:
        say(json, f"{len(done.differing)} settings are not the rig file's; to write them: flexura flash --configure")


@app.command()
def doctor(rig: RigFile = None, json: Json = False) -> None:
    """What is installed, what is missing, what that costs; and whether the rig can do what it is built for.

    \b
    Example: flexura doctor
    """
    from .doctor import examine

    findings = examine(rig)

    def table() -> Any:
        from rich.table import Table

        out = Table(show_edge=False)
        for name in ("", "found", "what it costs"):
            out.add_column(name, overflow="fold")
        mark = {"ok": "[green]ok     [/]", "missing": "[red]missing[/]", "note": "note   ", "wrong": "[red]wrong  [/]"}
        for f in findings:
            out.add_row(f"{mark[f.state]} {f.what}", f.found, f.cost)
        return out

    show(json, table, lambda: [vars(f) for f in findings])
    if any(f.state in ("missing", "wrong") for f in findings):
        raise typer.Exit(1)


def main() -> None:
    """Run the command; bad input ends in one line on stderr and status 2, whatever else goes wrong in status 1."""
    gc.set_threshold(100_000)  # looking for garbage among a million objects just imported is a tenth of the start
    try:
        app()
    except KeyboardInterrupt:
        typer.echo("flexura: interrupted", err=True)
        sys.exit(130)
    except OSError as error:
        typer.echo(f"flexura: {error.filename or 'a file'}: {error.strerror or error}", err=True)
        sys.exit(1)
    except Exception as error:
        from flexura.errors import FlexuraError, InputError

        if not isinstance(error, FlexuraError):
            raise
        typer.echo(f"flexura: {error}", err=True)
        sys.exit(2 if isinstance(error, InputError) else 1)


if __name__ == "__main__":
    main()
