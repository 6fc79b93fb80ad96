"""What drives the twin's joints: open-loop forces once a step, feedback inside Exudyn's equations.

A `Drive` becomes tau_i = F_i(t) - kp_i eta_i - kd_i d(eta_i)/dt with F = f + kp r + kd dr/dt: the two gains are a spring
and a damper on the joint's coordinate (implicit, in Exudyn's own code) and F is a load set once a step. A Python function
of time is such an F; one of the joints' state is called in every iteration, so that it acts without delay.

A load that jumps would shift by half a step, an error of first order. The load of a step is therefore the mean of F
over the half steps before and after its instant wherever F jumps there, so that the impulse is exact.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..drive import Drive
from ..errors import InputError
from .chain import Chain
from .part import Part


@dataclass(frozen=True)
class Actuation:
    """A drive as the twin applies it; `call(t, position, velocity, tip_deflection)` gives the n drive forces.

    `stiffness` and `damping` (n,) act on the coordinates; `open(t)` gives the rest, (n,), or is None where only `call`
    knows. `breaks`: instants at which `open` may jump; None: unknown, so every step may have one.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    call: Callable[..., np.ndarray]
    open: Callable[[float], np.ndarray] | None
    breaks: np.ndarray | None


def actuation(drive: Any, n: int) -> Actuation:
    """The actuation for a Drive, a function of (t) or (t, position, velocity, tip_deflection), or None."""
    drive = Drive.none(n) if drive is None else drive
    zero = np.zeros(n)
    if isinstance(drive, Drive):
        if len(drive.joints) != n:
            raise InputError(f"expected one drive for each of the robot's {n} joints", key="drive", value=len(drive.joints))
        gains = np.array([(j.kp, j.kd) if j.motion is not None else (0.0, 0.0) for j in drive.joints]).reshape(n, 2)
        return Actuation(gains[:, 0], gains[:, 1], drive, lambda t: drive(t, zero, zero), drive.breaks)
    if not callable(drive):
        raise InputError("expected a Drive or a function (t) or (t, position, velocity, tip_deflection)", key="drive", value=drive)

    def checked(*arguments: Any) -> np.ndarray:
        forces = np.asarray(drive(*arguments), dtype=float)
        if forces.shape != (n,) or not np.all(np.isfinite(forces)):
            raise InputError(f"expected {n} finite forces or torques from the drive at t = {arguments[0]:g} s", key="drive", value=forces)
        return forces

    if _takes_state(drive):
        return Actuation(zero, zero, checked, None, None)
    return Actuation(zero, zero, lambda t, *_: checked(t), checked, None)


def _takes_state(function: Callable[..., Any]) -> bool:
    """Whether a function can be called with four arguments."""
    try:
        inspect.signature(function).bind(0.0, None, None, 0.0)
    except TypeError:
        return False
    except ValueError:  # a builtin without a signature
        return True
    return True


class Loads:
    """Keeps Exudyn's loads up to date during a run with steps of `step_s`; `stop` is called with an error of the drive's."""

    def __init__(self, chain: Chain, act: Actuation, step_s: float, steps: int, stop: Callable[[BaseException], None]) -> None:
        self.chain, self.act, self.step_s, self.stop = chain, act, step_s, stop
        self.numbers = [c.load for c in chain.coordinates]
        self.applied = [0.0] * len(self.numbers)
        self.edges: dict[int, list[float]] = {}
        for t in [] if act.breaks is None else act.breaks[(act.breaks > 0) & (act.breaks <= (steps + 0.5) * step_s)]:
            self.edges.setdefault(round(t / step_s), []).append(t)
        if act.open is not None:
            self._apply(act.open(0.0))
        else:
            self._install_feedback()

    def before_step(self, t: float) -> None:
        """Set the open-loop loads for the step that ends at t [s]."""
        if self.act.open is None:
            return
        k = round(t / self.step_s)
        inside = self.edges.get(k, []) if self.act.breaks is not None else [t]
        if not inside:
            self._apply(self.act.open(t))
            return
        edges = np.array([t - self.step_s / 2, *inside, t + self.step_s / 2])
        self._apply(sum(w * self.act.open(m) for w, m in zip(np.diff(edges) / self.step_s, (edges[1:] + edges[:-1]) / 2, strict=True)))

    def _apply(self, forces: Any) -> None:
        for i, force in enumerate(forces):
            if force != self.applied[i]:
                self.applied[i] = force
                self.chain.mbs.SetLoadParameter(self.numbers[i], "load", float(force))

    def _install_feedback(self) -> None:
        """Let Exudyn ask for the forces whenever it evaluates them; the first joint's load computes those of all."""
        forces = np.zeros(len(self.numbers))
        sense = Senses(self.chain)

        def first(mbs: Any, t: float, _load: float) -> float:
            try:
                forces[:] = self.act.call(t, *sense())
            except BaseException as error:  # through Exudyn it would come out as another error
                self.stop(error)
            return forces[0]

        for i, number in enumerate(self.numbers):
            # Exudyn 1.13.6 evaluates loads in order of their numbers
            self.chain.mbs.SetLoadParameter(number, "loadUserFunction", first if i == 0 else lambda mbs, t, load, i=i: forces[i])


class Senses:
    """The joints' positions (n,), velocities (n,) and the last link's tip deflection [m] at the iterate Exudyn is at."""

    def __init__(self, chain: Chain) -> None:
        import exudyn as exu

        self.mbs, self.markers = chain.mbs, [c.marker for c in chain.coordinates]
        self.kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
        self.last: Part | None = chain.parts[-1] if chain.elements[-1] else None
        self.index, self.reference = chain.index[-1], chain.reference

    def __call__(self) -> tuple[np.ndarray, np.ndarray, float]:
        position, velocity = (np.array([self.mbs.GetMarkerOutput(m, kind)[0] for m in self.markers]) for kind in self.kinds)
        return position, velocity, self._deflection()

    def _deflection(self) -> float:
        if self.last is None:
            return 0.0
        q = (self.mbs.systemData.GetODE2Coordinates() + self.reference)[self.index][None, :]
        hub, tip = self.last.motion_at_origin(q, q), self.last.motion_at_tip(q, q)
        dx, dy = tip.r[0] - hub.r[0]
        return float(np.cos(hub.angle[0]) * dy - np.sin(hub.angle[0]) * dx)
