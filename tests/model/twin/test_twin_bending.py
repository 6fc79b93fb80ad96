"""Bent links under sliders and in sleeves of the twin against published numbers."""

import numpy as np
import pytest

from flexura import signals
from flexura.signals import Drive
from flexura.twin import solve
from flexura.twin.build import build
from flexura.twin.extrapolation import extrapolate
from flexura.twin.joints.mesh import mesh
from flexura.twin.loads import actuation
from robots import beam, rigid, robot
from twin_runs import let_go

SLEEVE_EI, SLEEVE_MASS, SLEEVE_LENGTH = 756.65, 4.015, 3.6
SLEEVE_LAW = signals.cycloid(3.6, 2.0, start=1.8)


def linear_link_leaving_its_sleeve(t, first, gravity):
    """Tip deflection of benchmark B9's equation by Galerkin's method, w = sum q_k u^2 P_k(2u - 1),
    u = x/l(t).

    rhoA (w_tt + 2 U w_xt + U^2 w_xx + U' (l - x) w_xx) + EI w_xxxx = -rhoA g, from rest with the
    first q's given.
    """
    n, mass, stiffness = 7, SLEEVE_MASS, SLEEVE_EI
    u, weights = np.polynomial.legendre.leggauss(20)
    u, weights = (u + 1) / 2, weights / 2
    legendre = (
        np.polynomial.Legendre.basis(k, domain=[0, 1]).convert(kind=np.polynomial.Polynomial)
        for k in range(n)
    )
    shapes = [np.polynomial.Polynomial([0, 0, 1]) * p for p in legendre]
    f, f1, f2 = (np.array([(p.deriv(d) if d else p)(u) for p in shapes]) for d in range(3))
    to_f = np.linalg.solve((f * weights) @ f.T, f * weights)  # a function's components
    one, first_u, second, second_u, second_uu = (
        to_f @ g.T for g in (f1, u * f1, f2, u * f2, u**2 * f2)
    )
    bending = np.linalg.solve((f * weights) @ f.T, (f2 * weights) @ f2.T) * stiffness / mass
    weight = np.concatenate([np.zeros(n), -gravity * to_f @ np.ones(len(u))])
    unit = np.eye(n)

    def matrix(s):
        l, U, a = SLEEVE_LAW(s)
        r = U / l
        w_tt = (2 * r**2 - a / l) * first_u + r**2 * second_uu
        w_xt = -r / l * (one + second_u)
        axial = r**2 * second + a / l * (second - second_u)
        stiffness = w_tt + 2 * U * w_xt + axial + bending / l**4
        return np.block([[0 * unit, unit], [-stiffness, 2 * r * (first_u - one)]])

    y, out, h = np.zeros(2 * n), [], 2.5e-4  # implicit midpoint rule
    y[: len(first)] = first
    for k in range(round(t[-1] / h) + 1):
        if np.isclose(k * h, t).any():
            out.append(y[:n] @ [p(1.0) for p in shapes])
        half = h / 2 * matrix((k + 0.5) * h)
        y = np.linalg.solve(np.eye(2 * n) - half, y + half @ y + h * weight)
    return np.array(out)


def test_a_link_leaving_its_sleeve():
    """B9's equation, checked against B9's numbers; then with a sudden weight instead, as the twin
    starts straight."""
    t = np.array([0.25, 0.50, 0.75, 1.00, 1.25, 1.50, 1.75, 2.00, 3.00])
    published = [
        -0.04204,
        0.03550,
        -0.04940,
        0.04403,
        0.05059,
        -0.01513,
        -0.06383,
        -0.05753,
        0.02941,
    ]
    bent = np.array([1.25, -0.25]) * 0.05  # 0.05 (3 u^2 - u^3)/2
    assert linear_link_leaving_its_sleeve(t, bent, 0.0) == pytest.approx(
        published, abs=1e-3 * 0.0638
    )

    arm = robot(
        beam(SLEEVE_LENGTH, SLEEVE_MASS, SLEEVE_EI, 4, "Pb", start=1.8), gravity=(0.0, -0.6)
    )
    t = np.linspace(0, 2, 81)
    run = let_go(arm, t, Drive.pd([SLEEVE_LAW], [1e7], [1e5]), step_s=1e-3)
    expected = linear_link_leaving_its_sleeve(t, [], 0.6)
    assert abs(run["joint/1/position"] - [SLEEVE_LAW(s)[0] for s in t]).max() < 1e-5
    assert abs(run["link/1/tip_deflection"] - expected).max() < 2e-3 * abs(expected).max()
    inside = abs(
        run["link/1/deflection/2"][t < 0.75]
    )  # at 0.9 m of 3.6 m, of which at least 1.6 m are inside: as straight as its guides
    assert inside.max() < 5e-4 * abs(expected).max() and np.all(run["link/1/angle"] == 0.0)


