"""The trials as a table, as JSON, and what limits them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from flexura.io import write_bytes, write_toml

from ..identification.identify_rig import Identified
from ..rig import RigSetup
from ..rig.axes import motor_axes
from ..rig.board_axes import board_axes
from ..rig.configuration import calibration
from ..runs.formatting import number
from ..runs.table import Styled, Table
from .drives import sticks_within
from .knowledge import NAMES
from .learn import Learned, numbers_of
from .task import Task

SUMMARY, BEST = "learning.json", "best.toml"


def resolution(task: Task) -> dict[str, float]:
    """What the sensors cannot tell apart, at the tip [m], by what it is."""
    setup: RigSetup = task.setup
    out = {}
    fitted = calibration(setup)
    if fitted is not None:
        out["sensor_count_m"] = abs(fitted.c1_m) / 1024
    reach = np.linalg.norm(task.slopes(task.first), axis=1).max(axis=0)
    for axis in board_axes(task.settings):
        out[f"encoder_{axis.number}_count_m"] = float(reach[axis.number - 1] / axis.counts)
    for motor in motor_axes(setup.rig):
        lever = float(reach[motor.number - 1])
        out[f"backlash_{motor.number}_m"] = lever * motor.guide.backlash
        out[f"friction_{motor.number}_m"] = lever * sticks_within(setup, task.settings, motor)
    return out


def _model(found: Identified) -> dict[str, list[float]]:
    return {
        name: [float(found.strip.values[name]), *map(float, found.strip.interval(name))]
        for name in NAMES
    }


def numbers(learned: Learned, label: str, emulated: bool) -> dict[str, Any]:
    """The learning for scripts.

    Args:
        learned: what came of it.
        label: of the board.
        emulated: whether the board is.

    Returns:
        `trials` in order, the `best` one's number, the model's factors with their intervals, and
        what limits it.
    """
    return {
        "emulated": emulated,
        "label": label,
        "manoeuvre": learned.task.manoeuvre.name,
        "complete": learned.complete,
        "ended": learned.ended or "in work",
        "trials": [numbers_of(t) | {"run": t.folder.name} for t in learned.trials],
        "best": learned.best.number if learned.trials else None,
        "model": _model(learned.found) if learned.found else None,
        "resolution": resolution(learned.task),
    }


def table(learned: Learned, title: str) -> Table:
    """One row a trial: its errors, what the sensors saw, what was special.

    Args:
        learned: what came of it.
        title: of the table.
    """
    true = "plant's own "
    heads = (f"{true}max [mm]", f"{true}RMS [mm]", "sensors' max [mm]", "sensors' RMS [mm]")
    out = Table(title, ("trial", *heads, "peak drive [V]", "note"), ("note",))
    for t in learned.trials:
        sizes = (t.true_m, t.true_rms_m, t.sensed_m, t.sensed_rms_m)
        cells = ["" if size is None else number(1e3 * size, 3) for size in sizes]
        cells.append(number(max(t.drives_V.values()), 3) if t.drives_V else "")
        name = f"{t.number}"
        best = t is learned.best
        out.add(Styled(f"{name} best", "green") if best else name, *cells, t.note)
    limits = resolution(learned.task)
    words = {
        "sensor_count_m": "a count of the strip's sensor",
        "encoder_1_count_m": "a count of encoder 1",
        "encoder_2_count_m": "a count of encoder 2",
        "backlash_1_m": "the play of joint 1",
        "backlash_2_m": "the play of joint 2",
        "friction_1_m": "joint 1 sticks within",
        "friction_2_m": "joint 2 sticks within",
    }
    seen = "; ".join(f"{words[name]}: {number(1e3 * size, 2)} mm" for name, size in limits.items())
    out.notes.append(f"what limits, at the tip: {seen}")
    if learned.ended:
        out.notes.append(learned.ended)
    return out


def save(learned: Learned, folder: Path, label: str, emulated: bool) -> None:
    """Write the summary and the best trial's manoeuvre, each as a whole.

    Args:
        learned: what came of it, at least one trial.
        folder: of the trials.
        label: of the board.
        emulated: whether the board is.
    """
    import json

    best = learned.best
    made = learned.task.asked(best.references, f"learned in trial {best.number}")
    write_toml(folder / BEST, made.spec())
    text = json.dumps(numbers(learned, label, emulated), indent=1)
    write_bytes(folder / SUMMARY, (text + "\n").encode())
