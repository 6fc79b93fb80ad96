"""The command `flexura frequencies`."""

from __future__ import annotations

from typing import Annotated

import typer

import flexura as fx

from ..studies.transmission_zeros import transmission
from . import tables
from .options import Json, RobotFile
from .output import print_results


def frequencies(
    robot: RobotFile,
    zeros: Annotated[
        bool,
        typer.Option(
            "--zeros", help="also the transmission zeros from each drive to its joint and the tip"
        ),
    ] = False,
    count: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="only the lowest N frequencies; default: all"),
    ] = None,
    json: Json = False,
) -> None:
    """Compute natural frequencies at the start, with joints locked and free.

    \b
    Example: flexura frequencies two-link-arm --count 6 --zeros
    """
    described = fx.load(robot)
    system = fx.assemble(described)
    locked, free = (fx.frequencies(system, joints=j, count=count) for j in ("locked", "free"))
    rows = transmission(fx.linearize(system)) if zeros else []
    title = described.name or robot.stem
    found = {"locked_Hz": locked.tolist(), "free_Hz": free.tolist()}
    print_results(
        json,
        lambda: tables.frequency_tables(locked, free, title, rows),
        lambda: found | ({"zeros": [row.numbers() for row in rows]} if zeros else {}),
    )
