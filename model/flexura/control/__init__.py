"""What acts in the joints beyond a plain drive: sampled controllers, their gains and figures,
functions of the caller's."""

from .controller import (
    DEFLECTION,
    DERIVATIVE,
    LIMIT,
    SETPOINT,
    SLEW,
    Controller,
    Linear,
    smoothing,
)
from .gains import BOARD, NAMES, Gains
from .gains import load as load_gains
from .lqr_design import Design, lqr
from .pid import GAINS, PID, Force, Motor, Output, Stepper
from .sampled import DriveFunction, Sampled
from .step_response import (
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
    Response,
    of_run,
    strip_figures,
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
    "Linear",
    "Motor",
    "Output",
    "Response",
    "Sampled",
    "Stepper",
    "load_gains",
    "lqr",
    "of_run",
    "smoothing",
    "strip_figures",
]
