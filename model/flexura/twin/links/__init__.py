"""One link in Exudyn: cable, geometrically exact beam, or rigid body, with its frames and
properties."""

from .ancf import CableLink
from .part import Frame, Ground, Lump
from .properties import beam_values, link_inertia

__all__ = ["CableLink", "Frame", "Ground", "Lump", "beam_values", "link_inertia"]
