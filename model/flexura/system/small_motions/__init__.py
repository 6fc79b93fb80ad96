"""Small motions about an equilibrium or a steady rotation: frequencies, modes, state space,
frequency responses."""

from .frequency_response import FrequencyResponse, frequency_response
from .spectrum import Modes, frequencies, modes
from .statespace import StateSpace, linearize

__all__ = [
    "FrequencyResponse",
    "Modes",
    "StateSpace",
    "frequencies",
    "frequency_response",
    "linearize",
    "modes",
]
