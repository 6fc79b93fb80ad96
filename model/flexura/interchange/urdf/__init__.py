"""Robots from URDF files, and URDF files of robots."""

from .reading import Imported, JointMap, read_urdf
from .writing import urdf

__all__ = ["Imported", "JointMap", "read_urdf", "urdf"]
