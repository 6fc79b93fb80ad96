"""Sampled controllers as drives: one law for the model, the emulated board and the board
(firmware/README.md).

The law of one joint, with T the tick, e = r - q, w the tip deflection and s the tip slope (70):

    u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + ks s + kt s' + kv r' + kc sign r' + f(t)
        + d^

r: the reference through a first-order filter; r': its change / T; q': the filtered change of q / T,
and of a stepper that counts its own pulses u of the tick before; w, s: the mean of two ticks, every
second tick, through a filter of their own, w' its change / 2T; joint i takes them in ticks k with k
mod 2 = i mod 2 (i from 0). |u| <= limit, and changes by at most slew T a tick. The sum's part of u
stays within the limit, and stands still while limit or slew holds u back and e pushes it further.
Filters: y += a (x - y), a = 1 - exp(-2 pi f T). u becomes a force, or a stepper's rate, after a
whole number of ticks. d^ is what the disturbance observer finds of a motor or a force (149), (150).
The board's library (firmware/lib/control) computes it, in integers there and
in floating point in the core.

    motor = fx.Motor(force_per_V=13.1, damping=1180.0)
    carriage = fx.PID(step(0.1), motor, kp=2000, ki=4000, limit=12)
    drive = fx.Controller((carriage, fx.PID(step(0.7), kp=6, kd=0.2)))
    run = fx.simulate(system, t_eval, drive)

The Run has `joint/i/reference` besides, and `joint/i/voltage` of a motor, `joint/i/pulses` of a
stepper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from .. import core, signals
from ..errors import InputError
from ..io import Run, Tables, tick_rate
from ..signals import Drive, JointDrive
from ..system import System
from .pid import GAINS, PID, Motor, Stepper, check_not_negative

# what a joint's output is: not the controller's, a force or voltage, a rate
NONE, EFFORT, STEPPER = 0, 1, 2
(
    KP,
    KI,
    KD,
    KF,
    KG,
    KS,
    KT,
    KV,
    KC,
    JO,
    BO,
    LIMIT,
    SLEW,
    FORCE,
    SETPOINT,
    DERIVATIVE,
    DEFLECTION,
    OBSERVER,
    COUNT,
    DUTY,
    ENCODER,
    RIGID,
    DELAY,
) = range(23)  # columns of `Controller.gains`, as Gain of control/controller.hpp in the core


@dataclass(frozen=True)
class Linear:
    """A linear law in place of the PID's terms (77), as `lqr` makes it.

    z^ = z + L (y - C z), u = hold - K z^ + Kr r + Kv r' + f(t), limited as a PID's; z of the next
    tick = F z^ + G (u - hold) with the u that the limits left. y: positions and deflection, less
    `offset`.
    """

    F: np.ndarray
    G: np.ndarray
    L: np.ndarray
    C: np.ndarray
    K: np.ndarray
    Kr: np.ndarray
    Kv: np.ndarray
    offset: np.ndarray
    hold: np.ndarray


@dataclass(frozen=True)
class Controller:
    """A sampled controller of all joints, one `PID` (or, left to itself, one `JointDrive`) a joint.

    It measures and computes at t_eval[0] + k / rate_Hz and holds its outputs between: references
    and velocities by (68), the tip deflection of the last flexible link by (69). The deflection is
    filtered by `deflection_Hz` (0: none), in steps of `deflection_quantum_m` (0: exact).
    """

    joints: tuple[PID | JointDrive, ...]
    rate_Hz: float = 1000.0
    deflection_Hz: float = 50.0
    deflection_quantum_m: float = 0.0
    linear: Linear | None = None

    def __post_init__(self) -> None:
        joints = self.joints
        if not isinstance(joints, Sequence) or not all(
            isinstance(joint, PID | JointDrive) for joint in joints
        ):
            raise InputError("expected a PID or a JointDrive a joint", key="joints", value=joints)
        object.__setattr__(self, "joints", tuple(joints))
        tick_rate(self.rate_Hz)
        for name in ("deflection_Hz", "deflection_quantum_m"):
            check_not_negative(self, name)
        if not (self.linear is None or isinstance(self.linear, Linear)):
            raise InputError("expected a Linear or None", key="linear", value=self.linear)
        for i, joint in enumerate(self.joints, 1):
            late = joint.delay_s * self.rate_Hz if isinstance(joint, PID) else 0.0
            if abs(late - round(late)) > 1e-6 or late > 10_000:
                expected = (
                    f"expected a whole number of ticks of {1 / self.rate_Hz:g} s, at most 10000"
                )
                raise InputError(expected, key=f"joint {i}: delay_s", value=late / self.rate_Hz)

    @property
    def follows(self) -> np.ndarray:
        """Which joints are held to a motion, (N,) bool."""
        return np.array([joint.prescribed for joint in self.joints]) & (
            self._open().follows | self._own
        )

    @property
    def breaks(self) -> np.ndarray:
        """Instants at which what is not sampled isn't smooth [s]."""
        return self._open().breaks

    @property
    def _own(self) -> np.ndarray:
        return np.array([isinstance(joint, PID) for joint in self.joints])

    def _open(self) -> Drive:
        return Drive(
            tuple(JointDrive() if isinstance(joint, PID) else joint for joint in self.joints)
        )

    def within(self, start: float, end: float) -> Controller:
        """The same controller for a run between two times, see `Drive.within`.

        Args:
            start: begin of the run [s].
            end: end of the run [s].

        Returns:
            A controller whose functions of time are Signals.
        """
        opened = self._open().within(start, end)
        joints = tuple(
            joint.within(start, end) if isinstance(joint, PID) else own
            for joint, own in zip(self.joints, opened.joints, strict=True)
        )
        return replace(self, joints=joints)

    def core_drives(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """What acts on the joints that are not this controller's: segments, ranges (N, 4) and gains
        (N, 2) as `Drive.packed`, which joints follow their motion, and, for the core to fill in,
        which this controller moves, (N,) each."""
        drive = self._open()
        return (
            *drive.packed(),
            drive.follows.astype(np.uint8),
            np.zeros(len(self.joints), dtype=np.uint8),
        )

    def sampler(self, system: System) -> core.Controller:
        """What the core needs of this controller on a robot.

        Args:
            system: the robot.

        Returns:
            A `core.Controller`, with the state and the log of one run.
        """
        index, parts = (
            np.zeros((len(self.joints), 5), dtype=np.int64),
            [np.zeros((0, signals.COLUMNS))],
        )
        springs, count = np.zeros((len(self.joints), 2)), 0
        for i, joint in enumerate(self.joints):
            if not isinstance(joint, PID):
                continue
            index[i, 0] = STEPPER if isinstance(joint.output, Stepper) else EFFORT
            for k, wave in enumerate((joint.reference, joint.feedforward)):
                segments = parts[0] if wave is None else wave.segments
                index[i, 1 + 2 * k : 3 + 2 * k] = count, count + len(segments)
                count += len(segments)
                parts.append(segments)
            if isinstance(joint.output, Stepper):
                springs[i] = joint.output.stiffness or 0.0, joint.output.damping
            elif isinstance(joint.output, Motor):
                springs[i, 1] = joint.output.damping
        linear = (
            []
            if self.linear is None
            else [np.array(getattr(self.linear, f.name), dtype=float) for f in fields(Linear)]
        )
        return core.Controller(
            system.equations,
            float(self.rate_Hz),
            float(self.deflection_quantum_m),
            np.concatenate(parts),
            index,
            self.gains(),
            springs,
            linear[:7],
            linear[7:],
        )

    def gains(self) -> np.ndarray:
        """The numbers of the law that a search may change, (N, 23): columns KP to DELAY."""
        g = np.zeros((len(self.joints), 23))
        for row, joint in zip(g, self.joints, strict=True):
            row[DEFLECTION] = filter_coefficient(self.deflection_Hz, 2 / self.rate_Hz)
            if not isinstance(joint, PID):
                continue
            row[:LIMIT] = [getattr(joint, name) for name in GAINS]
            row[LIMIT], row[SLEW] = joint.limit, joint.slew
            row[FORCE] = joint.output.force_per_V if isinstance(joint.output, Motor) else 1.0
            row[SETPOINT] = filter_coefficient(joint.setpoint_Hz, 1 / self.rate_Hz)
            if joint.observer_Hz > 0:
                row[OBSERVER] = filter_coefficient(joint.observer_Hz, 2 / self.rate_Hz)
            row[DERIVATIVE] = filter_coefficient(joint.derivative_Hz, 1 / self.rate_Hz)
            row[COUNT], row[DUTY], row[DELAY] = (
                joint.count,
                joint.duty,
                round(joint.delay_s * self.rate_Hz),
            )
            row[RIGID] = joint.prescribed
            row[ENCODER] = isinstance(joint.output, Stepper) and joint.output.encoder
        return g

    def recorded(self, run: Run, sampler: core.Sampler) -> Run:
        """A Run with the controller's own channels besides.

        Args:
            run: the Run.
            sampler: that ran in it, with its log.

        Returns:
            The Run with joint/i/reference, joint/i/voltage and joint/i/pulses.
        """
        log, start = np.asarray(sampler.log), float(run.t[0]) if len(run.t) else 0.0
        if len(log) == 0:  # no tick in it: a run of one instant
            log = np.zeros((1, len(self.joints), 6))
        k = np.clip(np.floor((run.t - start) * self.rate_Hz + 1e-6).astype(int), 0, len(log) - 1)
        s = np.maximum(run.t - (start + k / self.rate_Hz), 0.0)
        channels, units = dict(run.channels), dict(run.units)
        for i, joint in enumerate(self.joints):
            if not isinstance(joint, PID):
                continue
            row, unit = log[k, i], run.units[f"joint/{i + 1}/position"]
            channels[f"joint/{i + 1}/reference"], units[f"joint/{i + 1}/reference"] = (
                row[:, 0],
                unit,
            )
            if isinstance(joint.output, Motor):
                channels[f"joint/{i + 1}/voltage"], units[f"joint/{i + 1}/voltage"] = row[:, 1], "V"
            elif isinstance(joint.output, Stepper):
                place = row[:, 2] + s * (row[:, 3] + s * row[:, 4])
                channels[f"joint/{i + 1}/pulses"], units[f"joint/{i + 1}/pulses"] = place, unit
        return replace(run, channels=channels, units=units)

    def spec(self) -> Tables:
        """What it is, for a Run's metadata."""
        own = {
            "rate_Hz": self.rate_Hz,
            "deflection_Hz": self.deflection_Hz,
            "deflection_quantum_m": self.deflection_quantum_m,
        }
        return own | {
            "law": "PID" if self.linear is None else "linear",
            "joint": [joint.spec() for joint in self.joints],
        }


def filter_coefficient(frequency_Hz: float, period_s: float) -> float:
    """a of the first-order filter y += a (x - y): a = 1 - exp(-2 pi f T) (67).

    Args:
        frequency_Hz: f, the corner frequency [Hz]; 0: no filter, a = 1.
        period_s: T, the time of a tick [s].

    Returns:
        a, from 0 to 1.
    """
    return 1.0 if frequency_Hz == 0 else -math.expm1(-2 * math.pi * frequency_Hz * period_s)
