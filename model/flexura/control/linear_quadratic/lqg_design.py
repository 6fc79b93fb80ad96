"""LQG: a linear-quadratic regulator on Kalman's estimate from the robot's own sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...io import array, tick_rate
from ...signals import FunctionSignal, Signal, SignalLike, as_signals, constant
from ...system import RobotLike, System, assemble, linearize
from ..sampled import Sampled
from .gaussian_design import Design, Weights, gaussian_design
from .measurements import MeasuredLaw, Measurements
from .riccati import deviations, discretised


def lqg(
    robot: RobotLike,
    references: SignalLike | Sequence[SignalLike],
    effort: ArrayLike,
    rate_Hz: float = 1000.0,
    *,
    measure: Sequence[str] | None = None,
    limit: ArrayLike | None = None,
    follow: str = "joints",
    position: ArrayLike = 1.0,
    deflection: float = 1.0,
    damping: float = 0.0,
    disturbance: ArrayLike = 1.0,
    noise: ArrayLike | Mapping[str, float] = 1e-4,
    q: ArrayLike | None = None,
) -> tuple[Sampled, Design]:
    """A sampled controller of forces from the robot linearised: a regulator (75) on Kalman's
    estimate (76) from the robot's own sensors (127).

    The weights follow Bryson's rule, as in `flexura.control.lqr`. The controller begins anew with
    every run. `flexura.control.loop_figures` says what the loop bears.

    Args:
        robot: a System, a Robot, or the path or name of a robot file. A robot with few modes makes
            a controller with few states.
        references: a Signal or a number for each joint [m or rad]; None is good for a locked one.
        effort: of each joint that is free (m,), that counts as much as the deviations below [N or
            N m].
        rate_Hz: ticks a second.
        measure: names of the measurements; None: the joints and all sensors of deflection, slope
            and strain, or without such sensors the tip deflections.
        limit: of the forces, a number or one a joint [N or N m]; None: there is none.
        follow: what `position` weights: "joints", or "tips", where a flexible link that turns
            counts by the angle of the line from its hub to its tip.
        position: deviation of each free joint (m,) or of all [m or rad].
        deflection: of the tips [m].
        damping: time by which the rate of a deflection is weighted [s].
        disturbance: standard deviation of what acts at the joints in a tick, (m,) or one [N or
            N m].
        noise: standard deviation of the measurements, by their names, or (p,), or one.
        q: configuration (n,) of the design; None: the static equilibrium at the start.

    Returns:
        The controller for `flexura.simulate`, and the Design with its matrices and poles.

    Raises:
        InputError: an argument is not what is expected, or no stabilising solution exists.
    """
    system = assemble(robot)
    rate = tick_rate(rate_Hz)
    linear = linearize(system, q)
    if not linear.inputs:
        raise InputError("expected a joint that is free to move", key="link.joint.locked")
    measured = Measurements(system, measure)
    F, G = discretised(linear.A, linear.B, 1 / rate)
    design = gaussian_design(
        linear,
        (F, G, measured.derivatives(linear)),
        rate,
        measured.names,
        system,
        Weights(
            effort,
            position,
            deflection,
            damping,
            disturbance,
            noise_of(noise, measured.names),
            follow,
        ),
    )
    law = LinearQuadraticGaussian(
        system,
        design,
        measured,
        motions(references, system),
        linear.q,
        linear.hold,
        limits(limit, system),
    )
    return Sampled(law, rate), design


class LinearQuadraticGaussian(MeasuredLaw):
    """The law (77) as a Python object with a memory, the estimate: what `lqg` samples."""

    def __init__(
        self,
        system: System,
        design: Design,
        measured: Measurements,
        references: Sequence[Signal],
        q: np.ndarray,
        hold: np.ndarray,
        limit: np.ndarray,
    ) -> None:
        super().__init__(measured)
        self.design, self.references = design, references
        self.hold, self.limit, self.driven = hold, limit, list(design.inputs)
        self.offset = measured.at(q)
        rows = [
            int(np.flatnonzero(system.free_rows == system.joint_rows[i])[0]) for i in self.driven
        ]
        self.rows, self.rest = np.array(rows), q[system.joint_rows][self.driven]
        self.predicted = np.zeros(len(design.F))

    def begin(self, position: np.ndarray) -> None:
        """The estimate is the equilibrium with the joints at `position` (links,)."""
        self.predicted = np.zeros(len(self.design.F))
        self.predicted[self.rows] = position[self.driven] - self.rest

    def tick(self, t: float, y: np.ndarray) -> np.ndarray:
        """The forces (links,) from the measurements (p,) at time t [s]."""
        d = self.design
        estimate = self.predicted + d.L @ (y - self.offset - d.C @ self.predicted)
        wanted = np.zeros(len(d.F))
        for row, i, rest in zip(self.rows, self.driven, self.rest, strict=True):
            wanted[row], wanted[len(d.F) // 2 + row] = self.references[i](t)[:2]
            wanted[row] -= rest
        u = self.hold.copy()
        u[self.driven] -= d.K @ (estimate - wanted)
        u = np.clip(u, -self.limit, self.limit)
        self.predicted = d.F @ estimate + d.G @ (u - self.hold)[self.driven]
        return u


def motions(references: SignalLike | Sequence[SignalLike], system: System) -> list[Signal]:
    """The reference of each joint. Raises InputError where one is missing."""
    found = as_signals(references, len(system.robot.links), "references")
    out = []
    for i, (signal, locked) in enumerate(zip(found, system.locked, strict=True), 1):
        if signal is None and not locked:
            expected = "missing: expected a reference of every joint"
            raise InputError(expected, key=f"references[{i}]", value="None")
        if isinstance(signal, FunctionSignal):
            expected = "expected a Signal or a number: a controller needs the rate of a reference"
            raise InputError(expected, key=f"references[{i}]", value="a function")
        out.append(constant(0.0) if signal is None else signal)
    return out


def limits(limit: ArrayLike | None, system: System) -> np.ndarray:
    """Limits of the forces (links,); None: infinite ones. Raises InputError."""
    count = len(system.robot.links)
    return np.full(count, np.inf) if limit is None else deviations(limit, count, "limit")


def noise_of(noise: Any, names: Sequence[str]) -> Any:
    """One number, or one of each measurement by its name."""
    if not isinstance(noise, Mapping):
        return array(noise, "noise", f"expected a number above 0, or {len(names)} of them")
    for name in noise:
        if name not in names:
            expected = f"expected one of the measurements, {', '.join(names)}"
            raise InputError(expected, key="noise", value=name)
    missing = [name for name in names if name not in noise]
    if missing:
        raise InputError(
            "missing: expected the noise of every measurement", key=f"noise.{missing[0]}"
        )
    return [noise[name] for name in names]
