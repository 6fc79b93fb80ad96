"""`flexura bench ...`: experiments on the rig at a serial port or, unless a port is named, on the
emulated board."""

from __future__ import annotations

import contextlib
import functools
import inspect
import time
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

import flexura as fx
from flexura.errors import InputError

from .. import rig as rigs
from ..experiment import excitation, plan
from ..experiment import run_experiment as steps
from ..experiment.flash import RIG
from ..experiment.gains import board_settings
from ..experiment.stop_requests import watch_for_stop
from ..identification.vibration.shapers import read_shaper, shaped
from ..recordings.flex_calibration import read as read_calibration
from ..recordings.recording import unfinished
from ..recordings.run_from_recording import run_from_recording
from ..recordings.strip_sensor import sensor_of
from ..review.live import serve
from ..rig.board_axes import board_axes
from .bench_calibrate import calibrate
from .bench_options import (
    Calibrated,
    Configure,
    Countdown,
    Cut,
    Emulated,
    Firmware,
    Gains,
    Json,
    Live,
    LivePort,
    Out,
    Port,
    RigFile,
    Seed,
    Serve,
    Yes,
)
from .bench_serve import serve_board
from .bench_start import confirm, countdown
from .bench_tables import (
    heading,
    numbers,
    result_table,
    selftest_table,
)
from .bench_tables import live as live_view
from .options import Force, ShaperFile
from .output import events, message, print_results
from .results import refuse_taken

app = typer.Typer(
    name="bench",
    add_completion=False,
    no_args_is_help=True,
    invoke_without_command=True,
    rich_markup_mode=None,
    help=(
        "Experiments on the rig: self-test, execute, handle the signals. Emulated unless a port "
        "is named.\n\n\b\nExample: flexura bench forward --emulated --seed 1"
    ),
)

TOLD_BY_JSON = ["kind", "emulated", "label", "experiment", "complete", "line", "delays", "firmware"]

app.command()(calibrate)


@app.callback()
def bench(
    context: typer.Context,
    serve: Serve = False,
    rig: Annotated[
        Path | None, typer.Option("--rig", metavar="RIG", help="of --serve; default rig")
    ] = None,
    seed: Seed = 0,
    firmware: Firmware = None,
    json: Json = False,
) -> None:
    """Serve the emulated board where no experiment is named."""
    if context.invoked_subcommand is None:
        if not serve:
            raise InputError("expected an experiment, or --serve", key="bench")
        serve_board(rig, port=None, seed=seed, firmware=firmware, cut=None, json=json)


@dataclass(frozen=True)
class BenchOptions:
    """What all experiments are asked."""

    port: Port = None
    emulated: Emulated = False
    seed: Seed = 0
    out: Out = None
    force: Force = False
    yes: Yes = False
    countdown_s: Countdown = None
    calibration: Calibrated = None
    configure: Configure = False
    live: Live = False
    live_port: LivePort = 9876
    firmware: Firmware = None
    cut: Cut = None
    serve: Serve = False
    json: Json = False


def experiment(function: Any) -> Any:
    """A command's function with the options that all experiments share, which it gets as `options:
    BenchOptions`."""
    own = [
        p
        for p in inspect.signature(function, eval_str=True).parameters.values()
        if p.name != "options"
    ]
    kinds = get_type_hints(BenchOptions, include_extras=True)
    shared = [
        inspect.Parameter(
            f.name, inspect.Parameter.KEYWORD_ONLY, default=f.default, annotation=kinds[f.name]
        )
        for f in fields(BenchOptions)
    ]

    @functools.wraps(function)
    def command(**given: Any) -> None:
        options = BenchOptions(**{f.name: given.pop(f.name) for f in fields(BenchOptions)})
        function(**given, options=options)

    parameters = [*own, *shared]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    del command.__wrapped__
    return command


