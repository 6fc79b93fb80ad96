"""`flexura bench --serve`: the emulated board as a serial port, for hosts such as LabVIEW."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

from flexura.errors import InputError

from .. import rig as rigs
from ..board.commissioning import commission
from ..board.protocol.session import Link
from ..board.pty import Pty
from ..experiment.flash import RIG, write_and_reset
from ..experiment.run_experiment import open_board
from ..experiment.stop_requests import watch_for_stop
from .output import print_results, warn


def serve_board(
    rig: Path | None,
    *,
    port: str | None,
    seed: int,
    firmware: Path | None,
    cut: str | None,
    json: bool,
) -> None:
    """Offer the emulated board of a rig as a serial port until Ctrl-C.

    It has the rig's settings, and its emergency stop is proven: a host may arm it.
    """
    if port is not None:
        raise InputError(
            "expected no port: the emulated board is served, not a real one",
            key="--port",
            value=port,
        )
    bench = rigs.load(rig or RIG)
    opened = open_board(bench, None, seed, firmware, cut)
    board = opened.board
    with contextlib.closing(board):
        link = Link(board)
        link.connect()
        write_and_reset(link, rigs.configuration(bench), lambda text: None)
        commission(link, board)
        board.reset()
        with Pty(board) as line, watch_for_stop() as stop:
            data = {"port": line.device, "label": board.label, "emulated": True}
            print_results(json, lambda: line.device, lambda: data)
            sys.stdout.flush()
            warn(f"{bench.rig.name}: the {board.label} at {line.device}; Ctrl-C ends it")
            line.serve(lambda: bool(stop.asked()))
            if line.lag_s > 0.1:
                warn(f"it lagged behind the clock by up to {line.lag_s:.1f} s")
