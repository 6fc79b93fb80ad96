"""Joint 2 on the stepper's magnetic spring, by a solver whose drives are linear springs.

    T(e, theta) = T_h sin(N e) - T_d sin(4 N theta) = k e + [T(e, theta) - k e],    e = r - theta

r is the angle of the pulses, T_h the holding and T_d the detent torque, N the pole pairs. The joint
cannot be prescribed: N T_h = 20 N m/rad and the strip's 3e-3 kg m^2 give 12 Hz, near the strip's
own 5 Hz.

The bracket is a torque over time, taken from earlier simulations (waveform relaxation, Lelarasmee
1982), mixed by Anderson's method. k is chosen so that the bracket is small. The rounds end when the
assumed torque is that of the spring. If the stepper loses steps they do not converge; a Python
function then gives the torque.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura.errors import FlexuraError, OutOfMemory
from flexura.signals import JointDrive, Signal, table

from ...rig.plant.stepper import MagneticSpring

StartState = tuple[fx.System, np.ndarray]  # and its state at the start (n,)

MAX_ROUNDS = 40
# rounds in which k changes; assumed torques from which the next one is made
STIFFNESS_ROUNDS, ANDERSON_DEPTH = 3, 6
# rounds without progress after which what is left is the integrator's own error, if it is so small
# a multiple of the tolerance, or of what the integrator may be wrong by
STALLED, PROGRESS, FLOOR, OF_RTOL = 6, 0.8, 4.0, 0.5
TORQUE_TOLERANCE = (
    5e-4  # of the holding torque: what the assumed torque may differ by from the field's
)
TORQUE_STEP_S = 1e-3  # between two values of the bracket: the detent's period is 10 ms at 3 rad/s


@dataclass
class RelaxationState:
    """Result of a relaxation, start of the next one for nearly the same robot.

    `stiffness_N_m`: k [N m/rad]. `torque_N_m`: the bracket (T,) [N m], or None.
    """

    stiffness_N_m: float
    torque_N_m: np.ndarray | None = None


def simulate_with_stepper(
    start: StartState,
    t: np.ndarray,
    carriage: Signal | JointDrive,
    pulses: Signal,
    spring: MagneticSpring,
    rtol: float,
    progress: Callable[[float], None] | None = None,
    state: RelaxationState | None = None,
    torque_step_s: float = TORQUE_STEP_S,
    method: str = "auto",
    tolerance: float = TORQUE_TOLERANCE,
) -> fx.Run:
    """Simulate with joint 2 on the stepper's magnetic spring.

    Args:
        start: the system, and its state at the start (n,).
        t: output times (T,) [s].
        carriage: the force on joint 1 [N], or its drive.
        pulses: the angle of the stepper's pulses [rad].
        spring: the stepper's magnetic spring.
        rtol: tolerance of each simulation.
        progress: called with the finished fraction.
        state: start of the relaxation; it is set to the result.
        torque_step_s: longest time between two values of the bracket [s].
        method: a method of `fx.simulate`.
        tolerance: largest error of the assumed torque, relative to the holding torque.

    Returns:
        The run; `meta["relaxation_rounds"]` is None if a Python function gave the torque. In that
            case only joint 1's force acts.

    Raises:
        FlexuraError: steps are lost, and joint 1 has no force.
    """
    system, q0 = start
    report = progress or (lambda fraction: None)
    parts = max(1, int(np.ceil(np.median(np.diff(t)) / torque_step_s - 1e-6)))
    fine = np.interp(np.arange((len(t) - 1) * parts + 1) / parts, np.arange(len(t)), t)
    command = np.array([pulses(at)[0] for at in fine])
    carriage_drive = carriage if isinstance(carriage, JointDrive) else JointDrive(force=carriage)
    relaxed = state if state is not None else RelaxationState(spring.on_N_m)
    k, assumed = relaxed.stiffness_N_m, np.zeros(len(fine))  # [N m/rad], [N m]
    if relaxed.torque_N_m is not None and len(relaxed.torque_N_m) >= len(fine):
        assumed[:] = relaxed.torque_N_m[: len(fine)]
    correction = table(fine, assumed) if assumed.any() else None
    history: list[
        tuple[np.ndarray, np.ndarray]
    ] = []  # (what was assumed, what came of it less that)
    best = mark = np.inf
    since, nearest, found = 0, None, (k, assumed)
    for n in range(1, MAX_ROUNDS + 1):
        stepper_drive = JointDrive(force=correction, motion=pulses, kp=k)
        try:
            run = fx.simulate(
                system,
                fine,
                fx.Drive((carriage_drive, stepper_drive)),
                q0=q0,
                rtol=rtol,
                method=method,
            ).uninterrupted()
        except OutOfMemory:
            raise
        except FlexuraError:  # what was assumed has grown beyond all bounds
            break
        # the last row of an incomplete run is at the instant of its end
        m = len(run) if run.complete else len(run) - 1
        theta = run["joint/2/position"][:m]
        e, torque = command[:m] - theta, spring.torques(command[:m], theta)
        residual = np.abs(k * e + assumed[:m] - torque).max(initial=0.0) / spring.holding_N_m
        report(1 - 1 / (n + 1))
        if residual < best:
            best, nearest, found = residual, run, (k, assumed.copy())
        if best < PROGRESS * mark:
            mark, since = best, n
        stalled = n - since >= STALLED and best < max(FLOOR * tolerance, OF_RTOL * rtol)
        if nearest is not None and (best < tolerance or stalled):
            relaxed.stiffness_N_m, relaxed.torque_N_m = found
            nearest.meta["relaxation_rounds"] = n
            return _every_nth_row(nearest, parts)
        if n <= STIFFNESS_ROUNDS and relaxed.torque_N_m is None:
            k = float(np.clip(e @ torque / (e @ e), 0.05 * spring.on_N_m, spring.on_N_m))
            assumed[:m] = torque - k * e
        else:
            updated = assumed.copy()
            updated[:m] = torque - k * e
            history.append((assumed.copy(), updated - assumed))
            assumed = _anderson_step(history[-ANDERSON_DEPTH:])
        correction = table(fine, assumed)
    if carriage_drive.force is None:
        raise FlexuraError(
            "the stepper loses steps in this simulation: no torque of its field is consistent with "
            "its motion"
        )
    return _simulate_with_function(start, t, carriage_drive.force, pulses, spring, rtol, progress)


def _anderson_step(history: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """The next assumed torque by Anderson's method (J. ACM 12 (1965) 547).

    Args:
        history: pairs of assumed torques and their residuals (T,), the oldest first.
    """
    x, f = (np.array(column) for column in zip(*history, strict=True))
    if len(x) == 1:
        return x[0] + f[0]
    dx, df = np.diff(x, axis=0), np.diff(f, axis=0)
    mix, *_ = np.linalg.lstsq(df.T, f[-1], rcond=1e-8)
    return x[-1] + f[-1] - mix @ (dx + df)


def _simulate_with_function(
    start: StartState,
    t: np.ndarray,
    force: Signal,
    pulses: Signal,
    spring: MagneticSpring,
    rtol: float,
    progress: Callable[[float], None] | None,
) -> fx.Run:
    """The same with the torque evaluated at every instant: slower, but steps may be lost."""

    def drive(at: float, position: np.ndarray, velocity: np.ndarray, tip: float) -> list[float]:
        return [force(at)[0], spring.torque(pulses(at)[0], float(position[1]), on=True)]

    system, q0 = start
    run = fx.simulate(system, t, drive, q0=q0, rtol=rtol, progress=progress)
    run.meta["relaxation_rounds"] = None
    return run


def _every_nth_row(run: fx.Run, parts: int) -> fx.Run:
    """Every `parts`-th row of a run."""
    states = None if run.states is None else run.states[::parts]
    return dataclasses.replace(
        run,
        t=run.t[::parts],
        channels={n: v[::parts] for n, v in run.channels.items()},
        states=states,
    )
