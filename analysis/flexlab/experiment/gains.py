"""Gains files as settings of the board."""

from __future__ import annotations

from pathlib import Path

from flexura import signals
from flexura.control import BOARD, load_gains
from flexura.errors import InputError
from flexura.io import find, read_toml

from ..board.protocol.declaration import CONFIG
from ..rig import RigSetup, configuration
from ..rig.board_axes import board_axes

_TERMS = ("kp_", "ki_", "kd_", "kf_", "kg_", "kv_", "kc_", "jo_", "bo_", "observer_")
GAINS = (
    *(name for name in CONFIG if name.startswith(_TERMS)),
    "derivative_Hz",
    "deflection_Hz",
    "setpoint_1_Hz",
    "setpoint_2_Hz",
    "feedback_2",
)
# The controller of an empty gains file, as in `flexura.Controller`.
ALL_TERMS_OFF = dict.fromkeys(GAINS, 0.0) | {"derivative_Hz": 50.0, "deflection_Hz": 50.0}


def gains(path: Path) -> dict[str, float]:
    """Controller settings by the firmware's names, from a TOML file.

    A gains file of the model or of `flexura tune` has a table [controller] and is complete: terms
    that it does not name are off.

    Args:
        path: the file, or the name of a controller that comes with flexura.

    Raises:
        InputError: names file, key and value.
    """
    path = find(path, "controllers")
    data, known = read_toml(path), GAINS
    if "controller" in data:
        data, known = ALL_TERMS_OFF | load_gains(path).board(), BOARD
    for name, value in data.items():
        if name not in known:
            raise InputError(
                f"expected a setting of the controllers: {', '.join(GAINS)}",
                key=name,
                value=value,
                file=str(path),
            )
        item = CONFIG[name]
        if not signals.is_finite(value) or not item.least <= value <= item.greatest:
            expected = (
                f"expected a number between {item.least:g} and {item.greatest:g} ({item.text})"
            )
            raise InputError(expected, key=name, value=value, file=str(path))
    return {name: float(value) for name, value in data.items()}


def board_settings(setup: RigSetup, file: Path | None) -> dict[str, float]:
    """The board's settings of a rig, with the controllers of a gains file.

    Args:
        setup: the rig.
        file: the gains file, or the name of a controller that comes with flexura; None: the rig's.

    Raises:
        InputError: the file is wrong, or has no gain for a joint on a motor.
    """
    own = configuration(setup)
    if file is None:
        return own
    out = own | gains(file)
    for axis in board_axes(out):
        key = axis.names["kp"]
        if axis.kind == "motor" and not out[key] > 0:
            expected = f"expected a gain above 0 for joint {axis.number} of this rig"
            raise InputError(expected, key=key, value=out[key], file=str(file))
    return out
