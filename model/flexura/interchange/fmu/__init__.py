"""A robot as a co-simulation unit (FMU) of FMI 2.0 or 3.0, which runs where flexura is not."""

from .unit import fmu
from .variables import fmu_lacks

__all__ = ["fmu", "fmu_lacks"]
