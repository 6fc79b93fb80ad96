"""The rig: its file, the board's settings that follow from it, and whether it can do what it is
asked to do."""

from .checks import Check, examine
from .description import Bench, Rig, calibration, configuration, load
from .emulation import Truth, random_truth

__all__ = [
    "Bench",
    "Check",
    "Rig",
    "Truth",
    "calibration",
    "configuration",
    "examine",
    "load",
    "random_truth",
]
