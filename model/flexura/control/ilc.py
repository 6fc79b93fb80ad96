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
FORGETS = 7.0  # e-folds in the duration of a transform
RIDGE = 1e-3  # of the largest square: what moves the tip less is left alone
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


@dataclass(frozen=True)
class JointSpring:
    """A stepper: its pulses follow the reference, and a magnetic spring pulls the joint after them.

    Attributes:
        stiffness: of the spring [N/m or N m/rad].
    """

    stiffness: float


def reference_response(
    robot: Any, q: Any, s: Any, loops: Sequence[JointLoop | JointSpring]
) -> tuple[np.ndarray, np.ndarray]:
    """Small motions of tip and joints under the joints' references, through the controllers (122).

    The controllers move the robot as if it were rigid. Its links vibrate on joints that move as
    prescribed: friction and gear hold a motor's joint against them. A stepper's joint gives way.

    Args:
        robot: a System, a Robot, or the path or name of a robot file, with the drives' inertia and
            damping in its joints.
        q: the equilibrium (n,), or None: the static one at the start.
        s: complex frequencies (F,) [1/s], as of `transform_points`; not 0.
        loops: one a joint.

    Returns:
        H (F, 2, joints) and T (F, joints, joints), complex: x and y of the tip, and the joints, for
        a unit of each reference.

    Raises:
        InputError: there are not as many loops as joints, or a joint is locked.
    """
    system = assemble(robot)
    lin = linearize(system, q)
    joints = len(system.robot.links)
    if len(loops) != joints or len(lin.inputs) != joints:
        raise InputError("expected a loop for each joint, none locked", key="loops")
    s = np.asarray(s, dtype=complex)[:, None, None]
    whole = s**2 * lin.M + s * lin.G + lin.K
    rigid, input_ = lin.E.T @ whole @ lin.E, np.zeros((len(s), joints, joints), dtype=complex)
    for i, loop in enumerate(loops):
        if isinstance(loop, JointSpring):
            rigid[:, i], rigid[:, i, i], input_[:, i, i] = 0.0, 1.0, 1.0
            continue
        back = loop.force_per_V * (loop.kp + loop.ki / s + loop.kd * s)[:, 0, 0]
        rigid[:, i, i] += back
        input_[:, i, i] = back + loop.force_per_V * loop.kv * s[:, 0, 0]
    asked = np.linalg.solve(rigid, input_)
    stiffness = [loop.stiffness if isinstance(loop, JointSpring) else 0.0 for loop in loops]
    moved = np.linalg.solve(whole + lin.E @ np.diag(stiffness) @ lin.E.T, lin.E[None])
    place = [lin.outputs.index(f"joint/{i + 1}/position") for i in range(joints)]
    tip = [lin.outputs.index("tip/x"), lin.outputs.index("tip/y")]
    # forces that move motors' joints as asked, and those of springs
    left = lin.outlook[place] @ moved
    for i, k in enumerate(stiffness):
        if k:
            left[:, i], left[:, i, i], asked[:, i] = 0.0, 1.0, k * asked[:, i]
    forces = np.linalg.solve(left, asked)
    response: np.ndarray = lin.outlook[tip] @ moved @ forces
    return response, lin.outlook[place] @ moved @ forces


