"""Robot -> System: a robot's equations, its equilibria, its small motions.

`assembly` is the theory, dense and readable; `system` serves it to everybody, with the compiled
core where that is faster.
"""

from .assembly import Assembly
from .balance import (
    Balance,
    InternalForces,
    LinkForces,
    Load,
    Reaction,
    SectionForces,
    check_continuous,
    internal_forces,
    sections_known,
)
from .frequency_response import FrequencyResponse, frequency_response
from .spectrum import Modes, frequencies, modes
from .statespace import StateSpace, linearize
from .statics import NoEquilibrium, equilibrium, holding, static, tip_pose
from .system import RobotLike, System, assemble

__all__ = [
    "Assembly",
    "Balance",
    "FrequencyResponse",
    "InternalForces",
    "LinkForces",
    "Load",
    "Modes",
    "NoEquilibrium",
    "Reaction",
    "RobotLike",
    "SectionForces",
    "StateSpace",
    "System",
    "assemble",
    "check_continuous",
    "equilibrium",
    "frequencies",
    "frequency_response",
    "holding",
    "internal_forces",
    "linearize",
    "modes",
    "sections_known",
    "static",
    "tip_pose",
]
