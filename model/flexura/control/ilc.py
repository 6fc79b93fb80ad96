"""Iterative learning control: what a trial teaches the next one's references.

The learning filter is the model's inverse, noncausal, over all robots that the uncertainty allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..system import assemble, linearize

WEIGHTS = np.linspace(0.0, 1.0, 41)  # that are tried
CONTRACTS = 0.9  # of an error: what a trial must leave less than
RESTED = 1e-9  # of the largest response: a reference that moves the tip less does nothing


@dataclass(frozen=True)
class JointLoop:
    """The controller of one joint's motor: F = force_per_V u, u = kp e + ki int e + kd e' + kv r'.

    Attributes:
        force_per_V: force or torque of the motor at the joint [N/V or N m/V].
        kp: gain of the error e = r - eta [V/m or V/rad].
        ki: of its integral [V/(m s) or V/(rad s)].
        kd: of its rate [V s/m or V s/rad].
        kv: of the reference's rate [V s/m or V s/rad].
    """

    force_per_V: float
    kp: float
    ki: float = 0.0
    kd: float = 0.0
    kv: float = 0.0


def reference_response(
    robot: Any, q: Any, frequencies_Hz: Any, loops: Sequence[JointLoop | None]
) -> np.ndarray:
    """The tip's small motions under the joints' references, through the controllers (141).

    Args:
        robot: a System, a Robot, or the path or name of a robot file, with the drives' inertia and
            damping in its joints.
        q: the equilibrium (n,), or None: the static one at the start.
        frequencies_Hz: (F,), above 0.
        loops: one a joint; None: the joint follows its reference exactly.

    Returns:
        (F, 2, joints), complex: x and y of the tip for a unit of each reference.

    Raises:
        InputError: there are not as many loops as joints, or a joint is locked.
    """
    system = assemble(robot)
    lin = linearize(system, q)
    joints = len(system.robot.links)
    if len(loops) != joints or len(lin.inputs) != joints:
        raise InputError("expected a loop for each joint, none locked", key="loops")
    s = 2j * np.pi * np.asarray(frequencies_Hz, dtype=float)[:, None, None]
    moved = np.linalg.solve(s**2 * lin.M + s * lin.G + lin.K, lin.E[None])
    rows = [lin.outputs.index(f"joint/{i + 1}/position") for i in range(joints)]
    joint = lin.outlook[rows] @ moved
    tip = lin.outlook[[lin.outputs.index("tip/x"), lin.outputs.index("tip/y")]] @ moved
    left, right = joint.copy(), np.zeros_like(joint)
    for i, loop in enumerate(loops):
        right[:, i, i] = 1.0
        if loop is not None:
            back = loop.force_per_V * (loop.kp + loop.ki / s + loop.kd * s)[:, 0, 0]
            left[:, i] *= back[:, None]
            left[:, i, i] += 1.0
            right[:, i, i] = back + loop.force_per_V * loop.kv * s[:, 0, 0]
    return np.asarray(tip @ np.linalg.solve(left, right))


@dataclass(frozen=True)
class LearningFilter:
    """What is added to the references for an error of a trial.

    Attributes:
        step_s: time between two samples [s].
        inverse: L (F, m, m), complex, at the frequencies of `numpy.fft.rfftfreq`.
        weight: w (F,), between 0 and 1.
        contraction: what one trial leaves of an error at the worst (F,); 1 where w is 0.
    """

    step_s: float
    inverse: np.ndarray
    weight: np.ndarray
    contraction: np.ndarray

    @property
    def frequencies_Hz(self) -> np.ndarray:
        """Frequencies (F,) [Hz]."""
        return np.fft.rfftfreq(2 * (len(self.weight) - 1), self.step_s)

    @property
    def bandwidth_Hz(self) -> float:
        """The frequency below which all is learned with at least half the weight [Hz]."""
        low = np.flatnonzero(self.weight < 0.5)
        return float(self.frequencies_Hz[low[0] - 1 if len(low) and low[0] else -1])

    def update(self, error: Any) -> np.ndarray:
        """Changes of the references for a trial's error (140), before and after it in time.

        Args:
            error: (T, m), what the outputs lack, at rest at its start.

        Returns:
            (T, m).

        Raises:
            InputError: the trial is longer than half of what the filter is made for.
        """
        e = np.asarray(error, dtype=float)
        count = 2 * (len(self.weight) - 1)
        if 2 * len(e) > count:
            raise InputError(f"expected at most {count // 2} samples", key="error", value=len(e))
        # what is off at the end fades afterwards
        fade = 0.5 * (1 + np.cos(np.linspace(0.0, np.pi, count // 4)))
        padded = np.zeros((count, e.shape[1]))
        padded[: len(e)] = e
        padded[len(e) : len(e) + len(fade)] = e[-1] * fade[:, None]
        spectrum = np.fft.rfft(padded, axis=0)
        change = self.weight[:, None] * (self.inverse @ spectrum[:, :, None])[:, :, 0]
        return np.asarray(np.fft.irfft(change, count, axis=0)[: len(e)])


def filter_length(samples: int) -> int:
    """Samples of a filter for trials of so many: a power of two, at least twice as many."""
    return 1 << int(np.ceil(np.log2(2 * samples)))


def learning_filter(
    responses: np.ndarray, step_s: float, highest_Hz: float = np.inf
) -> LearningFilter:
    """The inverse of robots that may be meant (142), and how much of it is safe (143).

    L is the least-squares inverse of all responses together. Where they agree it inverts them.
    Where a resonance may be on either side, they cancel. The weight w is that which leaves the
    least of an error for the worst robot, 0 where an error might not shrink.

    Args:
        responses: H_p (P, F, m, m), complex, of P robots at the frequencies of `rfftfreq`.
        step_s: time between two samples [s].
        highest_Hz: nothing is learned above; the weight falls to 0 within half an octave below.

    Returns:
        The filter.

    Raises:
        InputError: a reference does not move the outputs.
    """
    H = np.asarray(responses, dtype=complex)
    conjugate = H.conj().swapaxes(-1, -2)
    normal = (conjugate @ H).sum(axis=0)
    if np.linalg.svd(normal[0], compute_uv=False)[-1] <= RESTED * np.abs(normal[0]).max():
        raise InputError("expected references that move the outputs", key="responses")
    inverse = np.linalg.solve(normal, conjugate.sum(axis=0))
    one = np.eye(H.shape[-1])
    passed = H @ inverse
    left = np.array(
        [np.linalg.norm(one - w * passed, 2, axis=(-2, -1)).max(axis=0) for w in WEIGHTS]
    )
    best = left.argmin(axis=0)
    weight = np.where(left.min(axis=0) < CONTRACTS, WEIGHTS[best], 0.0)
    f = np.fft.rfftfreq(2 * (len(weight) - 1), step_s)
    with np.errstate(divide="ignore"):
        octaves = np.log2(highest_Hz / f)
    weight *= 0.5 * (1 - np.cos(np.pi * np.clip(2 * octaves, 0.0, 1.0)))
    contraction = np.linalg.norm(one - weight[:, None, None] * passed, 2, axis=(-2, -1)).max(axis=0)
    return LearningFilter(step_s, inverse, weight, contraction)
