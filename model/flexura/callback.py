"""Forward dynamics under a Python function: the same equations by SciPy, 100 times slower than a Drive, and as exact."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from . import acting, loop
from .course import inputs_of
from .drive import Drive
from .errors import FlexuraError, InputError
from .kernel import accelerate
from .record import limit_event
from .system import System


def integrated(
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
        z = np.ascontiguousarray(z)  # a column of a matrix, of Radau's Jacobian
        y, v = z[:n], z[n : 2 * n]
        force = _forces(system, drive, time_s, y, v)
        accelerate(c, w, y, v, y, v, 0.0, force, zero, zero, a)
        dz = np.concatenate([v, a, [0.0, 0.0]])
        acting.powers(c, w, v, force, dz)
        return dz

    solver = (DOP853 if method == loop.EXPLICIT else Radau)(
        slope, t[0], state, t[-1], rtol=max(rtol, 3e-14), atol=rtol * loop.FLOOR
    )
    events: list[dict[str, Any]] = []
    out = [state]
    inputs = inputs_of(system, Drive.none(links))

    def beyond(z: np.ndarray) -> bool:
        return bool(acting.outside(c, inputs, z) >= 0)

    def stop(late: float) -> None:
        """Note the event, which is before `late` [s], and keep the last good state."""
        at, after = _crossing(lambda time_s: beyond(dense(time_s)), solver.t_old, late)
        joint = int(acting.outside(c, inputs, dense(after)))
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


def called(system: System, t: np.ndarray, states: np.ndarray, drive: Callable[..., Any]) -> np.ndarray:
    """The forces (T, N) of a drive function at the states (T, 2n) of a run."""
    out = [_forces(system, drive, s, z[: system.n], z[system.n :]) for s, z in zip(t, states, strict=True)]
    return np.array(out).reshape(len(t), len(system.robot.links))


def _forces(system: System, call: Callable[..., Any], t: float, y: np.ndarray, v: np.ndarray) -> np.ndarray:
    rows = system.joint_rows
    own = slice(rows[-1] + 1, system.n)
    force = np.asarray(call(t, y[rows], v[rows], float(system.links[-1].NL @ y[own])), dtype=float)
    if force.shape != rows.shape or not np.all(np.isfinite(force)):
        raise InputError(f"expected {len(rows)} finite forces from the drive function at t = {t:g} s", key="drive", value=force)
    return force
