"""Rig files from before constants had tables of their own: [emulated.motor] and the like.

Their values are read where they stand; each is named once with its place of today.
"""

from __future__ import annotations

import copy
from typing import Any

# table of [emulated] -> table of today; of the flex sensor only what is the sensor's own
MOVED = {
    "motor": "motor",
    "driver": "driver",
    "screw": "screw",
    "carriage": "carriage",
    "stepper": "stepper",
}
FLEX_MOVED = ("from_m", "nonlinearity_1_rad")


def with_constants_in_their_tables(data: Any) -> tuple[Any, list[str]]:
    """The tables with the constants of [emulated] where they stand today.

    Args:
        data: the rig file's tables; anything that is not a table is left to the validation.

    Returns:
        New tables, and a line for each table that moved.
    """
    emulated = data.get("emulated") if isinstance(data, dict) else None
    if not isinstance(emulated, dict) or not set(emulated) & {*MOVED, "flex"}:
        return data, []
    out, lines = copy.deepcopy(data), []
    emulated = out["emulated"]
    for old, new in MOVED.items():
        if isinstance(given := emulated.get(old), dict):
            del emulated[old]
            out[new] = given | dict(out.get(new) or {})
            lines.append(f"the constants of [emulated.{old}] stand in [{new}] now")
    if isinstance(flex := emulated.pop("flex", None), dict):
        own = {key: flex.pop(key) for key in FLEX_MOVED if key in flex}
        if own:
            out["flex"] = own | dict(out.get("flex") or {})
        emulated["sensor"] = flex
        lines.append("[emulated.flex] is [flex] (from_m, nonlinearity_1_rad) and [emulated.sensor]")
    if not emulated:
        del out["emulated"]
    return out, lines
