"""The system: a robot assembled. Constant; the workspace of a solver is apart from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag, eigvalsh

from . import extended
from .beam import LinkIntegrals, link_integrals, shape
from .chain import REVOLUTE, SLEEVE, SLIDER, Chain, Work, workspace
from .errors import InputError
from .modes import modal
from .newton_euler import inverse
from .outward import outward
from .robot import Link, Robot
from .run import STATIONS


@dataclass(frozen=True)
class System:
    """A robot's equations M(q) qdd + bias(q, qd) + damping qd + elastic(q) + gravity(q) = F.

    q (n,) is numbered [eta_1, u_1, eta_2, u_2, ...]: each joint, then the elastic unknowns of its link: deflection [m] and
    slope [rad] of nodes 1 ... n_i, or, for a link with `modes`, mass-normalised modal coordinates [kg^(1/2) m]. `labels` says
    which is which. F has entries in the joints' rows. The solver works in modal coordinates y throughout, q = transform @ y
    (exact for a full mesh).
    """

    robot: Robot
    chain: Chain
    links: tuple[LinkIntegrals, ...]
    transform: np.ndarray
    to_solver: np.ndarray
    labels: tuple[str, ...]

    @property
    def n(self) -> int:
        return len(self.labels)

    @property
    def joint_rows(self) -> np.ndarray:
        """Rows of the joints in q, (links,)."""
        return self.chain.first[:-1]

    @cached_property
    def elastic_rows(self) -> np.ndarray:
        """Rows of the elastic unknowns in q."""
        return np.setdiff1d(np.arange(self.n), self.joint_rows)

    @cached_property
    def free_rows(self) -> np.ndarray:
        """Rows of q that can move: all but locked joints."""
        return np.setdiff1d(np.arange(self.n), self.joint_rows[self.chain.locked.astype(bool)])

    @cached_property
    def limits(self) -> np.ndarray:
        """Lower and upper limits of the joints (links, 2) [m or rad]: those of the file, and the ends of the links that slide."""
        own = np.array([link.joint.limits or (-np.inf, np.inf) for link in self.robot.links])
        ends = np.array([self.robot.travel(i) for i in range(len(self.links))])
        return np.column_stack([np.maximum(own[:, 0], ends[:, 0]), np.minimum(own[:, 1], ends[:, 1])])

    @cached_property
    def spectrum(self) -> np.ndarray:
        """Natural frequencies at the start, joints free, gravity left out, ascending [rad/s]; [0] where nothing moves."""
        free = self.free_rows
        if len(free) == 0:
            return np.zeros(1)
        pick = np.ix_(free, free)
        return np.sqrt(np.maximum(eigvalsh(self.stiffness()[pick], self.mass(self.start())[pick]), 0.0))

    def start(self) -> np.ndarray:
        """The configuration at the start (n,): joints at their `start`, links straight."""
        q = np.zeros(self.n)
        q[self.joint_rows] = self.robot.start
        return q

    def mass(self, q: np.ndarray) -> np.ndarray:
        """M(q) (n, n) by the extended assembly."""
        M = extended.mass_matrix(self.chain, self._work(), self.to_solver @ self._check(q))
        return self.to_solver.T @ M @ self.to_solver

    def stiffness(self, q: np.ndarray | None = None) -> np.ndarray:
        """K (n, n), at the start (it depends on the free length of a sleeved link, on nothing else); with q the tangent stiffness
        there, d (elastic + gravity) / dq."""
        if q is None:
            self._check(self.start())
            K = np.diag(self._diagonal(self.chain.lam, np.zeros(len(self.links))))
        else:
            y, still = self.to_solver @ self._check(q), np.zeros(self.n)
            K = self.modal_stiffness + self.differences(lambda y: self.residual(y, still), y)
        return self.to_solver.T @ K @ self.to_solver

    @cached_property
    def modal_stiffness(self) -> np.ndarray:
        """The constant part of K (n, n) in the solver's coordinates, which `residual` leaves out: omega^2 of each link's own
        modes, 0 for links behind a sleeve."""
        fixed = np.where(self.chain.kind == SLEEVE, 0.0, 1.0)[:, None]
        return np.diag(self._diagonal(self.chain.lam * fixed, np.zeros(len(self.links))))

    @cached_property
    def damping(self) -> np.ndarray:
        """D (n, n) at the start: Rayleigh damping of the elastic unknowns and viscous friction of the joints."""
        return self.damping_at(self.start())

    def damping_at(self, q: np.ndarray) -> np.ndarray:
        """D (n, n) at q: it depends on the free length of a sleeved link, on nothing else."""
        c, w, y = self.chain, self._work(), self.to_solver @ self._check(q)
        D = np.diag(self._diagonal(c.damp, c.viscous))
        if SLEEVE in c.kind:
            outward(c, w, y, np.zeros(self.n))
        for i in np.flatnonzero(c.kind == SLEEVE):
            own = slice(c.first[i] + 1, c.first[i + 1])
            m = own.stop - own.start
            lower = c.alpha[i] * np.tril(w.M[i, :m, :m]) + c.beta[i] * np.tril(w.K[i, :m, :m])
            D[own, own] = lower + np.tril(lower, -1).T
        return self.to_solver.T @ D @ self.to_solver

    def _diagonal(self, elastic: np.ndarray, joint: np.ndarray) -> np.ndarray:
        """A diagonal (n,) from its values per link (N, m) and per joint (N,)."""
        parts = [np.concatenate([[joint[i]], elastic[i, : len(info.S0)]]) for i, info in enumerate(self.links)]
        return np.concatenate(parts)

    def elastic(self, q: np.ndarray) -> np.ndarray:
        """Elastic forces (n,), on the left-hand side: K q, and with stiffening the strain energy's terms of higher order."""
        zero = np.zeros(self.n)
        return self._constant_stiffness @ self._check(q) + self._inverse(q, zero, zero, np.zeros(2))

    def gravity(self, q: np.ndarray) -> np.ndarray:
        """Generalised gravity forces (n,), on the left-hand side."""
        zero = np.zeros(self.n)
        return self._inverse(q, zero, zero, self.chain.gravity) - self._inverse(q, zero, zero, np.zeros(2))

    def bias(self, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        """Coriolis and centrifugal forces (n,), on the left-hand side."""
        zero = np.zeros(self.n)
        return self._inverse(q, qd, zero, np.zeros(2)) - self._inverse(q, zero, zero, np.zeros(2))

    def forces(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) that the motion needs: the whole left-hand side (Coulomb friction left out), by
        Newton-Euler."""
        moving = self._inverse(q, qd, qdd, self.chain.gravity) + self.damping_at(q) @ np.asarray(qd)
        return moving + self._constant_stiffness @ np.asarray(q)

    @cached_property
    def _constant_stiffness(self) -> np.ndarray:
        return self.to_solver.T @ self.modal_stiffness @ self.to_solver

    def residual(self, y: np.ndarray, v: np.ndarray) -> np.ndarray:
        """bias + gravity and the strain energy's higher terms (n,), on the left-hand side, in the solver's coordinates."""
        out = np.zeros(self.n)
        inverse(self.chain, self._work(), y, v, np.zeros(self.n), self.chain.gravity, out)
        return out

    def differences(self, function: Callable[[np.ndarray], np.ndarray], y: np.ndarray, scale: float = 1.0) -> np.ndarray:
        """d function / dy (m, n) in the solver's coordinates; each step turns a link by about 1e-4 rad, times `scale`."""
        steep = _stack([np.abs(info.slope_d1).max(axis=0, initial=0.0) for info in self.links])
        return jacobian(function, y, scale * 1e-4 / self._diagonal(steep, np.ones(len(self.links))))

    def _inverse(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, gravity: np.ndarray) -> np.ndarray:
        out = np.zeros(self.n)
        y, v, a = (self.to_solver @ self._check(z) for z in (q, qd, qdd))
        inverse(self.chain, self._work(), y, v, a, gravity, out)
        return self.to_solver.T @ out

    def _check(self, q: np.ndarray) -> np.ndarray:
        if self.robot.nodal:
            text = 'expected "continuous": sliding from node to node has other matrices between every two nodes'
            raise InputError(text, key="sliding", value="nodal")
        q = np.asarray(q, dtype=float)
        if q.shape != (self.n,):
            raise InputError(f"expected an array of shape ({self.n},), in the order of system.labels", key="q", value=q.shape)
        return q

    def _work(self) -> Work:
        return workspace(self.chain)

    def deflections(self, link: int, y: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """The deflection [m] at the places where a Run holds it, (STATIONS, T), of states y (T, m) of a link (from 0) and
        positions eta (T,) of its joint: 0 for what is inside or behind a sleeve."""
        info, elements = self.links[link], self.robot.links[link].elements
        x = np.linspace(0, info.length, STATIONS)
        if self.chain.kind[link] != SLEEVE:
            return shape(info.length, elements, x).T @ info.basis @ y.T
        out = np.zeros((STATIONS, len(eta)))
        for k in range(1, STATIONS):
            ahead = np.maximum(x[k] - info.length + eta, 0.0) / eta  # xi
            out[k] = np.einsum("kt,kt->t", shape(info.length, elements, ahead * info.length), info.basis @ y.T)
        return out


def jacobian(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """d function / d x, (m, n), by central differences with the given steps (n,)."""
    shifts = np.diag(steps)
    return np.column_stack([(function(x + e) - function(x - e)) / (2 * h) for e, h in zip(shifts, steps, strict=True)])


def assemble(robot: Robot) -> System:
    """The System of a robot. Raises InputError for a singular mass matrix, and for joints that start beyond a link's end."""
    links = robot.links
    first, infos, spectra, transforms, back, labels = [0], [], [], [], [], []
    for i, link in enumerate(links, 1):
        last = i == len(links)
        nodal = link_integrals(link, robot.payload.mass_kg * last, robot.payload.inertia_kg_m2 * last)
        info, lam = modal(nodal, link.modes, loaded=not last)
        m = len(lam)
        unit = "rad" if link.joint.type == "R" else "m"
        labels.append(f"joint {i} position [{unit}]")
        if link.modes is not None:
            labels += [f"link {i} mode {k + 1} [kg^(1/2) m]" for k in range(m)]
            transforms.append(np.eye(1 + m))
            back.append(np.eye(1 + m))
        else:
            slope = "slope x d/L [rad]" if link.joint.type == "Pb" and robot.sliding == "continuous" else "slope [rad]"
            labels += [f"link {i} node {k // 2 + 1} {slope if k % 2 else 'deflection [m]'}" for k in range(m)]
            transforms.append(block_diag(1.0, info.basis) if m else np.eye(1))
            back.append(block_diag(1.0, info.basis.T @ nodal.M) if m else np.eye(1))
        first.append(first[-1] + 1 + m)
        spectra.append(lam)
        infos.append(info)
    column = lambda f, kind=float: np.array([f(link) for link in links], dtype=kind)
    of = lambda f: np.array([f(info) for info in infos], dtype=float)
    hubs = column(lambda k: k.joint.hub_mass_kg if k.joint.type == "Pb" else 0.0)
    at_end = np.arange(len(links)) == len(links) - 1
    laws = [_laws(link) if link.joint.type == "Pb" and link.flexible else _NO_LAWS for link in links]
    chain = Chain(
        first=np.array(first, dtype=np.int64),
        kind=column(lambda k: {"R": REVOLUTE, "Pa": SLIDER, "Pb": SLEEVE}[k.joint.type], np.int64),
        locked=column(lambda k: k.joint.locked, np.int64),
        angle=column(lambda k: k.joint.angle_rad),
        rotor=column(lambda k: k.joint.rotor_inertia),
        viscous=column(lambda k: k.joint.viscous_friction),
        coulomb=column(lambda k: k.joint.coulomb_friction),
        length=of(lambda k: k.length),
        mass=of(lambda k: k.mass) + hubs,
        hub=hubs,
        s1=of(lambda k: k.s1),
        inertia=of(lambda k: k.inertia),
        **{name: _stack([getattr(info, name) for info in infos]) for name in _PER_LINK},
        lam=_stack(spectra),
        alpha=column(lambda k: k.damping.alpha_1_s),
        beta=column(lambda k: k.damping.beta_s),
        damp=_stack(
            [np.where(lam > 0, k.damping.alpha_1_s + k.damping.beta_s * lam, 0.0) for k, lam in zip(links, spectra, strict=True)]
        ),
        points=of(lambda k: len(k.point_x)).astype(np.int64),
        payload=robot.payload.mass_kg * at_end,
        tip_inertia=robot.payload.inertia_kg_m2 * at_end,
        elements=column(lambda k: k.elements, np.int64),
        node=np.zeros(len(links), dtype=np.int64),
        reference=of(lambda k: k.reference),
        law_x=_stack([x for x, _, _ in laws], np.inf),
        law_mass=_stack([mass for _, mass, _ in laws]),
        law_EI=_stack([EI for _, _, EI in laws]),
        stiffening=robot.stiffening,
        gravity=np.array(robot.gravity_m_s2, dtype=float),
    )
    system = System(robot, chain, tuple(infos), block_diag(*transforms), block_diag(*back), tuple(labels))
    _check_mass(system)
    return system


def size(robot: Robot) -> int:
    """How many unknowns a robot's System has."""
    own = [2 * k.elements if k.modes is None else min(k.modes + 2 * (i < len(robot.links)), 2 * k.elements) for i, k in enumerate(robot.links, 1)]
    return len(robot.links) + sum(own)


def assemble_all(robots: Sequence[Robot]) -> list[System | InputError]:
    """The Systems of robots of one topology; an InputError in place of one that cannot be assembled."""
    out: list[System | InputError] = []
    for robot in robots:
        try:
            out.append(assemble(robot))
        except InputError as error:
            out.append(error)
    return out


_PER_LINK = (
    "S0", "S1", "NL", "SL", "G1", "G2", "H", "point_x", "point_mass", "point_phi", "slope_dx", "slope_EI", "slope_d1", "slope_d2",
    "ride", "sleeve_xi", "sleeve_w", "sleeve_phi", "sleeve_d1", "sleeve_d2",
)  # fmt: skip

_NO_LAWS = (np.zeros(1), np.zeros((1, 3)), np.zeros((1, 5)))


def _laws(link: Link) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """rho A and E I between a link's breaks as polynomials: where they begin (B,), coefficients (B, 3) and (B, 5), exact for
    sections that taper linearly."""
    breaks = np.array(link.breaks())
    pieces = list(pairwise(breaks))
    mass, EI = np.zeros((len(pieces), 3)), np.zeros((len(pieces), 5))
    for k, (a, b) in enumerate(pieces):
        for row, law in ((mass[k], link.mass_per_length), (EI[k], link.bending_stiffness)):
            s = np.linspace(0, b - a, len(row))
            row[:] = np.polynomial.polynomial.polyfit(s / (b - a), law(a + s), len(row) - 1) / (b - a) ** np.arange(len(row))
    return breaks[:-1], mass, EI


def _stack(arrays: list[np.ndarray], empty: float = 0.0) -> np.ndarray:
    """Arrays of the links as one, padded to the largest."""
    shape_ = np.max([a.shape for a in arrays], axis=0)
    out = np.full((len(arrays), *shape_), empty)
    for target, a in zip(out, arrays, strict=True):
        target[tuple(slice(k) for k in a.shape)] = a
    return out


def _check_mass(system: System) -> None:
    """Refuse a robot with a joint that moves nothing: its mass matrix is singular."""
    M = system.to_solver.T @ extended.mass_matrix(system.chain, system._work(), system.start()) @ system.to_solver
    free = system.free_rows
    if len(free) == 0:
        return
    scale = 1 / np.sqrt(np.maximum(np.diag(M)[free], 1e-300))
    smallest = np.linalg.eigvalsh(M[np.ix_(free, free)] * scale * scale[:, None])[0]
    if np.any(np.diag(M)[free] <= 0) or smallest < 1e-13:
        joint = next(
            (i + 1 for i, row in enumerate(system.joint_rows) if row in free and M[row, row] <= 1e-300), len(system.joint_rows)
        )
        raise InputError(
            "nothing to accelerate: expected a mass or inertia (link, hub, rotor or payload) that this joint moves",
            key=f"link[{joint}].joint",
        )
