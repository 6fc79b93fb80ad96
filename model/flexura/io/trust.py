"""What numbers say of a run: whether they are finite, and whether its energies balance."""

from __future__ import annotations

from typing import Any

import numpy as np

from .run import Run
from .toml_files import Tables

# of the energies: a balance beyond is a note, a warning, the end of trust in a run
NOTED, DOUBTED, REFUSED = 1e-3, 1e-2, 0.1


def judged(run: Run) -> Run:
    """The Run with an event for numbers that are not finite, and one for energies that do not
    balance; it is complete no more if it is not to be trusted.

    Args:
        run: the Run, which is changed.

    Returns:
        The same Run.
    """
    end = float(run.t[-1]) if len(run.t) else 0.0
    found = [*_not_finite(run), *balance_events(run.meta.get("energy_error", 0.0), end)]
    if found:
        run.meta["events"] = [*run.meta.get("events", []), *found]
    if any(event["level"] == "ERROR" for event in found):
        run.meta["complete"] = False
    return run


def interruption(t: float) -> Tables:
    """The event of a run that Ctrl-C ended; `Run.interrupted` finds it.

    Args:
        t: when [s].

    Returns:
        The event.
    """
    return {"t": t, "level": "WARN", "name": "interrupted", "text": "interrupted"}


def balance_events(error: float, end: float) -> list[Tables]:
    """The event of a balance (102), if there is something to be said.

    Args:
        error: share of the largest energy that is missing.
        end: of the run [s].

    Returns:
        Events as in `run.meta["events"]`.
    """
    if error <= NOTED:
        return []
    missing = (
        f"{error:.1%} of the largest of them is missing" if np.isfinite(error) else "no number"
    )
    level = "INFO" if error <= DOUBTED else "WARN" if error <= REFUSED else "ERROR"
    text = f"the energies do not balance: {missing}"
    return [{"t": end, "level": level, "name": "balance", "text": text}]


def _not_finite(run: Run) -> list[dict[str, Any]]:
    """The event of the first row with a number that is not finite."""
    rows = {name: np.flatnonzero(~np.isfinite(values)) for name, values in run.channels.items()}
    rows = {name: wrong for name, wrong in rows.items() if len(wrong)}
    if not rows:
        return []
    first = min(rows, key=lambda name: int(rows[name][0]))
    t = float(run.t[rows[first][0]])
    text = (
        f"{first} is no finite number from t = {t:.6g} s on: look for gains, forces or values of "
        f"the robot file that are many orders of magnitude apart"
    )
    return [{"t": t, "level": "ERROR", "name": "not_finite", "text": text}]
