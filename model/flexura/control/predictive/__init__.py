"""Nonlinear model predictive control with real-time iteration."""

from .nmpc import nmpc
from .nmpc_law import NonlinearPredictive

__all__ = ["NonlinearPredictive", "nmpc"]
