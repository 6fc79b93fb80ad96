"""Sampled controllers, their gains files and step metrics, LQR and LQG with the figures of their
loops, iterative learning, functions as drives."""

from .backlash import Backlash, Contact
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
from .gains import BOARD, NAMES, Designed, Gains, design_setting, load_controller
from .gains import load as load_gains
from .ilc import (
    JointLoop,
    JointSpring,
    LearningLaw,
    motion_response,
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
    "Backlash",
    "Contact",
    "Controller",
    "Design",
    "Designed",
    "DriveFunction",
    "Force",
    "Gains",
    "JointLoop",
    "JointSpring",
    "LearningLaw",
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
    "load_controller",
    "load_gains",
    "loop_figures",
    "lqg",
    "lqr",
    "motion_response",
    "nmpc",
    "step_figures",
    "step_response",
    "strip_metrics",
]
