"""The command `flexura`. Only typer is imported here: each command imports what it uses when it runs."""

from __future__ import annotations

import json as json_
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

app = typer.Typer(
    name="flexura",
    help="Planar robots with flexible links: simulate, cross-check, review. One robot file describes the robot.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

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
    method: Annotated[str, typer.Option(help="auto, explicit or implicit")] = "auto", json: Json = False,
) -> None:  # fmt: skip
    """Simulate a robot natively and store the run.

    \b
    Example: flexura simulate model/robots/rig.toml model/manoeuvres/rig-inverse-law.toml
    """
    import flexura as fx

    from . import tables

    system, asked = _prepare(robot, manoeuvre)
    with _progress("native") as report:
        run = fx.simulate(system, asked.t, asked.drive, rtol=rtol, method=method, progress=lambda f: report("native", f))
    run.meta["manoeuvre"] = asked.name
    folder = out or _default_folder("simulate", robot)
    path = run.save(folder)
    _show(json, lambda: tables.run_table(run), lambda: tables.run_json(run) | {"run": str(path)})
    _events(run)
    _say(json, f"stored {path}", f"look at it: flexura review {folder}")
    if not run.complete:
        raise typer.Exit(130 if _interrupted(run) else 1)


@app.command()
def frequencies(robot: RobotFile, json: Json = False) -> None:
    """Natural frequencies at the start, joints locked and free.

    \b
    Example: flexura frequencies model/robots/two-link-arm.toml
    """
    import flexura as fx

    from . import tables

    described = fx.load(robot)
    system = fx.assemble(described)
    locked, free = (fx.frequencies(system, joints=joints) for joints in ("locked", "free"))
    title = described.name or robot.stem
    _show(
        json,
        lambda: tables.frequency_table(locked, free, title),
        lambda: {"locked_Hz": locked.tolist(), "free_Hz": free.tolist()},
    )


@app.command()
def crosscheck(
    robot: RobotFile, manoeuvre: ManoeuvreFile = None, out: Out = None, rtol: Rtol = 1e-7,
    beam: Annotated[str, typer.Option(help="ancf (Euler-Bernoulli) or ge (geometrically exact, with shear)")] = "ancf",
    tolerance: Annotated[float, typer.Option(min=0.0, help="largest deviation allowed, relative to each channel's peak")] = 0.01,
    json: Json = False,
) -> None:  # fmt: skip
    """Simulate a robot natively and in Exudyn, and compare; exit status 1 when a channel deviates by more than the tolerance.

    \b
    Example: flexura crosscheck model/robots/rig.toml model/manoeuvres/rig-inverse-law.toml --tolerance 0.005
    """
    from . import crosscheck as cross
    from . import tables

    system, asked = _prepare(robot, manoeuvre)
    with _progress("native", "twin") as report:
        check = cross.crosscheck(system.robot, asked, beam=beam, rtol=rtol, tolerance=tolerance, progress=report)
    folder = out or _default_folder("crosscheck", robot)
    review = cross.save(check, folder)
    _show(json, lambda: tables.check_table(check), lambda: tables.check_json(check) | {"review": str(review)})
    for run in (check.simulation, check.twin):
        _events(run)
    _say(json, f"stored {folder}", f"look at it: flexura review {folder / 'simulation'} {folder / 'twin'}")
    if not check.passed:
        if check.failed:
            typer.echo(f"beyond the tolerance of {100 * tolerance:g} %: {', '.join(check.failed)}", err=True)
        raise typer.Exit(130 if _interrupted(check.simulation) or _interrupted(check.twin) else 1)


