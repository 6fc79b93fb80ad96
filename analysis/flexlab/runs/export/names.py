"""Names that other programs allow, from the names of channels."""

from __future__ import annotations

import re
from collections.abc import Iterable

MATLAB_LENGTH = 63  # characters of a variable or field


def topics(channels: Iterable[str]) -> dict[str, str]:
    """Topics by channel, with names that ROS 2 allows: "joint/1/position" -> "/joint_1/position".

    A token begins with a letter and has letters, digits and single underscores; a number joins the
    token before it.
    """
    return _unique(channels, _topic)


def variables(channels: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Variables of MATLAB by channel, "joint/1/position" -> "joint_1_position"; other than those
    that are `taken`."""
    return _unique(channels, _variable, taken)


def _topic(name: str) -> str:
    joined = re.sub(r"/+(?=\d)", "_", name.strip("/"))
    tokens = (re.sub(r"_+", "_", re.sub(r"\W", "_", t, flags=re.ASCII)) for t in joined.split("/"))
    kept = [token.strip("_") for token in tokens if token.strip("_")]
    return "".join(f"/{token}" if token[0].isalpha() else f"/n{token}" for token in kept) or "/n"


def _variable(name: str) -> str:
    plain = re.sub(r"\W", "_", name, flags=re.ASCII).lstrip("_")
    return (plain if plain[:1].isalpha() else f"n{plain}")[:MATLAB_LENGTH]


def _unique(names: Iterable[str], made: object, taken: Iterable[str] = ()) -> dict[str, str]:
    """What is made of each name; of two that would be equal the second gets a number."""
    assert callable(made)
    found: dict[str, str] = {}
    used = set(taken)
    for name in names:
        first = new = made(name)
        number = 1
        while new in used:
            number += 1
            new = f"{first[: MATLAB_LENGTH - 4] if made is _variable else first}_{number}"
        used.add(new)
        found[name] = new
    return found
