"""Drives of the twin's joints: open-loop forces once a step, feedback inside Exudyn's equations.

A `Drive` is, in each joint, a force f(t) and a PD controller with gains kp, kd along a motion r(t).
The force is a load that is set once a step. The controller is a spring-damper of Exudyn on the
joint's coordinate, whose offsets r, dr/dt are set once a step. It acts without delay, because
Exudyn solves for it.

A Python function of time is such a force. A function of the joints' state is called in every
iteration, also without delay. Newton's method knows no derivatives of it. Its gains at the start,
by finite differences, therefore become a controller, and the load subtracts that controller's force
again.

A force that jumps would be late or early by half a step, an error of first order. Where it jumps, a
step uses the mean over the half steps before and after its instant, so that the impulse is exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..io import array, function_of, takes
from ..optional import Optional
from ..signals import Drive, Signal, as_signals
from .build import TwinModel
from .links.part import Ground, Motion

exu = Optional("exudyn")

DIFFERENCE = 1e-6  # m, rad, m/s, rad/s


@dataclass(frozen=True)
class Actuation:
    """A drive as the twin applies it.

    `gains` (n, 2): kp and kd of the joints' controllers. `call(t, position, velocity,
    tip_deflection)`: the n drive forces. `plan(t)`: force, r, dr/dt of each joint (n, 3); None if
    the drive is a function of the state, whose controllers only help Newton's method. `breaks`:
    instants at which the plan may jump; None: unknown, every step may have one. `guided` (n,):
    which joints are held to their motion r; None: none is.
    """

    gains: np.ndarray
    call: Callable[..., np.ndarray]
    plan: Callable[[float], np.ndarray] | None
    breaks: np.ndarray | None
    guided: np.ndarray | None = None


def actuation(drive: Any, start: np.ndarray, speeds: np.ndarray, t: np.ndarray) -> Actuation:
    """The actuation for a drive.

    Args:
        drive: a Drive, a function of (t) or of (t, position, velocity, tip_deflection), forces one
            entry a joint, or None.
        start: joint positions at time 0 (n,).
        speeds: joint velocities at time 0 (n,).
        t: the run's times (T,) [s].

    Raises:
        InputError: the drive does not fit the robot.
    """
    n = len(start)
    drive = Drive.none(n) if drive is None else drive
    if not isinstance(drive, Drive) and (not callable(drive) or isinstance(drive, Signal | type)):
        drive = Drive.force(*as_signals(drive, n, "drive", t))
    if isinstance(drive, Drive):
        if len(drive.joints) != n:
            raise InputError(
                f"expected one drive for each of the robot's {n} joints",
                key="drive",
                value=len(drive.joints),
            )
        acting = drive.within(0.0, float(t[-1]))
        breaks = None if acting.has_functions else acting.breaks
        return Actuation(acting.gains, acting, lambda t: _plan(acting, t), breaks, acting.follows)

    expected = "expected a Drive or a function (t) or (t, position, velocity, tip_deflection)"
    function_of(drive, "drive", (1, 4), expected)

    def checked(*arguments: Any) -> np.ndarray:
        expected = f"expected {n} finite forces or torques from the drive at t = {arguments[0]:g} s"
        return array(drive(*arguments), "drive", expected, (n,))

    if takes(drive, 4):
        return Actuation(_gains(checked, start, speeds), checked, None, None)
    still = np.zeros((n, 2))
    return Actuation(
        still, lambda t, *_: checked(t), lambda t: np.column_stack([checked(t), still]), None
    )


def _gains(call: Callable[..., np.ndarray], start: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Stiffness and damping (n, 2) of a function of the state at the start, by differences.

    Only those on each joint's own coordinate; 0 if negative.
    """
    gains = np.zeros((len(start), 2))
    for i in range(len(start)):
        for column in range(2):
            low, high = [start.copy(), speeds.copy()], [start.copy(), speeds.copy()]
            low[column][i] -= DIFFERENCE
            high[column][i] += DIFFERENCE
            gains[i, column] = max(
                0.0, (call(0.0, *low, 0.0) - call(0.0, *high, 0.0))[i] / (2 * DIFFERENCE)
            )
    return gains


def _plan(drive: Drive, t: float) -> np.ndarray:
    """Force, r and dr/dt of each joint at t, (n, 3)."""
    out = np.zeros((len(drive.joints), 3))
    for i, joint in enumerate(drive.joints):
        out[i, 0] = joint.force_at(t)
        if joint.motion is not None:
            out[i, 1:] = joint.motion(t)[:2]
    return out


class Loads:
    """Keeps Exudyn's loads and controllers up to date during a run."""

    def __init__(
        self,
        model: TwinModel,
        act: Actuation,
        step_s: float,
        steps: int,
        stop: Callable[[BaseException], None],
    ) -> None:
        """Apply the drive at time 0.

        Args:
            model: the assembled robot.
            act: its drives.
            step_s: length of a step [s].
            steps: number of steps.
            stop: called with an error of the drive.
        """
        self.model, self.act, self.step_s, self.stop = model, act, step_s, stop
        self.applied = np.zeros((len(model.coordinates), 3))
        end = (steps + 0.5) * step_s
        self.edges = _edges([] if act.breaks is None else act.breaks, step_s, end)
        self.link_edges = _edges(model.loads.breaks, step_s, end)
        if act.plan is not None:
            self._apply(act.plan(0.0))
        else:
            self._install_feedback()

    def before_step(self, t: float) -> None:
        """Set what acts in the step that ends at t [s]."""
        on_links = self.model.loads
        if on_links.loads:
            jumps = self.link_edges.get(round(t / self.step_s), [])
            on_links.apply(self._mean(on_links.values, t, jumps))
        if self.act.plan is None:
            return
        inside = [t] if self.act.breaks is None else self.edges.get(round(t / self.step_s))
        if not inside:
            self._apply(self.act.plan(t))
            return
        mean = self._mean(self.act.plan, t, inside)
        if self.act.guided is not None:
            mean[self.act.guided] = self.act.plan(t)[self.act.guided]
        self._apply(mean)

    def _mean(self, plan: Callable[[float], np.ndarray], t: float, jumps: list[float]) -> Any:
        """A plan's values in the step that ends at t [s]: without jumps those at t."""
        if not jumps:
            return plan(t)
        edges = np.array([t - self.step_s / 2, *jumps, t + self.step_s / 2])
        weights, middles = np.diff(edges) / self.step_s, (edges[1:] + edges[:-1]) / 2
        return sum(w * plan(m) for w, m in zip(weights, middles, strict=True))

    def _apply(self, values: Any) -> None:
        mbs = self.model.mbs
        for joint, now, before in zip(self.model.coordinates, values, self.applied, strict=True):
            if now[0] != before[0]:
                mbs.SetLoadParameter(joint.load, "load", float(now[0]))
            if joint.guide is not None:
                mbs.SetObjectParameter(joint.guide, "offset", float(now[1]))
            if joint.servo is not None:
                mbs.SetObjectParameter(joint.servo, "offset", float(now[1]))
                mbs.SetObjectParameter(joint.servo, "velocityOffset", float(now[2]))
        self.applied = values

    def _install_feedback(self) -> None:
        """Let Exudyn call the drive whenever it evaluates loads.

        The first joint's load computes the forces of all.
        """
        numbers = [c.load for c in self.model.coordinates]
        forces = np.zeros(len(numbers))
        sense, (kp, kd) = Sensors(self.model), self.act.gains.T
        for joint, start in zip(self.model.coordinates, self.model.robot.start, strict=True):
            if joint.servo is not None:
                self.model.mbs.SetObjectParameter(joint.servo, "offset", float(start))

        def first(mbs: Any, t: float, _load: float) -> float:
            try:
                position, velocity, deflection = sense()
                forces[:] = self.act.call(t, position, velocity, deflection)
                forces[:] += kp * (position - self.model.robot.start) + kd * velocity
            except BaseException as error:  # through Exudyn it would come out as another error
                self.stop(error)
            return forces[0]

        for i, number in enumerate(numbers):
            # Exudyn 1.13.6 evaluates loads in order of their numbers
            self.model.mbs.SetLoadParameter(
                number, "loadUserFunction", first if i == 0 else lambda mbs, t, load, i=i: forces[i]
            )


def _edges(breaks: Any, step_s: float, end: float) -> dict[int, list[float]]:
    """Breaks in (0, end] by the number of the step [s] that they are next to."""
    out: dict[int, list[float]] = {}
    for t in breaks:
        if 0 < t <= end:
            out.setdefault(round(t / step_s), []).append(float(t))
    return out


class Sensors:
    """Joint positions and velocities (n,) and tip deflection [m] at Exudyn's current iterate."""

    def __init__(self, model: TwinModel) -> None:

        self.mbs, self.markers = model.mbs, [c.marker for c in model.coordinates]
        self.kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
        self.model = model

    def __call__(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Positions (n,), velocities (n,) and tip deflection [m]."""
        position, velocity = (
            np.array([self.mbs.GetMarkerOutput(m, kind)[0] for m in self.markers])
            for kind in self.kinds
        )
        return position, velocity, self._deflection()

    def _deflection(self) -> float:
        """Tip deflection of the last link [m]; 0 if it is rigid."""
        model, last = self.model, len(self.model.parts) - 1
        if not model.mesh.elements[last]:
            return 0.0
        q = (self.mbs.systemData.GetODE2Coordinates() + model.reference)[None, :]
        (hub, tip), turn = self._ends(q, last), 0.0
        if model.robot.links[last].joint.type == "Pb":  # in the frame of the sleeve
            hub = self._ends(q, last - 1)[1] if last else Ground.motion(1)
            turn = model.robot.links[last].joint.angle_rad
        dx, dy = tip.r[0] - hub.r[0]
        return float(np.cos(hub.angle[0] + turn) * dy - np.sin(hub.angle[0] + turn) * dx)

    def _ends(self, q: np.ndarray, i: int) -> tuple[Motion, Motion]:
        part, own = self.model.parts[i], q[:, self.model.index[i]]
        return part.motion_at_origin(own, own), part.motion_at_tip(own, own)
