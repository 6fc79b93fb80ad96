"""Derivatives of a run's channels by numbers of the robot file."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...io import Run
from ...robot import Robot
from ...signals import Drive, SignalLike, as_signals
from ...system import RobotLike, System, assemble, static
from ..dynamics import simulate
from ..problem import check_times
from ..recorder import channel_units, recorded_channels
from .posture import exact_system
from .variation import stage_times, variation

SHARE = 1e-4  # of a parameter: the step of its differences, at a state that is the same
RTOL = 1e-10


def parameter_derivatives(
    robot: RobotLike,
    t_eval: ArrayLike,
    drive: Drive | SignalLike | Sequence[SignalLike],
    parameters: str | Sequence[str],
    q0: ArrayLike | None = None,
) -> dict[str, Run]:
    """How the channels of a simulation change with numbers of the robot file (118).

    The equations of motion are linearised exactly along the run, by the core's dual numbers. What a
    parameter changes of the forces, at the run's own states, is found by differences of the robot's
    constants (of which the core has no derivatives). Both give the change of the states.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        t_eval: (T,), ascending times [s], so dense that the run's fastest motion that matters is
            resolved: they are the steps of the variation.
        drive: forces as in `fx.simulate`, one entry a joint; without feedback.
        parameters: keys of the robot file, as "payload.mass_kg" or "link.2.length_m".
        q0: (n,), the start; by default as in `fx.simulate`. It does not change with a parameter.

    Returns:
        For each key a Run at t_eval whose channels are derivatives; `units` are those of the
        channels, for each unit of the parameter.

    Raises:
        InputError: an argument is not what is expected.
    """
    system, t = exact_system(robot), check_times(t_eval)
    keys = [parameters] if isinstance(parameters, str) else parameters
    if not isinstance(keys, list | tuple) or not keys:
        raise InputError("expected keys of the robot file", key="parameters", value=parameters)
    for i, key in enumerate(keys, 1):
        try:
            system.robot.value(str(key))
        except InputError as error:
            raise InputError(error.expected, key=f"parameters[{i}]", value=key) from None
    if len(t) < 2:
        raise InputError("expected two times or more", key="t_eval", value=t)
    forces = (
        drive
        if isinstance(drive, Drive)
        else Drive.force(*as_signals(drive, len(system.robot.links), "drive", t))
    )
    if len(forces.joints) != len(system.robot.links):
        raise InputError("expected forces, one a joint of the robot", key="drive")
    if any(joint.motion is not None for joint in forces.joints):
        raise InputError("expected forces, without motions to follow", key="drive")
    at = stage_times(t)
    start = (
        q0
        if q0 is not None
        else (static(system) if any(system.robot.gravity_m_s2) else system.start())
    )
    run = simulate(system, np.append(t[0], at), forces, start, rtol=RTOL).uninterrupted()
    if run.states is None or len(run) <= len(at):
        raise InputError("expected a run that comes to its end", key="t_eval")
    n, rows = system.n, system.free_rows
    q, v = (np.ascontiguousarray(x) for x in (run.states[1:, :n], run.states[1:, n:]))
    acting = np.zeros((len(at), n))
    for i, row in enumerate(system.joint_rows):
        acting[:, row] = [forces.joints[i].force_at(float(x)) for x in at]
    a = np.array([system.accelerations(*x) for x in zip(q, v, acting, strict=True)])
    along = variation(system, t, q, v, a, rows)
    changed = np.stack([_changed(system.robot, str(key), q, v, a) for key in keys], axis=2)
    places, rates = along.integrate(-changed[:, rows])
    out = {}
    last = slice(2, None, 3)
    for k, key in enumerate(keys):
        dq, dv = np.zeros((len(t), n)), np.zeros((len(t), n))
        dq[1:, rows], dv[1:, rows] = places[last, :, k], rates[last, :, k]
        states = np.vstack([np.append(start, np.zeros(n)), run.states[3::3]])
        out[str(key)] = _channels(system, str(key), t, states[:, :n], states[:, n:], dq, dv)
    return out


def _changed(robot: Robot, key: str, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """The derivative of the forces of a motion (T, n) by a number of the robot."""
    return _slope(robot, key, lambda system, _: system.equations.force_derivatives(q, v, a)[0])


def _slope(robot: Robot, key: str, of: Callable[[System, float], np.ndarray]) -> np.ndarray:
    """The derivative, by a number of the robot, of what robots and their steps of it give."""
    value = robot.value(key)
    at = lambda step: of(assemble(robot.replace({key: value + step})), step)
    if value:
        step = SHARE * abs(value)
        return np.asarray((at(step) - at(-step)) / (2 * step))
    # below 0 there may be no robot
    return np.asarray((4 * at(SHARE) - 3 * at(0.0) - at(2 * SHARE)) / (2 * SHARE))


def _channels(
    system: System,
    key: str,
    t: np.ndarray,
    q: np.ndarray,
    v: np.ndarray,
    dq: np.ndarray,
    dv: np.ndarray,
) -> Run:
    """Changes of states, and of the robot, as changes of the channels that the core reads."""
    seen = _slope(
        system.robot,
        key,
        lambda other, step: np.asarray(
            other.observe(np.ascontiguousarray(q + step * dq), np.ascontiguousarray(v + step * dv))
        ),
    )
    channels: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for i, (row, link) in enumerate(zip(system.joint_rows, system.robot.links, strict=True), 1):
        unit = "rad" if link.joint.type == "R" else "m"
        channels |= {f"joint/{i}/position": dq[:, row], f"joint/{i}/velocity": dv[:, row]}
        units |= {f"joint/{i}/position": unit, f"joint/{i}/velocity": f"{unit}/s"}
    known = channel_units(system.robot)
    for k, name in enumerate(recorded_channels(system.robot)):
        if not name.startswith("energy"):
            channels[name], units[name] = seen[:, k], known[name]
    meta = {"source": "derivative", "program": "flexura", "parameter": key}
    return Run(t, channels, units, meta | {"robot": system.robot.to_dict(), "events": []})
