"""A robot as the compiled functions see it: its constants and a workspace, arrays only."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

REVOLUTE, PRISMATIC = 0, 1  # joint kinds; PRISMATIC: Pa on a rigid predecessor
COULOMB_SPEED = 1e-3  # m/s or rad/s: Coulomb friction is f tanh(v / COULOMB_SPEED)


class Chain(NamedTuple):
    """The constants of a robot: N links, n unknowns in the global numbering [eta_1, q_1, eta_2, q_2, ...], at most m elastic
    ones a link."""

    first: np.ndarray  # (N + 1,) int: row of the joint of each link; its elastic rows follow; first[N] = n
    kind: np.ndarray  # (N,) int: REVOLUTE or PRISMATIC
    locked: np.ndarray  # (N,) int
    angle: np.ndarray  # (N,) gamma [rad]
    rotor: np.ndarray  # (N,)
    viscous: np.ndarray  # (N,)
    coulomb: np.ndarray  # (N,)
    length: np.ndarray  # (N,)
    mass: np.ndarray  # (N,)
    s1: np.ndarray  # (N,)
    inertia: np.ndarray  # (N,)
    S0: np.ndarray  # (N, m) int phi dm
    S1: np.ndarray  # (N, m) int x phi dm
    NL: np.ndarray  # (N, m) phi(L)
    SL: np.ndarray  # (N, m) phi'(L)
    lam: np.ndarray  # (N, m) omega^2
    damp: np.ndarray  # (N, m) alpha + beta omega^2
    G1: np.ndarray  # (N, m, m)
    G2: np.ndarray  # (N, m, m)
    H: np.ndarray  # (N, m, m)
    points: np.ndarray  # (N,) int: mass points of each link, at most p; two slope points before each
    tip_inertia: np.ndarray  # (N,) of the payload [kg m^2]
    point_x: np.ndarray  # (N, p)
    point_mass: np.ndarray  # (N, p)
    point_phi: np.ndarray  # (N, p, m)
    slope_dx: np.ndarray  # (N, 2p)
    slope_EI: np.ndarray  # (N, 2p)
    slope_d1: np.ndarray  # (N, 2p, m) phi'
    slope_d2: np.ndarray  # (N, 2p, m) phi''
    stiffening: bool
    gravity: np.ndarray  # (2,)


class Work(NamedTuple):
    """Workspace of one solver: what the outward pass finds and the inward pass needs. N links, n unknowns."""

    cos: np.ndarray  # (N,) of the relative angle psi between a link and its predecessor's attachment
    sin: np.ndarray  # (N,)
    omega: np.ndarray  # (N,) angular velocity of the hub frame
    place: np.ndarray  # (N, 5): attachment r (2) and beta (3)
    tilt: np.ndarray  # (N,) rate of the tip's tangent over that of w'(L)
    g1q: np.ndarray  # (N, m) -Mrq, x: int h dm
    mt: np.ndarray  # (N, m) Mrq, angle
    cv: np.ndarray  # (N, m) velocity-dependent forces on the elastic rows
    hq: np.ndarray  # (N, m) h at the tip
    h: np.ndarray  # (N, p, m) h = -du/dq at the points
    slope: np.ndarray  # (2p, 4) tan dx, (tan - sin) dx, forces of the strain energy on w', w''
    point: np.ndarray  # (p, 5) factors of h, phi, phi, h and tan - sin in the inertia forces
    body: np.ndarray  # (N, 6): int w dm, int (x + u) dm, int (x + u)^2 + w^2 dm; hr (3)
    cond: np.ndarray  # (N, 36) of the condensation: A (6), b (3), (1 + E A)^-1 (9), X - P (9), t0 (3), E (6)
    joint: np.ndarray  # (N, 6): A s (3), 1 / (s^T A s + ...), tau - s^T b, s^T A s + rotor
    u: np.ndarray  # (N, 3)
    S: np.ndarray  # (N, m, m) the factor l of each link's elastic block
    dinv: np.ndarray  # (N, m) 1/d of its factorisation
    rhs: np.ndarray  # (N, m, 7)
    held: np.ndarray  # (N,) int: joints whose acceleration is given, locked ones at 0
    given: np.ndarray  # (N,) that acceleration
    reaction: np.ndarray  # (N,) the force in the joint that it takes, friction left out


def workspace(c: Chain) -> Work:
    """A fresh workspace for one solver of this chain."""
    z, (N, m), p = np.zeros, c.S0.shape, c.point_x.shape[1]
    return Work(
        cos=z(N), sin=z(N), omega=z(N), place=z((N, 5)), tilt=z(N), g1q=z((N, m)), mt=z((N, m)), cv=z((N, m)), hq=z((N, m)),
        h=z((N, p, m)), slope=z((2 * p, 4)), point=z((p, 5)), body=z((N, 6)), cond=z((N, 36)), joint=z((N, 6)),
        u=z((N, 3)), S=z((N, m, m)), dinv=z((N, m)), rhs=z((N, m, 7)), held=c.locked.copy(), given=z(N), reaction=z(N),
    )  # fmt: skip
