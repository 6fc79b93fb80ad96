"""A robot under drives from rest to rest: its state at the end, and the derivatives by the drives
and by the time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...signals import COLUMNS, Drive, Signal
from ...system import System
from ..dynamics import simulate
from .limits import Limits
from .variation import STAGES, Variation, stage_times, variation

RTOL, METHOD = 1e-8, "implicit"
SUBSTEPS = 2, 16  # of each interval, for derivatives: at least and at most
RESOLVED = 1.5  # rad: a mode turns by less in one of them
MODES = 4  # that are to be resolved, above the rigid robot's
PERIODS = 2.0  # of the first mode, in which the residual is looked at
LOOKS = 65  # instants within them
WATCHED = 0.8  # of a limit: from there on a motion is held to it between its drives' nodes too


@dataclass(frozen=True)
class Plant:
    """A robot that a motion takes from `start` to `end` (n,), both at rest; at most the
    share `left` of the tip deflections `unshaped` (tips,) [m] remains."""

    system: System
    start: np.ndarray
    end: np.ndarray
    unshaped: np.ndarray
    left: float

    @property
    def joints(self) -> int:
        """How many joints move: so many modes are those of the rigid robot."""
        return len(self.system.free_rows) - len(self.system.elastic_rows)

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """omega (k,) [rad/s] ascending and X^T M (k, n) of the free robot at its end."""
        from scipy.linalg import eigh

        system, rows = self.system, self.system.free_rows
        pick = np.ix_(rows, rows)
        M, K = system.mass(self.end)[pick], system.tangent(self.end)[pick]
        squares, X = eigh((K + K.T) / 2, M)
        into = np.zeros((len(rows), system.n))
        into[:, rows] = X.T @ M
        omega = np.sqrt(np.maximum(squares, 0.0))
        omega[: self.joints] *= float(any(system.robot.gravity_m_s2))
        return omega, into

    def shape(self, k: int) -> np.ndarray:
        """Mode k (n,) with X^T M X = 1."""
        rows, mode = self.system.free_rows, np.zeros(self.system.n)
        mass = self.system.mass(self.end)[np.ix_(rows, rows)]
        mode[rows] = np.linalg.solve(mass, self.modes[1][k, rows])
        return mode

    @cached_property
    def later(self) -> np.ndarray:
        """Tip deflections (tips x LOOKS, 2 n) after the motion, in shares of `unshaped`, of a small
        deviation of the state from rest at the end."""
        from scipy.linalg import expm

        system, rows = self.system, self.system.free_rows
        r, rest = len(rows), np.zeros((1, system.n))
        _, K, G, M, _, _ = system.equations.force_derivatives(self.end[None], rest, rest)
        K, G, M = (x[0][np.ix_(rows, rows)] for x in (K, G, M))
        A = np.zeros((2 * r, 2 * r))
        A[:r, r:] = np.eye(r)
        A[r:] = -np.linalg.solve(M, np.hstack([K, G]))
        step = expm(A * PERIODS * 2 * np.pi / self.modes[0][self.joints] / (LOOKS - 1))
        tip = deflection_slope(system, self.end)[:, rows] / self.unshaped[:, None]
        own = np.hstack([tip, np.zeros_like(tip)])
        out = np.zeros((LOOKS, len(tip), 2 * system.n))
        for look in out:
            look[:, np.concatenate([rows, system.n + rows])] = own
            own = own @ step
        return out.reshape(-1, 2 * system.n)

    @cached_property
    def hold(self) -> tuple[np.ndarray, np.ndarray]:
        """The drives (links,) that hold the robot at its start and at its end."""
        rest, rows = np.zeros(self.system.n), self.system.joint_rows
        return (
            self.system.forces(self.start, rest, rest)[rows],
            self.system.forces(self.end, rest, rest)[rows],
        )


@dataclass(frozen=True)
class Answer:
    """What a plant does under drives: its state at the end (2 n,), and the derivative (2 n, P + 1)
    by the drives' nodes and the time; speeds and tip deflections on the way (W,) in shares of their
    limits, and theirs (W, P + 1)."""

    end: np.ndarray
    slope: np.ndarray
    limited: np.ndarray
    limited_slope: np.ndarray


def linear_drive(times: np.ndarray, values: np.ndarray) -> Signal:
    """A drive that is linear between values (m + 1,) at times (m + 1,) [s], and stays at its last
    value."""
    rows = np.zeros((len(times), COLUMNS))
    rows[:, 0], rows[:, 1] = times, values
    rows[:-1, 2] = np.diff(values) / np.diff(times)
    return Signal(rows, {"kind": "drive"})


def answer(
    plant: Plant,
    u: np.ndarray,
    T: float,
    free: np.ndarray,
    limits: Limits | None = None,
    finer: int = 1,
) -> Answer | None:
    """What a plant does under drives in a time (118); None where it cannot run.

    With t = tau T and the drives kept over tau, a longer time acts as the force (2 M q'' + G q')/T.
    Speeds and deflections are looked at where the drives have nodes; between these nodes, where
    they are near a limit.

    Args:
        plant: the robot.
        u: drives (m + 1, links) at the nodes.
        T: the time [s].
        free: the joints that move.
        limits: of speeds and deflections; None: these are not asked for.
        finer: how many times as many steps in an interval.

    Returns:
        The Answer.
    """
    system, m = plant.system, len(u) - 1
    highest = plant.modes[0][: plant.joints + MODES][-1]
    substeps = int(np.clip(np.ceil(highest * T / m / RESOLVED), *SUBSTEPS)) * finer
    nodes, fine = np.linspace(0.0, T, m + 1), np.linspace(0.0, T, substeps * m + 1)
    t = stage_times(fine)
    drive = Drive.force(*(linear_drive(nodes, column) for column in u.T))
    times = np.append(0.0, t)
    run = simulate(system, times, drive, plant.start, rtol=RTOL, method=METHOD).uninterrupted()
    if len(run) <= len(t) or run.states is None or not np.isfinite(run.states).all():
        return None
    n, rows = system.n, system.free_rows
    q, v = (np.ascontiguousarray(x) for x in (run.states[1:, :n], run.states[1:, n:]))
    force = np.zeros((len(t), n))
    force[:, system.joint_rows] = np.column_stack([np.interp(t, nodes, column) for column in u.T])
    a = _accelerations(system, q, v, force)
    along = variation(system, fine, q, v, a, rows)
    index = np.searchsorted(rows, system.joint_rows[free])
    slower = (2 * along.M @ a[:, :, None] + along.G @ v[:, :, None])[:, rows] / T
    ends = slice(2, None, 3)  # the last stage of each step is its end
    limited, watch = _watched(plant, limits, q[ends], v[ends], substeps)
    state, limited_slope = _slopes(along, index, m, slower, watch)
    r = len(rows)
    state[r:, -1] -= v[-1][rows] / T
    rates = [W[:, r:] @ now[rows] for W, now in zip(watch, v[ends], strict=True)]
    limited_slope[:, -1] -= np.concatenate(rates) / T
    slope = np.zeros((2 * n, state.shape[1]))
    slope[rows], slope[n + rows] = state[:r], state[r:]
    return Answer(np.concatenate([q[-1], v[-1]]), slope, limited, limited_slope)


def _watched(
    plant: Plant, limits: Limits | None, q: np.ndarray, v: np.ndarray, substeps: int
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Speeds and deflections (W,) in shares of their limits, and their derivatives (w, 2 r) by the
    state at the end of each of the N steps."""
    system, rows, r = plant.system, plant.system.free_rows, len(plant.system.free_rows)
    values: list[float] = []
    watch = [np.zeros((0, 2 * r)) for _ in q]
    if limits is None or not limits.of_states:
        return np.zeros(0), watch
    fast = [i for i in system.joint_rows if i in rows]
    most = limits.speed[np.isin(system.joint_rows, fast)]
    fast, most = np.array(fast)[np.isfinite(most)], most[np.isfinite(most)]
    column = r + np.searchsorted(rows, fast)
    for k, (place, rate) in enumerate(zip(q, v, strict=True)):
        at_node = (k + 1) % substeps == 0
        speed = rate[fast] / most
        own = np.flatnonzero(at_node | (np.abs(speed) > WATCHED))
        taken = np.zeros((len(own), 2 * r))
        taken[np.arange(len(own)), column[own]] = 1 / most[own]
        values += speed[own].tolist()
        if np.isfinite(limits.deflection_m):
            bend = system.places(place)[0] / limits.deflection_m
            own = np.flatnonzero(at_node | (np.abs(bend) > WATCHED))
            if len(own):
                slope = deflection_slope(system, place)[own][:, rows] / limits.deflection_m
                taken = np.concatenate([taken, np.hstack([slope, np.zeros_like(slope)])])
                values += bend[own].tolist()
        watch[k] = taken
    return np.array(values), watch


def _slopes(
    along: Variation, joints: np.ndarray, m: int, slower: np.ndarray, watch: list[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives by drives and time of the state at the end (2 r, P + 1), and of what is watched
    at the ends of the N steps (W, P + 1).

    Args: joints: their rows among those of `along`; slower (3 N, r, 1): what a longer time does;
    watch: derivatives (w, 2 r) by the state, of each step.
    """
    N, r, k = len(along.nodes) - 1, len(along.rows), len(joints)
    substeps = N // m
    within = (np.arange(substeps)[:, None] + STAGES) / substeps  # of an interval, at its stages
    hats = np.tile(np.stack([1 - within, within], axis=-1), (m, 1, 1))  # (N, 3, 2)
    force = np.zeros((N, 3, r, 2 * k + 1))
    for j, row in enumerate(joints):
        force[:, :, row, 2 * j : 2 * j + 2] = hats
    force[..., -1] = slower.reshape(N, 3, r)
    step, own = along.transitions(force)
    Z = np.zeros((2 * r, k * (m + 1) + 1))
    out = []
    for i in range(N):
        node = i // substeps
        Z = step[i] @ Z
        for j in range(k):
            Z[:, j * (m + 1) + node : j * (m + 1) + node + 2] += own[i, :, 2 * j : 2 * j + 2]
        Z[:, -1] += own[i, :, -1]
        out.append(watch[i] @ Z)
    held = (m + 1) * np.arange(1, k + 1) - 1  # the last drive holds
    return np.delete(Z, held, axis=1), np.delete(np.concatenate(out), held, axis=1)


def _accelerations(system: System, q: np.ndarray, v: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Accelerations (T, n) of motions under forces (T, n); those of locked joints are 0."""
    a, rows = np.zeros_like(q), system.free_rows
    bias, _, _, M, _, _ = system.equations.force_derivatives(q, v, a)
    pick = np.ix_(np.arange(len(q)), rows, rows)
    a[:, rows] = np.linalg.solve(M[pick], (force - bias)[:, rows, None])[:, :, 0]
    return a


def deflection_slope(system: System, q: np.ndarray) -> np.ndarray:
    """Derivatives of the tip deflections (tips, n) by q, from differences."""
    columns = []
    for row in range(system.n):
        step = np.zeros(system.n)
        if row not in system.joint_rows:
            step[row] = 1e-6
        columns.append((system.places(q + step)[0] - system.places(q - step)[0]) / 2e-6)
    return np.array(columns).T
