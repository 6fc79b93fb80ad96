"""The gains file: a table `[controller]` of settings by their firmware names, with units.

    [controller]
    kp_1_V_m = 2000.0          # joint 1 on a motor: u in V; kp_1_V_rad where it turns
    ki_1_V_m_s = 4000.0
    voltage_max_V = 12.0
    kp_2_1_s = 20.0            # joint 2 on a stepper: u in rad/s
    rate_max_2_rad_s = 6.0

    [[output]]                 # of joint 1, for the model only: the board has it
    kind = "motor"
    force_per_V = 13.1         # N/V
    damping = 1180.0           # N s/m

There is one table `[[output]]` a joint, or none at all. With `type = "lqg"` or `"mpc"` the file
holds a design instead, which `designed.py` describes.
"""

from __future__ import annotations

import os
from dataclasses import fields
from typing import Any

from ...errors import InputError
from ...io import Tables, find, meant, read_toml
from ...signals import PLAUSIBLE, constant, is_plausible
from ..pid import Force, Motor, Output, Stepper
from .designed import Designed, read_design
from .names import BOARDS, NAMES, SHARED, fitting
from .settings import OUTPUTS, Gains


def load(path: str | os.PathLike[str]) -> Gains:
    """Read a gains file of a PID.

    Args:
        path: the file's path, or the name of a controller that comes with flexura.

    Returns:
        The Gains.

    Raises:
        InputError: no such file, or a wrong value; it names file, key, value and what was expected.
    """
    found = load_controller(path)
    if isinstance(found, Designed):
        expected = "expected the gains of a PID: a controller that is designed runs in simulations"
        raise InputError(expected, key="controller.type", value=found.kind, file=found.file)
    return found


def load_controller(path: str | os.PathLike[str]) -> Gains | Designed:
    """Read a gains file of any type; see `load`.

    Args:
        path: the file's path, or the name of a controller that comes with flexura.

    Returns:
        The Gains of a PID, or with `type = "lqg"` or `"mpc"` the design.

    Raises:
        InputError: as `load`.
    """
    found = find(path, "controllers")
    name = os.fspath(found)
    data = read_toml(found)
    try:
        table = data.get("controller")
        if isinstance(table, dict) and "type" in table:
            return read_design(data, name)
        return _gains(data, name)
    except InputError as error:
        raise error if error.file else error.in_file(name) from None


def _gains(data: Tables, file: str) -> Gains:
    for key, value in data.items():
        if key not in ("controller", "output"):
            raise InputError("an unknown key; known here: controller, output", key=key, value=value)
    table = data.get("controller")
    if not isinstance(table, dict) or not table:
        raise InputError(
            "missing: expected a table [controller] of settings", key="controller", value=table
        )
    settings = {}
    for key, value in table.items():
        if key not in NAMES and key not in SHARED:
            near = meant(key, fitting(table))
            hint = f"did you mean {near}?" if near else "names are as kp_1_N_m_rad, rate_Hz"
            raise InputError(f"an unknown setting; {hint}", key=f"controller.{key}", value=value)
        if not is_plausible(value):
            raise InputError(f"expected {PLAUSIBLE}", key=f"controller.{key}", value=value)
        if key.startswith("feedback_") and value not in (0, 1):
            raise InputError("expected 0 or 1", key=f"controller.{key}", value=value)
        settings[key] = float(value)
    for board, name in BOARDS.items():
        if board in settings and name in settings:
            expected = f"expected absent beside {board}, which is the same"
            raise InputError(expected, key=f"controller.{name}", value=settings[name])
    tables = data.get("output", [])
    if not isinstance(tables, list) or not all(isinstance(entry, dict) for entry in tables):
        raise InputError("expected tables [[output]], one a joint", key="output", value=tables)
    gains = Gains(
        settings,
        tuple(_read_output(entry, f"output[{i}]") for i, entry in enumerate(tables, 1)),
        file,
    )
    if len(tables) > len(gains.kinds):
        expected = f"expected at most {len(gains.kinds)} tables [[output]], one a joint"
        raise InputError(expected, key="output", value=len(tables))
    for i, (entry, own) in enumerate(zip(tables, gains.kinds, strict=False), 1):
        if entry["kind"] != (kind := own.rpartition(" ")[2]):
            expected = f'expected "{kind}", by the units of the settings of joint {i}'
            raise InputError(expected, key=f"output[{i}].kind", value=entry["kind"])
    try:
        gains.controller([_REST] * len(gains.kinds), [o or _ANYTHING[k] for k, o in _padded(gains)])
    except InputError as error:
        if error.key.startswith(("output", "controller")):
            raise
        asked = error.key.rpartition(" ")[2]  # "joint 1: delay_s" of a Controller
        shown = next(
            (
                name
                for name in settings
                if any(field == asked for _, _, field in NAMES.get(name, []))
            ),
            error.key,
        )
        raise InputError(error.expected, key=f"controller.{shown}", value=error.value) from None
    return gains


def _padded(gains: Gains) -> list[tuple[str, Output | None]]:
    """Kind and output of each joint, None where the file does not say."""
    kinds = gains.kinds
    return list(zip(kinds, [*gains.outputs, *[None] * len(kinds)], strict=False))


def _read_output(entry: dict[str, Any], key: str) -> Output:
    kind = entry.get("kind")
    known_kinds = [name for name in OUTPUTS if " " not in name]
    if not isinstance(kind, str) or kind not in known_kinds:
        raise InputError(f"expected one of {', '.join(known_kinds)}", key=f"{key}.kind", value=kind)
    known = [f.name for f in fields(OUTPUTS[kind]) if f.name != "encoder"]
    for name, value in entry.items():
        if name != "kind" and name not in known:
            raise InputError(
                f"an unknown key; known here: {', '.join(['kind', *known])}",
                key=f"{key}.{name}",
                value=value,
            )
        if name != "kind" and not (is_plausible(value) and value >= 0):
            raise InputError(
                "expected a finite number from 0 to 1e12", key=f"{key}.{name}", value=value
            )
    if kind == "motor" and not {"force_per_V", "damping"} <= set(entry):
        raise InputError(
            "missing: a motor has force_per_V [N or N m] and damping [N s/m or N m s/rad]", key=key
        )
    return OUTPUTS[kind](**{name: float(value) for name, value in entry.items() if name != "kind"})


_REST = constant(0.0)
_ANYTHING: dict[str, Output] = {
    "motor": Motor(1.0, 0.0),
    "turning motor": Motor(1.0, 0.0),
    "stepper": Stepper(),
    "force": Force(),
    "torque": Force(),
}
