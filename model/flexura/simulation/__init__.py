"""One robot: a problem is checked, solved and recorded."""

from .approximate_inverse import rigid_feedforward, rigid_robot, shoot_by_bisection
from .dynamics import inverse, simulate
from .feedforward import gravity, inverse_dynamics
from .gain_sweep import GainSweep, prepare_gain_sweep
from .problem import METHODS
from .recorder import channel_units
from .trajectory import feedforward, inverse_kinematics, invert, parameter_derivatives, time_optimal

__all__ = [
    "METHODS",
    "GainSweep",
    "channel_units",
    "feedforward",
    "gravity",
    "inverse",
    "inverse_dynamics",
    "inverse_kinematics",
    "invert",
    "parameter_derivatives",
    "prepare_gain_sweep",
    "rigid_feedforward",
    "rigid_robot",
    "shoot_by_bisection",
    "simulate",
    "time_optimal",
]
