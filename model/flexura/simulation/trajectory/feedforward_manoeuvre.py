"""A run's motions and drives as a manoeuvre: feedforward, and what a controller follows."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...io import Run, array
from ...signals import Drive, JointDrive, Manoeuvre, table


def feedforward(run: Run, kp: ArrayLike = 0.0, kd: ArrayLike = 0.0) -> Manoeuvre:
    """A manoeuvre in which each joint has the run's drive as its force, and the run's position as
    the motion to follow; it begins at 0 s.

    Args:
        run: of `invert`, `time_optimal` or `inverse`.
        kp: gains of the positions, one for all joints or one a joint. Without gains a run of the
            manoeuvre needs `manoeuvre.prescribed()` or a controller.
        kd: gains of the velocities.

    Returns:
        The manoeuvre.

    Raises:
        InputError: an argument is not what is expected.
    """
    if not isinstance(run, Run) or len(run) < 2:
        raise InputError("expected a Run of two rows or more", key="run", value=run)
    joints = sum(1 for name in run if name.startswith("joint/") and name.endswith("/drive"))
    gains = []
    for key, value in (("kp", kp), ("kd", kd)):
        expected = f"expected a number of 0 or more, or {joints} of them, one a joint"
        given = array(value, key, expected)
        if given.shape not in ((), (joints,)) or not np.all(given >= 0):
            raise InputError(expected, key=key, value=value)
        gains.append(np.broadcast_to(given, (joints,)).tolist())
    t = run.t - run.t[0]
    drives = tuple(
        JointDrive(
            force=table(t, run[f"joint/{i}/drive"]),
            motion=table(t, run[f"joint/{i}/position"]),
            kp=p,
            kd=d,
        )
        for i, (p, d) in enumerate(zip(*gains, strict=True), 1)
    )
    span = float(t[-1])
    return Manoeuvre("feedforward", span, span / max(len(t) - 1, 1), Drive(drives))
