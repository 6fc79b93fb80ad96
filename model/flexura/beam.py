"""Euler-Bernoulli beam elements: Hermite cubics and the integrals that a link's equations need.

A link of length L is clamped to its hub at x = 0 and carries n elements of equal length. Its unknowns are the transverse
displacement w and the slope w' at nodes 1 ... n (node 0 is the hub: w = w' = 0), so that w(x) = phi(x)^T q, q of
2n entries. Every matrix is a constant integral, computed once by Gauss quadrature that is exact for the given properties.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from .chain import NODES
from .robot import Link


def hermite(s: np.ndarray, h: Any, derivative: int = 0) -> np.ndarray:
    """The four cubics N1 ... N4 on elements of length h (that broadcasts with s) at s = x/h in [0, 1], or their x-derivatives;
    (4, *s.shape).

    N1 = 1 - 3 s^2 + 2 s^3, N2 = h (s - 2 s^2 + s^3), N3 = 3 s^2 - 2 s^3, N4 = h (s^3 - s^2)   (dissertation, 2.1).
    """
    s = np.asarray(s, dtype=float)
    square, cube = s * s, s * s * s
    if derivative == 0:
        return np.array([1 - 3 * square + 2 * cube, h * (s - 2 * square + cube), 3 * square - 2 * cube, h * (cube - square)])
    if derivative == 1:
        return np.array([-6 * s + 6 * square, h * (1 - 4 * s + 3 * square), 6 * s - 6 * square, h * (3 * square - 2 * s)]) / h
    if derivative == 2:
        return np.array([-6 + 12 * s, h * (-4 + 6 * s), 6 - 12 * s, h * (6 * s - 2)]) / h**2
    raise ValueError(f"derivative {derivative}: 0, 1 or 2")


def shape(length: float, elements: int, x: Any, derivative: int = 0) -> np.ndarray:
    """phi(x), phi'(x) or phi''(x) of the clamped link: (2n, *x.shape), unknowns (w_1, w'_1, ..., w_n, w'_n)."""
    return _shapes(np.array([length]), elements, np.atleast_1d(np.asarray(x, dtype=float))[None], derivative)[0]


