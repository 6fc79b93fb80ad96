"""What is tuned on what: robots, a manoeuvre, a controller with free settings, and an objective.
Plain data, that travels."""

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
from flexura.simulation import Trials, trials

from . import objective
from . import search_space as freedom
from .closed_loop import under
from .objective import Weights
from .search_space import Free

# of a search's runs, whose steps the ticks bound; what comes out is simulated again to 1e-6, with
# the mesh of the robot file
RTOL, MODES = 1e-3, 2


@dataclass(frozen=True)
class Task:
    """Robots (the nominal one first), what they are to do, `gains` with its free settings, weights;
    `pareto`: two objectives.

    The runs of a search keep `modes` of each flexible link (0: what the robot file says).
    """

    robots: tuple[fx.Robot, ...]
    manoeuvre: fx.Manoeuvre
    gains: Gains
    free: tuple[Free, ...]
    weights: Weights = field(default_factory=Weights)
    pareto: bool = False
    rtol: float = RTOL
    modes: int = MODES

    def __post_init__(self) -> None:
        freedom.check(self.free, self.gains)

    @cached_property
    def systems(self) -> list[fx.System]:
        """As the search has them."""
        return [fx.assemble(reduced(robot, self.modes)) for robot in self.robots]

    @cached_property
    def controllers(self) -> list[fx.Controller]:
        """The controller of each robot with the file's own gains. Raises InputError for a joint
        that has nowhere to go."""
        out = [under(system, self.manoeuvre, self.gains) for system in self.systems]
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
        """Of the last flexible link, 1 where there is none."""
        return next(
            (link.length_m for link in reversed(self.robots[0].links) if link.flexible), 1.0
        )

    @property
    def goals(self) -> tuple[str, ...]:
        return ("settling_s", "rms_mm") if self.pareto else ("J",)

    def values(self, points: np.ndarray) -> np.ndarray:
        return freedom.settings(self.free, points)

    def start(self) -> np.ndarray:
        """The point (d,) of the file's own gains, the middle where the file is silent."""
        own = self.gains.settings
        return np.array([f.place(own[f.name]) if f.name in own else 0.5 for f in self.free])

    def tuned(self, values: np.ndarray) -> Gains:
        """The gains file with the free settings at `values` (d,)."""
        return Gains(
            self.gains.settings | freedom.named(self.free, values),
            self.gains.outputs,
            self.gains.file,
        )

    @cached_property
    def prices(self) -> np.ndarray:
        """Of J."""
        return objective.prices(self.weights, len(self.robots[0].links), self.length_m)

    @cached_property
    def _rows(self) -> list[np.ndarray]:
        """The gains (N, 20) of each robot's controller."""
        return [c.gains() for c in self.controllers]

    def score(self, figures: np.ndarray, reached: np.ndarray) -> np.ndarray:
        """The goals (B, 1 or 2) from figures (B, R, k) and fractions reached (B, R)."""
        if self.pareto:
            return objective.double(figures, reached, self.manoeuvre.duration_s)
        return objective.single(figures, reached, self.prices)

    def trials(self) -> list[Trials]:
        """What runs are made with, one for each robot; for any number of threads."""
        m = self.manoeuvre
        both = zip(self.systems, self.controllers, strict=True)
        return [
            trials(system, controller, m.duration_s, m.output_step_s, self.rtol)
            for system, controller in both
        ]

    def run(
        self, robots: Sequence[Trials], points: np.ndarray, limits: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Figures (B, R, k) and fractions reached (B, R) at points (B, d) of the unit cube, each
        abandoned where J exceeds its limit (B,), inf for none: its figures are then lower bounds, 0
        on the robots that it was not tried on any more."""
        limits = np.full(len(points), np.inf) if limits is None else limits
        values, left = self.values(points), np.arange(len(points))
        width = self.prices.shape[1]
        figures, reached = (
            np.zeros((len(points), len(robots), width)),
            np.zeros((len(points), len(robots))),
        )
        for k, (one, controller, base) in enumerate(
            zip(robots, self.controllers, self._rows, strict=True)
        ):
            found, far = one.run(
                freedom.rows(self.free, values[left], controller, base), self.prices, limits[left]
            )
            figures[left, k], reached[left, k] = found, far
            left = left[(far == 1.0) | np.isinf(limits[left])]
        return figures, reached

    def spec(self) -> dict[str, Any]:
        """All that the outcome depends on but the search, for metadata and to know a stored run
        again."""
        return {
            "robots": [robot.to_dict() for robot in self.robots],
            "manoeuvre": self.manoeuvre.spec(),
            "controller": self.gains.settings,
            "outputs": [{"kind": type(o).__name__, **vars(o)} for o in self.gains.outputs],
            "free": freedom.spec(self.free),
            "weights": vars(self.weights),
            "goals": list(self.goals),
            "rtol": self.rtol,
            "modes": self.modes,
        }

    def digest(self, more: dict[str, Any] | None = None) -> str:
        """Of this task and `more`: to know it again."""
        return hashlib.sha256(
            json.dumps([self.spec(), more], sort_keys=True, default=str).encode()
        ).hexdigest()


def reduced(robot: fx.Robot, modes: int) -> fx.Robot:
    """The robot with so many modes of each flexible link, 0: as it is."""
    data = robot.to_dict()
    for table, link in zip(data["link"], robot.links, strict=True):
        if modes and link.flexible:
            table["modes"] = min(modes, link.modes or 2 * link.elements)
    return fx.Robot.from_dict(data)


def varied(
    robot: fx.Robot, payloads: Sequence[float] = (1.0,), stiffnesses: Sequence[float] = (1.0,)
) -> tuple[fx.Robot, ...]:
    """The robot itself, then all combinations of factors on the payload (mass and inertia) and on
    the links' stiffness."""
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