@app.command()
@experiment
def forward(
    rig: RigFile = None,
    profile: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help=(
                "name, duration_s, and the signals voltage_V and, of joint 2, rate_rad_s or "
                "voltage_2_V (TOML, as in a manoeuvre)"
            ),
        ),
    ] = None,
    *,
    options: BenchOptions,
) -> None:
    """Drive the joints open loop.

    A motor gets a voltage, a stepper pulses.

    \b
    Example: flexura bench forward --emulated --seed 1
    """
    ask = lambda bench, settings: plan.forward(bench, settings, profile)
    _run(rig, ask, options)


@app.command()
@experiment
def inverse(
    rig: RigFile = None,
    manoeuvre: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="manoeuvre file with a motion of each joint; default: the rig file's",
        ),
    ] = None,
    gains: Gains = None,
    shaper: ShaperFile = None,
    *,
    options: BenchOptions,
) -> None:
    """Track the joint motions of a manoeuvre.

    The firmware's controllers follow them.

    \b
    Example: flexura bench inverse --manoeuvre rig-inverse-law
    """
    filed = None if shaper is None else read_shaper(shaper)

    def ask(bench: Any, settings: Any) -> Any:
        joints = bench.rig.joints
        asked = None if manoeuvre is None else fx.load_manoeuvre(manoeuvre, joints)
        try:
            shape = None if filed is None else lambda whole: shaped(whole, filed)
            return plan.inverse(bench, settings, asked, shape)
        except fx.InputError as error:
            raise error.in_file(str(manoeuvre) if manoeuvre else bench.rig.manoeuvre) from None

    _run(rig, ask, options, gains)


@app.command()
@experiment
def step(
    rig: RigFile = None,
    step_1_m: Annotated[
        float | None, typer.Option(help="height of joint 1's step on a rail; default 0.005")
    ] = None,
    step_1_rad: Annotated[
        float | None, typer.Option(help="the same where joint 1 turns; default 0.1")
    ] = None,
    step_2_rad: Annotated[
        float | None, typer.Option(help="height of joint 2's step; default 0.1")
    ] = None,
    duration_s: Annotated[float, typer.Option(help="of the steps together")] = 4.0,
    apart_s: Annotated[
        float | None,
        typer.Option(help="joint 2's step after joint 1's; default: half the duration"),
    ] = None,
    gains: Gains = None,
    *,
    options: BenchOptions,
) -> None:
    """Step each joint's set-point.

    \b
    Example: flexura bench step --gains gains.toml --step-1-m 0.004
    """
    given = {"--step-1-m": step_1_m, "--step-1-rad": step_1_rad, "--step-2-rad": step_2_rad}

    def ask(bench: Any, settings: Any) -> Any:
        axes = [f"--step-{axis.number}-{axis.unit}" for axis in board_axes(settings)]
        for key, value in given.items():
            if value is not None and key not in axes:
                known = f"expected a step of this rig: {', '.join(axes)}"
                raise fx.InputError(known, key=key, value=value)
        return plan.step(bench, settings, [given[key] for key in axes], duration_s, apart_s)

    _run(rig, ask, options, gains)


@app.command("free-vibration")
@experiment
def free_vibration(
    rig: RigFile = None,
    turn_rad: Annotated[
        float, typer.Option(help="how far the last joint turns before it stops")
    ] = 0.1,
    duration_s: Annotated[float, typer.Option(help="of the whole")] = 6.0,
    *,
    options: BenchOptions,
) -> None:
    """Stop the last joint after a fast move; the strip rings.

    \b
    Example: flexura bench free-vibration --duration-s 10
    """
    ask = lambda bench, settings: plan.free_vibration(bench, settings, turn_rad, duration_s)
    _run(rig, ask, options)


@app.command()
@experiment
def excite(
    rig: RigFile = None,
    *,
    options: BenchOptions,
) -> None:
    """Run the 10 s that flexura identify needs.

    The drives run open loop. The motion shows stiffness, damping, payload, friction and play.

    \b
    Example: flexura bench excite --emulated --seed 1
    """
    _run(rig, excitation.plan, options)


