"""The motion whose tip comes nearest to a path, where none follows it exactly or Newton's method
finds none: least squares over the joints' splines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import FlexuraError, OutOfMemory
from ...signals import COLUMNS, Signal
from ...system import System
from ..dynamics import inverse
from .collocation import Mesh
from .posture import postures
from .tip_output import TipPath
from .variation import elastic_accelerations, stage_times, variation

MOST = 25  # steps of Levenberg and Marquardt
FIRST, LEAST, LARGEST = 1e-5, 1e-12, 1e3  # m s^2: the penalty on a change of the accelerations
ENOUGH = 1e-10  # m: the mean distance from the path that is good enough
SLOW = 0.98  # of the distance before: a step that gains less is the last
DEGREE = 5
RTOL = 1e-8


@dataclass(frozen=True)
class JointSplines:
    """Motions of joints as splines of degree 5 with four continuous derivatives, at rest at both
    ends: offset + sum_j p_j B_j(t), p (P,), of which three at each end are those of the rest."""

    nodes: np.ndarray

    def basis(self, t: np.ndarray) -> np.ndarray:
        """B, B' and B'' (3, T, P) at times t (T,)."""
        from scipy.interpolate import BSpline

        spline = BSpline(self._knots, np.eye(len(self._knots) - DEGREE - 1), DEGREE)
        return np.array([spline.derivative(k)(t) if k else spline(t) for k in range(3)])

    @property
    def _knots(self) -> np.ndarray:
        a, b = self.nodes[[0, -1]]
        return np.concatenate([[a] * DEGREE, self.nodes, [b] * DEGREE])

    def signal(self, p: np.ndarray) -> Signal:
        """The motion with coefficients p (P,) as a Signal."""
        from scipy.interpolate import BSpline, PPoly

        pieces = PPoly.from_spline(BSpline(self._knots, p, DEGREE))
        kept = np.diff(pieces.x) > 0
        rows = np.zeros((int(kept.sum()) + 1, COLUMNS))
        rows[:-1, 0] = pieces.x[:-1][kept]
        rows[:-1, 1 : DEGREE + 2] = pieces.c.T[kept][:, ::-1]
        rows[-1, :2] = self.nodes[-1], p[-1]
        return Signal(rows, {"kind": "motion"})


@dataclass(frozen=True)
class NearestMotion:
    """Motions of the joints as Signals, their accelerations' steps, and how many steps it took."""

    signals: list[Signal]
    mesh: Mesh
    iterations: int


def nearest_motion(system: System, path: TipPath, mesh: Mesh, start: np.ndarray) -> NearestMotion:
    """Motions of the joints that bring the tip nearest to a path, in the mean over time (119).

    Each step solves min |e + S dp|^2 + rho^2 |B'' dp|^2 over changes dp of the splines, with e the
    tip's distance from the path in a run under the motions, and S its exact derivative (118). The
    penalty rho grows after a step that does not help, and falls after one that does.

    Args: system: the robot; mesh: whose nodes are the splines' knots; start (n,): at rest, the tip
    where the path begins.

    Raises: FlexuraError: no motion was found.
    """
    splines, t = JointSplines(mesh.nodes), stage_times(mesh.nodes)
    free = np.flatnonzero(~system.locked)
    B = splines.basis(t)
    inner = slice(3, B.shape[2] - 3)
    weight = np.sqrt(np.repeat(np.diff(mesh.nodes), 3) * np.tile(WEIGHTS, len(mesh.nodes) - 1))
    p = _first(system, path, splines, t, start)
    wanted = path.at(t)
    size, run = _tried(system, path, splines, p, t, wanted, weight)
    if not np.isfinite(size):
        raise FlexuraError("no inverse motion was found: the first guess cannot be run")
    count, rho = 0, FIRST
    while count < MOST and size > ENOUGH and rho < LARGEST:
        count += 1
        e, S = _linear(system, path, mesh.nodes, run, wanted, B[:, :, inner], free)
        S = S * weight.repeat(e.shape[1])[:, None]
        e = (e * weight[:, None]).ravel()
        penalty = np.kron(np.eye(len(free)), weight[:, None] * B[2][:, inner])
        while True:
            left = np.vstack([S, rho * penalty])
            right = np.concatenate([-e, np.zeros(len(penalty))])
            change = np.linalg.lstsq(left, right, rcond=None)[0].reshape(len(free), -1)
            trial = p.copy()
            trial[free, inner] += change
            new, found = _tried(system, path, splines, trial, t, wanted, weight)
            if new < size or rho >= LARGEST:
                break
            rho *= 10
        if not new < size:
            break
        gained, p, size, run = new / size, trial, new, found
        rho = max(rho / 10, LEAST)
        if gained > SLOW:
            break
    return NearestMotion([splines.signal(row) for row in p], mesh, count)


