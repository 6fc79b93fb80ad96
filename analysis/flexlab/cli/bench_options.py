"""Options of the commands of `flexura bench`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RigFile = Annotated[
    Path | None, typer.Argument(metavar="RIG", help="rig file (TOML), or a name; default rig")
]
Port = Annotated[
    str | None,
    typer.Option("--port", metavar="DEVICE", help="the board's serial port; without it: emulated"),
]
Emulated = Annotated[
    bool,
    typer.Option("--emulated", help="on the emulated board (the default): no hardware is touched"),
]
Seed = Annotated[
    int, typer.Option(help="random seed of the emulated rig: noise, friction, backlash, drift")
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="FOLDER", help="new folder for the recording; default logs/EXPERIMENT-TIME"
    ),
]
Yes = Annotated[
    bool,
    typer.Option(
        "--yes",
        help="do not ask for confirmation: joints at their zero marks, nobody within reach",
    ),
]
Countdown = Annotated[
    float | None, typer.Option(min=0, help="seconds before the start; default 3, emulated 0")
]
Gains = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="controller settings (TOML) by the firmware's names"),
]
Calibrated = Annotated[
    Path | None,
    typer.Option(
        "--calibration", metavar="FILE", help="of the flex sensor (TOML), as calibrate leaves it"
    ),
]
Configure = Annotated[
    bool,
    typer.Option("--configure", help="write the rig file's settings to a board that has others"),
]
Live = Annotated[
    bool,
    typer.Option(
        "--live", help="serve a live view for Rerun and print its address; viewers may join late"
    ),
]
LivePort = Annotated[int, typer.Option(help="the live view's TCP port, on this machine only")]
Firmware = Annotated[
    Path | None,
    typer.Option(metavar="ELF", help="built firmware for the emulated board; default: build it"),
]
Cut = Annotated[
    str | None,
    typer.Option(
        "--cut",
        metavar="NAME",
        help="break the emulated wire of this entry of [pins], to see which fault is reported",
    ),
]
Serve = Annotated[
    bool,
    typer.Option(
        "--serve", help="offer the emulated board as a serial port to another host; run nothing"
    ),
]
Json = Annotated[bool, typer.Option("--json", help="print JSON instead of tables, for scripts")]
