"""Forces within a robot, from the balance of what lies beyond a cut: (121) to (128)."""

from .cuts import Balance, Load, Reaction, SectionForces
from .internal_forces import (
    InternalForces,
    LinkForces,
    check_continuous,
    internal_forces,
    sections_known,
)

__all__ = [
    "Balance",
    "InternalForces",
    "LinkForces",
    "Load",
    "Reaction",
    "SectionForces",
    "check_continuous",
    "internal_forces",
    "sections_known",
]
