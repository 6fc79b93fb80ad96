"""The command `flexura tune`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx
from flexura.control import BOARD, Designed, Gains, load_controller
from flexura.optional import need

from .. import rig as rigs
from ..rig.nominal_robot import with_nominal_drives
from ..tuning import dissertation as cases
from ..tuning import result as results
from ..tuning import search_space as freedom
from ..tuning.designed_task import DesignedTask, default_bounds
from ..tuning.executor import make_executor
from ..tuning.history import FILE, History
from ..tuning.objective import Weights
from ..tuning.search import Search, search
from ..tuning.task import Task, perturbed_robots
from .options import Json
from .output import message, print_results, warn
from .results import continued, replacing


def tune(
    robot: Annotated[Path | None, typer.Argument(metavar="ROBOT", help="robot file (TOML)")] = None,
    manoeuvre: Annotated[
        Path | None,
        typer.Argument(
            metavar="MANOEUVRE", help="manoeuvre file (TOML): the motions are the set-points"
        ),
    ] = None,
    controller: Annotated[
        Path | None,
        typer.Option(
            metavar="GAINS", help="gains file (TOML): the structure, and the settings not free"
        ),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW:HIGH", help="a free setting and its bounds; several are given"
        ),
    ] = None,
    free_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="TOML with a table [free]: name = [low, high]"),
    ] = None,
    algorithm: Annotated[
        str, typer.Option(help="ga, pso, cma-es, or nsga2: settling time against vibration")
    ] = "ga",
    population: Annotated[int, typer.Option(help="individuals in a generation")] = 50,
    generations: Annotated[int, typer.Option(help="maximum number of generations")] = 100,
    patience: Annotated[
        int,
        typer.Option(help="end the search after so many generations without 0.1 % of improvement"),
    ] = 30,
    polish: Annotated[
        int, typer.Option(help="generations of a local search (CMA-ES) from the best, at the end")
    ] = 0,
    seed: Annotated[int, typer.Option(help="random seed; the same seed gives the same result")] = 1,
    vibration: Annotated[
        float, typer.Option(help="weight VIBRATION in J; 0 ignores the deflection")
    ] = 100.0,
    effort: Annotated[float, typer.Option(help="weight EFFORT in J")] = 0.01,
    overshoot: Annotated[float, typer.Option(help="weight OVERSHOOT in J")] = 1.0,
    payload_factors: Annotated[
        str, typer.Option(metavar="LIST", help="judge by the worst of these payloads, as 0,1,2")
    ] = "1",
    stiffness_factors: Annotated[
        str,
        typer.Option(metavar="LIST", help="judge by the worst of these stiffnesses, as 0.9,1.1"),
    ] = "1",
    rig: Annotated[
        Path | None,
        typer.Option(
            metavar="RIG",
            help="rig file (TOML): adds its motor's rotor and friction, and its stepper",
        ),
    ] = None,
    rtol: Annotated[
        float,
        typer.Option(help="relative tolerance during the search; the result is simulated to 1e-6"),
    ] = 1e-3,
    modes: Annotated[
        int,
        typer.Option(min=0, help="modes of each link during the search; 0: the robot file's mesh"),
    ] = 2,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="a Dask scheduler, tcp://...")
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="threads; default: one a core")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FOLDER",
            help="default logs/tune-ROBOT-MANOEUVRE; the same search goes on in its folder",
        ),
    ] = None,
    dissertation: Annotated[
        bool,
        typer.Option(
            "--dissertation",
            help="tune the dissertation's control cases, types III and IV, instead of a ROBOT",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Find a controller's gains on the simulator.

    The runs include drive limits and sampling. The objective J is minimised. Of several robots the
    worst counts.

    \b
      J = sum over joints of [ int t |r - q| dt / |step|
                               + OVERSHOOT max(0, overshoot - 5 %)
                               + EFFORT int (u / limit)^2 dt / T ]
          + VIBRATION int t |w - w(end)| dt / L

    Times in s. w is the tip deflection, L the length of the last flexible link, u the drive's
    output. A run that ends early counts 1000 (2 - the fraction done).

    Every generation is stored in FOLDER. The same command goes on after an interruption, with the
    same result. A folder with other files is refused.

    \b
    Example: flexura tune rig rig-step --controller rig --rig rig
      --free kp_1_V_m=100:10000 --free kp_2_1_s=1:60 --algorithm cma-es
    """
    if free and free_file:
        raise fx.InputError(
            "expected either --free or --free-file", key="--free-file", value=str(free_file)
        )
    how = Search(algorithm, population, generations, seed, patience, polish)
    need("pymoo", "matplotlib")
    if dissertation:
        own = (robot, manoeuvre, controller, free, free_file, rig)
        _refuse_own(dict(zip(_OWN, own, strict=True)))
        _cases(how, out, scheduler, jobs, json)
        return
    if robot is None or manoeuvre is None or controller is None:
        three = {"ROBOT": robot, "MANOEUVRE": manoeuvre, "--controller": controller}
        raise fx.InputError(
            "missing: expected ROBOT, MANOEUVRE and --controller GAINS, or --dissertation",
            key=next(key for key, given in three.items() if given is None),
        )
    described, given = _controlled(robot, controller, rig)
    task = _task(
        perturbed_robots(
            described,
            _factors(payload_factors, "--payload-factors"),
            _factors(stiffness_factors, "--stiffness-factors"),
        ),
        _set_points(manoeuvre, described),
        given,
        (
            tuple(_free(free, free_file, given)),
            Weights(vibration, effort, overshoot),
            algorithm == "nsga2",
            rtol,
            modes,
        ),
    )
    folder = continued(out, "tune", robot.stem, manoeuvre.stem, mark=FILE)
    history = History.open(folder, task.digest(how.identity()))
    if history.stored:
        message(json, f"going on after generation {history.stored} in {folder}")
    with (
        make_executor(task, scheduler, jobs) as runs,
        _bar(how.generations + how.polish, task.objectives) as report,
    ):
        complete = search(task, how, runs, history, report)
    if not len(history):  # nothing to show
        raise KeyboardInterrupt
    found = results.result(task, how, history, complete)
    on_board = not isinstance(given, Designed) and set(given.settings) <= set(BOARD)
    _stored(found, folder, None if on_board else f"{robot} {manoeuvre}", json)
    if not complete:
        warn(f"interrupted after generation {len(history)}: the same command goes on in {folder}")
        raise typer.Exit(130)