@dataclass(frozen=True)
class LearningFilter:
    """What is added to the references for an error of a trial.

    Attributes:
        step_s: time between two samples [s].
        responses: H_p (P, F, k, J), complex, at `transform_points`: of k motions to J references.
        weight: w (F,), between 0 and 1.
        contraction: what one trial leaves of an error at the worst (F,); 1 where w is 0.
    """

    step_s: float
    responses: np.ndarray
    weight: np.ndarray
    contraction: np.ndarray

    @property
    def samples(self) -> int:
        """Samples of a transform."""
        return 2 * (len(self.weight) - 1)

    @property
    def frequencies_Hz(self) -> np.ndarray:
        """Frequencies (F,) [Hz]."""
        return np.fft.rfftfreq(self.samples, self.step_s)

    @property
    def shift(self) -> float:
        """The real part of the points at which responses are taken [1/s]."""
        return FORGETS / (self.samples * self.step_s)

    @property
    def bandwidth_Hz(self) -> float:
        """The frequency below which all is learned with at least half the weight [Hz]."""
        low = np.flatnonzero(self.weight < 0.5)
        return float(self.frequencies_Hz[low[0] - 1 if len(low) and low[0] else -1])

    def update(
        self,
        error: Any,
        basis: Sequence[np.ndarray],
        directions: np.ndarray,
        share: np.ndarray | None = None,
    ) -> np.ndarray:
        """Changes of the references for a trial's error (121), before and after it in time.

        Args:
            error: (T, m), what the outputs lack, at rest at its start.
            basis: one a reference: functions (T, n) of which its change is made. They are 0 at the
                start and constant at the end.
            directions: what the k motions do to the outputs (T, m, k).
            share: what each sample counts (T,), 1 where it is left out. Long after a motion the
                phase of a model's vibration is no longer the robot's.

        Returns:
            (T, J).

        Raises:
            InputError: the trial is longer than half of what the filter is made for.
        """
        e = np.asarray(error, dtype=float)
        rows = len(e)
        if 2 * rows > self.samples:
            raise InputError(
                f"expected at most {self.samples // 2} samples", key="error", value=rows
            )
        counts = np.ones(rows) if share is None else np.asarray(share, dtype=float)
        wanted = counts[:, None] * self._weighted(e)
        count = sum(one.shape[1] for one in basis)
        normal, right = np.zeros((count, count)), np.zeros(count)
        for H in self.responses:
            columns = [self._moved(H[:, :, j], one) for j, one in enumerate(basis)]
            A = self._weighted((directions @ np.concatenate(columns, axis=-1)).reshape(rows, -1))
            A = (counts[:, None] * A).reshape(e.size, -1)
            normal, right = normal + A.T @ A, right + A.T @ wanted.ravel()
        normal += RIDGE * np.diag(normal).max() * np.eye(len(normal))
        found = np.split(
            np.linalg.solve(normal, right), np.cumsum([b.shape[1] for b in basis])[:-1]
        )
        return np.column_stack([b @ c for b, c in zip(basis, found, strict=True)])

    def _moved(self, H: np.ndarray, one: np.ndarray) -> np.ndarray:
        """The motions (T, k, n) under functions (T, n) of one reference, H (F, k)."""
        rows = len(one)
        grow = np.exp(self.shift * self.step_s * np.arange(rows))[:, None, None]
        spectrum = np.fft.rfft(one / grow[:, 0], self.samples, axis=0)
        moved = np.fft.irfft(H[:, :, None] * spectrum[:, None], self.samples, axis=0)
        return np.asarray(grow * moved[:rows])

    def _weighted(self, values: np.ndarray) -> np.ndarray:
        """Values (T, n) through the weight, which has no phase; what is left at the end fades."""
        fade = 0.5 * (1 + np.cos(np.linspace(0.0, np.pi, self.samples // 4)))
        padded = np.concatenate([values, fade[:, None] * values[-1]])
        spectrum = self.weight[:, None] * np.fft.rfft(padded, self.samples, axis=0)
        return np.asarray(np.fft.irfft(spectrum, self.samples, axis=0)[: len(values)])


def filter_length(samples: int) -> int:
    """Samples of a transform for trials of so many: a power of two, at least twice as many.

    Args:
        samples: of a trial.

    Returns:
        How many.
    """
    return 1 << int(np.ceil(np.log2(2 * samples)))


def transform_points(samples: int, step_s: float) -> np.ndarray:
    """Complex frequencies s (F,) [1/s] of a transform that forgets.

    Their real part is above 0, so that a motion that rings for long does not come round again.

    Args:
        samples: of the transform, as of `filter_length`.
        step_s: time between two samples [s].

    Returns:
        (F,), at the frequencies of `numpy.fft.rfftfreq`.
    """
    return FORGETS / (samples * step_s) + 2j * np.pi * np.fft.rfftfreq(samples, step_s)


def inverse_of_many(responses: np.ndarray) -> np.ndarray:
    """The least-squares inverse of all responses together (123).

    Where they agree it inverts them. Where a resonance may be on either side, they cancel.

    Args:
        responses: H_p (P, F, m, m), complex.

    Returns:
        L (F, m, m), complex.

    Raises:
        InputError: a reference does not move the outputs.
    """
    H = np.asarray(responses, dtype=complex)
    conjugate = H.conj().swapaxes(-1, -2)
    normal = (conjugate @ H).sum(axis=0)
    if np.linalg.svd(normal[0], compute_uv=False)[-1] <= RESTED * np.abs(normal[0]).max():
        raise InputError("expected references that move the outputs", key="responses")
    return np.asarray(np.linalg.solve(normal, conjugate.sum(axis=0)))


def learning_filter(
    responses: np.ndarray,
    step_s: float,
    highest_Hz: float = np.inf,
    motions: np.ndarray | None = None,
) -> LearningFilter:
    """How much of an error is safe to learn at each frequency (124).

    The weight w is that which leaves the least of an error for the worst robot, 0 where an error
    might not shrink.

    Args:
        responses: H_p (P, F, m, m), complex, of P robots at `transform_points`: from which the
            weight follows.
        step_s: time between two samples [s].
        highest_Hz: nothing is learned above; the weight falls to 0 within half an octave below.
        motions: (P, F, k, J), what the references do, for the changes; None: `responses`.

    Returns:
        The filter.

    Raises:
        InputError: a reference does not move the outputs.
    """
    H = np.asarray(responses, dtype=complex)
    one, passed = np.eye(H.shape[-1]), H @ inverse_of_many(H)
    left = np.array(
        [np.linalg.norm(one - w * passed, 2, axis=(-2, -1)).max(axis=0) for w in WEIGHTS]
    )
    weight = np.where(left.min(axis=0) < CONTRACTS, WEIGHTS[left.argmin(axis=0)], 0.0)
    f = np.fft.rfftfreq(2 * (len(weight) - 1), step_s)
    with np.errstate(divide="ignore"):
        octaves = np.log2(highest_Hz / f)
    weight *= 0.5 * (1 - np.cos(np.pi * np.clip(2 * octaves, 0.0, 1.0)))
    contraction = np.linalg.norm(one - weight[:, None, None] * passed, 2, axis=(-2, -1)).max(axis=0)
    return LearningFilter(step_s, H if motions is None else motions, weight, contraction)