@pytest.mark.parametrize(
    ("stiffness", "published"),
    [
        (
            0.5,
            [-0.07664, -0.07753, -0.09263, -0.12076, -0.12630, -0.11907, -0.12829],
        ),  # exact, 21 % of the link's length
        (25.0, [-0.0015526, -0.0015976, -0.0019377, -0.00244, -0.0025598]),
    ],
)
def test_a_slider_on_a_bent_link(stiffness, published):
    """Benchmark B10: a point of 0.05 kg from 0.1 m to 0.5 m in 1 s under gravity, from static
    equilibrium."""
    law = signals.cycloid(0.5, 1.0, start=0.1)
    arm = robot(
        beam(0.6, 0.2355, stiffness, 4, locked=True),
        rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=0.1),
        gravity=(0.0, -9.81),
    )
    t = 0.25 * np.arange(len(published))

    def stand(motion):
        return Drive.pd([None, motion], [0.0, 1e6], [0.0, 1e4])

    def run(times):
        def new(robot, drive):
            return build(
                robot,
                "ancf",
                mesh(robot, None, None, times),
                np.zeros(2),
                actuation(drive, robot.start, np.zeros(2), np.array([0.0, 1.0])).gains,
            )

        damped, held = arm.replace({"link.1.damping.beta_s": 0.2}), stand(signals.constant(0.1))
        settle = solve.plan_steps(np.array([0.0, 4.0]), 2e-3, forced=True)
        (_, q, v, *_), *_ = solve._solve(
            new(damped, held),
            actuation(held, arm.start, np.zeros(2), np.array([0.0, 1.0])),
            settle,
            None,
        )
        assert abs(v[-1]).max() < 1e-6

        def from_equilibrium():
            import exudyn

            moving = new(arm, stand(law))
            moving.mbs.systemData.SetODE2Coordinates(q[-1], exudyn.ConfigurationType.Initial)
            return moving

        act = actuation(stand(law), arm.start, np.zeros(2), np.array([0.0, 1.0]))
        return solve._run(from_equilibrium, act, t, 1e-3, 1, lambda fraction: None, "ANCF")[0]

    slid = extrapolate(run({}), {"Pa": run({"Pa": 2.0})})
    assert slid["link/1/tip_deflection"] == pytest.approx(published, abs=2e-3 * abs(min(published)))
    assert slid["joint/2/position"] == pytest.approx([law(s)[0] for s in t], abs=1e-6)


def test_a_bent_link_is_pushed_out_of_its_sleeve():
    """Benchmark B11: M^2/(2 EI) at the exit, 0.242104 N for 1 N at 0.5 m of a link of 0.5 N m^2;
    from the force that holds it.

    The beam's mesh makes it wobble by 1 % as the link moves through an element, so the mean over
    one element.
    """
    held = []
    for part in range(4):
        start = 0.5 + part / 4 * 1.0 / 32
        arm = robot(
            beam(1.0, 1e-5, 0.5, 4, "Pb", start=start, damping={"beta_s": 0.1}),
            payload=0.1,
            gravity=(0.0, -10.0),
        )
        run = let_go(
            arm, [0.0, 4.0], Drive.pd([signals.constant(start)], [1e5], [1e3]), step_s=4e-3
        )
        held.append(-run["joint/1/drive"][-1] * (0.5 / start) ** 2)
    assert np.mean(held) == pytest.approx(0.242104, rel=5e-3)
