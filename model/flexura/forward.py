"""Forward dynamics: drives in, motion out, to a tolerance."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import loop, nodal
from .chain import Work
from .choice import choose, longest_step
from .drive import Drive
from .errors import FlexuraError, InputError
from .kernel import accelerate
from .record import limit_event, record
from .run import Run
from .signal import Signal
from .system import System

if TYPE_CHECKING:
    from .batch import Batch
    from .population import Population

METHODS = {"explicit": loop.EXPLICIT, "implicit": loop.IMPLICIT}
_STEPS_A_CALL = 400  # between two looks at the progress bar and the keyboard


@overload
def simulate(
    system: System,
    t_eval: Any,
    drive: Drive | Callable[..., Any] | None = None,
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
    drive: Drive | Callable[..., Any] | None = None,
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    progress: Callable[[float], None] | None = None,
    **population: Any,
) -> Run | Population:
    """Integrate the equations of motion from t_eval[0] on; the Run has its channels at t_eval (T,), ascending [s].

    `drive`: a Drive (compiled), or a function (t) -> (N,) or (t, position, velocity, tip_deflection) -> (N,) of forces and
    torques [N or N m] (slower, by scipy). `q0`, `qd0` (n,): state at the start, by default `system.start()` at
    rest. `rtol`: largest local error relative to the largest value so far. `method`: "explicit", "implicit" or "auto".
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
    if not isinstance(drive, Drive):
        drive = as_function(drive)
    q, qd = initial(system, t[0], drive, q0, qd0)
    if system.robot.nodal:
        return nodal.simulate(simulate, system, t, drive, q, qd, rtol, method, progress)
    state = to_state(system, q, qd)
    chosen = choose(system, t[-1] - t[0], rtol) if method == "auto" else METHODS[method]
    if isinstance(drive, Drive):
        t, states, work, meta = _compiled(system, t, drive, state, rtol, chosen, progress)
    else:
        t, states, work, meta = _python(system, t, drive, state, rtol, chosen, progress)
    meta |= {"rtol": rtol, "method": "explicit" if chosen == loop.EXPLICIT else "implicit"}
    return record(system, t, states, work, applied(system, t, states, drive), meta)


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
        raise InputError('expected "auto", "explicit" or "implicit"', key="method", value=method)
    return t


def initial(system: System, t: float, drive: Any, q0: Any, qd0: Any) -> tuple[np.ndarray, np.ndarray]:
    """q and qd (n,) at the start t [s]: as given, locked joints at rest, prescribed ones on their motion. Raises InputError for
    wrong shapes, a drive of another number of joints, and a joint outside its limits."""
    q, qd = _state(system, "q0", q0, system.start()), _state(system, "qd0", qd0, np.zeros(system.n))
    qd[system.joint_rows[system.chain.locked.astype(bool)]] = 0.0
    if isinstance(drive, Drive):
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


def begin(
    system: System, t: np.ndarray, drive: Drive, state: np.ndarray, method: int
) -> tuple[Work, loop.Inputs, loop.Memory, np.ndarray]:
    """A run about to be advanced from state (2n + 2,): workspace, inputs, memory, and its output (T, 2n + 2)."""
    inputs, m, w = _inputs(system, drive), loop.memory(len(system.robot.links), system.n), _following(system, drive)
    out = np.zeros((len(t), len(state)))
    m.z[:], out[0] = state, state
    m.s[loop.T], m.s[loop.OUT], m.s[loop.ERR] = t[0], 1, 1.0
    longest = longest_step(system) if method == loop.EXPLICIT else np.inf
    m.s[loop.LONGEST], m.s[loop.H] = longest, min(0.02 * longest, (t[-1] - t[0]) * 1e-4)
    return w, inputs, m, out


