"""Joint 2 in the stepper's field, whose torque is a sine of the angle, by a solver whose drives are
straight springs.

    T(e, theta) = T_h sin(N e) - T_d sin(4 N theta) = k e + [T(e, theta) - k e],    e = r - theta

with r the angle of the pulses, T_h the holding and T_d the detent torque, N the pole pairs. It is
no prescribed motion: N T_h = 20 N m/rad and the strip's 3e-3 kg m^2 make 12 Hz, too near the
strip's own 5 Hz for a clamp. The bracket is a torque over time, known from the simulations before
(waveform relaxation, Lelarasmee 1982, mixed by Anderson's method), with the k that leaves least of
it: repeated until the torque that was assumed is the field's. Where the field lets go of the rotor
(steps are lost) that ends nowhere, and a Python function takes over.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura.errors import FlexuraError
from flexura.signals import JointDrive, Signal, table

from ...rig.plant.stepper import MagneticSpring

Start = tuple[fx.System, np.ndarray]  # and its state at the start (n,)

ROUNDS = 40
SETTLED, DEPTH = 3, 6  # rounds until k stays as it is; assumptions that the next one is made of
STILL = 5e-4  # of the holding torque: what the assumed torque may differ by from the field's
FINE_S = 1e-3  # between two values of the bracket: the detent's period is 10 ms at 3 rad/s


@dataclass
class Guess:
    """What a relaxation came to, for the next one of nearly the same robot: k [N m/rad], the
    bracket [N m] or None."""

    stiffness_N_m: float
    torque_N_m: np.ndarray | None = None


def held_by_field(
    start: Start,
    t: np.ndarray,
    carriage: Signal | JointDrive,
    pulses: Signal,
    spring: MagneticSpring,
    rtol: float,
    progress: Callable[[float], None] | None = None,
    guess: Guess | None = None,
    fine_s: float = FINE_S,
    method: str = "auto",
    still: float = STILL,
) -> fx.Run:
    """Simulate with the force on joint 1 [N], or its drive, and the pulses [rad] given to joint 2.

    The Run's meta has `relaxation_rounds`, None where the torque had to be a Python function.
    `guess` is begun with and left at what was found. Where steps are lost joint 1 goes by its force
    alone; raises FlexuraError where it has none.
    """
    system, q0 = start
    report = progress or (lambda fraction: None)
    parts = max(1, int(np.ceil(np.median(np.diff(t)) / fine_s - 1e-6)))
    fine = np.interp(np.arange((len(t) - 1) * parts + 1) / parts, np.arange(len(t)), t)
    asked = np.array([pulses(at)[0] for at in fine])
    first = carriage if isinstance(carriage, JointDrive) else JointDrive(force=carriage)
    known = guess if guess is not None else Guess(spring.on_N_m)
    k, assumed = known.stiffness_N_m, np.zeros(len(fine))  # [N m/rad], [N m]
    if known.torque_N_m is not None and len(known.torque_N_m) >= len(fine):
        assumed[:] = known.torque_N_m[: len(fine)]
    extra = table(fine, assumed) if assumed.any() else None
    history: list[
        tuple[np.ndarray, np.ndarray]
    ] = []  # (what was assumed, what came of it less that)
    for n in range(1, ROUNDS + 1):
        held = JointDrive(force=extra, motion=pulses, kp=k)
        try:
            run = fx.simulate(
                system, fine, fx.Drive((first, held)), q0=q0, rtol=rtol, method=method
            )
        except FlexuraError:  # what was assumed has grown beyond all bounds
            break
        m = (
            len(run) if run.complete else len(run) - 1
        )  # the last row of a run that a limit ended is at that instant
        theta = run["joint/2/position"][:m]
        e, torque = asked[:m] - theta, spring.torques(asked[:m], theta)
        left = np.abs(k * e + assumed[:m] - torque).max(initial=0.0) / spring.holding_N_m
        report(1 - 1 / (n + 1))
        if left < still:
            known.stiffness_N_m, known.torque_N_m = k, assumed
            run.meta["relaxation_rounds"] = n
            return _thinned(run, parts)
        if n <= SETTLED and known.torque_N_m is None:
            k = float(np.clip(e @ torque / (e @ e), 0.05 * spring.on_N_m, spring.on_N_m))
            assumed[:m] = torque - k * e
        else:
            came = assumed.copy()
            came[:m] = torque - k * e
            history.append((assumed.copy(), came - assumed))
            assumed = _ahead(history[-DEPTH:])
        extra = table(fine, assumed)
    if first.force is None:
        raise FlexuraError(
            "the stepper loses steps in this simulation: no torque of its field is consistent with "
            "its motion"
        )
    return _by_function(start, t, first.force, pulses, spring, rtol, progress)


def _ahead(history: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """The next assumption by Anderson's method (J. ACM 12 (1965) 547): where the mix of those
    before would leave least."""
    x, f = (np.array(column) for column in zip(*history, strict=True))
    if len(x) == 1:
        return x[0] + f[0]
    dx, df = np.diff(x, axis=0), np.diff(f, axis=0)
    mix, *_ = np.linalg.lstsq(df.T, f[-1], rcond=1e-8)
    return x[-1] + f[-1] - mix @ (dx + df)


def _by_function(
    start: Start,
    t: np.ndarray,
    force: Signal,
    pulses: Signal,
    spring: MagneticSpring,
    rtol: float,
    progress: Callable[[float], None] | None,
) -> fx.Run:
    """The same, the torque evaluated at every instant: slower, and without a limit to where the
    rotor may go."""

    def drive(at: float, position: np.ndarray, velocity: np.ndarray, tip: float) -> list[float]:
        return [force(at)[0], spring.torque(pulses(at)[0], float(position[1]), on=True)]

    system, q0 = start
    run = fx.simulate(system, t, drive, q0=q0, rtol=rtol, progress=progress)
    run.meta["relaxation_rounds"] = None
    return run


def _thinned(run: fx.Run, parts: int) -> fx.Run:
    """Every parts-th row of a run."""
    states = None if run.states is None else run.states[::parts]
    return dataclasses.replace(
        run,
        t=run.t[::parts],
        channels={n: v[::parts] for n, v in run.channels.items()},
        states=states,
    )
