"""LQR on the linear model with a Kalman observer, discrete in time: the reference of what feedback
can do.

The robot about an equilibrium, its joints driven through `Force` or `Motor` outputs u held over a
tick T:

    x_k+1 = F x_k + G u_k,   y_k = C x_k,   [F G; 0 1] = exp([A B; 0 0] T)

y: what the rig measures, joint positions (the motor's, where a transmission is between) and the
deflection of the last flexible link. The feedback K minimises sum x^T Q x + u^T R u:

    P = Q + F^T P (F - G K),   K = (R + G^T P G)^-1 G^T P F

The observer's L is Kalman's for disturbances and noise with the covariances W and V:

    S = F (S - S C^T (C S C^T + V)^-1 C S) F^T + W,   L = S C^T (C S C^T + V)^-1

(Anderson and Moore, Optimal Control: Linear Quadratic Methods, 1990). The law is
z^ = z + L (y - C z), u = -K (z^ - x_r), where x_r has the references at the joints and their rates.
z of the next tick is F z^ + G u with u as the limits left it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...system import System, assemble, linearize
from ..controller import Controller, Linear
from ..pid import PID, Motor, Stepper
from .gaussian_design import Design, Weights, gaussian_design
from .riccati import discretised


def lqr(
    robot: Any,
    controller: Controller,
    effort: Any,
    *,
    position: ArrayLike = 1.0,
    deflection: float = 1.0,
    damping: float = 0.0,
    disturbance: Any = 1.0,
    noise: Any = 1e-4,
    q: ArrayLike | None = None,
) -> tuple[Controller, Design]:
    """A controller with its PIDs' terms replaced by an LQR and an observer (74) to (76).

    References, outputs, limits, slews, rate and quantisation stay. The weights follow Bryson's
    rule, with the cost (e / position)^2 + (w / deflection)^2 + (damping w' / deflection)^2 +
    (u / effort)^2.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        controller: the controller.
        effort: of each output (m,), that counts as much as the deviations below.
        position: deviation of each joint (N,) or of all [m or rad].
        deflection: of the tips [m].
        damping: time by which the rate of a deflection is weighted [s].
        disturbance: standard deviation of what acts at the outputs in a tick, (m,) or one.
        noise: standard deviation of the measurements, (N + 1,) or one.
        q: configuration (n,) of the design; None: the static equilibrium at the start.

    Returns:
        The controller, and the Design with its matrices and poles.

    Raises:
        InputError: a stepper, which has no force, or no stabilising solution exists.
    """
    system = assemble(robot)
    if not isinstance(controller, Controller):
        raise InputError("expected a Controller", key="controller", value=controller)
    if len(controller.joints) != len(system.robot.links):
        expected = f"expected a Controller of {len(system.robot.links)} joints"
        raise InputError(expected, key="controller", value=len(controller.joints))
    linear, T = linearize(system, q), 1 / controller.rate_Hz
    joints, driven = controller.joints, []
    damp, scale = np.zeros(len(linear.M)), []
    for i, joint in enumerate(joints):
        if not isinstance(joint, PID) or isinstance(joint.output, Stepper):
            raise InputError(
                "expected a Force or a Motor: a stepper takes a rate, no force",
                key=f"joint {i + 1}: output",
            )
        if f"joint/{i + 1}/drive" in linear.inputs:
            driven.append(i)
            motor = isinstance(joint.output, Motor)
            scale.append(joint.output.force_per_V if isinstance(joint.output, Motor) else 1.0)
            if motor:
                damp += linear.E[:, len(driven) - 1] * joint.output.damping  # type: ignore[union-attr]
    A, B = replace(linear, G=linear.G + np.diag(damp)).A, linear.B @ np.diag(scale)
    F, G = discretised(A, B, T)
    bent = [k for k, name in enumerate(linear.outputs) if name.endswith("tip_deflection")]
    measured = [f"joint/{i + 1}/{'motor_' * (i in system.windup_rows)}position" for i in driven] + [
        linear.outputs[k] for k in bent[-1:]
    ]
    C = linear.C[[linear.outputs.index(name) for name in measured]]
    design = gaussian_design(
        linear,
        (F, G, C),
        controller.rate_Hz,
        tuple(measured),
        system,
        Weights(effort, position, deflection, damping, disturbance, noise),
    )
    return replace(
        controller, linear=_linear(system, design, linear.q, linear.hold, scale, len(joints))
    ), design


def _linear(
    system: System, d: Design, q: np.ndarray, hold: np.ndarray, scale: Sequence[float], joints: int
) -> Linear:
    """The law's matrices: all joints', zero for those that it does not drive."""
    n, measured = len(d.F), np.zeros((joints + len(d.C) - len(d.inputs), len(d.F)))
    G, K, Kr, Kv = (
        np.zeros((n, joints)),
        np.zeros((joints, n)),
        np.zeros((joints, joints)),
        np.zeros((joints, joints)),
    )
    L, offset, held = np.zeros((n, len(measured))), np.zeros(len(measured)), np.zeros(joints)
    rows = [int(np.argmax(np.abs(row))) for row in d.C[: len(d.inputs)]]
    for a, i in enumerate(d.inputs):
        G[:, i], K[i], L[:, i], measured[i] = d.G[:, a], d.K[a], d.L[:, a], d.C[a]
        held[i] = hold[i] / scale[a]
        for b, j in enumerate(d.inputs):
            Kr[i, j], Kv[i, j] = d.K[a, rows[b]], d.K[a, n // 2 + rows[b]]
    offset[:joints] = q[system.joint_rows]
    if len(measured) > joints:
        L[:, joints], measured[joints] = d.L[:, -1], d.C[-1]
        offset[joints] = system.places(q)[0][-1]
    return Linear(d.F, G, L, measured, K, Kr, Kv, offset, held)
