"""What is known of the rig: the identified model, how sure it is, what a motion does to its tip."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import flexura as fx
from flexura.control import JointSpring, LearningLaw, motion_response
from flexura.errors import InputError

from ..identification.strip import with_parameters, with_stepper_damping
from ..rig.axes import motor_axes
from .drives import DriveInverse, drive_inverse, loops
from .knowledge import Knowledge
from .task import Task

STICKS_S = 0.2, 0.4  # after a joint's last motion: where it is then, it sticks
SINGULAR = 1e4  # condition of the joints' slopes


@dataclass(frozen=True)
class RigModel:
    """A task with what is known of its rig.

    Attributes:
        task: what is learned.
        knowledge: the model and its uncertainty.
    """

    task: Task
    knowledge: Knowledge

    def _robot(self, factors: dict[str, float]) -> fx.Robot:
        setup = self.task.setup
        values = self.knowledge.values | factors
        return with_stepper_damping(with_parameters(setup.robot, values), setup.rig)

    @cached_property
    def law(self) -> LearningLaw:
        """The law of learning: from the tip's error to changes of the joints' motions.

        Raises:
            InputError: the joints cannot move the tip in every direction, anywhere on the way.
        """
        task = self.task
        slopes = task.slopes(task.first)
        if task.first.shape[1] > 1 and np.linalg.cond(slopes).min() > SINGULAR:
            raise InputError(
                "expected a manoeuvre on which the joints can move the tip in every direction",
                key="manoeuvre",
                value=task.manoeuvre.name,
            )
        holding = self.knowledge.values.get("holding", 1.0)
        drives = loops(task.setup, task.settings, holding)
        springs = [drive if isinstance(drive, JointSpring) else None for drive in drives]
        responses = [
            task.along(
                motion_response(self._robot(factors), task.t, task.first, task.basis, springs)
            )
            for factors in ({}, *self.knowledge.others)
        ]
        counts = tuple(one.shape[1] for one in task.basis)
        return LearningLaw(np.array(responses), counts, task.share)

    def drives(self, motions: np.ndarray, beyond: np.ndarray | None = None) -> DriveInverse:
        """The references of joint motions (T, J) at the task's times [m or rad].

        Args:
            motions: of the joints.
            beyond: how far beyond its last place each joint will stick (J,); default 0.
        """
        task, knowledge = self.task, self.knowledge
        system = fx.assemble(self._robot({}))
        return drive_inverse(task.setup, task.settings, system, knowledge, task.t, motions, beyond)

    def beyond(self, run: fx.Run, motions: np.ndarray) -> np.ndarray:
        """How far beyond their last places joints stuck in a trial (J,) [m or rad].

        Args:
            run: the trial.
            motions: what its references were for (T, J).
        """
        task, wanted = self.task, self.drives(motions).references[-1]
        out = np.zeros(len(wanted))
        for axis in motor_axes(task.setup.rig):
            last = task.moving[axis.number - 1][1]
            holds = (run.t > last + STICKS_S[0]) & (run.t < last + STICKS_S[1])
            places = run[f"joint/{axis.number}/position"][holds]
            if np.isfinite(places).any():  # not all are dropouts
                out[axis.number - 1] = np.nanmedian(places) - wanted[axis.number - 1]
        return out

    def moved(self, run: fx.Run) -> np.ndarray:
        """The joints' motions in a run, of a stepper its pulses', in the task's functions.

        Args:
            run: a trial as the model follows it.

        Returns:
            (T, J) [m or rad].
        """
        task, out = self.task, self.task.first.copy()
        drives = loops(task.setup, task.settings)
        for j, (drive, basis) in enumerate(zip(drives, task.basis, strict=True)):
            if isinstance(drive, JointSpring):
                continue
            measured = run[f"joint/{j + 1}/position"]
            there = np.isfinite(measured)
            off = np.interp(task.t, run.t[there], measured[there]) - out[:, j]
            size = basis.shape[1]
            A = np.concatenate([basis, 1e-2 * np.eye(size)])
            out[:, j] += basis @ np.linalg.lstsq(A, np.append(off, np.zeros(size)), rcond=None)[0]
        return out
