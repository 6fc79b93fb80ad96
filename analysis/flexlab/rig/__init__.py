"""The rig: its file, the board's settings that follow from it, and checks of its capability."""

from .checks import Check, check_capability
from .configuration import calibration, configuration
from .description import Rig, RigSetup, load
from .emulation import TrueParameters, random_true_parameters

__all__ = [
    "Check",
    "Rig",
    "RigSetup",
    "TrueParameters",
    "calibration",
    "check_capability",
    "configuration",
    "load",
    "random_true_parameters",
]
