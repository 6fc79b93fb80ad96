"""The discrete design that LQR with an observer and LQG share: weights, covariances, gains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...io import choice, number
from ...system import StateSpace, System
from .riccati import deviations, riccati


@dataclass(frozen=True)
class Design:
    """A discrete regulator (75) with its observer (76): x0^T P x0 is the cost, S the observer's
    covariance.

    `states`, `outputs` are names; `inputs` (m,) the joints that it drives, from 0; `rate_Hz` the
    ticks a second.
    """

    F: np.ndarray
    G: np.ndarray
    C: np.ndarray
    K: np.ndarray
    L: np.ndarray
    P: np.ndarray
    S: np.ndarray
    states: tuple[str, ...]
    outputs: tuple[str, ...]
    inputs: tuple[int, ...]
    rate_Hz: float

    @property
    def poles(self) -> np.ndarray:
        """Of the closed loop F - G K, in the z plane."""
        return np.linalg.eigvals(self.F - self.G @ self.K)

    @property
    def observer_poles(self) -> np.ndarray:
        """Of the observer's error F (1 - L C), in the z plane."""
        return np.linalg.eigvals(self.F @ (np.eye(len(self.F)) - self.L @ self.C))


@dataclass(frozen=True)
class Weights:
    """Deviations that count alike (Bryson's rule), and standard deviations; as in `lqr`."""

    effort: Any
    position: Any = 1.0
    deflection: Any = 1.0
    damping: Any = 0.0
    disturbance: Any = 1.0
    noise: Any = 1e-4
    follow: str = "joints"


def driven_joints(linear: StateSpace) -> tuple[int, ...]:
    """The joints that have a drive, from 0."""
    return tuple(int(name.split("/")[1]) - 1 for name in linear.inputs)


def deviation_rows(linear: StateSpace, given: Weights, system: System) -> np.ndarray:
    """W (p, 2m): |W x|^2 is what deviations of joints and tips cost by Bryson's rule.

    Args:
        linear: the robot linearised.
        given: the weights; if tips follow, a turning flexible link counts by the angle of the line
            from its hub to its tip.
        system: the robot.

    Raises:
        InputError: a weight is not above 0.
    """
    m = len(linear.inputs)
    bent = [k for k, name in enumerate(linear.outputs) if name.endswith("tip_deflection")]
    hubs = [linear.outputs.index(f"joint/{i + 1}/position") for i in driven_joints(linear)]
    W = linear.C[hubs + bent]
    choice(given.follow, "follow", ("joints", "tips"))
    for row, i in enumerate(driven_joints(linear) if given.follow == "tips" else ()):
        link, name = system.robot.links[i], f"link/{i + 1}/tip_deflection"
        if link.joint.type == "R" and name in linear.outputs:
            W[row] += linear.C[linear.outputs.index(name)] / link.length_m
    deflection = deviations(given.deflection, 1, "deflection")[0]
    weights = np.concatenate(
        [1 / deviations(given.position, m, "position"), np.full(len(bent), 1 / deflection)]
    )
    rates = np.roll(W[m:], len(linear.M), axis=1) * number(given.damping, "damping") / deflection
    return np.concatenate([weights[:, None] * W, rates])


def gaussian_design(
    linear: StateSpace,
    matrices: tuple[np.ndarray, np.ndarray, np.ndarray],
    rate_Hz: float,
    measured: tuple[str, ...],
    system: System,
    given: Weights,
) -> Design:
    """The gains of feedback (75) and estimator (76).

    Args:
        linear: the robot linearised; its free joints are driven.
        matrices: F (n, n), G (n, m) of a tick (74), C (p, n) of the measurements.
        rate_Hz: ticks a second.
        measured: names of the measurements (p,).
        system: the robot.
        given: weights and covariances.

    Returns:
        The Design.

    Raises:
        InputError: a weight is not above 0, or no stabilising solution exists.
    """
    F, G, C = matrices
    m = G.shape[1]
    joints = driven_joints(linear)
    W = deviation_rows(linear, given, system)
    Q = W.T @ W
    R = np.diag(1 / deviations(given.effort, m, "effort") ** 2)
    process = G @ np.diag(deviations(given.disturbance, m, "disturbance") ** 2) @ G.T
    V = np.diag(deviations(given.noise, len(C), "noise") ** 2)
    P, S = riccati(F, G, Q, R, "effort"), riccati(F.T, C.T, process, V, "noise")
    K = np.linalg.solve(R + G.T @ P @ G, G.T @ P @ F)
    L = np.linalg.solve(C @ S @ C.T + V, C @ S).T
    return Design(F, G, C, K, L, P, S, linear.states, measured, joints, rate_Hz)
