"""Forward dynamics: drives in, motion out, to a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import callback, nodal
from .control import PID, Controller
from .course import METHODS, applied, compiled, which
from .drive import Drive
from .errors import InputError
from .record import record
from .run import Run
from .signal import Signal
from .system import System

if TYPE_CHECKING:
    from .batch import Batch
    from .population import Population


@overload
def simulate(
    system: System,
    t_eval: Any,
    drive: Drive | Controller | Callable[..., Any] | None = None,
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    progress: Callable[[float], None] | None = None,
) -> Run: ...
@overload
def simulate(
    system: Batch,
    t_eval: Any,
    drive: Drive | None = None,
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    progress: Callable[[float], None] | None = None,
    **population: Any,
) -> Population: ...
def simulate(
    system: System | Batch,
    t_eval: Any,
    drive: Drive | Controller | Callable[..., Any] | None = None,
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    progress: Callable[[float], None] | None = None,
    **population: Any,
) -> Run | Population:
    """Integrate the equations of motion from t_eval[0] on; the Run has its channels at t_eval (T,), ascending [s].

    `drive`: a Drive or a sampled Controller (compiled), or a function (t) -> (N,) or (t, position, velocity, tip_deflection) ->
    (N,) of forces and torques [N or N m] (slower, by scipy). `q0`, `qd0` (n,): state at the start, by default `system.start()`
    at rest. `rtol`: largest local error relative to the largest value so far. `method`: "explicit" (order 8), "explicit-3",
    "explicit-5" (cheaper where a controller ticks), "implicit", "exponential" or "auto" (`choice.py`).
    `progress` is called with the finished fraction. A joint that reaches a limit of the robot file or the end of its link ends
    the run: the Run holds the states before it and, last, the one at that instant, an event says so and `meta["complete"]` is
    false. A Ctrl-C ends it too. `meta["energy_error"]` is the largest |E - E(0) - work + loss| relative to the largest energy,
    work or loss. A Batch of robots gives a Population; see `population.simulate` for what else that takes. Raises InputError for
    wrong arguments, FlexuraError where the tolerance cannot be kept.
    """
    if not isinstance(system, System):
        from . import population as many

        if not (drive is None or isinstance(drive, Drive)):
            raise InputError("expected a Drive: a population runs in the compiled loop", key="drive", value=drive)
        return many.simulate(system, t_eval, drive, q0, qd0, rtol, method=method, progress=progress, **population)
    if population:
        raise InputError("expected this of a Batch only, not of one System", key=next(iter(population)))
    t = check(t_eval, rtol, method)
    drive = Drive.none(len(system.robot.links)) if drive is None else drive
    if not isinstance(drive, Drive | Controller):
        drive = callback.as_function(drive)
    q, qd = initial(system, t[0], drive, q0, qd0)
    if system.robot.nodal:
        if isinstance(drive, Controller):
            raise InputError('expected a robot with sliding = "continuous" under a Controller', key="sliding", value="nodal")
        return nodal.simulate(simulate, system, t, drive, q, qd, rtol, method, progress)
    state = to_state(system, q, qd)
    chosen = which(system, t, drive, rtol, method)
    about = {"rtol": rtol, "method": next(name for name, value in METHODS.items() if value == chosen)}
    if not isinstance(drive, Drive | Controller):
        t, states, work, meta = callback.integrated(system, t, drive, state, rtol, chosen, progress)
        return record(system, t, states, work, callback.called(system, t, states, drive), meta | about)
    t, states, work, inputs, meta = compiled(system, t, drive, state, rtol, chosen, progress)
    run = record(system, t, states, work, applied(system, t, states, drive, inputs), meta | about)
    if isinstance(drive, Controller):
        channels, units = drive.channels(inputs.law, t)
        units = {name: unit or run.units[f"joint/{name.split('/')[1]}/position"] for name, unit in units.items()}
        run = replace(run, channels=run.channels | channels, units=run.units | units)
    return run


def inverse(
    system: System,
    t_eval: Any,
    motion: Signal | Sequence[Signal],
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Inverse dynamics: joints follow `motion` (one Signal a joint) exactly; the Run has `joint/i/drive`, the forces that this
    takes.

    The elastic unknowns are integrated from q0, qd0 (n,), whose joint entries are replaced by the motion's; nothing is
    approximated by a rigid robot and nothing iterated. Replaying the drives through `simulate` returns the motion. Otherwise as
    `simulate`; raises InputError for a motion whose position or velocity jumps.
    """
    motions = [motion] if isinstance(motion, Signal) else list(motion)
    if len(motions) != len(system.robot.links) or not all(isinstance(m, Signal) for m in motions):
        raise InputError(f"expected {len(system.robot.links)} Signals, one a joint", key="motion", value=len(motions))
    return simulate(system, t_eval, Drive.prescribed(*motions), q0, qd0, rtol, method=method, progress=progress)