WEIGHTS = np.array([(16 - np.sqrt(6)) / 36, (16 + np.sqrt(6)) / 36, 1 / 9])


def _first(
    system: System, path: TipPath, splines: JointSplines, t: np.ndarray, start: np.ndarray
) -> np.ndarray:
    """Coefficients (links, P) of the motions without inertia."""
    places = path.at(t)
    moving = np.append(True, np.abs(np.diff(places, axis=0)).max(axis=1) > 0)
    found = postures(system, path, places[moving], start)
    joints = found[np.cumsum(moving) - 1][:, system.joint_rows]
    B = splines.basis(t)[0]
    p = np.zeros((joints.shape[1], B.shape[1]))
    p[:, :3], p[:, -3:] = start[system.joint_rows][:, None], joints[-1][:, None]
    left = joints - B[:, :3] @ p[:, :3].T - B[:, -3:] @ p[:, -3:].T
    p[:, 3:-3] = np.linalg.lstsq(B[:, 3:-3], left, rcond=None)[0].T
    return p


def _tried(
    system: System,
    path: TipPath,
    splines: JointSplines,
    p: np.ndarray,
    t: np.ndarray,
    wanted: np.ndarray,
    weight: np.ndarray,
) -> tuple[float, np.ndarray]:
    """How far the tip is from the path under motions with coefficients p, in the mean [m], infinity
    where they cannot be run; and the states with the joints' accelerations."""
    signals = [
        None if locked else splines.signal(row)
        for row, locked in zip(p, system.locked, strict=True)
    ]
    try:
        times = np.append(splines.nodes[0], t)
        run = inverse(system, times, signals, rtol=RTOL).uninterrupted()
    except OutOfMemory:
        raise
    except FlexuraError:
        return np.inf, np.zeros(0)
    if len(run) <= len(t) or run.states is None:
        return np.inf, np.zeros(0)
    tips = np.column_stack([run["tip/x"], run["tip/y"]])[1:]
    off, _ = path.deviation(tips, np.zeros((len(tips), 2, 1)), wanted)
    away = path.metres(off, tips)
    joints = splines.basis(t)[2] @ p.T
    span = splines.nodes[-1] - splines.nodes[0]
    mean = float(np.sqrt(((weight * away) ** 2).sum() / span))
    return (mean if np.isfinite(mean) else np.inf), np.hstack([run.states[1:], joints])


def _linear(
    system: System,
    path: TipPath,
    nodes: np.ndarray,
    run: np.ndarray,
    wanted: np.ndarray,
    B: np.ndarray,
    free: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Deviations e (T, m) in metres, and their derivative (T m, links P) by the splines'
    coefficients."""
    n = system.n
    q, v = (np.ascontiguousarray(x) for x in (run[:, :n], run[:, n : 2 * n]))
    a = elastic_accelerations(system, q, v, run[:, 2 * n :])
    along = variation(system, nodes, q, v, a, system.elastic_rows)
    rows, elastic, P = system.joint_rows[free], system.elastic_rows, B.shape[2]
    f = np.zeros((len(q), len(elastic), len(rows) * P))
    for k, row in enumerate(rows):
        own = slice(k * P, (k + 1) * P)
        for part, of in zip((along.K, along.G, along.M), B, strict=True):
            f[:, :, own] -= part[:, elastic, row, None] * of[:, None]
    change, _ = along.integrate(f)
    off, by_q = path.deviation(along.tip, along.tip_by_q, wanted)
    S = by_q[:, :, elastic] @ change
    for k, row in enumerate(rows):
        S[:, :, k * P : (k + 1) * P] += by_q[:, :, row, None] * B[0][:, None]
    reach = path.metres(np.ones((len(off), 1)), along.tip) if path.kind == "angle" else 1.0
    scale = np.broadcast_to(reach, len(off))[:, None]
    return off * scale, (S * scale[:, :, None]).reshape(off.size, -1)
