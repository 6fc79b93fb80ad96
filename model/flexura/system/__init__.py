"""Robot -> System: a robot's equations, its equilibria, its small motions.

A `System` is what everybody asks: it checks arguments and answers from an `Assembly` or from the
compiled core. An `Assembly` is the theory itself, dense and readable: the reference for the core,
and the equations of the models that the core does not have (linear lines, sliding by nodes).
"""

from .assembly import Assembly
from .balance import (
    Balance,
    InternalForces,
    LinkForces,
    PointLoad,
    Reaction,
    RunStates,
    SectionForces,
    check_continuous,
    internal_forces,
    sections_known,
)
from .loads import Impact, acting_loads, impact, load_forces, with_payload
from .sensors import sensor_channels
from .small_motions import (
    FrequencyResponse,
    Modes,
    StateSpace,
    frequencies,
    frequency_response,
    linearize,
    modes,
)
from .statics import NoEquilibrium, equilibrium, holding, static, tip_pose
from .system import RobotLike, System, assemble

__all__ = [
    "Assembly",
    "Balance",
    "FrequencyResponse",
    "Impact",
    "InternalForces",
    "LinkForces",
    "Modes",
    "NoEquilibrium",
    "PointLoad",
    "Reaction",
    "RobotLike",
    "RunStates",
    "SectionForces",
    "StateSpace",
    "System",
    "acting_loads",
    "assemble",
    "check_continuous",
    "equilibrium",
    "frequencies",
    "frequency_response",
    "holding",
    "impact",
    "internal_forces",
    "linearize",
    "load_forces",
    "modes",
    "sections_known",
    "sensor_channels",
    "static",
    "tip_pose",
    "with_payload",
]
