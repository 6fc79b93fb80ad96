"""What is learned: references of the joints with which the tip goes where a rigid robot's would.

A trial rests for REST_S, does the manoeuvre, and holds for HOLD_S. On a real rig it then goes back
to where it began. The joints may begin before the tip does.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import flexura as fx
from flexura import signals

from ..board.protocol.declaration import CONTROL_HZ
from ..experiment import plan
from ..experiment.lead_in import quintic, with_lead_in
from ..rig import Check, RigSetup, check_capability
from ..rig.board_axes import board_axes

STEP_S = 2**plan.PERIOD_LOG2 / CONTROL_HZ  # of the board's knots
REST_S, HOLD_S = 0.4, 0.4
SPACING_S = 0.04  # of the splines of which changes are made
BEFORE_S, AFTER_S = 0.2, -0.1  # the joint's motion, in which its references may change
MOVING = 0.02  # of its largest speed
PERIODS = 2.5  # of the first mode, in which an error after the motion counts an e-th
RETURN_S = 1.0  # at least
RETURN_SPEED = 0.25  # of the board's limit
STILL_S = 0.4  # at the end, so that the joints settle at zero


@dataclass(frozen=True)
class Task:
    """A manoeuvre to learn, on a rig.

    Attributes:
        setup: the rig.
        settings: the board's settings, by name.
        manoeuvre: as it is asked.
        motions: its joints' motions with leads, from REST_S on, one Signal a joint.
        span_s: their duration [s].
        goes_back: whether a trial ends where it began, as on a real rig.
    """

    setup: RigSetup
    settings: dict[str, float]
    manoeuvre: fx.Manoeuvre
    motions: tuple[fx.Signal, ...]
    span_s: float
    goes_back: bool = True

    @classmethod
    def of(
        cls,
        setup: RigSetup,
        settings: dict[str, float],
        manoeuvre: fx.Manoeuvre,
        goes_back: bool = True,
    ) -> Task:
        """The task of a manoeuvre, with leads where it does not begin and end at rest.

        Args:
            setup: the rig.
            settings: the board's settings, by name.
            manoeuvre: with a motion of each joint.
            goes_back: whether a trial ends where it began.

        Raises:
            InputError: a joint has no motion.
        """
        asked = plan.inverse(setup, settings, manoeuvre).asked
        lead_s, out_s = asked["lead_s"], asked["out_s"]
        motions = [joint.motion for joint in manoeuvre.drive.joints if joint.motion is not None]
        led = [with_lead_in(m, manoeuvre.duration_s, lead_s, out_s) for m in motions]
        span_s = lead_s + manoeuvre.duration_s + out_s
        return cls(setup, settings, manoeuvre, tuple(led), span_s, goes_back)

    @cached_property
    def t(self) -> np.ndarray:
        """The board's knots, from the start to the end of the hold (T,) [s]."""
        count = int(np.ceil((REST_S + self.span_s + HOLD_S) / STEP_S - 1e-9)) + 1
        return np.asarray(STEP_S * np.arange(count))

    @cached_property
    def first(self) -> np.ndarray:
        """References of the first trial: the manoeuvre's own motions (T, J) [m or rad]."""
        return self.joints(self.t)

    def joints(self, t: np.ndarray) -> np.ndarray:
        """Where the joints of a rigid robot would be, at times (T,) (T, J) [m or rad]."""
        inside = np.clip(t - REST_S, 0.0, self.span_s)
        return np.array([[motion(float(at))[0] for motion in self.motions] for at in inside])

    def wanted(self, t: np.ndarray) -> np.ndarray:
        """Where the tip is asked to be, x and y at times (T,): a rigid robot's (T, 2) [m]."""
        return self._tips(self.joints(t))

    def _tips(self, joints: np.ndarray) -> np.ndarray:
        system = fx.assemble(self.setup.robot)
        q, out = np.zeros(system.n), []
        for place in joints:
            q[system.joint_rows] = place
            out.append(fx.tip_pose(system, q)[:2])
        return np.array(out)

    def slopes(self, joints: np.ndarray) -> np.ndarray:
        """How a rigid robot's joints at (T, J) move its tip (T, 2, J)."""
        at, h = joints, 1e-5
        columns = []
        for i in range(at.shape[1]):
            off = h * np.eye(at.shape[1])[i]
            columns.append((self._tips(at + off) - self._tips(at - off)) / (2 * h))
        return np.stack(columns, axis=-1)

    def error(self, t: np.ndarray, tip: np.ndarray) -> np.ndarray:
        """What the tip lacks along what the joints can move (T, J) [m].

        One joint that turns: along its circle, by the tip's polar angle. Else x and y.

        Args:
            t: times (T,) [s].
            tip: x and y (T, 2) [m].
        """
        wanted = self.wanted(t)
        if self.setup.rig.joints > 1:
            return wanted - tip
        angle = np.arctan2(wanted[:, 1], wanted[:, 0]) - np.arctan2(tip[:, 1], tip[:, 0])
        angle = (angle + np.pi) % (2 * np.pi) - np.pi
        return np.asarray(angle * np.hypot(*wanted.T))[:, None]

    def along(self, moved: np.ndarray) -> np.ndarray:
        """Small motions of the tip, as `error` measures them: (T, 2, n) becomes (T, m, n)."""
        if self.setup.rig.joints > 1:
            return moved
        return np.asarray(self.across(self.first)[:, None] @ moved)

    def across(self, joints: np.ndarray) -> np.ndarray:
        """Unit vectors across the last link of a rigid robot whose joints are at (T, J) (T, 2)."""
        links = self.setup.robot.links
        turns = [link.joint.type == "R" for link in links]
        angle = joints @ np.array(turns, dtype=float)
        angle = angle + sum(link.joint.angle_rad for link in links)
        return np.column_stack([-np.sin(angle), np.cos(angle)])

    @cached_property
    def basis(self) -> list[np.ndarray]:
        """Of each joint the functions (T, n) of which a change of its references is made.

        They are cubic B-splines from shortly before the joint moves until shortly after. A joint at
        rest sticks, so that a change ends with the motion. The last one stays: the joint stops
        elsewhere.
        """
        from scipy.interpolate import BSpline

        spline = BSpline.basis_element(np.arange(5.0), extrapolate=False)
        out = []
        for first, last in self.moving:
            begin, end = first - BEFORE_S, last + AFTER_S
            count = int(np.ceil((end - begin) / SPACING_S))
            places = (self.t[:, None] - begin) / SPACING_S
            each = np.nan_to_num(spline(places - np.arange(4 + int(places[-1, 0]))))
            out.append(np.column_stack([each[:, :count], each[:, count:].sum(axis=1)]))
        return out

    @cached_property
    def moving(self) -> list[tuple[float, float]]:
        """From when to when each joint moves in the first trial [s]."""
        out = []
        for column in self.first.T:
            speed = np.abs(np.gradient(column, STEP_S))
            times = self.t[speed > MOVING * max(speed.max(), 1e-12)]
            out.append((times[0], times[-1]) if len(times) else (REST_S, REST_S))
        return out

    @cached_property
    def share(self) -> np.ndarray:
        """What the tip's error counts at each time (T,): less and less after the motion.

        A vibration that is stopped in its first periods does not come back. Later its phase shows
        what the model's frequency is off, and a change that follows it would be wrong.
        """
        end = max(last for _, last in self.moving) + AFTER_S
        period = 1 / fx.frequencies(self.setup.robot, count=1)[0]
        return np.asarray(np.exp(-np.maximum(self.t - end, 0.0) / (PERIODS * period)))

    def asked(self, references: np.ndarray, name: str) -> fx.Manoeuvre:
        """A trial as a manoeuvre: the references, and the way back if there is one.

        Args:
            references: (T, J) at `t` [m or rad].
            name: of the manoeuvre.
        """
        back_s = RETURN_S
        for axis, last in zip(board_axes(self.settings), references[-1], strict=True):
            speed = RETURN_SPEED * self.settings[axis.names["speed"]]
            back_s = max(back_s, 1.875 * abs(float(last)) / speed)
        steps = int(np.ceil(back_s / STEP_S)) if self.goes_back else 0
        still = round(STILL_S / STEP_S) if self.goes_back else 0
        t = STEP_S * np.arange(len(self.t) + steps + still)
        s, motions = STEP_S * np.arange(1, steps + 1), []
        for column in references.T:
            row = quintic(0.0, back_s, (column[-1], 0.0, 0.0), (0.0, 0.0, 0.0))
            way = np.polynomial.polynomial.polyval(np.minimum(s, back_s), row[1:7])
            motions.append(signals.table(t, np.concatenate([column, way, np.zeros(still)])))
        off = [0.0] * len(motions)
        drive = fx.Drive.pd(motions, off, off)
        return fx.Manoeuvre(name, float(t[-1]), STEP_S, drive)

    def plan(
        self,
        references: np.ndarray,
        trial: int,
        motions: np.ndarray | None = None,
        checks: Sequence[Check] = (),
        **more: Any,
    ) -> plan.Plan:
        """The plan of a trial, with the rig's checks of drive, travel, limits and speed.

        Args:
            references: (T, J) at `t` [m or rad].
            trial: its number, from 1.
            motions: of the joints, where references differ from what they are for (T, J).
            checks: further ones.
            more: further entries of the Run's metadata.
        """
        name = f"trial {trial} of {self.manoeuvre.name or 'a manoeuvre'}"
        made = plan.inverse(self.setup, self.settings, self.asked(references, name))
        learning = {"trial": trial, "learned_s": [0.0, float(self.t[-1])]} | more
        phases = [
            {"t": 0.0, "name": "rest"},
            {"t": REST_S, "name": "manoeuvre"},
            {"t": REST_S + self.span_s, "name": "hold"},
        ]
        if self.goes_back:
            phases.append({"t": float(self.t[-1]), "name": "way back"})
        found = made.checks
        if motions is not None:  # a reference's own speed and force are the controller's
            moved = check_capability(self.setup, self.asked(motions, name))
            found = moved + [check for check in found if check.what.endswith("range")]
        return dataclasses.replace(
            made,
            checks=[*found, *checks],
            asked=made.asked | {"learning": learning},
            phases=phases,
        )
