"""What is tuned: robots, a manoeuvre, a controller with free settings, and an objective.

All is plain data, which can be sent to workers.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import PID, Gains
from flexura.errors import InputError
from flexura.simulation import GainSweep, prepare_gain_sweep

from . import objective, search_space
from .closed_loop import closed_loop_controller
from .objective import Weights
from .search_space import FreeGain

# of a search's runs, whose steps the ticks bound; what comes out is simulated again to 1e-6, with
# the mesh of the robot file
RTOL, MODES = 1e-3, 2


@dataclass(frozen=True)
class Task:
    """Robots (the nominal one first), a manoeuvre, gains with free settings, and weights.

    `pareto`: two objectives. The runs of a search keep `modes` modes of each flexible link; 0: as
    in the robot file.
    """

    robots: tuple[fx.Robot, ...]
    manoeuvre: fx.Manoeuvre
    gains: Gains
    free: tuple[FreeGain, ...]
    weights: Weights = field(default_factory=Weights)
    pareto: bool = False
    rtol: float = RTOL
    modes: int = MODES

    def __post_init__(self) -> None:
        search_space.check(self.free, self.gains)
        if not 0 < self.rtol <= 0.1:
            raise InputError(
                "expected a relative tolerance above 0, at most 0.1", key="--rtol", value=self.rtol
            )

    @cached_property
    def systems(self) -> list[fx.System]:
        """The robots as the search simulates them."""
        return [fx.assemble(with_modes(robot, self.modes)) for robot in self.robots]

    @cached_property
    def controllers(self) -> list[fx.Controller]:
        """The controller of each robot with the file's own gains.

        Raises:
            InputError: a joint has no step.
        """
        out = [
            closed_loop_controller(system, self.manoeuvre, self.gains) for system in self.systems
        ]
        for joint, link in zip(out[0].joints, self.robots[0].links, strict=True):
            assert isinstance(joint, PID)
            if joint.reference(self.manoeuvre.duration_s)[0] == link.joint.start:
                raise InputError(
                    "expected a manoeuvre at whose end every joint is elsewhere than at its start",
                    key="MANOEUVRE",
                )
        return out

    @property
    def length_m(self) -> float:
        """Length of the last flexible link [m]; 1 if there is none."""
        return next(
            (link.length_m for link in reversed(self.robots[0].links) if link.flexible), 1.0
        )

    @property
    def objectives(self) -> tuple[str, ...]:
        """Names of the goals."""
        return ("settling_s", "rms_mm") if self.pareto else ("J",)

    def values(self, points: np.ndarray) -> np.ndarray:
        """Values (B, d) of the free settings at points (B, d)."""
        return search_space.settings(self.free, points)

    def start(self) -> np.ndarray:
        """The point (d,) of the file's own gains; the middle for settings that it lacks."""
        own = self.gains.settings
        return np.array(
            [f.to_unit_interval(own[f.name]) if f.name in own else 0.5 for f in self.free]
        )

    def tuned(self, values: np.ndarray) -> Gains:
        """The gains with the free settings at `values` (d,)."""
        return Gains(
            self.gains.settings | search_space.named(self.free, values),
            self.gains.outputs,
            self.gains.file,
        )

    @cached_property
    def cost_weights(self) -> np.ndarray:
        """The weights of J, (2, k)."""
        return objective.cost_weights(self.weights, len(self.robots[0].links), self.length_m)

    @cached_property
    def _rows(self) -> list[np.ndarray]:
        """The gains (N, 23) of each robot's controller."""
        return [c.gains() for c in self.controllers]

    def score(self, metrics: np.ndarray, reached: np.ndarray) -> np.ndarray:
        """The goals (B, 1 or 2).

        Args:
            metrics: (B, R, k).
            reached: fractions of the time reached (B, R).
        """
        if self.pareto:
            return objective.two_objectives(metrics, reached, self.manoeuvre.duration_s)
        return objective.scalar_cost(metrics, reached, self.cost_weights)

    def gain_sweeps(self) -> list[GainSweep]:
        """The prepared runs of each robot; any number of threads may use them."""
        m = self.manoeuvre
        both = zip(self.systems, self.controllers, strict=True)
        return [
            prepare_gain_sweep(
                system,
                controller,
                m.duration_s,
                m.output_step_s,
                self.rtol,
                start=m.start,
                loads=m.loads,
            )
            for system, controller in both
        ]

    def run(
        self, robots: Sequence[GainSweep], points: np.ndarray, limits: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Run points of the unit cube on all robots.

        A run is stopped if its J exceeds its limit. Its metrics are then lower bounds; they are 0
        on robots that follow.

        Args:
            robots: as `gain_sweeps` returns them.
            points: (B, d).
            limits: largest useful J (B,); inf or None: no limit.

        Returns:
            Metrics (B, R, k) and fractions of the time reached (B, R).
        """
        limits = np.full(len(points), np.inf) if limits is None else limits
        values, remaining = self.values(points), np.arange(len(points))
        width = self.cost_weights.shape[1]
        metrics, reached = (
            np.zeros((len(points), len(robots), width)),
            np.zeros((len(points), len(robots))),
        )
        for k, (case, controller, base) in enumerate(
            zip(robots, self.controllers, self._rows, strict=True)
        ):
            found, fraction = case.run(
                search_space.rows(self.free, values[remaining], controller, base),
                self.cost_weights,
                limits[remaining],
            )
            metrics[remaining, k], reached[remaining, k] = found, fraction
            remaining = remaining[(fraction == 1.0) | np.isinf(limits[remaining])]
        return metrics, reached

    def spec(self) -> dict[str, Any]:
        """All that the result depends on, except the search."""
        return {
            "robots": [robot.to_dict() for robot in self.robots],
            "manoeuvre": self.manoeuvre.spec(),
            "controller": self.gains.settings,
            "outputs": [{"kind": type(o).__name__, **vars(o)} for o in self.gains.outputs],
            "free": search_space.spec(self.free),
            "weights": vars(self.weights),
            "goals": list(self.objectives),
            "rtol": self.rtol,
            "modes": self.modes,
        }

    def digest(self, more: dict[str, Any] | None = None) -> str:
        """Digest of this task and `more`, to recognise it."""
        return hashlib.sha256(
            json.dumps([self.spec(), more], sort_keys=True, default=str).encode()
        ).hexdigest()


def with_modes(robot: fx.Robot, modes: int) -> fx.Robot:
    """The robot with so many modes of each flexible link; 0: unchanged."""
    data = robot.to_dict()
    for table, link in zip(data["link"], robot.links, strict=True):
        if modes and link.flexible:
            table["modes"] = min(modes, link.modes or 2 * link.elements)
    return fx.Robot.from_dict(data)


def perturbed_robots(
    robot: fx.Robot, payloads: Sequence[float] = (1.0,), stiffnesses: Sequence[float] = (1.0,)
) -> tuple[fx.Robot, ...]:
    """The robot, then all combinations of factors on payload and stiffness.

    Args:
        robot: the nominal robot.
        payloads: factors on the payload's mass and inertia.
        stiffnesses: factors on the links' stiffness.
    """
    out = [robot]
    for p in payloads:
        for s in stiffnesses:
            data = robot.to_dict()
            for key in ("mass_kg", "inertia_kg_m2"):
                if key in data.get("payload", {}):
                    data["payload"][key] *= p
            for link in data["link"]:
                if "young_modulus_Pa" in link:
                    link["young_modulus_Pa"] *= s
                elif "bending_stiffness_N_m2" in link:
                    EI = link["bending_stiffness_N_m2"]
                    link["bending_stiffness_N_m2"] = (
                        [entry | {"value": entry["value"] * s} for entry in EI]
                        if isinstance(EI, list)
                        else EI * s
                    )
            if (p, s) != (1.0, 1.0):
                out.append(fx.Robot.from_dict(data))
    return tuple(out)
