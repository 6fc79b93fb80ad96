"""The robot file: a frozen, validated description of a robot in SI units."""

from .joint import Joint, key_of
from .link import LEAST_FREE, MAX_ELEMENTS, MOST_MODES, Damping, Link, Section, SectionAt, ValueAt
from .old_keys import OldKey, renamed
from .robot import MAX_LINKS, Payload, Robot, load, robot_of, save
from .table import Table

__all__ = [
    "LEAST_FREE",
    "MAX_ELEMENTS",
    "MAX_LINKS",
    "MOST_MODES",
    "Damping",
    "Joint",
    "Link",
    "OldKey",
    "Payload",
    "Robot",
    "Section",
    "SectionAt",
    "Table",
    "ValueAt",
    "key_of",
    "load",
    "renamed",
    "robot_of",
    "save",
]
