"""The command `flexura review`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import flexura as fx

from .. import review as rerun


def review(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN [RUN]", help="one or two folders of runs; or a review, .rrd"),
    ],
    save: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.rrd", help="write the review to this file instead of opening it"
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="draw the review into this file, without a screen"),
    ] = None,
    time_s: Annotated[
        float | None,
        typer.Option(help="the picture's instant; default: the largest tip deflection"),
    ] = None,
) -> None:
    """Look at one run, or at two of them side by side, in Rerun.

    \b
    Example: flexura review logs/demo/simulation logs/demo/twin --picture review.png
    """
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
