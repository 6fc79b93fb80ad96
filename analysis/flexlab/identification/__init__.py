"""Identification: parameters with their intervals.

`identify_rig` is for a robot on a rig, from the rig's own experiment: motors, friction, play and
the sensor have models of their own. `fit` is for any robot, from any runs of it, and fits what is
named. Both minimise by `estimate`'s least squares; the command `flexura identify` has both.
"""

from .fit.identify_robot import Identification, Quantity, identify_robot

__all__ = ["Identification", "Quantity", "identify_robot"]
