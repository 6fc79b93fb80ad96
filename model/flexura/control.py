"""Sampled controllers as drives: one law for the model, the emulated board and the board (`law.py`, firmware/README.md).

    carriage = fx.PID(step(0.1), fx.Motor(force_per_V=13.1, damping=1180.0), kp=2000, ki=4000, limit=12)
    drive = fx.Controller((carriage, fx.PID(step(0.7), kp=6, kd=0.2)))
    run = fx.simulate(system, t_eval, drive)

The Run has `joint/i/reference` besides, and `joint/i/voltage` of a motor, `joint/i/pulses` of a stepper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from . import law, signal
from .drive import Drive, JointDrive
from .errors import InputError
from .law import Law
from .signal import Signal
from .system import System


@dataclass(frozen=True)
class Force:
    """The law's output is the joint's force or torque itself [N or N m]."""


@dataclass(frozen=True)
class Motor:
    """The output is a DC motor's voltage u: force = force_per_V u - damping eta'.

    With torque constant k, resistance R, back-EMF constant ke and a transmission of i rad per m or rad: force_per_V = k i / R,
    damping = k ke i^2 / R + friction; the inductance is left out. The rotor's inertia is the robot file's `rotor_inertia`.
    """

    force_per_V: float
    damping: float


@dataclass(frozen=True)
class Stepper:
    """The output is a stepper's rate: the pulses' place is its integral, and the joint follows that place.

    `stiffness` [N m/rad or N/m] and `damping` of the magnetic spring between them; without a stiffness the joint is held to the
    pulses, whose rate then changes evenly over a tick. The law counts the pulses (the firmware's `feedback_2` = 0), or with
    `encoder` measures the joint. Lost steps are not in it.
    """

    stiffness: float | None = None
    damping: float = 0.0
    encoder: bool = False


Output = Force | Motor | Stepper


@dataclass(frozen=True)
class PID:
    """One joint's law; gains in units of its output (N, N m, V, rad/s or m/s) per m or rad, s, as the formula in `law.py` says.

    `reference` [m or rad] through a filter of `setpoint_Hz` (0: none), `feedforward` [units of the output], `derivative_Hz`
    (0: none) for the measured velocity. `limit`, `slew` (per second) of the output. `delay_s`, a whole number of ticks, from
    measurement to output. `count`: the encoder's resolution [m or rad], `duty`: that of the output; 0: exact.
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
    limit: float = math.inf
    slew: float = math.inf
    setpoint_Hz: float = 0.0
    derivative_Hz: float = 50.0
    feedforward: Signal | None = None
    delay_s: float = 0.0
    count: float = 0.0
    duty: float = 0.0

    def __post_init__(self) -> None:
        for name in GAINS:
            if not math.isfinite(getattr(self, name)):
                raise InputError("expected a finite gain", key=name, value=getattr(self, name))
        for name in ("setpoint_Hz", "derivative_Hz", "delay_s", "count", "duty"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError("expected a finite number of 0 or more", key=name, value=getattr(self, name))
        for name in ("limit", "slew"):
            if not getattr(self, name) > 0:
                raise InputError("expected a number above 0", key=name, value=getattr(self, name))

    @property
    def prescribed(self) -> bool:
        """Is the joint held to the pulses of its stepper?"""
        return isinstance(self.output, Stepper) and self.output.stiffness is None

    def one_sensor(self, length: float) -> PID:
        """The same law for a strip of that free length [m] whose deflection alone is measured, as on the rig: w'(L) is taken as
        3 w(L) / (2 L), a cantilever's that its tip loads."""
        per_m = 1.5 / length
        return replace(self, kf=self.kf + self.ks * per_m, kg=self.kg + self.kt * per_m, ks=0.0, kt=0.0)

    def spec(self) -> dict[str, Any]:
        """What it is, for a Run's metadata; without what is infinite."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.type == "float"}
        out = {name: value for name, value in plain.items() if math.isfinite(value)}
        out |= {"reference": self.reference.spec, "output": {"kind": type(self.output).__name__.lower(), **asdict(self.output)}}
        return out | ({"feedforward": self.feedforward.spec} if self.feedforward else {})


GAINS = ("kp", "ki", "kd", "kf", "kg", "ks", "kt", "kv", "kc")


@dataclass(frozen=True)
class Linear:
    """A linear law in place of the PID's terms: matrices of `law.Law`, made by `lqr`."""

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

    It measures and computes at t_eval[0] + k / rate_Hz and holds its outputs between. The tip deflection is that of the last
    flexible link, filtered by `deflection_Hz` (0: none), in steps of `deflection_quantum_m` (0: exact).
    """

    joints: tuple[PID | JointDrive, ...]
    rate_Hz: float = 1000.0
    deflection_Hz: float = 50.0
    deflection_quantum_m: float = 0.0
    linear: Linear | None = None

    def __post_init__(self) -> None:
        if not 0 < self.rate_Hz < math.inf:
            raise InputError("expected a rate above 0 in hertz", key="rate_Hz", value=self.rate_Hz)
        for name in ("deflection_Hz", "deflection_quantum_m"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError("expected a finite number of 0 or more", key=name, value=getattr(self, name))
        for i, joint in enumerate(self.joints, 1):
            late = joint.delay_s * self.rate_Hz if isinstance(joint, PID) else 0.0
            if abs(late - round(late)) > 1e-6 or late > 10_000:
                expected = f"expected a whole number of ticks of {1 / self.rate_Hz:g} s, at most 10000"
                raise InputError(expected, key=f"joint {i}: delay_s", value=late / self.rate_Hz)

    @property
    def follows(self) -> np.ndarray:
        """Which joints are held to a motion, (N,) bool."""
        return np.array([joint.prescribed for joint in self.joints]) & (self._open().follows | self._own)

    @property
    def breaks(self) -> np.ndarray:
        """Instants at which what is not sampled isn't smooth [s]."""
        return self._open().breaks

    @property
    def _own(self) -> np.ndarray:
        return np.array([isinstance(joint, PID) for joint in self.joints])

    def _open(self) -> Drive:
        return Drive(tuple(JointDrive() if isinstance(joint, PID) else joint for joint in self.joints))

    def packed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `Drive.packed`: a row of the segments for each force or motion that the law holds, and a motor's zero motion."""
        segments, index, gains = self._open().packed()
        rows = len(segments)
        for i, joint in enumerate(self.joints):
            if not isinstance(joint, PID):
                continue
            force, motion = not isinstance(joint.output, Stepper), not isinstance(joint.output, Force)
            index[i] = rows, rows + force, rows + force, rows + force + motion
            rows += force + motion
            if isinstance(joint.output, Motor):
                gains[i, 1] = joint.output.damping
            elif isinstance(joint.output, Stepper):
                gains[i] = joint.output.stiffness or 0.0, joint.output.damping
        return np.vstack([segments, np.zeros((rows - len(segments), signal.COLUMNS))]), index, gains

    def law(self, system: System, index: np.ndarray, start: float, ticks: int) -> Law:
        """The compiled loop's part: `index` (N, 4) of `packed`, the time of the first tick, and how many ticks to log."""
        N, count, c = len(self.joints), 0, system.chain
        kind, ranges, parts = np.zeros(N, np.int64), np.zeros((N, 4), np.int64), [np.zeros((0, signal.COLUMNS))]
        gains, rows = np.zeros((N, 20)), np.full((N, 2), -1, np.int64)
        for i, joint in enumerate(self.joints):
            if not isinstance(joint, PID):
                continue
            kind[i] = law.STEPPER if isinstance(joint.output, Stepper) else law.EFFORT
            rows[i] = index[i, 0] if index[i, 1] > index[i, 0] else -1, index[i, 2] if index[i, 3] > index[i, 2] else -1
            for k, wave in enumerate((joint.reference, joint.feedforward)):
                own = 0 if wave is None else len(wave.segments)
                ranges[i, 2 * k], ranges[i, 2 * k + 1] = count, count + own
                count += own
                parts += [] if wave is None else [wave.segments]
            gains[i] = self._gains(joint)
        flexible = [i for i, link in enumerate(system.robot.links) if link.flexible]
        look, sleeve = np.zeros((2, system.n)), -1
        for i in flexible[-1:]:
            first, m = int(c.first[i]) + 1, len(system.links[i].S0)
            look[:, first : first + m] = c.NL[i, :m], c.SL[i, :m]
            sleeve = int(c.first[i]) if system.robot.links[i].joint.type == "Pb" else -1
        linear = Linear(*[np.zeros((0, 0))] * 7, *[np.zeros(0)] * 2) if self.linear is None else self.linear  # type: ignore[call-arg]
        late = int(gains[:, law.DELAY].max(initial=0)) + 1
        return Law(
            rate_Hz=float(self.rate_Hz), start=float(start), kind=kind, gains=gains, rows=rows,
            segments=np.ascontiguousarray(np.concatenate(parts)), ranges=ranges, first=c.first[:-1].copy(), look=look,
            sleeve=sleeve, quantum=float(self.deflection_quantum_m),
            **{f.name: np.array(getattr(linear, f.name), dtype=float, order="C") for f in fields(Linear)},
            z=np.zeros((2, len(linear.F))), y=np.zeros(len(linear.offset)), memory=np.zeros((N, 9)), sensor=np.zeros(7),
            ring=np.zeros((N, late)), log=np.zeros((ticks, N, law.LOGGED)),
        )  # fmt: skip

    def _gains(self, joint: PID) -> np.ndarray:
        """Row of `Law.gains`."""
        g = np.zeros(20)
        g[: law.LIMIT] = [getattr(joint, name) for name in GAINS]
        g[law.LIMIT], g[law.SLEW] = joint.limit, joint.slew
        g[law.FORCE] = joint.output.force_per_V if isinstance(joint.output, Motor) else 1.0
        g[law.SETPOINT] = smoothing(joint.setpoint_Hz, 1 / self.rate_Hz)
        g[law.DERIVATIVE] = smoothing(joint.derivative_Hz, 1 / self.rate_Hz)
        g[law.DEFLECTION] = smoothing(self.deflection_Hz, 2 / self.rate_Hz)
        g[law.COUNT], g[law.DUTY], g[law.DELAY] = joint.count, joint.duty, round(joint.delay_s * self.rate_Hz)
        g[law.RIGID] = joint.prescribed
        g[law.ENCODER] = isinstance(joint.output, Stepper) and joint.output.encoder
        return g

    def channels(self, d: Law, t: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, str]]:
        """The law's own channels at t (T,) from its log, and their units without those of the joints' positions ("")."""
        k, s = logged(d, t)
        out: dict[str, np.ndarray] = {}
        units: dict[str, str] = {}
        for i, joint in enumerate(self.joints):
            if isinstance(joint, PID):
                row = d.log[k, i]
                out[f"joint/{i + 1}/reference"], units[f"joint/{i + 1}/reference"] = row[:, 0], ""
                if isinstance(joint.output, Motor):
                    out[f"joint/{i + 1}/voltage"], units[f"joint/{i + 1}/voltage"] = row[:, 1], "V"
                elif isinstance(joint.output, Stepper):
                    place = row[:, 2] + s * (row[:, 3] + s * row[:, 4])
                    out[f"joint/{i + 1}/pulses"], units[f"joint/{i + 1}/pulses"] = place, ""
        return out, units

    def spec(self) -> dict[str, Any]:
        """What it is, for a Run's metadata."""
        own = {"rate_Hz": self.rate_Hz, "deflection_Hz": self.deflection_Hz, "deflection_quantum_m": self.deflection_quantum_m}
        return own | {"law": "PID" if self.linear is None else "linear", "joint": [joint.spec() for joint in self.joints]}


def smoothing(frequency_Hz: float, period_s: float) -> float:
    """a of y += a (x - y): 1 - exp(-2 pi f T); 1, no filter, for f = 0."""
    return 1.0 if frequency_Hz == 0 else -math.expm1(-2 * math.pi * frequency_Hz * period_s)


def logged(d: Law, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ticks (T,) whose outputs hold at t, and the times since them [s]."""
    done = max(1, min(int(d.sensor[law.TICK]), len(d.log)))
    k = np.clip(np.floor((t - d.start) * d.rate_Hz + 1e-6).astype(int), 0, done - 1)
    return k, np.maximum(t - (d.start + k / d.rate_Hz), 0.0)


def replay(d: Law, segments: np.ndarray, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Segments and index (N, 4) that hold, one after another, what the law held in a run: an open-loop copy of its outputs."""
    index, parts, count = index.copy(), [segments], len(segments)
    done = min(int(d.sensor[law.TICK]), len(d.log))
    start = d.start + np.arange(done) / d.rate_Hz
    for i in np.flatnonzero(d.kind != law.NONE):
        rows = np.zeros((done, signal.COLUMNS))
        rows[:, 0], rows[:, 1:4] = start, d.log[:done, i, 2:5]
        at = 0 if d.kind[i] == law.EFFORT else 2
        index[i, at : at + 2] = count, count + done
        parts.append(rows)
        count += done
    return np.ascontiguousarray(np.concatenate(parts)), index


def gravity(system: System, motions: Sequence[Signal], t_s: Any) -> list[Signal]:
    """Feedforwards that hold each joint against gravity along its motion, links straight: tables over t_s (T,) [N or N m]."""
    times = np.asarray(t_s, dtype=float)
    rows, held = system.joint_rows, np.zeros((len(times), len(motions)))
    for k, t in enumerate(times):
        q = np.zeros(system.n)
        q[rows] = [motion(t)[0] for motion in motions]
        held[k] = system.gravity(q)[rows]
    return [signal.table(times, column) for column in held.T]


def inverse_dynamics(system: System, motions: Sequence[Signal], t_s: Any, rtol: float = 1e-7) -> list[Signal]:
    """Feedforwards that the motions take, the links' bending included: tables over t_s (T,) of `fx.inverse` [N or N m]."""
    from .forward import inverse

    run = inverse(system, t_s, motions, rtol=rtol)
    return [signal.table(run.t, run[f"joint/{i}/drive"]) for i in range(1, len(motions) + 1)]
