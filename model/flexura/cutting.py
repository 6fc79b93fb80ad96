"""A flexible link cut into shorter ones by locked joints: the same line in several frames.

One evaluation costs what its links cost; that of a single link grows with the cube of its elements once these are many. Cut into
parts of a few elements each, a link of any number of elements costs in proportion to them, and slopes may reach a right angle
in each part instead of in the whole.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .errors import InputError
from .robot import Link, Robot


def cut(robot: Robot, link: int, parts: int) -> Robot:
    """The robot with its flexible link (from 1) in `parts` equal parts on locked R joints; joints and links beyond move up.

    The tips of parts carry no mass of their own, so that motion and forces stay the same up to the quadrature of each link's
    geometry. A slider on the link must start and stay on its outermost part, a sleeve (Pb) on its innermost. Raises InputError
    for a link that is rigid, keeps `modes`, or has elements that do not divide by `parts`.
    """
    if not 1 <= link <= len(robot.links):
        raise InputError(f"expected a link from 1 to {len(robot.links)}", key="link", value=link)
    whole = robot.links[link - 1]
    if not whole.flexible or whole.modes is not None:
        raise InputError("expected a flexible link with all unknowns of its mesh", key=f"link[{link}]", value=whole.name)
    if parts < 1 or whole.elements % parts:
        raise InputError(f"expected a divisor of the link's {whole.elements} elements", key="parts", value=parts)
    data = robot.to_dict()
    table = data["link"][link - 1]
    length = whole.length_m / parts
    pieces: list[dict[str, Any]] = []
    for k in range(parts):
        piece = table | {"length_m": length, "elements": whole.elements // parts}
        listed = laws(whole, k * length, (k + 1) * length)
        piece |= {key: [entry.model_dump() for entry in entries] for key, entries in listed.items()}
        if k:
            piece["joint"] = {"type": "R", "locked": True}
        pieces.append(piece)
    rest = (parts - 1) * length
    if whole.joint.type == "Pb":
        pieces[0]["joint"] = _shifted(table["joint"], rest)
    if link < len(robot.links) and robot.links[link].joint.type == "Pa":
        data["link"][link]["joint"] = _shifted(data["link"][link]["joint"], rest)
    data["link"][link - 1 : link] = pieces
    return Robot.from_dict(data)


def _shifted(joint: dict[str, Any], by: float) -> dict[str, Any]:
    """A sliding joint whose position counts from `by` m further along."""
    moved = joint | {"start": joint.get("start", 0.0) - by}
    if "limits" in joint:
        moved["limits"] = [limit - by for limit in joint["limits"]]
    return moved


def laws(link: Link, low: float, high: float) -> dict[str, list[Any]]:
    """The properties of a link that are lists along it, for its part between two places [m], counted from the first."""
    out: dict[str, list[Any]] = {}
    for key in ("section", "mass_per_length_kg_m", "bending_stiffness_N_m2"):
        entries = getattr(link, key)
        if isinstance(entries, list):
            at = [entry.at_m for entry in entries]
            value = lambda name, x, at=at, entries=entries: float(np.interp(x, at, [getattr(entry, name) for entry in entries]))
            names = [name for name in type(entries[0]).model_fields if name != "at_m"]
            places = [low, *(x for x in at if low + 1e-12 * high < x < high * (1 - 1e-12)), high]
            out[key] = [entries[0].model_copy(update={"at_m": x - low} | {k: value(k, x) for k in names}) for x in places]
    return out
