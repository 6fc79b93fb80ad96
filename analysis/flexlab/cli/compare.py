"""The command `flexura compare`."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx
from flexura.io import write_bytes
from flexura.io.drawing import attempted
from flexura.optional import need

from ..comparison import table
from ..comparison.measures import Comparison, simulation_first
from ..comparison.measures import compare as compared
from ..comparison.pages import pdf
from ..comparison.replay.simulate_experiment import simulate_experiment
from ..comparison.report import html, png
from ..review import picture as draw
from ..review import write_review
from ..runs.alignment import best_shift, shifted
from ..runs.deviation import common
from ..runs.formatting import finite
from ..runs.of_robot import check_channels, check_own
from .options import Force, Json, Rtol
from .output import events, message, print_results, progress_bars
from .results import counted, file_result, results


def compare(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="folder of an experiment, or of any run with a second one"
        ),
    ],
    other: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RUN2]", help="folder of a run to compare with; without one, RUN is simulated"
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(
            help="the simulation is driven by what was commanded (default), reference or measured"
        ),
    ] = None,
    robot: Annotated[
        Path | None,
        typer.Option(metavar="ROBOT", help="robot file to simulate instead of the run's own"),
    ] = None,
    channels: Annotated[
        list[str] | None,
        typer.Option(
            "--channel",
            metavar="CHANNEL",
            help="what is compared; default: joint positions and tip deflections, or else all that "
            "both runs have",
        ),
    ] = None,
    align: Annotated[
        bool,
        typer.Option("--align", help="move RUN2 in time by what makes both agree best"),
    ] = False,
    shift: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="add this to RUN2's times; may be negative"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FOLDER", help="new folder; default RUN/comparison-1, -2, ..."
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="draw the review into this file")
    ] = None,
    rtol: Rtol = 1e-6,
    force: Force = False,
    json: Json = False,
) -> None:
    """Compare an experiment with its simulation, or two runs.

    It writes a report (HTML, PDF), figures and a review.

    \b
    Example: flexura compare logs/experiment --by commanded
    """
    need("matplotlib", "rerun")
    moved = _moved(other, align, shift)
    first = fx.Run.read(run)
    home = run if run.is_dir() else run.parent
    target = counted(home / "comparison", folder=True) if out is None else out
    with (
        results(target, force=force) as draft,
        file_result(picture, "--picture", force=force, suffix=".png") as shot,
    ):
        if other is not None:
            for key, value in (("by", by), ("robot", robot)):
                if value is not None:
                    raise fx.InputError(
                        "expected one run: two are compared as they are",
                        key=f"--{key}",
                        value=str(value),
                    )
            second = fx.Run.read(other)
            check_own(first, str(run))
            check_own(second, str(other))
            if align:
                found_shift = best_shift(first, second, channels)
                moved = (found_shift.seconds, found_shift.correlation)
            if moved is not None:
                second = shifted(second, moved[0])
            if not common(first, second).any():
                raise fx.InputError(_apart(first, second), key="RUN2", value=str(other))
            first, second = simulation_first(first, second)
        else:
            described = None if robot is None else fx.load(robot)
            if described is None:
                check_own(first, str(run))
            else:
                check_channels(first, described, str(run))
            with progress_bars("native") as report:
                try:
                    second, by = first, by or "commanded"
                    first = simulate_experiment(
                        second, by, described, rtol=rtol, progress=lambda f: report("native", f)
                    )
                except fx.InputError as error:
                    raise error if error.file else error.in_file(str(run)) from None
        found = compared(first, second, channels)
        written = save(found, draft.folder, simulated=other is None)
        if picture is not None:
            with attempted(str(picture)):
                draw(written[-1], shot)
        names = [path.relative_to(draft.folder) for path in written]
        folder = draft.keep(interrupted=first.interrupted)
    paths = [folder / name for name in names] + ([] if picture is None else [picture])
    data: dict[str, Any] = table.numbers(found) | {"stored": [str(path) for path in paths]}
    if moved is not None:
        data |= {"shift_s": moved[0], "correlation": finite(moved[1])}
    print_results(json, lambda: table.table(found), lambda: data)
    if moved is not None:
        fits = f"; correlation {moved[1]:.4f}" if align else ""
        message(json, f"{other}: {moved[0]:.6g} s added to its times{fits}")
    for each in (first, second):
        events(each)
    message(
        json,
        f"stored {folder}: {', '.join(map(str, names))}",
        f"look at it: flexura review {folder / 'review.rrd'}",
    )
    if not first.complete:
        raise typer.Exit(130 if first.interrupted else 1)


def _moved(other: Path | None, align: bool, shift: float | None) -> tuple[float, float] | None:
    """The shift that is asked for, and NaN for its correlation; None for no shift, or --align."""
    if align and shift is not None:
        raise fx.InputError("expected --align or --shift, not both", key="--shift", value=shift)
    if other is None and (align or shift is not None):
        raise fx.InputError("expected two runs: the second is moved", key="RUN2")
    return None if shift is None else (shift, float("nan"))


def _apart(first: fx.Run, second: fx.Run) -> str:
    spans = (
        f"{run.t[0]:.6g} to {run.t[-1]:.6g} s" if len(run) else "nothing" for run in (first, second)
    )
    both = " and ".join(spans)
    return f"no time in common: {both}; --align finds the shift, --shift SECONDS sets it"


def save(c: Comparison, folder: Path, *, simulated: bool) -> list[Path]:
    """Write comparison.json, report.html, report.pdf, comparison.png, review.rrd, and the
    simulation where it is new."""
    paths = [c.simulation.save(folder / "simulation")] if simulated else []
    for name, make in (
        ("comparison.json", lambda c: json_.dumps(table.numbers(c), indent=1).encode()),
        ("report.html", lambda c: html(c).encode()),
        ("report.pdf", pdf),
        ("comparison.png", png),
    ):
        with attempted(name):
            data = make(c)
        write_bytes(folder / name, data)
        paths.append(folder / name)
    return [*paths, write_review(folder / "review.rrd", [c.simulation, c.experiment])]
