"""flexura: planar robots with flexible links, from one robot file.

    import flexura as fx

    robot = fx.load("rig")
    run = fx.simulate(robot, t_eval, drive)

The theory as implemented is in `docs/theory`.
"""

import importlib
from types import ModuleType

from . import moved, signals
from .api import simulate
from .control import PID, Controller, Force, Motor, Sampled, Stepper, lqg, nmpc
from .errors import FlexuraError, InputError, NumericalError
from .io import Run
from .population import Batch, Population
from .robot import Robot, load, save
from .signals import Drive, JointDrive, Load, Manoeuvre, PayloadChange, Signal, load_manoeuvre
from .simulation import (
    feedforward,
    inverse,
    inverse_kinematics,
    invert,
    parameter_derivatives,
    time_optimal,
)
from .system import (
    FrequencyResponse,
    InternalForces,
    Modes,
    NoEquilibrium,
    StateSpace,
    System,
    assemble,
    frequencies,
    frequency_response,
    holding,
    internal_forces,
    linearize,
    modes,
    static,
    tip_pose,
)

__version__ = "0.1.0"
__all__ = [
    "PID",
    "Batch",
    "Controller",
    "Drive",
    "FlexuraError",
    "Force",
    "FrequencyResponse",
    "InputError",
    "InternalForces",
    "JointDrive",
    "Load",
    "Manoeuvre",
    "Modes",
    "Motor",
    "NoEquilibrium",
    "NumericalError",
    "PayloadChange",
    "Population",
    "Robot",
    "Run",
    "Sampled",
    "Signal",
    "StateSpace",
    "Stepper",
    "System",
    "assemble",
    "feedforward",
    "frequencies",
    "frequency_response",
    "holding",
    "internal_forces",
    "inverse",
    "inverse_kinematics",
    "invert",
    "linearize",
    "load",
    "load_manoeuvre",
    "lqg",
    "modes",
    "nmpc",
    "parameter_derivatives",
    "save",
    "signals",
    "simulate",
    "static",
    "time_optimal",
    "tip_pose",
]

moved.answer_old_names()


def __getattr__(name: str) -> ModuleType:
    """Modules of 0.1 by their old names, for example `fx.signal`."""
    if name not in moved.NEW:
        raise AttributeError(f"module 'flexura' has no attribute {name!r}")
    return importlib.import_module(f"flexura.{name}")
