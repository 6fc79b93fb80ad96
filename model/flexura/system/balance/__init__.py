"""Forces within a robot, from the balance of what lies beyond a cut: (139) to (146)."""

from .cuts import Balance, PointLoad, Reaction, SectionForces
from .internal_forces import (
    InternalForces,
    LinkForces,
    check_continuous,
    internal_forces,
    point_loads,
    sections_known,
)
from .run_states import RunStates

__all__ = [
    "Balance",
    "InternalForces",
    "LinkForces",
    "PointLoad",
    "Reaction",
    "RunStates",
    "SectionForces",
    "check_continuous",
    "internal_forces",
    "point_loads",
    "sections_known",
]
