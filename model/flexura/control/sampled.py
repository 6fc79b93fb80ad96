"""Functions of the caller's own as drives: called at any time, or once a tick."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import Tables, array, function_of, takes, tick_rate
from ..signals import Loads
from ..system import RunStates, System, sensor_channels

MEASURED = ("q", "qd", "tip_deflections", "sensors")  # what a Sampled's function may ask for


@dataclass(frozen=True)
class Sampled:
    """A Python object that is called once a tick and may have a memory.

    f(t, position, velocity, tip_deflection), or f(t), is called at t = k / rate_Hz, k = 0, 1, 2,
    ..., counted from the start of the run, each exactly once and in order of time, with the state
    at that instant; steps that are rejected, events and an interruption change nothing of this. The
    forces that it gives are held to the next tick. position and velocity have one entry a joint [m
    or rad]; tip_deflection is the last flexible link's [m]. An error in f ends the run and reaches
    the caller.

    If f has keyword-only parameters of these names, it also gets `sensors`, the values of the
    robot's sensors by name; `tip_deflections` of all flexible links [m]; `q` and `qd`, the state.
    An accelerometer shows what it does under the forces of the tick before.
    """

    function: Callable[..., ArrayLike]
    rate_Hz: float

    def __post_init__(self) -> None:
        expected = "expected a function of (t) or of (t, position, velocity, tip_deflection)"
        if not asked_measurements(self.function):
            function_of(self.function, "function", (1, 4), expected)
        tick_rate(self.rate_Hz)

    def spec(self) -> Tables:
        """What it is, for a Run's metadata."""
        return {
            "function": getattr(self.function, "__name__", type(self.function).__name__),
            "rate_Hz": self.rate_Hz,
        }


class DriveFunction:
    """A drive function of (t), or of (t, position, velocity, tip_deflection), for the forces of the
    joints of a robot.

    `of_state`: the function asks for further measurements. What the integrators call then is
    `function(t, q, qd)`.

    Raises:
        InputError: the function takes other arguments.
    """

    def __init__(
        self,
        function: Callable[..., ArrayLike],
        joints: int,
        system: System | None = None,
        loads: Loads | None = None,
    ) -> None:
        self.function, self.joints, self.of_state = function, joints, False
        try:
            parameters = list(inspect.signature(function).parameters.values())
        except (TypeError, ValueError):
            parameters = []
        needed = [
            p
            for p in parameters
            if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) and p.default is p.empty
        ]
        gathers = any(p.kind is p.VAR_POSITIONAL for p in parameters)
        self.of_time = len(needed) == 1 and not gathers
        if not (self.of_time or len(needed) == 4 or (parameters and takes(function, 4))):
            expected = "expected a function of (t) or of (t, position, velocity, tip_deflection)"
            raise InputError(expected, key="drive", value=function)
        if system is not None and (asked := asked_measurements(function)):
            self.function, self.of_state = _Measured(self, system, asked, loads), True
            self.of_time = False

    def read(self, given: Any, t: float) -> np.ndarray:
        """The forces that the function has given.

        Args:
            given: its result.
            t: time of the call [s].

        Returns:
            Forces (joints,) [N or N m].

        Raises:
            InputError: it gave something else.
        """
        expected = f"expected {self.joints} finite forces from the drive function at t = {t:g} s"
        force = np.atleast_1d(array(given, "drive", expected))
        if force.shape != (self.joints,):
            raise InputError(expected, key="drive", value=given)
        return force

    def __call__(
        self, t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float
    ) -> np.ndarray:
        """The forces (joints,) at time t [s]."""
        return self.read(
            self.function(t)
            if self.of_time
            else self.function(t, position, velocity, tip_deflection),
            t,
        )


class _Measured:
    """A function of (t, q, qd) that measures what another one asks for."""

    def __init__(
        self, drive: DriveFunction, system: System, asked: tuple[str, ...], loads: Loads | None
    ) -> None:
        self.f, self.read, self.system = drive.function, drive.read, system
        self.asked, self.of_time, self.loads = asked, drive.of_time, loads or Loads()
        self.force = np.zeros(drive.joints)

    def __call__(self, t: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        rows = self.system.joint_rows
        bent = self.system.places(q)[0]
        known: dict[str, Any] = {"q": q, "qd": qd, "tip_deflections": bent}
        if "sensors" in self.asked:
            now = (np.array([t]), q[None], qd[None], self.force[None])
            channels = sensor_channels(RunStates(self.system, *now, self.loads))
            known["sensors"] = {
                name.removeprefix("sensor/"): float(value[0]) for name, value in channels.items()
            }
        more = {name: known[name] for name in self.asked}
        tip = float(bent[-1]) if len(bent) else 0.0
        given = self.f(t, **more) if self.of_time else self.f(t, q[rows], qd[rows], tip, **more)
        self.force = self.read(given, t)
        return self.force


def asked_measurements(function: Any) -> tuple[str, ...]:
    """Which further measurements a function of a Sampled asks for.

    Args:
        function: the function.

    Returns:
        Names of `MEASURED`.

    Raises:
        InputError: it needs another keyword.
    """
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return ()
    named = [p for p in parameters if p.kind is p.KEYWORD_ONLY]
    for p in named:
        if p.default is p.empty and p.name not in MEASURED:
            expected = f"expected keywords of its measurements: {', '.join(MEASURED)}"
            raise InputError(expected, key="function", value=p.name)
    return tuple(p.name for p in named if p.name in MEASURED)