def _shapes(length: np.ndarray, elements: int, x: np.ndarray, derivative: int = 0) -> np.ndarray:
    """The same of B links at places x (B, Q): (B, 2n, Q)."""
    h = (length / elements)[:, None]
    element = np.clip((x / h).astype(int), 0, elements - 1)
    values = hermite(x / h - element, h, derivative)
    out = np.zeros((len(x), 2 * elements + 2, x.shape[1]))
    link, place = np.arange(len(x))[:, None], np.arange(x.shape[1])
    for k in range(4):
        out[link, 2 * element + k, place] = values[k]
    return out[:, 2:]


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

    `integrals` has those of B links at once, every field with a leading axis (B,).
    """

    length: Any
    mass: Any
    s1: Any
    inertia: Any
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
    reference: Any = 0.0
    sleeve_xi: np.ndarray = _NONE
    sleeve_w: np.ndarray = _NONE
    sleeve_phi: np.ndarray = _EMPTY
    sleeve_d1: np.ndarray = _EMPTY
    sleeve_d2: np.ndarray = _EMPTY

    def changed(self, basis: np.ndarray) -> LinkIntegrals:
        """The same link in coordinates p with q = basis @ p."""
        B = basis
        new: dict[str, Any] = {name: _sandwich(B, getattr(self, name)) for name in ("M", "K", "G1", "G2", "H")}
        new |= {name: (getattr(self, name)[..., None, :] @ B)[..., 0, :] for name in ("S0", "S1", "NL", "SL")}
        new |= {name: getattr(self, name) @ B for name in _ROWS if getattr(self, name).size}
        if self.ride.size:
            new["ride"] = self.ride @ B[..., None, :, :]
        return self._replace(**new)


_ROWS = ("basis", "point_phi", "slope_d1", "slope_d2", "sleeve_phi", "sleeve_d1", "sleeve_d2")


def link_integrals(link: Link, tip_mass: float = 0.0, tip_inertia: float = 0.0) -> LinkIntegrals:
    """The integrals of a link, its hub and a payload at its tip, in nodal unknowns; rigid links have none (m = 0)."""
    return LinkIntegrals(*(field[0] for field in integrals([link], np.array([tip_mass]), np.array([tip_inertia]))))


def integrals(links: Sequence[Link], tip_mass: np.ndarray, tip_inertia: np.ndarray) -> LinkIntegrals:
    """The integrals of B links of one joint type, as many elements and modes, with their payloads (B,), as `link_integrals`.

    What one link gets does not depend on the others, to the last bit.
    """
    if len(links) > 1 and (len(set(map(uniform, links))) > 1 or _cells(links) is None):  # kinks in some, or in other places
        parts = [integrals([link], tip_mass[k : k + 1], tip_inertia[k : k + 1]) for k, link in enumerate(links)]
        return LinkIntegrals(*(np.concatenate(fields) for fields in zip(*parts, strict=True)))
    sleeve = links[0].joint.type == "Pb"
    bare = (_sleeved if sleeve else flexible)(links) if links[0].flexible else _rigid(links)
    return with_ends(bare, links, tip_mass, tip_inertia)


def with_ends(bare: LinkIntegrals, links: Sequence[Link], tip_mass: np.ndarray, tip_inertia: np.ndarray) -> LinkIntegrals:
    """The same links, in whatever coordinates, with their hubs and payloads (B,)."""
    sleeve = links[0].joint.type == "Pb"
    L, mp, Jp = bare.length, np.asarray(tip_mass, dtype=float), np.asarray(tip_inertia, dtype=float)
    hub = np.array([0.0 if sleeve else link.joint.hub_mass_kg for link in links])
    turn = bare.SL / bare.reference[:, None] if sleeve and links[0].flexible else bare.SL
    of = lambda values: values[:, None]
    outer = lambda a: a[:, :, None] * a[:, None, :]
    return bare._replace(
        mass=bare.mass + hub + mp,
        s1=bare.s1 + mp * L,
        inertia=bare.inertia + np.array([link.joint.hub_inertia_kg_m2 for link in links]) + mp * L**2 + Jp,
        S0=bare.S0 + of(mp) * bare.NL,
        S1=bare.S1 + of(mp * L) * bare.NL + of(Jp) * bare.SL,
        M=bare.M + mp[:, None, None] * outer(bare.NL) + Jp[:, None, None] * outer(turn),
        G1=bare.G1 + mp[:, None, None] * bare.H,
        G2=bare.G2 + (mp * L)[:, None, None] * bare.H,
        point_mass=bare.point_mass + of(mp) * (bare.point_x == of(L)),
    )


def bare_integrals(links: Sequence[Link], **fields: Any) -> LinkIntegrals:
    """Fields (B, ...), and empty ones for the rest."""
    B = len(links)
    empty = {name: np.broadcast_to(value, (B, *np.shape(value))) for name, value in LinkIntegrals._field_defaults.items()}
    return LinkIntegrals(**(empty | {"length": lengths(links)} | fields))


def _rigid(links: Sequence[Link]) -> LinkIntegrals:
    moments = np.zeros((len(links), 3))
    for k, link in enumerate(links):
        if link.mass_kg is not None:
            centre = link.centre_of_mass_m if link.centre_of_mass_m is not None else link.length_m / 2
            m, about_centre = link.mass_kg, link.inertia_kg_m2 or 0.0
            moments[k] = m, m * centre, about_centre + m * centre**2
        else:
            moments[k] = _moments([link])[0]
    return bare_integrals(links, mass=moments[:, 0], s1=moments[:, 1], inertia=moments[:, 2])


def _moments(links: Sequence[Link]) -> np.ndarray:
    """int dm, int x dm and int x^2 dm of links whose properties have equally many kinks: (B, 3)."""
    if uniform(links[0]):
        L, rho = lengths(links)[:, None], numbers(links, "mass_per_length")[:, None]
        return np.asarray(rho * np.concatenate([L, L**2 / 2, L**3 / 3], axis=1))
    mesh = _cells(links)
    assert mesh is not None
    x, dx = _quadrature(mesh[0])
    dm = _law(links, "mass_per_length", x) * dx
    return np.stack([dm.sum(axis=1), (dm * x).sum(axis=1), (dm * x * x).sum(axis=1)], axis=1)


def flexible(links: Sequence[Link]) -> LinkIntegrals:
    """Flexible links clamped to their hubs, without these and their payloads."""
    n, mesh = links[0].elements, _cells(links)
    assert mesh is not None
    cells, element = mesh
    L = cells[:, -1]
    x, dx = _quadrature(cells)
    rho, EI = _law(links, "mass_per_length", x), _law(links, "bending_stiffness", x)
    dm = rho * dx
    n1, n2 = _outboard(links, cells, x)
    h = (L / n)[:, None]
    s = x / h - np.repeat(element, 6)
    N, S, C = (np.moveaxis(hermite(s, h, k), 0, -1).reshape(len(links), len(element), 6, 4) for k in (0, 1, 2))
    joined = lambda shapes, weight: _joined(shapes, weight.reshape(*shapes.shape[:3], 1), element, n)
    tip = L[:, None]
    return bare_integrals(
        links, mass=dm.sum(axis=1), s1=(dm * x).sum(axis=1), inertia=(dm * x * x).sum(axis=1), S0=joined(N, dm)[0],
        S1=joined(N, dm * x)[0], M=joined(N, dm)[1], K=joined(C, EI * dx)[1], G1=joined(S, n1 * dx)[1], G2=joined(S, n2 * dx)[1],
        H=joined(S, dx)[1], NL=_shapes(L, n, tip)[:, :, 0], SL=_shapes(L, n, tip, 1)[:, :, 0],
        basis=np.tile(np.eye(2 * n), (len(links), 1, 1)), ride=_ride(L, n), **_points(links),
    )  # fmt: skip


def _joined(shapes: np.ndarray, weight: np.ndarray, element: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """sum phi w (B, 2n) and sum phi phi^T w (B, 2n, 2n) over quadrature points of cells, of shapes (B, cells, points, 4)."""
    B = len(shapes)
    vector, matrix = np.zeros((B, 2 * n + 2)), np.zeros((B, 2 * n + 2, 2 * n + 2))
    weighted = shapes * weight
    sums, blocks = weighted.sum(axis=2), np.swapaxes(weighted, 2, 3) @ shapes
    for cell, e in enumerate(element):
        own = slice(2 * e, 2 * e + 4)
        vector[:, own] += sums[:, cell]
        matrix[:, own, own] += blocks[:, cell]
    return vector[:, 2:], (matrix + np.swapaxes(matrix, 1, 2))[:, 2:, 2:] / 2


def uniform(link: Link) -> bool:
    return not any(isinstance(p, list) for p in (link.section, link.mass_per_length_kg_m, link.bending_stiffness_N_m2))


def lengths(links: Sequence[Link]) -> np.ndarray:
    return np.array([link.length_m for link in links], dtype=float)


def numbers(links: Sequence[Link], name: str) -> np.ndarray:
    """`mass_per_length` or `bending_stiffness` of uniform links (B,)."""
    return np.array([getattr(link, name)(0.0) for link in links], dtype=float)


def _cells(links: Sequence[Link]) -> tuple[np.ndarray, np.ndarray] | None:
    """Ends (B, C + 1) of the cells in which the links' properties are smooth, and the element of each (C,); of rigid links and
    those behind a sleeve only their breaks. None where the links differ in it."""
    one, n = links[0], links[0].elements
    meshed = one.flexible and one.joint.type != "Pb"
    if uniform(one):
        n = n if meshed else 1
        return lengths(links)[:, None] * np.linspace(0, 1, n + 1), np.arange(n)
    found = []
    for link in links:
        cells, L = np.array(link.breaks()), link.length_m
        if meshed:
            cells = np.union1d(L * np.linspace(0, 1, n + 1), cells)
            cells = cells[np.concatenate([[True], np.diff(cells) > 1e-12 * L])]
            cells[-1] = L
        found.append(cells)
    if len({len(cells) for cells in found}) > 1:
        return None
    ends = np.array(found)
    element = ((ends[:, 1:] + ends[:, :-1]) / 2 / (ends[:, -1:] / max(n, 1))).astype(int)
    return (ends, element[0]) if (element == element[0]).all() else None


def _law(links: Sequence[Link], name: str, x: np.ndarray) -> np.ndarray:
    """`mass_per_length` or `bending_stiffness` of the links at x (B, ...): all are uniform, or none."""
    if uniform(links[0]):
        return np.broadcast_to(numbers(links, name).reshape(-1, *[1] * (x.ndim - 1)), x.shape)
    return np.array([getattr(link, name)(x[k]) for k, link in enumerate(links)])


def _sleeved(links: Sequence[Link]) -> LinkIntegrals:
    """Flexible links behind a sleeve. Their unknowns are the deflections w_k of the moving nodes and their slopes times d / L:
    the link's own Hermite cubics, compressed from L to d."""
    n, count = links[0].elements, len(links)
    L, d = np.array([(k.length_m, k.joint.start) for k in links], dtype=float).T[:, :, None]
    x, dx = _quadrature(L * np.linspace(0, 1, n + 1), NODES)
    xi, w = (np.concatenate([part, np.full((count, 1), end)], axis=1) for part, end in ((x / L, 1.0), (dx / L, 0.0)))
    N, S, C = (_shapes(L[:, 0], n, xi * L, k) * L[:, :, None] ** k for k in (0, 1, 2))
    X = L - d + xi * d
    mass, EI = w * d * _law(links, "mass_per_length", X), w * _law(links, "bending_stiffness", X) / d**3
    moments = _moments(links)
    none, empty = np.zeros((count, 2 * n)), np.zeros((count, 2 * n, 2 * n))
    turned = lambda a: np.swapaxes(a, 1, 2)
    return bare_integrals(
        links, mass=moments[:, 0], s1=moments[:, 1], inertia=moments[:, 2], S0=none, S1=none,
        M=(N * mass[:, None, :]) @ turned(N), K=(C * EI[:, None, :]) @ turned(C), G1=empty, G2=empty, H=empty, NL=N[:, :, -1],
        SL=S[:, :, -1], basis=np.tile(np.eye(2 * n), (count, 1, 1)), ride=_ride(L[:, 0], n), slope_d1=turned(S) / d[:, :, None],
        reference=d[:, 0], sleeve_xi=xi, sleeve_w=w, sleeve_phi=turned(N), sleeve_d1=turned(S), sleeve_d2=turned(C),
    )  # fmt: skip


