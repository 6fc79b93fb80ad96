"""Forward dynamics: drives in, motion out, to a tolerance."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from . import loop
from .chain import Work
from .choice import choose, longest_step
from .drive import Drive
from .errors import FlexuraError, InputError
from .kernel import accelerate
from .record import record
from .run import Run
from .signal import Signal
from .system import System

_METHODS = {"explicit": loop.EXPLICIT, "implicit": loop.IMPLICIT}
_STEPS_A_CALL = 400  # between two looks at the progress bar and the keyboard


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
) -> Run:
    """Integrate the equations of motion from t_eval[0] on; the Run has its channels at t_eval (T,), ascending [s].

    `drive`: a Drive (compiled), or a function (t) -> (N,) or (t, position, velocity, tip_deflection) -> (N,) of forces and
    torques [N or N m] (slower, by scipy). `q0`, `qd0` (n,): state at the start, by default `system.start()` at
    rest. `rtol`: largest local error relative to the largest value so far. `method`: "explicit", "implicit" or "auto".
    `progress` is called with the finished fraction. A joint that reaches a limit of the robot file ends the run: the Run holds
    the states before it, an event says so and `meta["complete"]` is false; so it is after a Ctrl-C. `meta["energy_error"]` is
    the largest |E - E(0) - work + loss| relative to the largest energy, work or loss. Raises InputError for wrong arguments,
    FlexuraError where the tolerance cannot be kept.
    """
    t = _times(t_eval)
    if not 1e-13 <= rtol <= 0.1:
        raise InputError("expected a relative tolerance between 1e-13 and 0.1", key="rtol", value=rtol)
    if method not in ("auto", *_METHODS):
        raise InputError('expected "auto", "explicit" or "implicit"', key="method", value=method)
    state = np.concatenate(
        [
            system.to_solver @ _state(system, "q0", q0, system.start()),
            system.to_solver @ _state(system, "qd0", qd0, np.zeros(system.n)),
            [0.0, 0.0],
        ]
    )
    state[system.n + system.joint_rows[system.chain.locked.astype(bool)]] = 0.0
    if isinstance(drive, Drive):
        _put_on_motions(system, drive, t[0], state)
    _inside_limits(system, state)
    drive = Drive.none(len(system.robot.links)) if drive is None else drive
    chosen = choose(system, t[-1] - t[0], rtol) if method == "auto" else _METHODS[method]
    if isinstance(drive, Drive):
        if len(drive.joints) != len(system.robot.links):
            raise InputError(
                f"expected {len(system.robot.links)} joint drives, one a joint", key="drive", value=len(drive.joints)
            )
        states, work, meta = _compiled(system, t, drive, state, rtol, chosen, progress)
    else:
        states, work, meta = _python(system, t, drive, state, rtol, chosen, progress)
    meta |= {"rtol": rtol, "method": "explicit" if chosen == loop.EXPLICIT else "implicit"}
    t = t[: len(states)]
    return record(system, t, states, work, _applied(system, t, states, drive), meta)


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


def _compiled(
    system: System,
    t: np.ndarray,
    drive: Drive,
    state: np.ndarray,
    rtol: float,
    method: int,
    progress: Callable[[float], None] | None,
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    c, n, links = system.chain, system.n, len(system.robot.links)
    inputs, m, w = _inputs(system, drive), loop.memory(links, n), _following(system, drive)
    out = np.zeros((len(t), 2 * n + 2))
    m.z[:], out[0] = state, state
    m.s[loop.T], m.s[loop.OUT], m.s[loop.ERR] = t[0], 1, 1.0
    longest = longest_step(system) if method == loop.EXPLICIT else np.inf
    m.s[loop.LONGEST], m.s[loop.H] = longest, min(0.02 * longest, (t[-1] - t[0]) * 1e-4)
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
                events.append(_limit_event(system, int(m.s[loop.FAULT]), float(m.s[loop.T])))
                break
            complete = status == loop.DONE
    except KeyboardInterrupt:
        events.append({"t": float(m.s[loop.T]), "level": "WARN", "text": "interrupted"})
    rows = int(m.s[loop.OUT])
    counts: dict[str, Any] = {
        name: int(m.s[k]) for name, k in (("steps", loop.STEPS), ("rejected", loop.REJECTED), ("evaluations", loop.EVALS))
    }
    counts["wall_s"] = time.perf_counter() - begun
    return (
        out[:rows, : 2 * n],
        out[:rows, 2 * n :],
        counts | {"complete": complete, "events": events, "drive": [j.spec() for j in drive.joints]},
    )


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
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """The same equations under a Python function, by scipy: 100 times slower than a Drive, and as exact."""
    from scipy.integrate import DOP853, Radau

    c, n, links = system.chain, system.n, len(system.robot.links)
    w, zero, a = system._work(), np.zeros(links), np.zeros(n)
    call = as_function(drive)
    begun = time.perf_counter()

    def slope(time_s: float, z: np.ndarray) -> np.ndarray:
        y, v = z[:n], z[n : 2 * n]
        force = _forces(system, call, time_s, y, v)
        accelerate(c, w, y, v, y, v, 0.0, force, zero, zero, a)
        dz = np.concatenate([v, a, [0.0, 0.0]])
        loop._powers(c, w, v, force, dz)
        return dz

    solver = (DOP853 if method == loop.EXPLICIT else Radau)(
        slope, t[0], state, t[-1], rtol=max(rtol, 3e-14), atol=rtol * loop.FLOOR
    )
    events: list[dict[str, Any]] = []
    out = [state]
    limits = _slack(system)

    def beyond(z: np.ndarray) -> list[dict[str, Any]]:
        outside = (z[system.joint_rows] < limits[:, 0]) | (z[system.joint_rows] > limits[:, 1])
        if not outside.any():
            return []
        joint = int(np.argmax(outside))
        return [
            _limit_event(
                system, joint, _crossing(solver.dense_output(), limits[joint], system.joint_rows[joint], solver.t_old, solver.t)
            )
        ]

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
                events += beyond(z)
                out += [] if events else [z]
            events = events or beyond(solver.y)
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
    return z[:, : 2 * n], z[:, 2 * n :], meta | {"complete": len(out) == len(t)}


def _crossing(dense: Callable[[float], np.ndarray], limits: np.ndarray, row: int, before: float, after: float) -> float:
    """When the unknown in `row` left its limits, by bisection between two times [s]."""
    for _ in range(60):
        middle = (before + after) / 2
        inside = limits[0] <= dense(middle)[row] <= limits[1]
        before, after = (middle, after) if inside else (before, middle)
    return before


def _limit_event(system: System, joint: int, t: float) -> dict[str, Any]:
    low, high = system.limits[joint]
    unit = "rad" if system.robot.links[joint].joint.type == "R" else "m"
    return {"t": t, "level": "ERROR", "text": f"joint {joint + 1} left its limits, {low:g} to {high:g} {unit}: stopped"}


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


def _applied(system: System, t: np.ndarray, states: np.ndarray, drive: Any) -> np.ndarray:
    n, rows = system.n, system.joint_rows
    if isinstance(drive, Drive):
        out = np.zeros((len(t), len(rows)))
        loop.forces(system.chain, _following(system, drive), _inputs(system, drive), loop.memory(len(rows), n), t, states, out)
    else:
        call = as_function(drive)
        out = np.array([_forces(system, call, s, z[:n], z[n:]) for s, z in zip(t, states, strict=True)])
    return out.reshape(len(t), len(rows))


def _times(t_eval: Any) -> np.ndarray:
    t = np.asarray(t_eval, dtype=float)
    if t.ndim != 1 or len(t) < 1 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0):
        raise InputError("expected ascending finite times in seconds, one or more", key="t_eval", value=t_eval)
    return t


def _state(system: System, key: str, value: Any, default: np.ndarray) -> np.ndarray:
    if value is None:
        return default
    array = np.asarray(value, dtype=float)
    if array.shape != (system.n,) or not np.all(np.isfinite(array)):
        raise InputError(f"expected {system.n} finite numbers, in the order of system.labels", key=key, value=value)
    return array


def _put_on_motions(system: System, drive: Drive, t: float, state: np.ndarray) -> None:
    for joint, row in zip(drive.joints, system.joint_rows, strict=False):
        if joint.prescribed and joint.motion is not None:
            state[row], state[system.n + row], _ = joint.motion(t)


def _inside_limits(system: System, state: np.ndarray) -> None:
    for i, (link, row) in enumerate(zip(system.robot.links, system.joint_rows, strict=True), 1):
        if link.joint.limits is not None and not link.joint.limits[0] <= state[row] <= link.joint.limits[1]:
            raise InputError(
                f"expected a start inside the limits of joint {i}, {list(link.joint.limits)}", key="q0", value=float(state[row])
            )
