"""Functions of the caller's own as drives: called at any time, or once a tick."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .errors import InputError

Function = Callable[[float, np.ndarray, np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class Sampled:
    """A Python object that is called once a tick and may have a memory.

    f(t, position, velocity, tip_deflection), or f(t), is called at t = k / rate_Hz, k = 0, 1, 2, ..., counted from the start of
    the run, each exactly once and in order of time, with the state at that instant; steps that are rejected, events and an
    interruption change nothing of this. The forces that it gives are held to the next tick. position and velocity have one
    entry a
    joint [m or rad]; tip_deflection is the last flexible link's [m]. An error in f ends the run and reaches the caller.
    """

    function: Callable[..., Any]
    rate_Hz: float

    def __post_init__(self) -> None:
        if not 0 < self.rate_Hz < math.inf:
            raise InputError("expected a rate above 0 in hertz", key="rate_Hz", value=self.rate_Hz)

    def spec(self) -> dict[str, Any]:
        """What it is, for a Run's metadata."""
        return {"function": getattr(self.function, "__name__", type(self.function).__name__), "rate_Hz": self.rate_Hz}


def as_function(drive: Callable[..., Any], joints: int) -> Function:
    """A drive function of (t) or (t, position, velocity, tip_deflection) as one of four arguments that gives (joints,) floats.

    Raises: InputError: it takes other arguments; or, when it is called, it gives something else.
    """
    try:
        needed = [
            p for p in inspect.signature(drive).parameters.values()
            if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) and p.default is p.empty
        ]  # fmt: skip
        count = len(needed)
    except (TypeError, ValueError):
        count = 0
    if count not in (1, 4):
        raise InputError("expected a function of (t) or of (t, position, velocity, tip_deflection)", key="drive", value=drive)

    def call(t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float) -> np.ndarray:
        given = drive(t) if count == 1 else drive(t, position, velocity, tip_deflection)
        force = np.ascontiguousarray(given, dtype=float)
        if force.shape != (joints,) or not np.all(np.isfinite(force)):
            raise InputError(
                f"expected {joints} finite forces from the drive function at t = {t:g} s", key="drive", value=given
            )
        return force

    return call