def _compiled(
    system: System,
    t: np.ndarray,
    drive: Drive,
    state: np.ndarray,
    rtol: float,
    method: int,
    progress: Callable[[float], None] | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
    """Times, states (T, 2n), work and loss (T, 2), and what the Run's metadata says of the solution."""
    c, n = system.chain, system.n
    w, inputs, m, out = begin(system, t, drive, state, method)
    events: list[dict[str, Any]] = []
    complete = len(t) == 1
    loop.advance(c, w, inputs, m, method, rtol, t, out, 0)  # no step: compile before the clock starts
    begun = time.perf_counter()
    try:
        while not complete:
            loop.advance(c, w, inputs, m, method, rtol, t, out, _STEPS_A_CALL)
            status = int(m.s[loop.STATUS])
            if progress is not None:
                progress((m.s[loop.T] - t[0]) / (t[-1] - t[0]))
            if status == loop.STUCK:
                raise FlexuraError(
                    f"the simulation got no further than t = {m.s[loop.T]:.6g} s with rtol = {rtol:g}: a link is bent "
                    "to a right angle, or a gain or force is too large"
                )
            if status == loop.LIMIT:
                joint, at, row = int(m.s[loop.FAULT]), float(m.s[loop.T]), int(m.s[loop.OUT])
                events.append(limit_event(system, joint, at, m.z[system.joint_rows]))
                if at > t[row - 1]:  # the last good state
                    t, out[row] = np.append(t[:row], at), m.z
                    m.s[loop.OUT] += 1
                break
            complete = status == loop.DONE
    except KeyboardInterrupt:
        events.append({"t": float(m.s[loop.T]), "level": "WARN", "text": "interrupted"})
    rows = int(m.s[loop.OUT])
    counts: dict[str, Any] = {
        name: int(m.s[k]) for name, k in (("steps", loop.STEPS), ("rejected", loop.REJECTED), ("evaluations", loop.EVALS))
    }
    counts["wall_s"] = time.perf_counter() - begun
    about = counts | {"complete": complete, "events": events, "drive": [j.spec() for j in drive.joints]}
    return t[:rows], out[:rows, : 2 * n], out[:rows, 2 * n :], about


def _inputs(system: System, drive: Drive) -> loop.Inputs:
    segments, ranges, gains = drive.packed()
    limits = _slack(system)
    follows = drive.follows.astype(np.int64)
    return loop.Inputs(
        segments, ranges, gains[:, 0].copy(), gains[:, 1].copy(), follows, limits[:, 0].copy(), limits[:, 1].copy(), drive.breaks
    )


def _slack(system: System) -> np.ndarray:
    """The joints' limits (N, 2), a billionth wider: a motion may end on one, and does so up to round-off."""
    return system.limits + [-1e-9, 1e-9] * np.maximum(1.0, np.abs(np.where(np.isfinite(system.limits), system.limits, 0.0)))


def _following(system: System, drive: Drive) -> Work:
    """A workspace in which the joints with a prescribed motion are held to it."""
    w = system._work()
    w.held[:] |= drive.follows
    return w


def _python(
    system: System,
    t: np.ndarray,
    drive: Callable[..., Any],
    state: np.ndarray,
    rtol: float,
    method: int,
    progress: Callable[[float], None] | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
    """The same equations under a Python function, by scipy: 100 times slower than a Drive, and as exact."""
    from scipy.integrate import DOP853, Radau

    c, n, links = system.chain, system.n, len(system.robot.links)
    w, zero, a = system._work(), np.zeros(links), np.zeros(n)
    begun = time.perf_counter()

    def slope(time_s: float, z: np.ndarray) -> np.ndarray:
        y, v = z[:n], z[n : 2 * n]
        force = _forces(system, drive, time_s, y, v)
        accelerate(c, w, y, v, y, v, 0.0, force, zero, zero, a)
        dz = np.concatenate([v, a, [0.0, 0.0]])
        loop._powers(c, w, v, force, dz)
        return dz

    solver = (DOP853 if method == loop.EXPLICIT else Radau)(
        slope, t[0], state, t[-1], rtol=max(rtol, 3e-14), atol=rtol * loop.FLOOR
    )
    events: list[dict[str, Any]] = []
    out = [state]
    inputs = _inputs(system, Drive.none(links))

    def beyond(z: np.ndarray) -> bool:
        return bool(loop.outside(c, inputs, z) >= 0)

    def stop(late: float) -> None:
        """Note the event, which is before `late` [s], and keep the last good state."""
        at, after = _crossing(lambda time_s: beyond(dense(time_s)), solver.t_old, late)
        joint = int(loop.outside(c, inputs, dense(after)))
        events.append(limit_event(system, joint, at, dense(at)[system.joint_rows]))
        if at > times[-1]:
            times.append(at)
            out.append(dense(at))

    times = [float(t[0])]
    steps = 0
    try:
        while len(out) < len(t) and not events:
            message = solver.step()
            if solver.status == "failed":
                raise FlexuraError(f"the simulation got no further than t = {solver.t:.6g} s: {message}")
            steps += 1
            dense = solver.dense_output()
            while len(out) < len(t) and t[len(out)] <= solver.t and not events:
                z = dense(t[len(out)])
                if beyond(z):
                    stop(t[len(out)])
                else:
                    times.append(float(t[len(out)]))
                    out.append(z)
            if not events and beyond(dense(solver.t)):
                stop(solver.t)
            if progress is not None:
                progress((solver.t - t[0]) / (t[-1] - t[0]))
    except KeyboardInterrupt:
        events.append({"t": float(solver.t), "level": "WARN", "text": "interrupted"})
    z = np.array(out)
    meta = {
        "steps": steps,
        "evaluations": solver.nfev,
        "wall_s": time.perf_counter() - begun,
        "events": events,
        "drive": "Python function",
    }
    complete = not events and len(out) == len(t)
    return np.array(times), z[:, : 2 * n], z[:, 2 * n :], meta | {"complete": complete}


def _crossing(beyond: Callable[[float], bool], before: float, after: float) -> tuple[float, float]:
    """The last time before `beyond` and the first at which it is so [s], by bisection between two such times."""
    for _ in range(60):
        middle = (before + after) / 2
        before, after = (before, middle) if beyond(middle) else (middle, after)
    return before, after


def as_function(drive: Callable[..., Any]) -> Callable[[float, np.ndarray, np.ndarray, float], np.ndarray]:
    """A drive function of (t) or (t, position, velocity, tip_deflection) as one of four arguments."""
    try:
        count = len(inspect.signature(drive).parameters)
    except (TypeError, ValueError):
        count = 0
    if count not in (1, 4):
        raise InputError("expected a function of (t) or of (t, position, velocity, tip_deflection)", key="drive", value=drive)
    return drive if count == 4 else lambda t, position, velocity, tip_deflection: drive(t)


def _forces(system: System, call: Callable[..., Any], t: float, y: np.ndarray, v: np.ndarray) -> np.ndarray:
    rows = system.joint_rows
    own = slice(rows[-1] + 1, system.n)
    force = np.asarray(call(t, y[rows], v[rows], float(system.links[-1].NL @ y[own])), dtype=float)
    if force.shape != rows.shape or not np.all(np.isfinite(force)):
        raise InputError(f"expected {len(rows)} finite forces from the drive function at t = {t:g} s", key="drive", value=force)
    return force


def applied(system: System, t: np.ndarray, states: np.ndarray, drive: Any) -> np.ndarray:
    """Drive forces (T, N) [N or N m] at states (T, 2n), whose prescribed joints are put on their motion."""
    n, rows = system.n, system.joint_rows
    if isinstance(drive, Drive):
        out = np.zeros((len(t), len(rows)))
        loop.forces(system.chain, _following(system, drive), _inputs(system, drive), loop.memory(len(rows), n), t, states, out)
    else:
        out = np.array([_forces(system, drive, s, z[:n], z[n:]) for s, z in zip(t, states, strict=True)])
    return out.reshape(len(t), len(rows))


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


def _put_on_motions(system: System, drive: Drive, t: float, q: np.ndarray, qd: np.ndarray) -> None:
    for joint, row in zip(drive.joints, system.joint_rows, strict=True):
        if joint.prescribed and joint.motion is not None:
            q[row], qd[row], _ = joint.motion(t)


def _inside_limits(system: System, q: np.ndarray) -> None:
    for i, (link, row) in enumerate(zip(system.robot.links, system.joint_rows, strict=True), 1):
        if link.joint.limits is not None and not link.joint.limits[0] <= q[row] <= link.joint.limits[1]:
            raise InputError(
                f"expected a start inside the limits of joint {i}, {list(link.joint.limits)}", key="q0", value=float(q[row])
            )
