"""Robot -> System: a robot's equations, its equilibria, its small motions.

`assembly` is the theory, dense and readable; `system` serves it to everybody, with the compiled
core where that is faster.
"""

from .assembly import Assembly
from .frequency_response import FrequencyResponse, frequency_response
from .loads import Impact, acting_loads, impact, load_forces, with_payload
from .sensors import sensor_channels
from .spectrum import Modes, frequencies, modes
from .statespace import StateSpace, linearize
from .statics import NoEquilibrium, equilibrium, holding, static, tip_pose
from .system import RobotLike, System, assemble

__all__ = [
    "Assembly",
    "FrequencyResponse",
    "Impact",
    "Modes",
    "NoEquilibrium",
    "RobotLike",
    "StateSpace",
    "System",
    "acting_loads",
    "assemble",
    "equilibrium",
    "frequencies",
    "frequency_response",
    "holding",
    "impact",
    "linearize",
    "load_forces",
    "modes",
    "sensor_channels",
    "static",
    "tip_pose",
    "with_payload",
]
