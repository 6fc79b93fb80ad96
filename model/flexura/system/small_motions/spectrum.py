"""Natural frequencies and modes: about a configuration at rest, or about a steady rotation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError, guarded
from ...io import Run, choice, number, summary, whole
from ..statics import static
from ..system import RobotLike, System, assemble
from .mode_motion import moving_run


@dataclass(frozen=True)
class Modes:
    """Natural modes at q (n,): frequencies_Hz (k,) ascending, shapes (n, k) with x . M x = 1, in
    the order of `labels`.

    `damping_ratios` (k,): x . D x / (2 omega) (120), exact where D is proportional to stiffness and
    mass; 0 where omega is.
    """

    frequencies_Hz: np.ndarray
    shapes: np.ndarray
    q: np.ndarray
    labels: tuple[str, ...]
    damping_ratios: np.ndarray
    system: System = field(repr=False, compare=False)

    def __repr__(self) -> str:
        rows = [
            (str(k), f"{frequency:.6g} Hz, damping ratio {ratio:.3g}")
            for k, (frequency, ratio) in enumerate(
                zip(self.frequencies_Hz, self.damping_ratios, strict=True), 1
            )
        ]
        return summary.text(f"Modes: {len(rows)} of {len(self.labels)} unknowns", rows)

    def run(self, mode: int = 1, *, amplitude_m: float | None = None, periods: int = 1) -> Run:
        """A Run of the robot in one of its modes, undamped.

        Args:
            mode: its number, from 1.
            amplitude_m: how far what moves most of tip and joints goes [m or rad]; by default a
                tenth of the robot's length.
            periods: how many; a mode without frequency takes a second.

        Returns:
            The Run.

        Raises:
            InputError: there is no such mode, or another argument is not what is expected.
        """
        expected = f"expected a mode from 1 to {len(self.frequencies_Hz)}"
        if number(mode, "mode", expected) not in range(1, len(self.frequencies_Hz) + 1):
            raise InputError(expected, key="mode", value=mode)
        most = 0.1 * sum(link.length_m for link in self.system.robot.links)
        if amplitude_m is not None:
            most = number(amplitude_m, "amplitude_m")
        count = whole(periods, "periods", 1)
        shape = self.shapes[:, mode - 1]
        return moving_run(
            self.system, self.q, shape, float(self.frequencies_Hz[mode - 1]), most, count
        )

    def animate(
        self,
        out: str | Path,
        mode: int = 1,
        *,
        frame_rate: float = 25.0,
        duration: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Path:
        """Write a mode as a film.

        Args:
            out: the file, .gif, or .mp4 where an encoder is installed.
            mode: its number, from 1.
            frame_rate: pictures a second of the film [1/s].
            duration: of the film [s], as in `Run.animate`.
            progress: called with the fraction that is done.

        Returns:
            The file.

        Raises:
            InputError: a wrong argument.
            Missing: matplotlib or pillow is not installed.
        """
        return self.run(mode).animate(
            out, frame_rate=frame_rate, duration=duration, progress=progress
        )


@guarded("the natural frequencies")
def frequencies(
    robot: RobotLike,
    q: ArrayLike | None = None,
    joints: str = "locked",
    *,
    count: int | None = None,
    qd: ArrayLike | None = None,
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


@guarded("the natural modes")
def modes(
    robot: RobotLike, q: ArrayLike | None = None, count: int | None = 10, *, joints: str = "locked"
) -> Modes:
    """Natural modes of the undamped, linearised robot. Errors as in `frequencies`.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        q: configuration (n,); None: the static equilibrium at the start.
        count: how many of the lowest; None: all.
        joints: "locked" or "free".

    Returns:
        Frequencies [Hz], ascending, damping ratios and shapes.
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
    elif joints == "free" and _on_a_rail(system):
        squares[np.abs(squares).argmin()] = 0.0
    return _modes(system, squares, columns, at)


def _unheld(system: System) -> int:
    """How many free joints nothing holds where there is no gravity: those without a spring."""
    return sum(
        not each.joint.locked and not each.joint.spring_stiffness for each in system.robot.links
    )


def _on_a_rail(system: System) -> bool:
    """Whether the first joint moves the whole robot along a line, and no spring holds it."""
    first = system.robot.links[0]
    slides = first.joint.type == "Pa" or (first.joint.type == "Pb" and not first.flexible)
    return slides and not first.joint.locked and not first.joint.spring_stiffness


def _check(joints: ArrayLike, count: Any) -> None:
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
        return _modes(system, np.zeros(0), shapes, at)
    K = system.tangent(at)[pick]
    squares, shapes[rows] = eigh((K + K.T) / 2, system.mass(at)[pick])
    if joints == "free" and not any(system.robot.gravity_m_s2):
        squares[: _unheld(system)] = 0.0
    elif joints == "free" and _on_a_rail(system):
        squares[np.abs(squares).argmin()] = 0.0
    return _modes(system, squares[:count], shapes[:, :count], at)


def _modes(system: System, squares: np.ndarray, shapes: np.ndarray, at: np.ndarray) -> Modes:
    """Modes whose damping is known where their shapes are."""
    hertz = _hertz(squares)
    damped = np.zeros(len(hertz))
    if shapes.size:
        damped = np.einsum("nk,nm,mk->k", shapes, system.damping_at(at), shapes)
    ratios = np.where(hertz > 0, damped / np.maximum(4 * np.pi * hertz, 1e-300), 0.0)
    return Modes(hertz, shapes, at, system.labels, ratios, system)


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
