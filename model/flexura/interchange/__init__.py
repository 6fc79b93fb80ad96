"""Robots for other programs, and from them: URDF files."""

from .urdf import Imported, JointMap, read_urdf, urdf

__all__ = ["Imported", "JointMap", "read_urdf", "urdf"]
