"""Nonlinear model predictive control with real-time iteration."""

from .nmpc_design import nmpc
from .nmpc_law import NonlinearPredictive

__all__ = ["NonlinearPredictive", "nmpc"]
