"""Forces within a robot, from the balance of what lies beyond a cut: (121) to (128)."""

from .cuts import Balance, ExternalLoad, Reaction, SectionForces
from .force_channels import force_channels
from .internal_forces import (
    InternalForces,
    LinkForces,
    check_continuous,
    internal_forces,
    sections_known,
)

__all__ = [
    "Balance",
    "ExternalLoad",
    "InternalForces",
    "LinkForces",
    "Reaction",
    "SectionForces",
    "check_continuous",
    "force_channels",
    "internal_forces",
    "sections_known",
]
