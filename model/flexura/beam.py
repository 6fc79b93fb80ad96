"""Euler-Bernoulli beam elements: Hermite cubics and the integrals that a link's equations need.

A link of length L is clamped to its hub at x = 0 and carries n elements of equal length. Its unknowns are the transverse
displacement w and the slope w' at nodes 1 ... n (node 0 is the hub: w = w' = 0), so that w(x) = phi(x)^T q, q of
2n entries. Every matrix is a constant integral, computed once by Gauss quadrature that is exact for the given properties.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .chain import NODES
from .robot import Link


def hermite(s: np.ndarray, h: float, derivative: int = 0) -> np.ndarray:
    """The four cubics N1 ... N4 on an element of length h at s = x/h in [0, 1], or their x-derivatives; (4, *s.shape).

    N1 = 1 - 3 s^2 + 2 s^3, N2 = h (s - 2 s^2 + s^3), N3 = 3 s^2 - 2 s^3, N4 = h (s^3 - s^2)   (dissertation, 2.1).
    """
    s = np.asarray(s, dtype=float)
    if derivative == 0:
        return np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)])
    if derivative == 1:
        return np.array([-6 * s + 6 * s**2, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h
    if derivative == 2:
        return np.array([-6 + 12 * s, h * (-4 + 6 * s), 6 - 12 * s, h * (6 * s - 2)]) / h**2
    raise ValueError(f"derivative {derivative}: 0, 1 or 2")


def shape(length: float, elements: int, x: Any, derivative: int = 0) -> np.ndarray:
    """phi(x), phi'(x) or phi''(x) of the clamped link: (2n, *x.shape), unknowns (w_1, w'_1, ..., w_n, w'_n)."""
    x = np.atleast_1d(np.asarray(x, dtype=float))
    h = length / elements
    element = np.clip((x / h).astype(int), 0, elements - 1)
    values = hermite(x / h - element, h, derivative)
    out = np.zeros((2 * elements + 2, len(x)))
    for k in range(4):
        out[2 * element + k, np.arange(len(x))] = values[k]
    return out[2:]


_NONE, _EMPTY = np.zeros(0), np.zeros((0, 0))


class LinkIntegrals(NamedTuple):
    """Constants of one link in some elastic coordinates q (m of them; 0: a rigid link), with dm = rho A dx plus tip and hub
    masses.

    mass m0 = int dm [kg]; first moment s1 = int x dm [kg m]; second moment inertia = int x^2 dm [kg m^2], about the hub;
    S0 = int phi dm, S1 = int x phi dm (m,); M = int phi phi^T dm, K = int EI phi'' phi''^T dx (m, m);
    G1 = int n1 phi' phi'^T dx, G2 = int n2 phi' phi'^T dx, n1(x) = int_x^L dm, n2(x) = int_x^L X dm, so that the shortening
    u2 = -1/2 int_0^x w'^2 has int u2 dm = -q^T G1 q / 2, int x u2 dm = -q^T G2 q / 2; and H = int phi' phi'^T dx, u2(L) = -q^T
    H q / 2. NL = phi(L), SL = phi'(L) (m,); basis (2n, m): nodal unknowns = basis @ q. What is of higher order in the
    deflection is summed over points (`model/README.md`, section 3): mass points (p,) at x with their masses and phi (p, m), the
    last one being the tip with the payload; and slope points (2p,), two before each mass point, with weights dx, EI dx, and
    phi', phi'' (2p, m). `ride` (n + 1, 3, m): w, w_xi and the mean of w_xi,xi on both sides of each node, xi = x / length: the
    quintic Hermite curve through these is the line on which a slider rides.

    A link behind a sleeve (`sleeve.py`): its mesh covers the free length d and moves with it, xi = x / d; s1 and inertia are
    about the proximal end and have no sleeve in them; M and K hold at the start's d, `reference`; NL = Phi(1), SL = Phi_xi(1);
    Phi, Phi_xi, Phi_xi,xi (P + 1, m) stand at Gauss points `sleeve_xi` and the tip; G1, G2, H, S0, S1 are not used.
    """

    length: float
    mass: float
    s1: float
    inertia: float
    S0: np.ndarray = _NONE
    S1: np.ndarray = _NONE
    M: np.ndarray = _EMPTY
    K: np.ndarray = _EMPTY
    G1: np.ndarray = _EMPTY
    G2: np.ndarray = _EMPTY
    H: np.ndarray = _EMPTY
    NL: np.ndarray = _NONE
    SL: np.ndarray = _NONE
    basis: np.ndarray = _EMPTY
    point_x: np.ndarray = _NONE
    point_mass: np.ndarray = _NONE
    point_phi: np.ndarray = _EMPTY
    slope_dx: np.ndarray = _NONE
    slope_EI: np.ndarray = _NONE
    slope_d1: np.ndarray = _EMPTY
    slope_d2: np.ndarray = _EMPTY
    ride: np.ndarray = np.zeros((1, 3, 0))
    reference: float = 0.0
    sleeve_xi: np.ndarray = _NONE
    sleeve_w: np.ndarray = _NONE
    sleeve_phi: np.ndarray = _EMPTY
    sleeve_d1: np.ndarray = _EMPTY
    sleeve_d2: np.ndarray = _EMPTY

    def changed(self, basis: np.ndarray) -> LinkIntegrals:
        """The same link in coordinates p with q = basis @ p."""
        B = basis
        new: dict[str, Any] = {name: _sandwich(B, getattr(self, name)) for name in ("M", "K", "G1", "G2", "H")}
        new |= {name: B.T @ getattr(self, name) for name in ("S0", "S1", "NL", "SL")}
        new |= {name: getattr(self, name) @ B for name in _ROWS if getattr(self, name).size}
        return self._replace(**new)


