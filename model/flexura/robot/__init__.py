"""The robot file: a frozen, validated description of a robot in SI units."""

from .damping import Damping
from .joint import Joint, Spring, Transmission, key_of
from .link import (
    LEAST_FREE,
    MAX_ELEMENTS,
    MOST_MODES,
    Link,
    Lump,
    ValueAt,
)
from .old_keys import OldKey, renamed
from .payload import Payload
from .robot import MAX_LINKS, Robot, load, robot_of, save
from .section import Section, SectionAt, form_of
from .sensor import FORCE_KINDS, Sensor
from .table import BOUNDS, Bounds, Table

__all__ = [
    "BOUNDS",
    "FORCE_KINDS",
    "LEAST_FREE",
    "MAX_ELEMENTS",
    "MAX_LINKS",
    "MOST_MODES",
    "Bounds",
    "Damping",
    "Joint",
    "Link",
    "Lump",
    "OldKey",
    "Payload",
    "Robot",
    "Section",
    "SectionAt",
    "Sensor",
    "Spring",
    "Table",
    "Transmission",
    "ValueAt",
    "form_of",
    "key_of",
    "load",
    "renamed",
    "robot_of",
    "save",
]
