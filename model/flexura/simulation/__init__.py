"""One robot: a problem is checked, solved and recorded."""

from .approximate_inverse import by_bisection, by_rigid_robot, rigid_robot
from .dynamics import inverse, simulate
from .feedforward import gravity, inverse_dynamics
from .gain_sweep import Trials, trials
from .problem import METHODS
from .recorder import channel_units
from .trajectory import feedforward, inverse_kinematics, invert

__all__ = [
    "METHODS",
    "Trials",
    "by_bisection",
    "by_rigid_robot",
    "channel_units",
    "feedforward",
    "gravity",
    "inverse",
    "inverse_dynamics",
    "inverse_kinematics",
    "invert",
    "rigid_robot",
    "simulate",
    "trials",
]
