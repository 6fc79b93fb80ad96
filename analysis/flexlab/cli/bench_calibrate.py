"""`flexura bench calibrate`: the flex sensor's calibration."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx

from .. import rig as rigs
from ..board.protocol.session import Link
from ..experiment.flash import RIG
from ..experiment.run_experiment import open_board
from ..recordings import flex_calibration as fitting
from .bench_options import (
    Emulated,
    Firmware,
    Json,
    Out,
    Port,
    RigFile,
    Seed,
)
from .bench_tables import (
    calibration_numbers,
    calibration_table,
)
from .output import message, print_results


def calibrate(
    rig: RigFile = None,
    tips_mm: Annotated[
        str | None, typer.Option(metavar="LIST", help="deflections to hold; default -20 to 20")
    ] = None,
    port: Port = None,
    emulated: Emulated = False,
    seed: Seed = 0,
    out: Out = None,
    firmware: Firmware = None,
    json: Json = False,
) -> None:
    """Calibrate the flex sensor.

    The strip is held at known tip deflections. The firmware's cubic is fitted to the readings.

    \b
    Example: flexura bench calibrate --emulated --tips-mm=-15,-10,-5,0,5,10,15
    """
    if emulated and port:
        raise fx.InputError("expected either a port or --emulated", key="--port", value=port)
    tips = fitting.TIPS_M if tips_mm is None else _millimetres(tips_mm)
    bench = rigs.load(rig or RIG)
    opened: Any = open_board(bench, port, seed, firmware)
    hold = _held_by_hand
    if opened.plant is not None:
        held = fitting.DeflectedPlant(opened.plant, bench)
        opened.board.plant, hold = held, held.hold
    with contextlib.closing(opened.board):
        found = fitting.fit(*fitting.measure(Link(opened.board), tips, hold))
    path = (
        out
        or Path("logs")
        / f"{'' if port else 'emulated-'}calibration-{time.strftime('%Y%m%d-%H%M%S')}"
    ) / "calibration.toml"
    fitting.write(found, path)
    label = {"label": opened.board.label, "emulated": opened.board.emulated}
    print_results(
        json,
        lambda: calibration_table(found, opened.board.label),
        lambda: label | calibration_numbers(found) | {"file": str(path)},
    )
    message(json, f"stored {path}", f"use it: flexura bench inverse --calibration {path}")


def _millimetres(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) / 1000 for part in text.split(","))
    except ValueError:
        raise fx.InputError(
            "expected deflections in mm with commas between, as -10,-5,0,5,10,15",
            key="--tips-mm",
            value=text,
        ) from None


def _held_by_hand(tip_m: float) -> float:
    """Ask for the strip to be held at a deflection; what the person types is where it is."""
    return 1e-3 * typer.prompt(
        f"hold the tip at {1e3 * tip_m:g} mm; deflection in mm",
        default=1e3 * tip_m,
        type=float,
        err=True,
    )
