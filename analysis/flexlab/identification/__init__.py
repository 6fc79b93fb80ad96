"""Identification: parameters with their intervals, of a rig from its experiment, and of any robot
from runs of it."""

from .fit.identify import Identification, Quantity, identify_robot

__all__ = ["Identification", "Quantity", "identify_robot"]