_OWN = ("ROBOT", "MANOEUVRE", "--controller", "--free", "--free-file", "--rig")


def _refuse_own(given: dict[str, Any]) -> None:
    """Refuse what the dissertation's cases bring themselves."""
    for key, value in given.items():
        if value:
            expected = "expected --dissertation without it: it brings its own"
            raise fx.InputError(expected, key=key, value=str(value))


def _controlled(
    robot: Path, controller: Path, rig: Path | None
) -> tuple[fx.Robot, Gains | Designed]:
    """The robot, with a rig's drives, and the controller that is tuned."""
    described, given = fx.load(robot), load_controller(controller)
    if rig is None:
        return described, given
    if isinstance(given, Designed):
        expected = "expected without --rig: a designed controller has forces and torques"
        raise fx.InputError(expected, key="--rig", value=str(rig))
    described, outputs = with_nominal_drives(described, rigs.load(rig))
    return described, Gains(given.settings, outputs, given.file)


def _set_points(manoeuvre: Path, robot: fx.Robot) -> fx.Manoeuvre:
    """The manoeuvre whose motions a controller follows."""
    asked = fx.load_manoeuvre(manoeuvre, len(robot.links))
    asked.refuse_payloads("a controller's memory would begin anew at the impact")
    return asked


def _free(
    options: list[str] | None, file: Path | None, given: Gains | Designed
) -> list[freedom.FreeGain]:
    """The settings that are searched, with their bounds."""
    if file:
        return freedom.read(file)
    if options:
        return [freedom.from_option(option) for option in options]
    if isinstance(given, Designed):
        return default_bounds(given)
    return freedom.default_bounds(given)


def _task(
    robots: tuple[fx.Robot, ...],
    asked: fx.Manoeuvre,
    given: Gains | Designed,
    chosen: tuple[Any, ...],
) -> Task | DesignedTask:
    """What is to be minimised; refuses what can't be before anything is written."""
    task = (
        DesignedTask(robots, asked, given, *chosen)
        if isinstance(given, Designed)
        else Task(robots, asked, given, *chosen)
    )
    task.controllers  # noqa: B018
    return task


def _stored(found: results.TuningResult, folder: Path, simulated: str | None, json: bool) -> None:
    """Store what was found, print it, and say how to use it: by `flexura simulate` with the robot
    and the manoeuvre `simulated`, or on the board."""
    with replacing(folder) as draft:
        paths = [folder / path.relative_to(draft) for path in results.save(found, draft)]
    print_results(
        json,
        lambda: results.table(found),
        lambda: results.numbers(found) | {"stored": [str(path) for path in paths]},
    )
    message(
        json,
        f"stored {folder}: {', '.join(path.name for path in paths)}",
        f"use it: flexura simulate {simulated} --controller {paths[0]}"
        if simulated
        else f"use it: flexura bench step --gains {paths[0]}",
    )


def _cases(
    how: Search, out: Path | None, scheduler: str | None, jobs: int | None, json: bool
) -> None:
    folder = continued(out, "tune-dissertation", mark=f"type-IV-case-1/{FILE}")
    with _bar(how.generations + how.polish, ("J",)) as report:
        found, complete = cases.study(["IV", "III"], how, folder, scheduler, jobs, report)
    if found:
        print_results(json, lambda: cases.table(found), lambda: cases.data(found))
    message(json, f"stored {folder}")
    if not complete:
        warn(f"interrupted: the same command goes on in {folder}")
        raise typer.Exit(130)


def _factors(text: str, key: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if (
        not values
        or not all(0 <= v < 100 for v in values)
        or (key.startswith("--stiff") and min(values) <= 0)
    ):
        expected = (
            "expected factors of 0 or more (stiffness: above 0) with commas between, as 0.5,1,2"
        )
        raise fx.InputError(expected, key=key, value=text)
    return values


@contextmanager
def _bar(generations: int, objectives: tuple[str, ...]) -> Iterator[Callable[[Any], None]]:
    """A bar on a terminal's stderr with the best so far, nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda history: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("generation", total=generations)

        def report(history: Any) -> None:
            best = history.all("goals")[history.best]
            text = ", ".join(
                f"{name} {value:.4g}" for name, value in zip(objectives, best, strict=True)
            )
            bars.update(task, completed=len(history), description=f"best {text}")

        yield report