_ROWS = ("basis", "point_phi", "slope_d1", "slope_d2", "ride", "sleeve_phi", "sleeve_d1", "sleeve_d2")


def link_integrals(link: Link, tip_mass: float = 0.0, tip_inertia: float = 0.0) -> LinkIntegrals:
    """The integrals of a link, its hub and a payload at its tip, in nodal unknowns; rigid links have none (m = 0)."""
    L, mp, Jp = link.length_m, tip_mass, tip_inertia
    sleeve = link.joint.type == "Pb"
    if not link.flexible:
        bare = _rigid(link)
    elif sleeve:
        bare = _sleeved(link)
    else:
        bare = _flexible(link)
    hub = (0.0 if sleeve else link.joint.hub_mass_kg, link.joint.hub_inertia_kg_m2)
    turn = bare.SL / bare.reference if sleeve and link.flexible else bare.SL
    return bare._replace(
        mass=bare.mass + hub[0] + mp,
        s1=bare.s1 + mp * L,
        inertia=bare.inertia + hub[1] + mp * L**2 + Jp,
        S0=bare.S0 + mp * bare.NL,
        S1=bare.S1 + mp * L * bare.NL + Jp * bare.SL,
        M=bare.M + mp * np.outer(bare.NL, bare.NL) + Jp * np.outer(turn, turn),
        G1=bare.G1 + mp * bare.H,
        G2=bare.G2 + mp * L * bare.H,
        point_mass=bare.point_mass + mp * (bare.point_x == L),
    )


def _rigid(link: Link) -> LinkIntegrals:
    if link.mass_kg is not None:
        centre = link.centre_of_mass_m if link.centre_of_mass_m is not None else link.length_m / 2
        m, about_centre = link.mass_kg, link.inertia_kg_m2 or 0.0
        mass, s1, inertia = m, m * centre, about_centre + m * centre**2
    else:
        x, dx = _quadrature(np.array(link.breaks()))
        rho = link.mass_per_length(x)
        mass, s1, inertia = float(rho @ dx), float((rho * x) @ dx), float((rho * x**2) @ dx)
    return LinkIntegrals(link.length_m, mass, s1, inertia)


def _flexible(link: Link) -> LinkIntegrals:
    L, n = link.length_m, link.elements
    cells = np.union1d(np.linspace(0, L, n + 1), np.array(link.breaks()))
    cells = cells[np.concatenate([[True], np.diff(cells) > 1e-12 * L])]
    cells[-1] = L
    x, dx = _quadrature(cells)
    rho, EI = link.mass_per_length(x), link.bending_stiffness(x)
    N, S, C = (shape(L, n, x, k) for k in (0, 1, 2))
    n1, n2 = _outboard(link, cells, x)
    dm = rho * dx
    return LinkIntegrals(
        L, float(dm.sum()), float(dm @ x), float(dm @ x**2), S0=N @ dm, S1=N @ (x * dm), M=(N * dm) @ N.T,
        K=(C * (EI * dx)) @ C.T, G1=(S * (n1 * dx)) @ S.T, G2=(S * (n2 * dx)) @ S.T, H=(S * dx) @ S.T,
        NL=shape(L, n, L)[:, 0], SL=shape(L, n, L, 1)[:, 0], basis=np.eye(2 * n), ride=_ride(L, n), **_points(link),
    )  # fmt: skip