def check(t_eval: Any, rtol: float, method: str) -> np.ndarray:
    """The times (T,) of a request whose tolerance and method are good. Raises InputError."""
    t = _times(t_eval)
    if not 1e-13 <= rtol <= 0.1:
        raise InputError("expected a relative tolerance between 1e-13 and 0.1", key="rtol", value=rtol)
    if method not in ("auto", *METHODS):
        raise InputError(f"expected one of auto, {', '.join(METHODS)}", key="method", value=method)
    return t


def initial(system: System, t: float, drive: Any, q0: Any, qd0: Any) -> tuple[np.ndarray, np.ndarray]:
    """q and qd (n,) at the start t [s]: as given, locked joints at rest, prescribed ones on their motion. Raises InputError for
    wrong shapes, a drive of another number of joints, and a joint outside its limits."""
    q, qd = _state(system, "q0", q0, system.start()), _state(system, "qd0", qd0, np.zeros(system.n))
    qd[system.joint_rows[system.chain.locked.astype(bool)]] = 0.0
    if isinstance(drive, Drive | Controller):
        if len(drive.joints) != len(system.robot.links):
            raise InputError(
                f"expected {len(system.robot.links)} joint drives, one a joint", key="drive", value=len(drive.joints)
            )
        _put_on_motions(system, drive, t, q, qd)
    _inside_limits(system, q)
    return q, qd


def to_state(system: System, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """The loop's state (2n + 2,) at q and qd (n,): both in the solver's coordinates, no work done yet."""
    return np.concatenate([system.to_solver @ q, system.to_solver @ qd, [0.0, 0.0]])


def _times(t_eval: Any) -> np.ndarray:
    t = np.asarray(t_eval, dtype=float)
    if t.ndim != 1 or len(t) < 1 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0):
        raise InputError("expected ascending finite times in seconds, one or more", key="t_eval", value=t_eval)
    return t


def _state(system: System, key: str, value: Any, default: np.ndarray) -> np.ndarray:
    if value is None:
        return default
    array = np.array(value, dtype=float)
    if array.shape != (system.n,) or not np.all(np.isfinite(array)):
        raise InputError(f"expected {system.n} finite numbers, in the order of system.labels", key=key, value=value)
    return array


def _put_on_motions(system: System, drive: Drive | Controller, t: float, q: np.ndarray, qd: np.ndarray) -> None:
    for joint, row in zip(drive.joints, system.joint_rows, strict=True):
        if isinstance(joint, PID):
            qd[row] = 0.0 if joint.prescribed else qd[row]
        elif joint.prescribed and joint.motion is not None:
            q[row], qd[row], _ = joint.motion(t)


def _inside_limits(system: System, q: np.ndarray) -> None:
    for i, (link, row) in enumerate(zip(system.robot.links, system.joint_rows, strict=True), 1):
        if link.joint.limits is not None and not link.joint.limits[0] <= q[row] <= link.joint.limits[1]:
            raise InputError(
                f"expected a start inside the limits of joint {i}, {list(link.joint.limits)}", key="q0", value=float(q[row])
            )
