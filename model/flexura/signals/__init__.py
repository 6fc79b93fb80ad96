"""Functions of time: motions to follow, forces and torques to apply, and their reading from
tables."""

from . import shaping, signal
from .drive import Drive, JointDrive
from .manoeuvre import Manoeuvre, load_manoeuvre
from .parsing import finite, from_spec
from .shaping import matched_cycloid, zv, zvd
from .signal import (
    COLUMNS,
    Signal,
    bang_bang,
    constant,
    cycloid,
    evaluate,
    harmonic,
    piecewise,
    polynomial,
    step,
    table,
    trapezoidal,
)

__all__ = [
    "COLUMNS",
    "Drive",
    "JointDrive",
    "Manoeuvre",
    "Signal",
    "bang_bang",
    "constant",
    "cycloid",
    "evaluate",
    "finite",
    "from_spec",
    "harmonic",
    "load_manoeuvre",
    "matched_cycloid",
    "piecewise",
    "polynomial",
    "shaping",
    "signal",
    "step",
    "table",
    "trapezoidal",
    "zv",
    "zvd",
]
