"""Inverse dynamics: benchmark B7 (the bench arm along a cycloid), exact identities, and replaying
the drives."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.signals import JointDrive, cycloid, harmonic, polynomial, step, table

TORQUE_AT = {
    0.10: 0.043175,
    0.25: 0.33398,
    0.40: 0.61167,
    0.50: 0.44220,
    0.60: -0.09519,
    0.75: -0.91220,
    0.90: -0.77400,
    1.25: 0.70646,
    1.50: -0.81519,
}
DEFLECTION_AT = {0.25: -0.068424, 0.50: -0.094305, 0.75: 0.190961, 1.00: 0.022690}


def bench_arm(elements: int = 8, modes: int | None = None, **keys: object) -> fx.System:
    link = ({} if modes is None else {"modes": modes}) | {
        "length_m": 0.6,
        "elements": elements,
        "mass_per_length_kg_m": 0.2355,
        "bending_stiffness_N_m2": 0.5,
        "joint": {"type": "R", "hub_inertia_kg_m2": 2e-3},
    }
    return fx.assemble(fx.Robot.from_dict({"link": [link], "payload": {"mass_kg": 0.05}, **keys}))


def cart_arm() -> fx.System:
    """A carriage, a flexible link, a flexible link; friction in every joint."""
    cart = {
        "length_m": 0.1,
        "mass_kg": 0.5,
        "inertia_kg_m2": 1e-3,
        "joint": {"type": "Pa", "viscous_friction_N_s_m": 0.8, "rotor_mass_kg": 0.1},
    }
    first = {
        "length_m": 0.4,
        "elements": 3,
        "mass_per_length_kg_m": 0.3,
        "bending_stiffness_N_m2": 4.0,
        "damping": {"beta_s": 1e-4},
        "joint": {"type": "R", "hub_inertia_kg_m2": 1e-3, "coulomb_friction_N_m": 0.02},
    }
    second = {
        "length_m": 0.3,
        "elements": 3,
        "mass_per_length_kg_m": 0.2,
        "bending_stiffness_N_m2": 1.0,
        "damping": {"beta_s": 1e-4},
        "joint": {
            "type": "R",
            "hub_mass_kg": 0.1,
            "hub_inertia_kg_m2": 1e-4,
            "viscous_friction_N_m_s_rad": 0.01,
        },
    }
    data = {
        "gravity_m_s2": [0.0, -9.81],
        "link": [cart, first, second],
        "payload": {"mass_kg": 0.05, "inertia_kg_m2": 1e-5},
    }
    return fx.assemble(fx.Robot.from_dict(data))


MOTIONS = (polynomial(0.1, 0.8), cycloid(0.7, 0.8), harmonic(0.4, 1.0, 0.0, -0.4))


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_bench_arm_needs_the_torque_of_benchmark_b7(method: str) -> None:
    t = np.linspace(0.0, 1.5, 1501)
    run = fx.inverse(bench_arm(), t, cycloid(np.pi / 2, 1.0), rtol=1e-8, method=method)
    torque, tip = run["joint/1/drive"], run["link/1/tip_deflection"]
    for at, value in TORQUE_AT.items():
        assert np.interp(at, t, torque) == pytest.approx(value, abs=2e-5), at
    for at, value in DEFLECTION_AT.items():
        assert np.interp(at, t, tip) == pytest.approx(value, abs=1e-5), at
    assert torque.max() == pytest.approx(0.84354, abs=1e-4)
    assert torque.min() == pytest.approx(-0.99543, abs=1e-4)
    stored = run["energy/kinetic"][-1] + run["energy/strain"][-1]
    assert run["energy/work"][-1] == pytest.approx(
        stored, rel=1e-7
    )  # the hub is at rest: the work is in the link
    assert stored == pytest.approx(0.127168, abs=1e-5)
    assert run.meta["energy_error"] < 1e-7


@pytest.mark.slow
def test_linear_kinematics_need_the_torque_of_the_dissertations_form() -> None:
    """B7, last row: no stiffening, quadratic terms kept. The row has two to three digits of
    agreement between codes."""
    t = np.linspace(0.0, 1.0, 1001)
    torque = fx.inverse(
        bench_arm(modes=4, stiffening=False), t, cycloid(np.pi / 2, 1.0), rtol=1e-6
    )["joint/1/drive"]
    for at, value in {0.50: 0.4078, 0.60: 0.0216, 0.75: -0.8425, 0.90: -0.9733}.items():
        assert np.interp(at, t, torque) == pytest.approx(value, abs=0.01), at


def test_joints_follow_their_motions_exactly() -> None:
    t = np.linspace(0.0, 1.0, 201)
    run = fx.inverse(cart_arm(), t, MOTIONS, rtol=1e-8)
    for i, motion in enumerate(MOTIONS, 1):
        wanted = np.array([motion(s)[:2] for s in t])
        assert np.allclose(run[f"joint/{i}/position"], wanted[:, 0], atol=1e-13)
        assert np.allclose(run[f"joint/{i}/velocity"], wanted[:, 1], atol=1e-13)
    assert run.meta["energy_error"] < 1e-6


def test_replayed_drives_return_the_motion() -> None:
    t = np.linspace(0.0, 1.0, 4001)
    system = cart_arm()
    run = fx.inverse(system, t, MOTIONS, rtol=1e-10, method="explicit")
    drives = fx.Drive.force(*(table(t, run[f"joint/{i}/drive"]) for i in (1, 2, 3)))
    start = fx.simulate(system, [0.0], fx.Drive.prescribed(*MOTIONS)).states
    assert start is not None
    n = system.n
    replay = fx.simulate(
        system, t, drives, q0=start[0, :n], qd0=start[0, n:], rtol=1e-10, method="explicit"
    )
    for i in (1, 2, 3):
        assert np.abs(replay[f"joint/{i}/position"] - run[f"joint/{i}/position"]).max() < 1e-6


def test_drives_equal_the_joint_rows_of_the_equations_of_motion() -> None:
    """tau = M qdd + bias + D qd + K q + gravity by Newton-Euler, accelerations by differences of
    the run's own velocities."""
    system, at, h = cart_arm(), 0.43, 1e-4
    run = fx.inverse(
        system, np.array([0.0, at - h, at, at + h]), MOTIONS, rtol=1e-11, method="explicit"
    )
    assert run.states is not None
    n = system.n
    qdd = (run.states[3, n:] - run.states[1, n:]) / (2 * h)
    coulomb = np.array([0.0, 0.02 * np.tanh(run["joint/2/velocity"][2] / 1e-3), 0.0])
    needed = system.forces(run.states[2, :n], run.states[2, n:], qdd)[system.joint_rows] + coulomb
    found = np.array([run[f"joint/{i}/drive"][2] for i in (1, 2, 3)])
    assert np.allclose(found, needed, rtol=1e-4, atol=1e-4 * np.abs(needed).max())


