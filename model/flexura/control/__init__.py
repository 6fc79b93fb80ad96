"""Sampled controllers, their gains files and step metrics, LQR designs, iterative learning,
functions as drives."""

from .board_replay import board_pulses
from .controller import (
    DEFLECTION,
    DERIVATIVE,
    LIMIT,
    SETPOINT,
    SLEW,
    Controller,
    Linear,
    filter_coefficient,
)
from .gains import BOARD, NAMES, Gains
from .gains import load as load_gains
from .ilc import (
    JointLoop,
    LearningFilter,
    filter_length,
    learning_filter,
    reference_response,
)
from .lqr_design import Design, lqr
from .pid import GAINS, PID, Force, Motor, Output, Stepper
from .sampled import DriveFunction, Sampled
from .step_metrics import (
    EFFORT,
    ERROR,
    ITAE,
    JOINT,
    OVERSHOOT,
    RESIDUAL,
    RMS,
    SETTLING,
    STRIP,
    VIBRATION,
    StepResponse,
    step_figures,
    step_response,
    strip_metrics,
)

__all__ = [
    "BOARD",
    "DEFLECTION",
    "DERIVATIVE",
    "EFFORT",
    "ERROR",
    "GAINS",
    "ITAE",
    "JOINT",
    "LIMIT",
    "NAMES",
    "OVERSHOOT",
    "PID",
    "RESIDUAL",
    "RMS",
    "SETPOINT",
    "SETTLING",
    "SLEW",
    "STRIP",
    "VIBRATION",
    "Controller",
    "Design",
    "DriveFunction",
    "Force",
    "Gains",
    "JointLoop",
    "LearningFilter",
    "Linear",
    "Motor",
    "Output",
    "Sampled",
    "StepResponse",
    "Stepper",
    "board_pulses",
    "filter_coefficient",
    "filter_length",
    "learning_filter",
    "load_gains",
    "lqr",
    "reference_response",
    "step_figures",
    "step_response",
    "strip_metrics",
]
