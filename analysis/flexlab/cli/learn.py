"""The command `flexura learn`."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

import flexura as fx

from .. import rig as rigs
from ..experiment import run_experiment as steps
from ..experiment.gains import board_settings
from ..experiment.stop_requests import watch_for_stop
from ..identification.identify_rig import Identified
from ..identification.identify_rig import identify as identified
from ..learning import output
from ..learning.board_trials import BoardTrials
from ..learning.learn import Learned, Trial
from ..learning.learn import learn as learned_of
from ..learning.task import Task
from ..recordings.flex_calibration import read as read_calibration
from ..recordings.strip_sensor import sensor_of
from ..runs.formatting import file_name
from .bench_options import (
    Calibrated,
    Configure,
    Countdown,
    Emulated,
    Firmware,
    Gains,
    Json,
    Port,
    Seed,
    Yes,
)
from .bench_start import confirm, countdown
from .bench_tables import heading
from .options import Force
from .output import message, print_results, progress_bars, warn
from .results import LOGS, counted, file_result, refuse_taken
from .verbosity import quiet

REVIEWED = 6  # runs in a review
SEEDS = 1000  # a seed of the command has so many of its own, one a trial


def learn(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="rig file (TOML), or a name")],
    manoeuvre: Annotated[
        Path | None,
        typer.Argument(
            metavar="MANOEUVRE",
            help="manoeuvre file with a motion of each joint, or a name; default: the rig file's",
        ),
    ] = None,
    trials: Annotated[int, typer.Option(metavar="N", help="how many at most")] = 10,
    model: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="experiment of this rig from which the model is identified, best from flexura "
            "bench excite; default: the first trial",
        ),
    ] = None,
    gains: Gains = None,
    port: Port = None,
    emulated: Emulated = False,
    seed: Seed = 0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="new folder for the trials; default logs/learn-RIG-N"),
    ] = None,
    force: Force = False,
    yes: Yes = False,
    countdown_s: Countdown = None,
    calibration: Calibrated = None,
    configure: Configure = False,
    firmware: Firmware = None,
    json: Json = False,
) -> None:
    """Repeat a manoeuvre until the tip goes where a rigid robot's would.

    The first trial is the manoeuvre as it is. Each further one changes the joints' motions by what
    the model's inverse makes of the error. Limits are checked before each trial, and none is done
    for which more than 1.5 times the first error is predicted.

    \b
    Example: flexura learn rig-r rig-r-swing --trials 10 --emulated
    """
    if emulated and port:
        raise fx.InputError("expected either a port or --emulated", key="--port", value=port)
    if trials < 1:
        raise fx.InputError("expected 1 or more", key="--trials", value=trials)
    refuse_taken(out, force)
    setup = rigs.load(rig)
    settings = board_settings(setup, gains)
    asked = setup.manoeuvre
    if manoeuvre is not None:
        asked = fx.load_manoeuvre(manoeuvre, setup.rig.joints)
    try:
        task = Task.of(setup, settings, asked, goes_back=port is not None)
    except fx.InputError as error:
        raise error.in_file(str(manoeuvre or setup.rig.manoeuvre)) from None
    steps.check(task.plan(task.first, 1))
    sensor = sensor_of(setup, None if calibration is None else read_calibration(calibration))
    given = None if model is None else fx.Run.read(model)
    name = f"{'' if port else 'emulated-'}learn-{file_name(Path(rig).stem)}"
    folder = out or counted(LOGS / name, folder=True)
    if port is not None and not yes:
        confirm()
    with contextlib.ExitStack() as stack:
        stack.enter_context(file_result(folder / output.SUMMARY, force=force))
        report = stack.enter_context(progress_bars("trials", "identify"))
        known = None if given is None else _known(given, model, report)
        stop = stack.enter_context(watch_for_stop())
        pause = (3.0 if port else 0.0) if countdown_s is None else countdown_s
        watch = steps.Hooks(
            say=lambda text: typer.echo(text, err=True),
            may_start=lambda link: countdown(link, pause, stop),
            stop_asked=stop.asked,
        )
        rig_trials = BoardTrials(
            setup,
            lambda number: steps.open_board(setup, port, SEEDS * seed + number - 1, firmware),
            folder,
            sensor,
            watch,
            configure,
        )
        stack.callback(rig_trials.close)
        label, is_emulated = rig_trials.opened.board.label, rig_trials.opened.board.emulated
        title = heading(label, is_emulated, f"learning of {asked.name or name}")
        _remove_trials(folder)

        def done(learned: Learned) -> None:
            output.save(learned, folder, label, is_emulated)
            if not quiet():
                trial = learned.trials[-1]
                warn(f"trial {trial.number}: {1e3 * trial.sensed_m:.3g} mm by the sensors")

        try:
            learned = learned_of(
                task,
                rig_trials,
                trials,
                known=known,
                progress=lambda what, part: report(
                    "identify" if what == "identify" else "trials", part
                ),
                done=done,
            )
        except steps.RefusedToStart as error:
            warn(f"flexura: {error}")
            raise typer.Exit(130) from None
        if learned.trials:
            output.save(learned, folder, label, is_emulated)
    _tell(learned, folder, title, label, is_emulated, json)


def _known(run: fx.Run, path: Path | None, report: Callable[[str, float], None]) -> Identified:
    """The model from an experiment."""
    try:
        return identified(run, lambda name, part: report("identify", part))
    except fx.InputError as error:
        raise error if error.file else error.in_file(str(path)) from None


def _remove_trials(folder: Path) -> None:
    """Trials of an earlier learning in this folder, which --force replaces."""
    for old in folder.glob("trial-[0-9]*"):
        shutil.rmtree(old)
    for name in (output.SUMMARY, output.BEST):
        (folder / name).unlink(missing_ok=True)


def _side_by_side(learned: Learned) -> list[Trial]:
    """The trials that a review has room for: the first ones, and the best."""
    first = [trial for trial in learned.trials if trial is not learned.best][: REVIEWED - 1]
    return sorted([*first, learned.best], key=lambda trial: trial.number)


def _tell(
    learned: Learned, folder: Path, title: str, label: str, emulated: bool, json: bool
) -> None:
    """The table or JSON, what to look at, and the status of what is not complete."""
    if learned.trials or json:
        print_results(
            json,
            lambda: output.table(learned, title),
            lambda: output.numbers(learned, label, emulated) | {"folder": str(folder)},
        )
    if learned.trials:
        seen = [trial.folder for trial in _side_by_side(learned)]
        message(json, f"stored {folder}; the best manoeuvre: {folder / output.BEST}")
        message(json, f"look at it: flexura review {' '.join(map(str, seen))}")
    if not learned.complete:
        warn(f"flexura: not complete: {learned.ended}")
        raise typer.Exit(130 if learned.interrupted else 1)
