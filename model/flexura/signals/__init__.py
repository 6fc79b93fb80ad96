"""Functions of time: motions to follow, forces and torques to apply, and their reading from
tables."""

from . import paths, shaping, signal
from .acting import Acting, acts
from .composite import chirp, delayed, noise, pulse, sum
from .conversion import FunctionSignal, SignalLike, as_signal, as_signals, spline
from .drive import Drive, JointDrive
from .kinds import (
    bang_bang,
    constant,
    cycloid,
    harmonic,
    piecewise,
    polynomial,
    ramp,
    step,
    table,
    trapezoidal,
)
from .load import Load, Loads, LoadsLike, as_loads
from .manoeuvre import STARTS, Manoeuvre, load_manoeuvre
from .parsing import KINDS, PLAUSIBLE, from_spec, is_finite, is_plausible
from .payload_change import PayloadChange, PayloadsLike, as_payloads
from .shaping import ei, matched_cycloid, zv, zvd
from .signal import COLUMNS, Signal, evaluate, evaluate_many
from .smooth import check_smooth

__all__ = [
    "COLUMNS",
    "KINDS",
    "PLAUSIBLE",
    "STARTS",
    "Acting",
    "Drive",
    "FunctionSignal",
    "JointDrive",
    "Load",
    "Loads",
    "LoadsLike",
    "Manoeuvre",
    "PayloadChange",
    "PayloadsLike",
    "Signal",
    "SignalLike",
    "acts",
    "as_loads",
    "as_payloads",
    "as_signal",
    "as_signals",
    "bang_bang",
    "check_smooth",
    "chirp",
    "constant",
    "cycloid",
    "delayed",
    "ei",
    "evaluate",
    "evaluate_many",
    "from_spec",
    "harmonic",
    "is_finite",
    "is_plausible",
    "load_manoeuvre",
    "matched_cycloid",
    "noise",
    "paths",
    "piecewise",
    "polynomial",
    "pulse",
    "ramp",
    "shaping",
    "signal",
    "spline",
    "step",
    "sum",
    "table",
    "trapezoidal",
    "zv",
    "zvd",
]
