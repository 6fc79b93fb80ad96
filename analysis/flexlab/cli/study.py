"""The command `flexura study`."""

from __future__ import annotations

from typing import Annotated

import typer

import flexura as fx
from flexura.optional import need

from .. import studies
from .options import Json, ManoeuvreFile, Out, RobotFile, Rtol
from .output import default_folder, progress_bars, say, show


def study(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="payload, length-ratio or boundary")],
    robot: RobotFile,
    manoeuvre: ManoeuvreFile = None,
    out: Out = None,
    rtol: Rtol = 1e-6,
    values: Annotated[
        str | None,
        typer.Option(metavar="LOW:HIGH:COUNT", help="payloads [kg], ratios, lengths [m]"),
    ] = None,
    keep: Annotated[
        str, typer.Option(help="lengths: total (L1 + L2), first (L1), density (total, m1 = mu1 L1)")
    ] = "total",
    channels: Annotated[
        bool, typer.Option("--channels", help="store the channels of all runs too")
    ] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes; default: one a core")] = None,
    json: Json = False,
) -> None:
    """The dissertation's studies on any robot: payload, ratio of link lengths, with and without a
    sleeve; table, figure, Parquet.

    \b Example: flexura study payload model/robots/type-1-rr.toml
    model/manoeuvres/type-1-bang-bang.toml --values 0:0.2:41
    """
    described = fx.load(robot)
    need("matplotlib")
    asked = None if manoeuvre is None else fx.load_manoeuvre(manoeuvre, len(described.links))
    folder = out or default_folder(f"study-{kind}", robot)
    with progress_bars(kind) as report:
        done = studies.run(
            kind,
            described,
            asked,
            values,
            keep=keep,
            rtol=rtol,
            jobs=jobs,
            progress=lambda f: report(kind, f),
            channels=folder / "runs" if channels else None,
        )
    stored = [str(path) for path in studies.save(done, folder)]
    show(json, lambda: studies.table(done), lambda: studies.numbers(done) | {"stored": stored})
    say(json, f"stored {', '.join(stored)}")
    if not done.complete:
        typer.echo(f"interrupted after {len(done.rows)} runs, which are stored", err=True)
        raise typer.Exit(130)
