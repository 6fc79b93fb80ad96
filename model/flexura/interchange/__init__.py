"""Robots for other programs, and from them: FMUs of FMI 2.0 and 3.0, and URDF files."""

from .fmu import fmu, fmu_lacks
from .urdf import Imported, JointMap, read_urdf, urdf

__all__ = ["Imported", "JointMap", "fmu", "fmu_lacks", "read_urdf", "urdf"]