def _sleeved(link: Link) -> LinkIntegrals:
    """A flexible link behind a sleeve. Its unknowns are the deflections w_k of the moving nodes and their slopes times d / L: the
    link's own Hermite cubics, compressed from L to d."""
    L, n, d = link.length_m, link.elements, link.joint.start
    x, dx = _quadrature(np.linspace(0, L, n + 1), NODES)
    xi, w = np.append(x / L, 1.0), np.append(dx / L, 0.0)
    N, S, C = (shape(L, n, xi * L, k) * L**k for k in (0, 1, 2))
    X = L - d + xi * d
    mass, EI = w * d * link.mass_per_length(X), w * link.bending_stiffness(X) / d**3
    whole, weight = _quadrature(np.array(link.breaks()))
    dm = link.mass_per_length(whole) * weight
    none, empty = np.zeros(2 * n), np.zeros((2 * n, 2 * n))
    return LinkIntegrals(
        L, float(dm.sum()), float(dm @ whole), float(dm @ whole**2), S0=none, S1=none, M=(N * mass) @ N.T, K=(C * EI) @ C.T,
        G1=empty, G2=empty, H=empty, NL=N[:, -1], SL=S[:, -1], basis=np.eye(2 * n), ride=_ride(L, n), slope_d1=S.T / d,
        reference=d, sleeve_xi=xi, sleeve_w=w, sleeve_phi=N.T, sleeve_d1=S.T, sleeve_d2=C.T,
    )  # fmt: skip


def _ride(L: float, n: int) -> np.ndarray:
    """w, w_xi and the mean w_xi,xi of the elements on both sides of each node: (n + 1, 3, 2n)."""
    x = np.linspace(0, L, n + 1)
    ends = np.array([hermite(np.array([0.0, 1.0]), L / n, 2)[:, k] for k in (0, 1)])  # w'' at both ends of an element
    bend, count = np.zeros((n + 1, 2 * n + 2)), np.zeros(n + 1)
    for e in range(n):
        bend[e, 2 * e : 2 * e + 4] += ends[0]
        bend[e + 1, 2 * e : 2 * e + 4] += ends[1]
        count[e : e + 2] += 1
    return np.stack([shape(L, n, x).T, shape(L, n, x, 1).T * L, bend[:, 2:] / count[:, None] * L**2], axis=1)


def _outboard(link: Link, cells: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """int_x^L rho A dX and int_x^L rho A X dX at the quadrature points x of `cells`."""
    count = len(x) // (len(cells) - 1)
    k = np.arange(len(x)) // count
    s, weight = np.polynomial.legendre.leggauss(count)
    half = (cells[k + 1] - x) / 2
    X = x[:, None] + half[:, None] * (1 + s)
    rho = link.mass_per_length(X)
    cell_x, cell_dx = _quadrature(cells)
    cell_rho = link.mass_per_length(cell_x)
    out = []
    for near, f in ((rho, cell_rho), (rho * X, cell_rho * cell_x)):
        whole = (f * cell_dx).reshape(-1, count).sum(axis=1)
        beyond = np.append(np.cumsum(whole[::-1])[::-1][1:], 0.0)
        out.append((half[:, None] * weight * near).sum(axis=1) + beyond[k])
    return out[0], out[1]


def _points(link: Link) -> dict[str, Any]:
    """The ends of equal cells (x, mass, phi) and two Gauss points in each cell (dx, EI dx, phi', phi'').

    The cells are the elements, so that nothing jumps inside one, but at least 4 and, where only some modes are kept, no more
    than their shapes need.
    """
    L, n = link.length_m, link.elements
    count = n if n > 2 else 4
    if link.modes is not None:
        count = min(count, max(4, link.modes + 1))
    x = L * np.arange(1, count + 1) / count
    mass = _newton_cotes(count)[1:] * (L / count) * link.mass_per_length(x)
    place, dx = _quadrature(np.append(0.0, x), 2)
    EI = link.bending_stiffness(place)
    points = {"point_x": x, "point_mass": mass, "point_phi": shape(L, n, x).T}
    return points | {
        "slope_dx": dx, "slope_EI": EI * dx, "slope_d1": shape(L, n, place, 1).T, "slope_d2": shape(L, n, place, 2).T,
    }  # fmt: skip


def _newton_cotes(cells: int) -> np.ndarray:
    """Weights (cells + 1,) of a closed rule on cells of length 1: Boole for 4, else Simpson, and 3/8 for the last three of an
    odd number."""
    if cells == 4:
        return np.array([14, 64, 24, 64, 14]) / 45
    weights = np.zeros(cells + 1)
    even = cells - 3 * (cells % 2)
    for k in range(0, even, 2):
        weights[k : k + 3] += np.array([1, 4, 1]) / 3
    if cells % 2:
        weights[even:] += np.array([3, 9, 9, 3]) / 8
    return weights


def _quadrature(cells: np.ndarray, points: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights on consecutive cells; 6 points are exact to degree 11, the integrands here reach degree 8."""
    s, weight = np.polynomial.legendre.leggauss(points)
    half, middle = np.diff(cells) / 2, (cells[1:] + cells[:-1]) / 2
    return (middle[:, None] + half[:, None] * s).ravel(), (half[:, None] * weight).ravel()


def _sandwich(B: np.ndarray, A: np.ndarray) -> np.ndarray:
    out = B.T @ A @ B
    return (out + out.T) / 2
