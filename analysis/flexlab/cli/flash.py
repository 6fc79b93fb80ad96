"""The command `flexura flash`."""

from __future__ import annotations

from typing import Annotated

import typer

from ..experiment import flash as loader
from ..rig import load
from .options import Json, RigFile
from .output import message, print_results


def flash(
    rig: RigFile = None,
    port: Annotated[
        str | None,
        typer.Option(metavar="DEVICE", help="serial port; default: the one that is a Mega 2560"),
    ] = None,
    emulated: Annotated[
        bool,
        typer.Option("--emulated", help="use an emulated board instead; no hardware is touched"),
    ] = False,
    configure: Annotated[
        bool,
        typer.Option(
            "--configure", help="write the rig file's settings, and store them in the board"
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Build the firmware and load it into the board.

    It waits for the board's first good frame, and reads back version and settings.

    \b
    Example: flexura flash --emulated --configure
    """
    done = loader.flash(
        load(rig or loader.RIG), port, emulated, configure, say=lambda text: message(json, text)
    )
    print_results(json, lambda: loader.table(done), lambda: loader.data(done))
    if done.differing:
        message(
            json,
            f"{len(done.differing)} settings are not the rig file's; to write them: flexura flash "
            f"--configure",
        )
