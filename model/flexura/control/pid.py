"""One joint's sampled law, and what its output is: a force, a motor's voltage, a stepper's rate."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from ..errors import InputError
from ..io import Tables, flag, number
from ..signals import FunctionSignal, Signal, as_signal, spline

GAINS = ("kp", "ki", "kd", "kf", "kg", "ks", "kt", "kv", "kc", "jo", "bo")


@dataclass(frozen=True)
class Force:
    """The law's output is the joint's force or torque itself [N or N m]."""


@dataclass(frozen=True)
class Motor:
    """The output is a DC motor's voltage u: force = force_per_V u - damping eta' (62).

    With torque constant k, resistance R, back-EMF constant ke and a transmission of i rad per m or
    rad: force_per_V = k i / R, damping = k ke i^2 / R + friction; the inductance is left out. The
    rotor's inertia is the robot file's `rotor_inertia_kg_m2` or `rotor_mass_kg`.
    """

    force_per_V: float
    damping: float

    def __post_init__(self) -> None:
        for name in ("force_per_V", "damping"):
            object.__setattr__(self, name, number(getattr(self, name), name))


@dataclass(frozen=True)
class Stepper:
    """The output is a stepper's rate: the pulses' place is its integral, and the joint follows that
    place (63).

    `stiffness` [N m/rad or N/m] and `damping` of the magnetic spring between them; without a
    stiffness the joint is held to the pulses, whose rate then changes evenly over a tick. The law
    counts the pulses (the firmware's `feedback_2` = 0), or with `encoder` measures the joint. Lost
    steps are not in it.
    """

    stiffness: float | None = None
    damping: float = 0.0
    encoder: bool = False

    def __post_init__(self) -> None:
        if self.stiffness is not None:
            object.__setattr__(self, "stiffness", number(self.stiffness, "stiffness"))
        object.__setattr__(self, "damping", number(self.damping, "damping"))
        object.__setattr__(self, "encoder", flag(self.encoder, "encoder"))


Output = Force | Motor | Stepper


@dataclass(frozen=True)
class PID:
    """One joint's law, a PID with deflection feedback (70), limits (71) and anti-windup (72).

    Gains are in units of its output (N, N m, V, rad/s or m/s) per m or rad, s.

    `reference` [m or rad] through a filter of `setpoint_Hz` (0: none), `feedforward` [units of the
    output], `derivative_Hz` (0: none) for the measured velocity. `limit`, `slew` (per second) of
    the output. `observer_Hz` (0: none) for the disturbance observer, whose nominal joint is
    u = jo q'' + bo q'; a stepper has none. `delay_s`, a whole number of ticks, from measurement to
    output. `count`: the encoder's resolution [m or rad], `duty`: that of the output; 0: exact.
    """

    reference: Signal
    output: Output = Force()
    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0
    kf: float = 0.0
    kg: float = 0.0
    ks: float = 0.0
    kt: float = 0.0
    kv: float = 0.0
    kc: float = 0.0
    jo: float = 0.0
    bo: float = 0.0
    limit: float = math.inf
    slew: float = math.inf
    setpoint_Hz: float = 0.0
    derivative_Hz: float = 50.0
    observer_Hz: float = 0.0
    feedforward: Signal | None = None
    delay_s: float = 0.0
    count: float = 0.0
    duty: float = 0.0

    def __post_init__(self) -> None:
        for name in ("reference", "feedforward"):
            object.__setattr__(self, name, as_signal(getattr(self, name), name))
        if self.reference is None:
            raise InputError("expected a reference to follow", key="reference", value="None")
        if not isinstance(self.output, Force | Motor | Stepper):
            expected = "expected Force(), a Motor or a Stepper"
            raise InputError(expected, key="output", value=self.output)
        for name in GAINS:
            object.__setattr__(self, name, number(getattr(self, name), name))
        for name in (
            "setpoint_Hz",
            "derivative_Hz",
            "observer_Hz",
            "jo",
            "bo",
            "delay_s",
            "count",
            "duty",
        ):
            check_not_negative(self, name)
        if self.observer_Hz > 0 and isinstance(self.output, Stepper):
            expected = "expected 0: a stepper's joint is where its pulses are"
            raise InputError(expected, key="observer_Hz", value=self.observer_Hz)
        for name in ("limit", "slew"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
                raise InputError("expected a number above 0", key=name, value=value)

    def within(self, start: float, end: float) -> PID:
        """The same law for a run between two times: functions of time become splines.

        Args:
            start: begin of the run [s].
            end: end of the run [s].

        Returns:
            A law whose reference and feedforward are Signals.

        Raises:
            InputError: a function gives anything but finite numbers, or jumps.
        """
        waves = {name: getattr(self, name) for name in ("reference", "feedforward")}
        made: dict[str, Any] = {
            name: spline(replace(wave, key=name), start, end)
            for name, wave in waves.items()
            if isinstance(wave, FunctionSignal)
        }
        return replace(self, **made) if made else self

    @property
    def prescribed(self) -> bool:
        """Is the joint held to the pulses of its stepper?"""
        return isinstance(self.output, Stepper) and self.output.stiffness is None

    def one_sensor(self, length: float) -> PID:
        """The same law for a strip whose deflection alone is measured, as on the rig.

        w'(L) is taken as 3 w(L) / (2 L), a cantilever's that its tip loads (73).

        Args:
            length: free length of the strip [m].

        Returns:
            A law without terms in the slope.
        """
        per_m = 1.5 / length
        return replace(
            self, kf=self.kf + self.ks * per_m, kg=self.kg + self.kt * per_m, ks=0.0, kt=0.0
        )

    def spec(self) -> Tables:
        """What it is, for a Run's metadata; without what is infinite."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.type == "float"}
        out = {name: value for name, value in plain.items() if math.isfinite(value)}
        out |= {
            "reference": self.reference.spec,
            "output": {"kind": type(self.output).__name__.lower(), **asdict(self.output)},
        }
        return out | ({"feedforward": self.feedforward.spec} if self.feedforward else {})


def check_not_negative(given: Any, name: str) -> None:
    """Raises InputError where a field is no finite number of 0 or more."""
    expected, value = "expected a finite number of 0 or more", getattr(given, name)
    if not number(value, name, expected) >= 0:
        raise InputError(expected, key=name, value=value)
