"""One link in Exudyn: cable, geometrically exact beam, or rigid body, with its properties."""

from .ancf import CableLink
from .part import Frame, Ground, PointMass
from .properties import beam_values, link_inertia

__all__ = ["CableLink", "Frame", "Ground", "PointMass", "beam_values", "link_inertia"]