def test_rigid_robot_needs_the_textbook_torque() -> None:
    """One rigid link under gravity: tau = J theta'' + m g c cos(theta)."""
    link = {
        "length_m": 0.5,
        "mass_kg": 2.0,
        "centre_of_mass_m": 0.3,
        "inertia_kg_m2": 0.04,
        "joint": {"type": "R"},
    }
    system = fx.assemble(fx.Robot.from_dict({"gravity_m_s2": [0.0, -9.81], "link": [link]}))
    t, motion = np.linspace(0.0, 1.0, 51), cycloid(1.2, 0.9)
    torque = fx.inverse(system, t, motion)["joint/1/drive"]
    wanted = [(0.04 + 2 * 0.3**2) * motion(s)[2] + 2 * 9.81 * 0.3 * np.cos(motion(s)[0]) for s in t]
    assert np.allclose(torque, wanted, atol=1e-10)


def test_one_joint_may_be_prescribed_and_another_driven() -> None:
    system = cart_arm()
    drive = fx.Drive(
        (
            JointDrive(motion=MOTIONS[0], prescribed=True),
            JointDrive(motion=MOTIONS[1], kp=20.0, kd=0.5),
            JointDrive(),
        )
    )
    run = fx.simulate(system, np.linspace(0, 0.5, 101), drive, rtol=1e-9)
    assert np.allclose(run["joint/1/position"], [MOTIONS[0](s)[0] for s in run.t], atol=1e-13)
    assert np.abs(run["joint/3/position"]).max() > 0.1  # it falls
    assert np.all(run["joint/3/drive"] == 0)
    assert run.meta["energy_error"] < 1e-7


def test_motion_that_jumps_is_refused() -> None:
    with pytest.raises(fx.InputError, match=r"motion of joint 1.*jump"):
        fx.inverse(bench_arm(), [0.0, 1.0], step(0.3, 0.5))


def test_wrong_number_of_motions_is_refused() -> None:
    with pytest.raises(fx.InputError, match="3 entries, one a joint"):
        fx.inverse(cart_arm(), [0.0, 1.0], MOTIONS[:2])


@pytest.mark.parametrize("method", ["implicit", "exponential", "explicit"])
@pytest.mark.parametrize(
    "name, friction", [("single-r", 0.05), ("single-pa", 1.0), ("single-pb", 1.0)]
)
def test_the_work_of_a_prescribed_joint_overcomes_its_viscous_friction(
    name: str, friction: float, method: str
) -> None:
    """The work's own integral balances energies and losses: an implicit stage counts the friction
    of the speed at its end, not of the speed that it set out with."""
    arm = fx.load(name).replace({"link.1.joint.viscous_friction": friction})
    motion = polynomial(arm.start[0] + 0.1, 0.5, arm.start[0])
    run = fx.inverse(arm, np.linspace(0, 0.6, 61), [motion], rtol=1e-8, method=method)
    assert run.complete and run["energy/loss"][-1] > 1e-4
    assert run.meta["energy_error"] < (1e-7 if method == "exponential" else 1e-8)
