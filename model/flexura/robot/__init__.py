"""The robot file: a frozen, validated description of a robot in SI units."""

from .link import (
    LEAST_FREE,
    MAX_ELEMENTS,
    MOST_MODES,
    Damping,
    Joint,
    Link,
    Section,
    SectionAt,
    Table,
    ValueAt,
)
from .robot import MAX_LINKS, Payload, Robot, load, save

__all__ = [
    "LEAST_FREE",
    "MAX_ELEMENTS",
    "MAX_LINKS",
    "MOST_MODES",
    "Damping",
    "Joint",
    "Link",
    "Payload",
    "Robot",
    "Section",
    "SectionAt",
    "Table",
    "ValueAt",
    "load",
    "save",
]
