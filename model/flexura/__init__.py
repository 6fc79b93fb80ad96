"""flexura: planar robots with flexible links, from one robot file.

    import flexura as fx
    robot = fx.load("model/robots/rig.toml")
    system = fx.assemble(robot)
    run = fx.simulate(system, t_eval, drive)

The theory as implemented is in `model/README.md`. Names are loaded when first used, so that `import flexura` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "Robot": "robot", "load": "robot", "save": "robot",
    "System": "system", "assemble": "system",
    "static": "system", "tip_pose": "system", "NoEquilibrium": "system",
    "frequencies": "system", "modes": "system", "Modes": "system",
    "StateSpace": "system", "linearize": "system",
    "simulate": "forward", "inverse": "forward",
    "Run": "run",
    "Batch": "batch", "Population": "population",
    "Drive": "drive", "JointDrive": "drive", "Manoeuvre": "drive", "load_manoeuvre": "drive",
    "Controller": "control", "PID": "control", "Force": "control", "Motor": "control", "Stepper": "control",
    "Signal": "signals", "signals": "signals", "Sampled": "sampled",
    "FlexuraError": "errors", "InputError": "errors",
}  # fmt: skip

__all__ = [
    "PID", "Batch", "Controller", "Drive", "FlexuraError", "Force", "InputError", "JointDrive", "Manoeuvre", "Modes", "Motor",
    "NoEquilibrium", "Population", "Robot", "Run", "Sampled", "Signal", "StateSpace", "Stepper", "System",
    "assemble", "frequencies", "inverse", "linearize", "load", "load_manoeuvre", "modes", "save", "signals", "simulate", "static",
    "tip_pose",
]  # fmt: skip

if TYPE_CHECKING:
    from . import signals
    from .batch import Batch
    from .control import PID, Controller, Force, Motor, Stepper
    from .drive import Drive, JointDrive, Manoeuvre, load_manoeuvre
    from .errors import FlexuraError, InputError
    from .forward import inverse, simulate
    from .population import Population
    from .robot import Robot, load, save
    from .run import Run
    from .sampled import Sampled
    from .signals import Signal
    from .system import (
        Modes,
        NoEquilibrium,
        StateSpace,
        System,
        assemble,
        frequencies,
        linearize,
        modes,
        static,
        tip_pose,
    )


def __getattr__(name: str) -> Any:
    if name in ("signal", "shaping"):  # of 0.1: they say what they are now
        return importlib.import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module 'flexura' has no attribute {name!r}")
    home = importlib.import_module(f".{_HOME[name]}", __name__)
    value = home if name == _HOME[name] else getattr(home, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
