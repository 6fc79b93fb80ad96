"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RobotFile = Annotated[
    Path,
    typer.Argument(metavar="ROBOT", help="robot file (TOML), or the name of a shipped one, as rig"),
]
ManoeuvreFile = Annotated[
    Path | None,
    typer.Argument(
        metavar="MANOEUVRE",
        help="manoeuvre file (TOML), or the name of a shipped one; default: every joint moves a "
        "little and then rests",
    ),
]
RigFile = Annotated[
    Path | None, typer.Argument(metavar="RIG", help="rig file (TOML), or a name; default rig")
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="FOLDER",
        help="new folder for the results; default logs/COMMAND-ROBOT-MANOEUVRE-1, -2, ...",
    ),
]
Force = Annotated[
    bool, typer.Option("--force", help="write into a folder that has results, and replace them")
]
ForceFile = Annotated[bool, typer.Option("--force", help="replace a file that is there")]
Json = Annotated[bool, typer.Option("--json", help="print JSON instead of tables, for scripts")]
Rtol = Annotated[float, typer.Option(help="relative tolerance of the native solver")]
Prescribed = Annotated[
    bool, typer.Option("--prescribed", help="follow the manoeuvre's motions exactly")
]
ShaperFile = Annotated[
    Path | None,
    typer.Option(
        "--shaper",
        metavar="FILE",
        help="input shaper (TOML, of flexura vibration): the manoeuvre's motions are shaped",
    ),
]
MaxSteps = Annotated[
    int | None,
    typer.Option(metavar="N", help="budget of steps; it ends the run; default 20 million"),
]
WallTime = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="stop after so many seconds; keep what is computed"),
]
InternalForces = Annotated[
    bool,
    typer.Option(
        "--internal-forces",
        help="store the reactions of joints, and moment, forces and stress along links, too",
    ),
]
Start = Annotated[
    str | None,
    typer.Option(
        metavar="static|straight",
        help="links at the start: in equilibrium, the default under gravity, or straight",
    ),
]


def stem(path: Path | None) -> tuple[str, ...]:
    """A file's name without folder and extension, as a part of a folder's name; () for None."""
    return () if path is None else (path.stem,)
