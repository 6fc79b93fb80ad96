"""Natural frequencies and modes: about a configuration at rest, or about a steady rotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import guarded
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


@guarded("the natural frequencies")
def frequencies(
    robot: Any, q: Any = None, joints: str = "locked", *, count: int | None = None, qd: Any = None
) -> np.ndarray:
    """Natural frequencies [Hz], ascending, of the undamped robot linearised about q (n,) (52),
    (54).

    Args: robot: a System, a Robot, or a robot file; q (n,): by default the static equilibrium at
    the start; joints: "locked" (only
        the elastic unknowns move) or "free" (rigid motions come out as 0); count: the lowest so
        many, by default all; qd (n,): joint rates of a steady motion, for example a rotation at
        constant speed, joints locked to it.

    Returns: (k,). Frequencies of unstable directions are 0.

    Raises: InputError: an argument is not what is expected. NoEquilibrium: q is not given and there
    is no static equilibrium.
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
    return _found(
        system, static(system) if q is None else system.check(q), joints, count, False
    ).frequencies_Hz


@guarded("the natural modes")
def modes(robot: Any, q: Any = None, joints: str = "locked", *, count: int | None = None) -> Modes:
    """Natural modes of the undamped robot linearised about q (n,). Arguments and errors as in
    `frequencies`."""
    system = assemble(robot)
    _check(joints, count)
    return _found(system, static(system) if q is None else system.check(q), joints, count, True)


def _found(system: System, at: np.ndarray, joints: str, count: int | None, shapes: bool) -> Modes:
    """The modes at q (n,); where frequencies are all that is asked for, shapes may be empty."""
    if not system.exact:
        return _dense(system, at, joints, count)
    free = np.full(len(system.joint_rows), joints == "free", dtype=np.uint8)
    squares, columns = system.equations.modes(at, free, count or 0, np.zeros(3), shapes)
    if joints == "free" and not any(system.robot.gravity_m_s2):
        squares[: len(system.free_rows) - len(system.elastic_rows)] = (
            0.0  # without gravity nothing holds a free joint
        )
    return Modes(_hertz(squares), columns, at, system.labels)


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
        squares[: len(rows) - len(system.elastic_rows)] = 0.0
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
