"""What acts on the chain in Exudyn: loads from tables, PD spring-dampers, constraints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from flexura.optional import Optional

from ..problems.problem import Work
from .chain import Chain

exu, advanced = Optional("exudyn"), Optional("exudyn.advancedUtilities")

FRICTION_SPEED = 1e-3  # m/s or rad/s: Coulomb friction is f tanh(v / this)
Signals = Any  # a sequence of flexura's signals, or of None


def sampled(signals: Signals, steps: int, step: float, derivative: int = 0) -> np.ndarray:
    """Signals at the ends of the steps.

    At a jump the value is the mean over the half steps before and after, so that the impulse is
    exact.

    Args:
        signals: one Signal a joint.
        steps: number of steps.
        step: their length [s].
        derivative: 0, 1 or 2.

    Returns:
        (steps + 1, joints).
    """
    out = np.zeros((steps + 1, len(signals)))
    for j, signal in enumerate(signals):
        out[:, j] = [signal(k * step)[derivative] for k in range(steps + 1)]
        for at in signal.breaks:
            k = round(at / step) if abs(at) < 1e9 else -1
            if 0 < k <= steps:
                edges = np.array([-0.5, np.clip(at / step - k, -0.5, 0.5), 0.5])
                middles = (k + (edges[1:] + edges[:-1]) / 2) * step
                out[k, j] = sum(
                    w * signal(m)[derivative] for w, m in zip(np.diff(edges), middles, strict=True)
                )
    return out


class Loads:
    """All that a problem's work asks for, added to a chain before it is assembled."""

    def __init__(self, chain: Chain, work: Work) -> None:
        """Add loads, servos, constraints and friction to the chain."""
        self.chain, self.work = chain, work
        item, mbs = chain.item, chain.mbs
        self.loads = [
            [self._load(k, marker) for marker in joint.loads]
            for k, joint in enumerate(chain.joints)
        ]
        self.servos: list[int] = []
        self.constraints: list[int] = []
        self.reactions: list[int] = []
        self._friction()
        for k, joint in enumerate(chain.joints):
            ends = [chain.origin, joint.coordinate]
            if work.motion and not work.rate_Hz:
                servo = item.ObjectConnectorCoordinateSpringDamperExt(
                    markerNumbers=ends,
                    stiffness=work.kp[k],
                    damping=work.kd[k],
                    frictionProportionalZone=1.0,
                )
                self.servos.append(mbs.AddObject(servo))
            if work.prescribed:
                start = float(work.prescribed[k](0.0)[0])
                self.constraints.append(
                    mbs.AddObject(item.ObjectConnectorCoordinate(markerNumbers=ends, offset=start))
                )
                sensor = item.SensorObject(
                    objectNumber=self.constraints[-1],
                    outputVariableType=chain.exu.OutputVariableType.Force,
                    storeInternal=True,
                    writeToFile=False,
                )
                self.reactions.append(mbs.AddSensor(sensor))

    def _is_carriage(self, k: int) -> bool:
        """Whether joint k is the carriage's."""
        return self.chain.has_carriage and k == 0

    def _load(self, k: int, marker: int) -> int:
        item = self.chain.item
        if self._is_carriage(k):
            return self.chain.mbs.AddLoad(item.LoadCoordinate(markerNumber=marker, load=0.0))
        return self.chain.mbs.AddLoad(
            item.LoadTorqueVector(markerNumber=marker, loadVector=[0, 0, 0])
        )

    def _friction(self) -> None:
        """Add viscous and Coulomb friction; Exudyn compiles the latter from an expression."""
        self.references = []
        for link, joint in zip(self.chain.robot["link"], self.chain.joints, strict=True):
            viscous, coulomb = (
                link["joint"].get("viscous_friction_N_m_s_rad", 0.0),
                link["joint"].get("coulomb_friction_N_m", 0.0),
            )
            if not viscous and not coulomb:
                continue
            ends = [self.chain.origin, joint.coordinate]
            damper = self.chain.mbs.AddObject(
                self.chain.item.ObjectConnectorCoordinateSpringDamper(
                    markerNumbers=ends, damping=viscous
                )
            )

            def force(mbs, t, itemNumber, displacement, velocity, stiffness, damping, offset):  # type: ignore[no-untyped-def]
                return damping * velocity + coulomb * exu.symbolic.tanh(velocity / FRICTION_SPEED)  # noqa: B023 (compiled at once)

            if coulomb:
                function = advanced.CreateSymbolicUserFunction(
                    self.chain.mbs, force, "springForceUserFunction", damper
                )
                self.references.append(function)
                self.chain.mbs.SetObjectParameter(damper, "springForceUserFunction", function)

    def _apply(self, k: int, force: float) -> None:
        """Set joint k's drive: on the link, and back on what carries it."""
        if self._is_carriage(k):
            self.chain.mbs.SetLoadParameter(self.loads[k][0], "load", force)
            return
        for one, sign in zip(self.loads[k], (1.0, -1.0), strict=False):
            self.chain.mbs.SetLoadParameter(one, "loadVector", [0, 0, sign * force])

    def begin(self, steps: int, step: float) -> None:
        """Prepare a run: tables, values at the start, and the function that Exudyn calls each step.

        Args:
            steps: number of steps.
            step: their length [s].
        """
        work = self.work
        parts: list[Callable[[int], None]] = []
        if work.force:
            parts.append(self._forces(sampled(work.force, steps, step)))
        if work.motion and not work.rate_Hz:
            parts.append(
                self._motions(
                    sampled(work.motion, steps, step), sampled(work.motion, steps, step, 1)
                )
            )
        if work.prescribed:
            parts.append(self._prescribed(sampled(work.prescribed, steps, step)))
        if work.of_time is not None:
            parts.append(self._of_time(work.of_time, step))
        if work.rate_Hz:
            parts.append(self._ticks(round(1 / (work.rate_Hz * step)), step))
        if work.of_state is not None:
            self._of_state(work.of_state)

        def before_step(mbs: Any, t: float) -> bool:
            """Called with the time at which the step ends."""
            k = round(t / step)
            for part in parts:
                part(k)
            return True

        if parts:
            for part in parts:
                part(0)
            self.chain.mbs.SetPreStepUserFunction(before_step)

    def _forces(self, table: np.ndarray) -> Callable[[int], None]:
        last = np.full(table.shape[1], np.nan)

        def part(k: int) -> None:
            for j, force in enumerate(table[k]):
                if force != last[j]:
                    self._apply(j, float(force))
                    last[j] = force

        return part

    def _motions(self, place: np.ndarray, rate: np.ndarray) -> Callable[[int], None]:
        def part(k: int) -> None:
            for j, servo in enumerate(self.servos):
                self.chain.mbs.SetObjectParameter(servo, "offset", float(place[k, j]))
                self.chain.mbs.SetObjectParameter(servo, "velocityOffset", float(rate[k, j]))

        return part

    def _prescribed(self, place: np.ndarray) -> Callable[[int], None]:
        def part(k: int) -> None:
            for j, constraint in enumerate(self.constraints):
                self.chain.mbs.SetObjectParameter(constraint, "offset", float(place[k, j]))

        return part

    def _of_time(self, function: Callable[[float], Any], step: float) -> Callable[[int], None]:
        def part(k: int) -> None:
            for j, force in enumerate(function(k * step)):
                self._apply(j, float(force))

        return part

    def _of_state(self, function: Callable[..., Any]) -> None:
        """A control law of the state, which Exudyn calls in every iteration; one joint only."""

        def torque(mbs: Any, t: float, load: Any) -> list[float]:
            return [0.0, 0.0, float(function(t, *self.chain.measured())[0])]

        self.chain.mbs.SetLoadParameter(self.loads[0][0], "loadVectorUserFunction", torque)

    def _ticks(self, steps: int, step: float) -> Callable[[int], None]:
        """A sampled control law.

        A tick's output holds from its instant on. The load at the instant itself should be the mean
        of old and new output; the step after it makes up for the difference.
        """
        law = self.work.tick() if self.work.tick is not None else proportional(self.work)
        held, late = np.zeros(len(self.loads)), np.zeros(len(self.loads))

        def part(k: int) -> None:
            if k == 0:
                return
            first = (k - 1) % steps == 0
            if first:
                new = np.asarray(law((k - 1) * step, *self.chain.measured()), dtype=float)
                late[:] = (new - held) / 2 if k > 1 else 0.0
                held[:] = new
            if first or (k - 2) % steps == 0:
                for j in range(len(held)):
                    self._apply(j, float(held[j] + (late[j] if first else 0.0)))

        return part


def proportional(work: Work) -> Callable[..., Any]:
    """PD control of measured positions, rates by differences of two ticks: `fx.PID` unfiltered."""
    last: list[np.ndarray] = []

    def law(
        t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float
    ) -> np.ndarray:
        wanted = np.array([signal(t)[0] for signal in work.motion])
        rate = (
            work.rate_Hz * ((wanted - position) - (last[1] - last[0]))
            if last
            else np.zeros(len(position))
        )
        last[:] = [position, wanted]
        return np.array(work.kp) * (wanted - position) + np.array(work.kd) * rate

    return law