@app.command()
def recover(
    folder: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", help="of a recording whose host did not come to its end"),
    ],
    json: Json = False,
) -> None:
    """Make the run of a recording that was cut off.

    Every experiment does this by itself for the recordings beside its own.

    \b
    Example: flexura bench recover logs/forward-20260101-120000
    """
    run = run_from_recording(folder)
    path = run.save(folder, overwrite=True)
    if json:
        print_results(
            True,
            lambda: None,
            lambda: {"run": str(path), "rows": len(run), "emulated": run.meta["emulated"]},
        )
    events(run)
    message(json, f"{run.meta['label']}: {len(run)} rows, {run.t[-1]:.3f} s", f"stored {path}")


def _run(rig: Path | None, ask: Any, options: BenchOptions, gains: Path | None = None) -> None:
    """What all experiments have in common, from the files to the table."""
    if options.serve:
        serve_board(
            rig,
            port=options.port,
            seed=options.seed,
            firmware=options.firmware,
            cut=options.cut,
            json=options.json,
        )
        return
    if options.emulated and options.port:
        raise fx.InputError(
            "expected either a port or --emulated", key="--port", value=options.port
        )
    refuse_taken(options.out, options.force)
    bench = rigs.load(rig or RIG)
    settings = board_settings(bench, gains)
    asked = ask(bench, settings)
    steps.check(asked)
    if gains is not None:
        asked = replace(asked, asked=asked.asked | {"gains": str(gains)})
    given = options.calibration
    sensor = sensor_of(bench, None if given is None else read_calibration(given))
    emulated = "" if options.port else "emulated-"
    folder = (
        options.out
        or Path("logs") / f"{emulated}{asked.experiment}-{time.strftime('%Y%m%d-%H%M%S')}"
    )
    _recover_beside(folder, options.json)
    if options.port is not None and not options.yes:
        confirm()
    opened = steps.open_board(bench, options.port, options.seed, options.firmware, options.cut)
    title = heading(opened.board.label, opened.board.emulated, asked.experiment)
    pause = (
        options.countdown_s
        if options.countdown_s is not None
        else 0.0
        if opened.board.emulated
        else 3.0
    )
    with contextlib.ExitStack() as stack:
        stack.callback(opened.board.close)
        stop = stack.enter_context(watch_for_stop())
        seers = [stack.enter_context(live_view(asked, sensor, title))]
        if options.live:
            seers.append(
                stack.enter_context(serve(asked, sensor, bench.robot, title, options.live_port))
            )
            typer.echo(
                f"live view: rerun --connect rerun+http://127.0.0.1:{options.live_port}/proxy",
                err=True,
            )

        def observe(reports: Any, part: float) -> None:
            for see in seers:
                see(reports, part)

        watch = steps.Hooks(
            tested=lambda findings: (
                None
                if options.json
                else print_results(False, lambda: selftest_table(findings, title), dict)
            ),
            say=lambda text: typer.echo(text, err=True),
            may_start=lambda link: countdown(link, pause, stop),
            stop_asked=stop.asked,
            observe=observe,
        )
        try:
            done = steps.conduct(
                bench, asked, opened, folder, sensor, watch, options.configure, options.force
            )
        except steps.RefusedToStart as error:
            typer.echo(f"flexura: {error}", err=True)
            raise typer.Exit(130) from None
    kept = {key: done.run.meta[key] for key in TOLD_BY_JSON}
    print_results(
        options.json,
        lambda: result_table(done),
        lambda: kept | {"run": str(folder), "channels": numbers(done.run)},
    )
    events(done.run)
    message(options.json, f"stored {folder}", f"look at it: flexura review {folder}")
    if not done.ended.complete:
        typer.echo(f"flexura: not complete: {done.ended.text}", err=True)
        raise typer.Exit(130 if done.ended.interrupted else 1)


def _recover_beside(folder: Path, json: bool) -> None:
    """Runs of recordings that a killed host left beside this one."""
    for left in unfinished(folder.parent):
        try:
            run = run_from_recording(left)
        except (
            InputError
        ) as error:  # nothing was received, or it is damaged: that is no reason not to start
            typer.echo(f"not recovered: {error}", err=True)
            continue
        run.save(left, overwrite=True)
        typer.echo(
            f"recovered {left}: {len(run)} rows that a host which ended without a word had "
            f"received",
            err=True,
        )
