"""Iterative learning control: what a trial teaches the next one's joint motions.

The model is linearised along the motion, and its inverse is that of least squares over all robots
that the uncertainty allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..system import assemble, linearize, static

RIDGE = 1e-3  # of the largest square of a joint: what moves the tip less is left alone
SMOOTH = 1e-3  # of it: second differences of the splines' coefficients
POSTURE_S = 0.04  # between two postures in which the robot is linearised
STEP_S = 0.002  # at most, of the midpoint rule
MODES = 4  # of the links with held joints
SAME = 1e-4  # m or rad: postures that are not told apart


@dataclass(frozen=True)
class JointLoop:
    """The controller of one joint's motor: u = kp e + ki int e + kd e' + kv r' + kc sign r'.

    Attributes:
        force_per_V: force or torque of the motor at the joint [N/V or N m/V].
        kp: gain of the error e = r - eta [V/m or V/rad].
        ki: of its integral [V/(m s) or V/(rad s)].
        kd: of its rate [V s/m or V s/rad].
        kv: of the reference's rate [V s/m or V s/rad].
        kc: with the sign of the reference's rate [V].
    """

    force_per_V: float
    kp: float
    ki: float = 0.0
    kd: float = 0.0
    kv: float = 0.0
    kc: float = 0.0

    def reference(
        self, step_s: float, position: np.ndarray, voltage: np.ndarray, side: np.ndarray
    ) -> np.ndarray:
        """The reference with which a joint that moves so gets this voltage (125).

        Args:
            step_s: time between two samples [s].
            position: of the joint (T,) [m or rad], at rest at the start.
            voltage: that moves it (T,) [V].
            side: sign of its velocity, smooth at reversals (T,).

        Returns:
            (T,) [m or rad].
        """
        rate = np.gradient(position, step_s)
        own = np.asarray(voltage) - self.kv * rate - self.kc * np.asarray(side)
        slow = (self.kd + self.kv) / step_s
        error, total, out = 0.0, 0.0, np.zeros(len(own))
        for k in range(1, len(own)):
            error = (slow * error + own[k] - self.ki * total) / (slow + self.kp + self.ki * step_s)
            total += step_s * error
            out[k] = error
        return np.asarray(position + out)


@dataclass(frozen=True)
class JointSpring:
    """A stepper: its pulses follow the reference, and a magnetic spring pulls the joint after them.

    Attributes:
        stiffness: of the spring [N/m or N m/rad].
    """

    stiffness: float


def motion_response(
    robot: Any,
    t: Any,
    joints: np.ndarray,
    changes: Sequence[np.ndarray],
    springs: Sequence[JointSpring | None] = (),
) -> np.ndarray:
    """What changes of the joints' motions do to the tip, along a motion (124).

    A joint is where its motion says. One with a spring gives way; its motion is that of the pulses.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        t: evenly spaced times (T,) [s].
        joints: the motion (T, J) along which the robot is linearised, links in static equilibrium.
        changes: one a joint: functions (T, n_j), at rest at the start.
        springs: one a joint, or None; empty: there is none.

    Returns:
        x and y of the tip for a unit of each function, (T, 2, sum of n_j) [m].

    Raises:
        InputError: there are not as many changes or springs as joints.
    """
    from scipy.interpolate import CubicSpline

    system, t = assemble(robot), np.asarray(t, dtype=float)
    count = len(system.robot.links)
    held = tuple(springs) or (None,) * count
    if not len(changes) == len(held) == np.shape(joints)[1] == count:
        raise InputError("expected changes of each joint", key="changes", value=len(changes))
    parts = max(int(np.ceil((t[1] - t[0]) / STEP_S - 1e-9)), 1)
    h = (t[1] - t[0]) / parts
    fine = t[0] + h * np.arange(parts * (len(t) - 1) + 1)
    nodes, M, G, K, O = _along(system, t, joints)
    columns = np.cumsum([0, *(c.shape[1] for c in changes)])
    asked = np.zeros((len(fine), count, columns[-1]))
    for j, change in enumerate(changes):
        asked[:, j, columns[j] : columns[j + 1]] = CubicSpline(t, change)(fine)
    x = np.zeros((M.shape[1], columns[-1]))
    v, out = x.copy(), np.zeros((len(t), 2, columns[-1]))
    for k in range(1, len(fine)):
        s = (fine[k] - 0.5 * h - nodes[0]) / (nodes[1] - nodes[0])
        i = min(int(s), len(nodes) - 2)
        at = lambda A, i=i, s=s: (1 + i - s) * A[i] + (s - i) * A[i + 1]
        m, g, stiff = at(M), at(G), at(K)
        force = np.zeros_like(x)
        for j, spring in enumerate(held):
            if spring is not None:
                stiff[j, j] += spring.stiffness
                force[j] = 0.5 * spring.stiffness * (asked[k, j] + asked[k - 1, j])
        A = m / h + g / 2 + h / 4 * stiff
        right = force + (m / h - g / 2 - h / 4 * stiff) @ v - stiff @ x
        for j, spring in enumerate(held):
            if spring is None:
                A[j], A[j, j] = 0.0, 1.0
                right[j] = 2 * (asked[k, j] - asked[k - 1, j]) / h - v[j]
        after = np.linalg.solve(A, right)
        x, v = x + h / 2 * (v + after), after
        if k % parts == 0:
            out[k // parts] = at(O) @ x
    return out


def _along(
    system: Any, t: np.ndarray, joints: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, G, K and the tip's rows at postures on the way, in joints and the links' lowest modes."""
    from scipy.linalg import eigh

    count = max(int(np.ceil((t[-1] - t[0]) / POSTURE_S)) + 1, 2)
    nodes = np.linspace(t[0], t[-1], count)
    way = np.column_stack([np.interp(nodes, t, column) for column in np.asarray(joints).T])
    linear, last = [], None
    for posture in way:
        if last is None or np.abs(posture - last).max() > SAME:
            lin, last = linearize(system, static(system, joints=posture)), posture
        linear.append(lin)
    first = linear[count // 2]
    links = np.setdiff1d(np.arange(system.n), system.joint_rows)
    some = min(MODES, len(links))
    shapes = np.zeros((system.n, way.shape[1] + some))
    shapes[list(system.joint_rows), np.arange(way.shape[1])] = 1.0
    if some:
        own = np.ix_(links, links)
        shapes[links, way.shape[1] :] = eigh(first.K[own], first.M[own])[1][:, :some]
    tip = [first.outputs.index(name) for name in ("tip/x", "tip/y")]
    small = [
        np.array([shapes.T @ matrix(lin) @ shapes for lin in linear])
        for matrix in (lambda lin: lin.M, lambda lin: lin.G, lambda lin: lin.K)
    ]
    seen = np.array([lin.outlook[tip] @ shapes for lin in linear])
    return nodes, small[0], small[1], small[2], seen


@dataclass(frozen=True)
class LearningLaw:
    """What is added to the joints' motions for an error of a trial, as coefficients of functions.

    Attributes:
        responses: Y_p (P, T, m, n) of the robots that may be meant, the likeliest one first: what n
            functions do to m outputs.
        counts: of the functions of each joint; their sum is n.
        share: what each sample counts (T,), 1 where all of it does.
    """

    responses: np.ndarray
    counts: tuple[int, ...]
    share: np.ndarray

    def update(self, error: np.ndarray) -> np.ndarray:
        """The coefficients of a change (123).

        Args:
            error: (T, m), what the outputs lack.

        Returns:
            (n,).

        Raises:
            InputError: the functions do not move the outputs.
        """
        wanted = (self.share[:, None] * error).ravel()
        normal, right = np.zeros((sum(self.counts),) * 2), np.zeros(sum(self.counts))
        for Y in self.responses:
            A = (self.share[:, None, None] * Y).reshape(len(wanted), -1)
            normal, right = normal + A.T @ A, right + A.T @ wanted
        start = 0
        for count in self.counts:
            own = slice(start, start + count)
            size = np.diag(normal)[own].max()
            if not size > 0:
                raise InputError("expected motions that move the outputs", key="responses")
            bend = np.diff(np.eye(count), 2, axis=0)
            normal[own, own] += size * (RIDGE * np.eye(count) + SMOOTH * bend.T @ bend)
            start += count
        return np.asarray(np.linalg.solve(normal, right))

    def predicted(self, error: np.ndarray, change: np.ndarray) -> np.ndarray:
        """The largest error that each robot predicts for a change (126).

        Args:
            error: (T, m), what the outputs lack without it.
            change: coefficients (n,).

        Returns:
            (P,), in the outputs' unit.
        """
        left = error - self.responses @ change
        return np.asarray(np.linalg.norm(left, axis=2).max(axis=1))
