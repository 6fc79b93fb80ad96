"""Sampled controllers, their gains files and step metrics, LQR and LQG with the figures of their
loops, iterative learning, functions as drives."""

from .board_replay import board_pulses
from .controller import (
    DEFLECTION,
    DERIVATIVE,
    LIMIT,
    OBSERVER,
    SETPOINT,
    SLEW,
    Controller,
    Linear,
    filter_coefficient,
)
from .designed import Designed, design_setting
from .gain_names import BOARD, NAMES
from .gains import Gains, load_controller
from .gains import load as load_gains
from .ilc import (
    JointLoop,
    JointSpring,
    LearningFilter,
    filter_length,
    inverse_of_many,
    learning_filter,
    reference_response,
    transform_points,
)
from .linear_quadratic.gaussian_design import Design
from .linear_quadratic.loop_figures import LoopFigures, LoopMargins, loop_figures
from .linear_quadratic.lqg_design import lqg
from .linear_quadratic.lqr_design import lqr
from .pid import GAINS, PID, Force, Motor, Output, Stepper
from .predictive import nmpc
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
    "OBSERVER",
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
    "Designed",
    "DriveFunction",
    "Force",
    "Gains",
    "JointLoop",
    "JointSpring",
    "LearningFilter",
    "Linear",
    "LoopFigures",
    "LoopMargins",
    "Motor",
    "Output",
    "Sampled",
    "StepResponse",
    "Stepper",
    "board_pulses",
    "design_setting",
    "filter_coefficient",
    "filter_length",
    "inverse_of_many",
    "learning_filter",
    "load_controller",
    "load_gains",
    "loop_figures",
    "lqg",
    "lqr",
    "nmpc",
    "reference_response",
    "step_figures",
    "step_response",
    "strip_metrics",
    "transform_points",
]
