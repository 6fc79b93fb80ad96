"""Before something moves: the question to the person at the bench, and the countdown."""

from __future__ import annotations

import math
import sys

import typer

import flexura as fx

from ..board.protocol.session import Link
from ..experiment.stop_requests import KEYS_HELP, StopRequest


def confirm() -> None:
    """Ask whether the joints stand at zero and nobody is in reach.

    Raises:
        InputError: nobody can be asked.
    """
    if not sys.stdin.isatty():
        raise fx.InputError(
            "missing: nobody can be asked here whether the joints stand at zero and nobody is in "
            "reach",
            key="--yes",
        )
    typer.confirm(
        "Do the joints stand at their zero marks, and is nobody in reach of the arm?",
        abort=True,
        err=True,
    )


def countdown(link: Link, seconds: float, stop: StopRequest) -> str:
    """Count the seconds down with the session alive; says why the experiment is not to start, or
    ""."""
    end = link.board.now() + seconds
    said = -1
    while (left := end - link.board.now()) > 0:
        if (whole := math.ceil(left)) != said:
            said = whole
            typer.echo(f"starts in {whole} s; {KEYS_HELP}", err=True)
        link.run(min(0.05, left))
        if why := stop.asked():
            return why
    return stop.asked()
