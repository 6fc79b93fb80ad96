"""Keys of robot files of 0.1, which had no unit, beside those of today."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..io import Tables
from .joint import KEYS, key_of


@dataclass(frozen=True)
class OldKey:
    """An old key in the joint of link `link` (from 1), and the one that took its place."""

    link: int
    old: str
    new: str

    @property
    def path(self) -> str:
        """The key as messages name it."""
        return f"link[{self.link}].joint.{self.old}"


def renamed(data: Tables) -> tuple[Tables, list[OldKey]]:
    """The tables of a robot file with the keys of today.

    A joint that has a quantity under both names keeps both, and the old one is an unknown key.

    Args:
        data: the tables.

    Returns:
        The tables, and what was old in them.
    """
    links = data.get("link") if isinstance(data, dict) else None
    if not isinstance(links, list):
        return data, []
    out, old = [], []
    for i, link in enumerate(links, 1):
        joint = link.get("joint") if isinstance(link, Mapping) else None
        if isinstance(joint, Mapping):
            new = {key: key_of(key, joint.get("type")) for key in joint if key in KEYS}
            new = {key: name for key, name in new.items() if name not in joint}
            if new:
                old += [OldKey(i, *names) for names in new.items()]
                joint = {new.get(key, key): value for key, value in joint.items()}
                link = {**link, "joint": joint}
        out.append(link)
    return ({**data, "link": out}, old) if old else (data, [])
