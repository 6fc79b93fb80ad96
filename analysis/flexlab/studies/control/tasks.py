"""The motions of `flexura study control`: from rest to rest on smooth set-points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import flexura as fx
from flexura.signals import Signal, polynomial
from flexura.simulation import rigid_robot

ROOM = 1.5  # drive limits over what the rigid robot needs on the set-points
BANDWIDTH = 1.0  # of the joints' loops, over the first frequency with joints locked
RATE_HZ = 4000.0  # of the PIDs: the rotor of joint 2 is light
DERIVATIVE_HZ = 20.0  # filter of their measured velocities


@dataclass(frozen=True)
class Task:
    """A motion of a robot with two joints: `start` and `end` of the joints [m or rad], and the
    duration of the set-points [s]."""

    described: fx.Robot
    start: tuple[float, float]
    end: tuple[float, float]
    duration_s: float

    @cached_property
    def robot(self) -> fx.Robot:
        """The robot with its joints at the start."""
        data = self.described.to_dict()
        for link, at in zip(data["link"], self.start, strict=True):
            link["joint"]["start_rad" if link["joint"]["type"] == "R" else "start_m"] = at
        return fx.Robot.from_dict(data)

    @cached_property
    def system(self) -> fx.System:
        """The robot, assembled."""
        return fx.assemble(self.robot)

    @cached_property
    def rigid(self) -> fx.System:
        """The same robot with rigid links."""
        return fx.assemble(rigid_robot(self.robot))

    @cached_property
    def set_points(self) -> tuple[Signal, ...]:
        """Of the joints: polynomials of degree 5."""
        ends = zip(self.start, self.end, strict=True)
        return tuple(polynomial(b, self.duration_s, a) for a, b in ends)

    def tip(self, joints: tuple[Signal, ...], t: float) -> np.ndarray:
        """The rigid robot's tip.

        Args:
            joints: the joints as signals of time.
            t: the time [s].

        Returns:
            x and y (2,) [m].
        """
        q = self.rigid.start()
        q[self.rigid.joint_rows] = [signal(t)[0] for signal in joints]
        return np.asarray(fx.tip_pose(self.rigid, q)[:2])

    @cached_property
    def limits(self) -> np.ndarray:
        """Of the drives (2,) [N or N m]: more than the rigid robot needs on the set-points."""
        t = np.linspace(0.0, self.duration_s, 201)
        run = fx.inverse(self.rigid, t, list(self.set_points)).uninterrupted()
        return ROOM * np.array([np.abs(run[f"joint/{i}/drive"]).max() for i in (1, 2)])

    @cached_property
    def mode(self) -> tuple[float, float]:
        """Frequency [Hz] and damping ratio of the first mode, joints locked at the end."""
        modes = fx.modes(self.system, fx.static(self.system, list(self.end)), count=1)
        return float(modes.frequencies_Hz[0]), float(modes.damping_ratios[0])

    @cached_property
    def gains(self) -> tuple[np.ndarray, np.ndarray]:
        """kp and kd (2,) of the joints: two equal real poles for each joint's rigid inertia."""
        q = self.rigid.start()
        q[self.rigid.joint_rows] = self.end
        inertia = np.diag(self.rigid.mass(q))[self.rigid.joint_rows]
        pole = 2 * math.pi * BANDWIDTH * self.mode[0]
        return inertia * pole**2, 2 * inertia * pole

    def with_payload(self, factor: float) -> fx.Robot:
        """The robot with another payload.

        Args:
            factor: how many times the mass.

        Returns:
            The Robot.
        """
        mass = self.robot.payload.mass_kg
        return self.robot.replace({"payload.mass_kg": factor * mass})


TASKS = {
    "rig": Task(fx.load("rig"), (0.0, 0.0), (0.10, math.pi / 4), 0.6),
    "type-1-rr": Task(fx.load("type-1-rr"), (0.0, 0.6), (0.8, 0.1), 0.6),
}
