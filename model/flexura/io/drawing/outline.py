"""What a picture of a run needs of its robot: joints, lengths, and which links bend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...errors import InputError


@dataclass(frozen=True)
class Outline:
    """One link: `joint` "R", "Pa" or "Pb", its fixed angle [rad] and limits [m or rad], the link's
    length [m], whether it bends."""

    joint: str
    angle_rad: float
    limits: tuple[float, ...]
    length_m: float
    flexible: bool


def outlines(meta: Mapping[str, Any]) -> tuple[Outline, ...]:
    """The links of a run's robot, from the tables of its robot file in the metadata.

    Args:
        meta: the metadata of a Run.

    Returns:
        One a link; none for a run without a robot.

    Raises:
        InputError: the tables are no robot's.
    """
    tables = (meta.get("robot") or {}).get("link") or []
    found = []
    for number, link in enumerate(tables, 1):
        try:
            joint = link["joint"]
            limits = next((joint[k] for k in joint if k.startswith("limits")), None)
            found.append(
                Outline(
                    str(joint["type"]),
                    float(joint.get("angle_rad", 0.0)),
                    tuple(map(float, limits or ())),
                    float(link["length_m"]),
                    int(link.get("elements", 0)) > 0,
                )
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                f"expected a link of a robot file ({error} is missing or wrong)",
                key=f"meta.robot.link[{number}]",
            ) from None
    return tuple(found)


def shortens(meta: Mapping[str, Any]) -> bool:
    """Whether a bent link gets shorter in x: all but the dissertation's linear model."""
    return bool((meta.get("robot") or {}).get("stiffening", True))