@app.command()
def review(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN [RUN]", help="one or two folders of runs")],
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
    read = [fx.Run.read(folder) for folder in runs]
    target = save or (
        picture.with_suffix(".rrd") if picture else (runs[0] if runs[0].is_dir() else runs[0].parent) / "review.rrd"
    )
    rerun.write_review(target, read)
    typer.echo(f"stored {target}")
    if picture is not None:
        rerun.picture(target, picture, time_s=time_s)
        typer.echo(f"stored {picture}")
    if save is None and picture is None:
        rerun.open_viewer(target)


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="where to leave the results")] = Path("logs/demo"),
    json: Json = False,
) -> None:
    """The dissertation's rig along its inverse law, natively and in Exudyn, with a review to look at.

    \b
    Example: flexura demo
    """
    from . import tables
    from .demo import demonstrate

    _announce_compiling()
    with _progress("native", "twin") as report:
        check, recording, drawn = demonstrate(out, report)
    _show(
        json,
        lambda: tables.check_table(check),
        lambda: tables.check_json(check) | {"review": str(recording), "picture": str(drawn) if isinstance(drawn, Path) else None},
    )
    lines = [
        f"stored {out}: the runs, the review {recording.name}"
        + (f" and its picture {drawn.name}" if isinstance(drawn, Path) else "")
    ]
    if not isinstance(drawn, Path):
        lines.append(f"no picture: {drawn}")
    lines += [
        "next:",
        f"  flexura review {out / 'simulation'} {out / 'twin'}      the review, in a window",
        "  flexura crosscheck model/robots/two-link-arm.toml        another robot",
        "  flexura frequencies model/robots/rig.toml                its natural frequencies",
        "  flexura --help                                           everything else",
    ]
    if not _on_path():
        lines.append("(the command is in .venv/bin; to have it at hand: source .venv/bin/activate)")
    _say(json, *lines)
    if not check.passed:
        raise typer.Exit(130 if _interrupted(check.simulation) or _interrupted(check.twin) else 1)


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

    done = loader.flash(load(rig or loader.RIG), port, emulated, configure, say=lambda text: _say(json, text))
    _show(json, lambda: loader.table(done), lambda: loader.data(done))
    if done.differing:
        _say(json, f"{len(done.differing)} settings are not the rig file's; to write them: flexura flash --configure")


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

    _show(json, table, lambda: [vars(f) for f in findings])
    if any(f.state in ("missing", "wrong") for f in findings):
        raise typer.Exit(1)


def _prepare(robot: Path, manoeuvre: Path | None) -> Any:
    """The assembled robot and what it is asked to do."""
    import flexura as fx

    from .manoeuvres import modest

    described = fx.load(robot)
    try:
        system = fx.assemble(described)
    except fx.InputError as error:
        raise error if error.file else error.in_file(str(robot)) from None
    asked = None if manoeuvre is None else fx.load_manoeuvre(manoeuvre, len(described.links))
    _announce_compiling()
    return system, asked or modest(system)


def _announce_compiling() -> None:
    from flexura.compiled import folder

    if not any(folder().glob("**/*.nbc")):
        typer.echo("compiling the solver: once, about half a minute", err=True)


@contextmanager
def _progress(*names: str) -> Iterator[Callable[[str, float], None]]:
    """Progress bars on a terminal's stderr, nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda name, fraction: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>8}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks = {name: bars.add_task(name, total=1.0) for name in names}
        yield lambda name, fraction: bars.update(tasks[name], completed=fraction)


def _show(json: bool, table: Callable[[], Any], data: Callable[[], Any]) -> None:
    if json:
        typer.echo(json_.dumps(data(), indent=1))
        return
    from rich.console import Console

    console = Console() if sys.stdout.isatty() else Console(width=120)
    console.print(table())


def _say(json: bool, *lines: str) -> None:
    if not json:
        for line in lines:
            typer.echo(line)


def _events(run: Any) -> None:
    for event in run.meta.get("events", []):
        typer.echo(f"{run.meta['source']}: {event['level'].lower()} at t = {event['t']:.4g} s: {event['text']}", err=True)


def _interrupted(run: Any) -> bool:
    return any(event["text"] == "interrupted" for event in run.meta.get("events", []))


def _default_folder(command: str, robot: Path) -> Path:
    return Path("logs") / f"{command}-{robot.stem}"


def _on_path() -> bool:
    import shutil

    return shutil.which("flexura") is not None


def main() -> None:
    """Run the command; bad input ends in one line on stderr and status 2, whatever else goes wrong in status 1."""
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
