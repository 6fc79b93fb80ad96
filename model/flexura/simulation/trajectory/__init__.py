"""Whole motions as the unknown: tip inversion, shortest motions, derivatives by parameters."""

from .feedforward_manoeuvre import feedforward
from .parameter_derivatives import parameter_derivatives
from .posture import inverse_kinematics
from .time_optimal import time_optimal
from .tip_inversion import invert

__all__ = ["feedforward", "inverse_kinematics", "invert", "parameter_derivatives", "time_optimal"]
