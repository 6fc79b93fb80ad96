"""The rig: its file, the board's settings that follow from it, and whether it can do what it is asked to do."""

from .checks import Check, examine
from .description import Bench, Rig, calibration, configuration, load

__all__ = ["Bench", "Check", "Rig", "calibration", "configuration", "examine", "load"]
