"""A robot as the compiled functions see it: its constants and a workspace, arrays only."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compiled import internal
from .lanes import room

REVOLUTE, SLIDER, SLEEVE = 0, 1, 2  # joint kinds R, Pa, Pb
COULOMB_SPEED = 1e-3  # m/s or rad/s: Coulomb friction is f tanh(v / COULOMB_SPEED)
NODES = 4  # Gauss points an element, where a link is summed at run time


class Chain(NamedTuple):
    """The constants of a robot: N links, n unknowns in the global numbering [eta_1, q_1, eta_2, q_2, ...], at most m elastic
    ones and p mass points a link, m and p made multiples of four by zeros (`lanes.py`).

    Of a link behind a sleeve (Pb), `s1` and `inertia` are about its proximal end and without the sleeve's mass, `NL` and `SL`
    are Phi and Phi_xi at its tip, and the arrays `sleeve_*` and `law_*` stand for the rest (`sleeve.py`).
    """

    first: np.ndarray  # (N + 1,) int: row of the joint of each link; its elastic rows follow; first[N] = n
    kind: np.ndarray  # (N,) int: REVOLUTE, SLIDER or SLEEVE
    locked: np.ndarray  # (N,) int
    angle: np.ndarray  # (N,) gamma [rad]
    rotor: np.ndarray  # (N,)
    viscous: np.ndarray  # (N,)
    coulomb: np.ndarray  # (N,)
    length: np.ndarray  # (N,)
    mass: np.ndarray  # (N,) with hub or sleeve, and payload
    hub: np.ndarray  # (N,) the sleeve's mass, 0 for R and Pa
    s1: np.ndarray  # (N,)
    inertia: np.ndarray  # (N,)
    S0: np.ndarray  # (N, m) int phi dm
    S1: np.ndarray  # (N, m) int x phi dm
    NL: np.ndarray  # (N, m) phi(L)
    SL: np.ndarray  # (N, m) phi'(L)
    lam: np.ndarray  # (N, m) omega^2
    alpha: np.ndarray  # (N,) Rayleigh damping alpha M + beta K [1/s]
    beta: np.ndarray  # (N,) [s]
    damp: np.ndarray  # (N, m) alpha + beta omega^2
    G1: np.ndarray  # (N, m, m)
    G2: np.ndarray  # (N, m, m)
    H: np.ndarray  # (N, m, m)
    points: np.ndarray  # (N,) int: mass points of each link; two slope points before each, the nearer ones first below
    payload: np.ndarray  # (N,) mass at the tip [kg]
    tip_inertia: np.ndarray  # (N,) of the payload [kg m^2]
    point_x: np.ndarray  # (N, p)
    point_mass: np.ndarray  # (N, p)
    point_phi: np.ndarray  # (N, p, m)
    point_phi_T: np.ndarray  # (N, m, p): the same for four points at a time
    slope_dx: np.ndarray  # (N, 2, p)
    slope_EI: np.ndarray  # (N, 2, p)
    slope_d1: np.ndarray  # (N, 2, p, m) phi'
    slope_d2: np.ndarray  # (N, 2, p, m) phi''
    slope_d1_T: np.ndarray  # (N, m, 2, p)
    slope_d2_T: np.ndarray  # (N, m, 2, p)
    elements: np.ndarray  # (N,) int
    ride: np.ndarray  # (N, E + 1, m, 4) w, w_xi, w_xi,xi at the nodes, 0: the curve that a slider rides on
    node: np.ndarray  # (N,) int: the node whose displacement a nodal slider (joint i) takes, 0: it rides on the curve
    reference: np.ndarray  # (N,) the free length for which a sleeved link's modes are made [m]; 0 elsewhere
    sleeve_xi: np.ndarray  # (N, P + 1) Gauss points, and the tip
    sleeve_w: np.ndarray  # (N, P + 1) their weights, 0 at the tip
    sleeve_phi: np.ndarray  # (N, P + 1, m) Phi
    sleeve_d1: np.ndarray  # (N, P + 1, m) Phi_xi
    sleeve_d2: np.ndarray  # (N, P + 1, m) Phi_xi,xi
    law_x: np.ndarray  # (N, B) where the pieces of the two laws begin, along the material [m]; +inf: no more
    law_mass: np.ndarray  # (N, B, 3) rho A, polynomials in X - law_x [kg/m]
    law_EI: np.ndarray  # (N, B, 5) E I [N m^2]
    stiffening: bool
    gravity: np.ndarray  # (2,)


def one_of(chains: Chain, k: int) -> Chain:
    """Robot k of chains whose fields have a leading axis (B,)."""
    return Chain(*(field[k] for field in chains))  # type: ignore[index, arg-type]


# the same, compiled; made from the fields so that a new one is not forgotten
of_many = internal(eval(f"lambda chains, k: Chain({', '.join(f'chains.{name}[k]' for name in Chain._fields)})"), cache=False)


class Work(NamedTuple):
    """Workspace of one solver: what the outward pass finds and the inward pass needs. N links, n unknowns."""

    cos: np.ndarray  # (N,) of the relative angle psi between a link and its predecessor's attachment
    sin: np.ndarray  # (N,)
    omega: np.ndarray  # (N,) angular velocity of the hub frame
    angle: np.ndarray  # (N,) slope angle of the attachment in the link's frame
    place: np.ndarray  # (N, 2): where the next joint is attached, r
    beta: np.ndarray  # (N, 3): its acceleration where nothing accelerates
    rate: np.ndarray  # (N, 3): its velocity relative to the hub frame
    slide: np.ndarray  # (N, 3): direction of joint i in its predecessor's axes; unused for a sleeve
    flow: np.ndarray  # (N, 3): velocity of the attachment per unit of a sleeve's d'
    tilt: np.ndarray  # (N,) rate of the tip's tangent over that of w'(L)
    body: np.ndarray  # (N, 11): int w dm, int (x + u) dm, int (x + u)^2 + w^2 dm; hr (3); of a sleeve Mxd, Myd, Mtd, Mdd, hd
    terms: np.ndarray  # (N, m, 8) of each elastic row: Mqr x, y, angle; nonlinear forces; Jq^T x, y, angle; Mqr d of a sleeve
    h: np.ndarray  # (N, p, m) h = -du/dq at the points
    slope: np.ndarray  # (4, 2, p) tan dx, (tan - sin) dx, forces of the strain energy on w', w''
    point: np.ndarray  # (5, p) factors of h, phi, phi, h and tan - sin in the inertia forces
    M: np.ndarray  # (N, m, m) Mqq of sleeved links
    K: np.ndarray  # (N, m, m) their stiffness at d
    strain: np.ndarray  # (N,) their strain energy
    sum: np.ndarray  # (P + 1, 12) what a sleeved link has at its points
    sum_h: np.ndarray  # (P + 1, m) int tan Phi_xi up to each of them
    ride: np.ndarray  # (E + 1, 3, 4) node values w, w_xi, w_xi,xi, 0 of q, of qd, and the weights of their gradients
    quintic: np.ndarray  # (4, 8) polynomials of that curve in one element, and their derivatives: of its start, 0, its end, 0
    cond: np.ndarray  # (N, 36) of the condensation: A (6), b (3), (1 + E A)^-1 (9), X - P (9), t0 (3), E (6)
    joint: np.ndarray  # (N, 6): A s (3), 1 / (s^T A s + ...), tau - s^T b, s^T A s + rotor
    X: np.ndarray  # (N, 3, 4) X - P of sleeved links
    inertia: np.ndarray  # (4, 4) of a sleeved link at its sleeve
    bias: np.ndarray  # (4,)
    u: np.ndarray  # (N, 3)
    S: np.ndarray  # (N, m, m + 8) each link's elastic block, upper triangle, and l^-1 terms, with the linear forces
    L: np.ndarray  # (N, m, m) the factor l of it, below its diagonal of 1
    dinv: np.ndarray  # (N, m) 1/d of the factorisation
    qdd: np.ndarray  # (m,)
    held: np.ndarray  # (N,) int: joints whose acceleration is given, locked ones at 0
    given: np.ndarray  # (N,) that acceleration
    reaction: np.ndarray  # (N,) the force in the joint that it takes, friction left out


def workspace(c: Chain) -> Work:
    """A fresh workspace for one solver of this chain."""
    (N, m), p, P, E = c.S0.shape, c.point_x.shape[1], c.sleeve_xi.shape[1], c.ride.shape[1]
    return Work(**room(
        cos=N, sin=N, omega=N, angle=N, place=(N, 2), beta=(N, 3), rate=(N, 3), slide=(N, 3), flow=(N, 3), tilt=N, body=(N, 11),
        terms=(N, m, 8), h=(N, p, m), slope=(4, 2, p), point=(5, p), M=(N, m, m), K=(N, m, m), strain=N, sum=(P, 12),
        sum_h=(P, m), ride=(E, 3, 4), quintic=(4, 8), cond=(N, 36), joint=(N, 6), X=(N, 3, 4), inertia=(4, 4), bias=4, u=(N, 3),
        S=(N, m, m + 8), L=(N, m, m), dinv=(N, m), qdd=m, given=N, reaction=N,
    ), held=c.locked.copy())  # fmt: skip
