"""What a run is called wherever it is shown, so that nothing emulated can pass as measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..run import Run

EMULATED = "emulated: board and rig ran as programs, nothing here was measured on a physical rig"


def kind(run: Run) -> str:
    """What a run is of.

    Args:
        run: the run.

    Returns:
        "simulation", "twin" or "experiment".
    """
    return str(run.meta.get("source") or run.meta.get("kind") or "simulation")


def emulated(run: Run) -> bool:
    """Whether a run is of a board and a rig that ran as programs.

    Args:
        run: the run.

    Returns:
        True if they were emulated.
    """
    return bool(run.meta.get("emulated"))


def called(run: Run, which: str = "") -> str:
    """What a run is called: its kind, and in brackets what a reader must know of it.

    Args:
        run: the run.
        which: put after the kind, to tell two runs apart.

    Returns:
        For example "experiment (emulated)", "simulation (incomplete)".
    """
    notes = [
        word
        for word, true in (("emulated", emulated(run)), ("incomplete", not run.complete))
        if true
    ]
    return kind(run) + which + (f" ({', '.join(notes)})" if notes else "")
