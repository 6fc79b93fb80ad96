"""Natural frequencies and modes: about a configuration at rest, or about a steady rotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..io import choice, whole
from .statics import static
from .system import System, assemble


@dataclass(frozen=True)
class Modes:
    """Natural modes at q (n,): frequencies_Hz (k,) ascending, shapes (n, k) with x . M x = 1, in
    the order of `labels`."""

    frequencies_Hz: np.ndarray
    shapes: np.ndarray
    q: np.ndarray
    labels: tuple[str, ...]


def frequencies(
    robot: Any, q: Any = None, joints: str = "locked", *, count: int | None = None, qd: Any = None
) -> np.ndarray:
    """Natural frequencies of the undamped, linearised robot, ascending (52), (54).

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        q: configuration (n,); None: the static equilibrium at the start.
        joints: "locked" (only the elastic unknowns move) or "free" (rigid motions come out as 0).
        count: how many of the lowest; None: all.
        qd: joint rates of a steady motion (n,), for example a rotation at constant speed; joints
            are locked to it.

    Returns:
        (k,) [Hz]. Frequencies of unstable directions are 0.

    Raises:
        InputError: an argument is not what is expected.
        NoEquilibrium: q is not given and there is no static equilibrium.
    """
    system = assemble(robot)
    _check(joints, count)
    if system.robot.nodal:
        q = static(system) if q is None else q
        system = system.fixed(q)
    if qd is not None:
        return _steady(
            system, static(system) if q is None else system.check(q), system.check(qd, "qd"), joints
        )[:count]
    return _eigenmodes(
        system, static(system) if q is None else system.check(q), joints, count, False
    ).frequencies_Hz


def modes(robot: Any, q: Any = None, joints: str = "locked", *, count: int | None = None) -> Modes:
    """Natural modes of the undamped, linearised robot. Errors as in `frequencies`.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        q: configuration (n,); None: the static equilibrium at the start.
        joints: "locked" or "free".
        count: how many of the lowest; None: all.

    Returns:
        Frequencies [Hz], ascending, and shapes.
    """
    system = assemble(robot)
    _check(joints, count)
    return _eigenmodes(
        system, static(system) if q is None else system.check(q), joints, count, True
    )


def _eigenmodes(
    system: System, at: np.ndarray, joints: str, count: int | None, shapes: bool
) -> Modes:
    """The modes at q (n,); where frequencies are all that is asked for, shapes may be empty."""
    if not system.exact:
        return _dense(system, at, joints, count)
    free = np.full(len(system.joint_rows), joints == "free", dtype=np.uint8)
    squares, columns = system.equations.modes(at, free, count or 0, np.zeros(3), shapes)
    if joints == "free" and not any(system.robot.gravity_m_s2):
        squares[: _unheld(system)] = 0.0
    return Modes(_hertz(squares), columns, at, system.labels)


def _unheld(system: System) -> int:
    """How many free joints nothing holds where there is no gravity: those without a spring."""
    return sum(
        not each.joint.locked and not each.joint.spring_stiffness for each in system.robot.links
    )


def _check(joints: Any, count: Any) -> None:
    choice(joints, "joints", ("locked", "free"))
    if count is not None:
        whole(count, "count", 1)


def _hertz(squares: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)


def _dense(system: System, at: np.ndarray, joints: str, count: int | None) -> Modes:
    """The modes of the dissertation's linear model, from the dense equations."""
    from scipy.linalg import eigh

    rows = system.elastic_rows if joints == "locked" else system.free_rows
    pick, shapes = np.ix_(rows, rows), np.zeros((system.n, len(rows)))
    if len(rows) == 0:
        return Modes(np.zeros(0), shapes, at, system.labels)
    K = system.tangent(at)[pick]
    squares, shapes[rows] = eigh((K + K.T) / 2, system.mass(at)[pick])
    if joints == "free" and not any(system.robot.gravity_m_s2):
        squares[: _unheld(system)] = 0.0
    return Modes(_hertz(squares)[:count], shapes[:, :count], at, system.labels)


def _steady(system: System, at: np.ndarray, rates: np.ndarray, joints: str) -> np.ndarray:
    """Frequencies about a steady motion: imaginary parts of the eigenvalues of its linear
    equations."""
    rows = system.elastic_rows if joints == "locked" else system.free_rows
    pick, n = np.ix_(rows, rows), len(rows)
    M, K = system.mass(at)[pick], system.tangent(at, rates)[pick]
    G = (system.rate(at, rates) - system.damping_at(at))[pick]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, G)]])
    values = np.linalg.eigvals(A).imag
    return np.sort(values[values >= 0])[-n:] / (2 * np.pi)