def _ride(L: np.ndarray, n: int) -> np.ndarray:
    """w, w_xi and the mean w_xi,xi of the elements on both sides of each node, of links of lengths L (B,): (B, n + 1, 3, 2n)."""
    at, B = L[:, None], len(L)
    x = at * np.linspace(0, 1, n + 1)
    ends = np.moveaxis(hermite(np.tile([0.0, 1.0], (B, 1)), at / n, 2), 0, -1)  # w'' at both ends of an element, (B, 2, 4)
    bend, count = np.zeros((B, n + 1, 2 * n + 2)), np.zeros(n + 1)
    for e in range(n):
        bend[:, e : e + 2, 2 * e : 2 * e + 4] += ends
        count[e : e + 2] += 1
    scaled = bend[:, :, 2:] / count[:, None] * (at**2)[:, :, None]
    turned = lambda a: np.swapaxes(a, 1, 2)
    return np.stack([turned(_shapes(L, n, x)), turned(_shapes(L, n, x, 1)) * at[:, :, None], scaled], axis=2)


def _outboard(links: Sequence[Link], cells: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """int_x^L rho A dX and int_x^L rho A X dX at the quadrature points x (B, Q) of `cells` (B, C + 1)."""
    B, count = len(links), x.shape[1] // (cells.shape[1] - 1)
    k = np.arange(x.shape[1]) // count
    s, weight = _gauss(count)
    half = (cells[:, k + 1] - x) / 2
    X = x[:, :, None] + half[:, :, None] * (1 + s)
    rho = _law(links, "mass_per_length", X)
    cell_x, cell_dx = _quadrature(cells)
    cell_rho = _law(links, "mass_per_length", cell_x)
    out = []
    for near, f in ((rho, cell_rho), (rho * X, cell_rho * cell_x)):
        whole = (f * cell_dx).reshape(B, -1, count).sum(axis=2)
        beyond = np.zeros_like(whole)
        beyond[:, :-1] = np.cumsum(whole[:, ::-1], axis=1)[:, ::-1][:, 1:]
        out.append((half[:, :, None] * weight * near).sum(axis=2) + beyond[:, k])
    return out[0], out[1]


def _points(links: Sequence[Link]) -> dict[str, Any]:
    """The ends of equal cells (x, mass, phi) and two Gauss points in each cell (dx, EI dx, phi', phi'').

    The cells are the elements, so that nothing jumps inside one, but at least 4 and, where only some modes are kept, no more
    than their shapes need.
    """
    n, modes = links[0].elements, links[0].modes
    L = lengths(links)
    count = n if n > 2 else 4
    if modes is not None:
        count = min(count, max(4, modes + 1))
    x = L[:, None] * (np.arange(1, count + 1) / count)  # the last one is L to the last digit: there is the payload
    mass = _newton_cotes(count)[1:] * (L / count)[:, None] * _law(links, "mass_per_length", x)
    place, dx = _quadrature(np.concatenate([np.zeros((len(L), 1)), x], axis=1), 2)
    EI = _law(links, "bending_stiffness", place)
    turned = lambda a: np.swapaxes(a, 1, 2)
    points = {"point_x": x, "point_mass": mass, "point_phi": turned(_shapes(L, n, x))}
    return points | {
        "slope_dx": dx, "slope_EI": EI * dx, "slope_d1": turned(_shapes(L, n, place, 1)),
        "slope_d2": turned(_shapes(L, n, place, 2)),
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
    """Gauss points and weights on consecutive cells (B, C + 1): (B, C points); 6 points are exact to degree 11, the integrands
    here reach degree 8."""
    s, weight = _gauss(points)
    half, middle = np.diff(cells) / 2, (cells[:, 1:] + cells[:, :-1]) / 2
    B = len(cells)
    return (middle[..., None] + half[..., None] * s).reshape(B, -1), (half[..., None] * weight).reshape(B, -1)


@cache
def _gauss(points: int) -> tuple[np.ndarray, np.ndarray]:
    return np.polynomial.legendre.leggauss(points)


def _sandwich(B: np.ndarray, A: np.ndarray) -> np.ndarray:
    out = np.swapaxes(B, -1, -2) @ A @ B
    return (out + np.swapaxes(out, -1, -2)) / 2
