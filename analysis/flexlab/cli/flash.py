"""The command `flexura flash`."""

from __future__ import annotations

from typing import Annotated

import typer

from ..experiment import flash as loader
from ..rig import load
from .options import Json, RigFile
from .output import say, show


def flash(
    rig: RigFile = None,
    port: Annotated[
        str | None,
        typer.Option(metavar="DEVICE", help="serial port; default: the one that is a Mega 2560"),
    ] = None,
    emulated: Annotated[
        bool,
        typer.Option("--emulated", help="into an emulated board instead: no hardware is touched"),
    ] = False,
    configure: Annotated[
        bool, typer.Option("--configure", help="write the rig's constants, store them, compare")
    ] = False,
    json: Json = False,
) -> None:
    """Build the firmware, load it into the board, wait for its first good frame, read back version
    and settings.

    \b
    Example: flexura flash --emulated --configure
    """
    done = loader.flash(
        load(rig or loader.RIG), port, emulated, configure, say=lambda text: say(json, text)
    )
    show(json, lambda: loader.table(done), lambda: loader.data(done))
    if done.differing:
        say(
            json,
            f"{len(done.differing)} settings are not the rig file's; to write them: flexura flash "
            f"--configure",
        )
