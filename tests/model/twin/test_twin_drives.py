"""The twin's drives, times, interruption and errors."""

import os
import signal as os_signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import flexura
from flexura import signals, twin
from flexura.errors import FlexuraError, InputError
from flexura.signals import Drive
from twin_robots import beam, bench_arm, rig, rigid, robot

# Drives


def test_pd_control_is_continuous_and_equals_the_same_law_as_a_function():
    """A carriage under PD is a damped oscillator; the error at the default step is that of the time
    integration."""
    cart = robot(rigid(0.1, 2.0, 0.0, 1.0, "Pa"))
    t = np.linspace(0, 1, 101)
    drive = Drive.pd([signals.step(0.1)], [200.0], [12.0])
    run = twin.simulate(cart, t, drive)
    function = twin.simulate(
        cart, t, lambda t, position, velocity, tip: drive(t, position, velocity)
    )
    omega, zeta = 10.0, 0.3
    damped = omega * np.sqrt(1 - zeta**2)
    exact = 0.1 - 0.1 * np.exp(-zeta * omega * t) * (
        np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t)
    )
    assert abs(run["joint/1/position"] - exact).max() < 1e-6
    assert abs(run["joint/1/position"] - function["joint/1/position"]).max() < 1e-9
    assert np.allclose(
        run["joint/1/drive"],
        [
            drive(s, [p], [v])[0]
            for s, p, v in zip(t, run["joint/1/position"], run["joint/1/velocity"], strict=True)
        ],
    )


def test_stiff_gains_on_a_light_rotor_as_data_and_as_a_function_and_with_dry_friction():
    motion = [signals.harmonic(0.012, 1.0, -np.pi / 2), signals.harmonic(0.5, 1.0, -np.pi / 2)]
    drive = Drive.pd(motion, [900.0, 6.0], [50.0, 0.25])
    t = np.linspace(0, 0.4, 41)
    one = twin.simulate(rig(), t, drive)
    two = twin.simulate(rig(), t, lambda t, *state: drive(t, *state), step_s=one.meta["step_s"])
    for name in ("joint/2/position", "link/2/tip_deflection", "joint/2/drive"):
        assert abs(one[name] - two[name]).max() < 1e-5 * abs(one[name]).max(), name
    rough = rig().replace(
        {"link.1.joint.coulomb_friction": 0.5, "link.2.joint.coulomb_friction": 5e-3}
    )
    run = twin.simulate(rough, t, drive)
    assert run.complete and run.meta["step_s"] < one.meta["step_s"]
    fine = twin.simulate(rough, t, drive, step_s=run.meta["step_s"] / 2)
    coarse, exact = run["link/2/tip_deflection"], fine["link/2/tip_deflection"]
    assert abs(coarse - exact).max() < 2e-3 * abs(exact).max()


def test_a_function_of_the_state_sees_the_tip_deflection_at_once():
    seen = []

    def drive(t, position, velocity, tip):
        seen.append((t, position[0], velocity[0], tip))
        return [0.02 - 0.1 * position[0] - 0.5 * tip]

    run = twin.simulate(bench_arm(start=0.3), np.linspace(0, 0.2, 21), drive)
    last = seen[-1]
    assert last[0] == pytest.approx(0.2) and last[3] == pytest.approx(
        run["link/1/tip_deflection"][-1], rel=1e-6
    )
    assert last[1] == pytest.approx(run["joint/1/position"][-1], rel=1e-9)
    assert run["joint/1/position"][0] == pytest.approx(0.3)


def test_a_jump_of_the_force_keeps_second_order():
    """A force that ends within a step: its impulse is exact, as a Drive (instants known); on a step
    also as a function."""
    cart = robot(rigid(0.1, 1.0, 0.0, 1.0, "Pa"))
    for end, drive in (
        (0.30317, Drive.force(signals.piecewise([0.0, 0.30317], [1.0, 0.0]))),
        (0.3, lambda t: [1.0 * (t < 0.3)]),
    ):
        run = twin.simulate(cart, [0.0, 1.0], drive, step_s=1e-3)
        assert run["joint/1/velocity"][-1] == pytest.approx(end, abs=1e-9)
        assert run["joint/1/position"][-1] == pytest.approx(end**2 / 2 + end * (1 - end), abs=1e-6)


# Times, interruption, errors


def test_times_between_steps_are_interpolated():
    cart = robot(rigid(0.1, 1.0, 0.0, 1.0, "Pa"))
    t = np.array([0.0, 0.1234567, 0.5, 0.777777, 0.9])
    run = twin.simulate(
        cart, t, Drive.pd([signals.constant(0.0)], [100.0], [0.0]), qd0=[1.0], step_s=2e-4
    )
    assert np.array_equal(run.t, t)
    assert np.allclose(run["joint/1/position"], np.sin(10 * t) / 10, atol=1e-6)
    assert np.allclose(run["joint/1/velocity"], np.cos(10 * t), atol=1e-5)
    late = twin.simulate(cart, [0.5, 0.75, 1.0], qd0=[1.0])
    assert np.array_equal(late.t, [0.5, 0.75, 1.0]) and np.allclose(late["joint/1/velocity"], 1.0)
    assert twin.simulate(cart, [0.0], qd0=[1.0])["joint/1/velocity"] == pytest.approx([1.0])


def test_ctrl_c_ends_a_run_with_what_there_is():
    threading.Timer(0.5, lambda: os.kill(os.getpid(), os_signal.SIGINT)).start()
    before = os_signal.getsignal(os_signal.SIGINT)
    fractions = []
    run = twin.simulate(
        rig(),
        np.linspace(0, 20, 2001),
        lambda t: [0.1, 0.0],
        step_s=1e-4,
        progress=fractions.append,
    )
    assert not run.complete and 0 < run.t[-1] < 20 and len(run.t) > 2
    assert len(run["tip/x"]) == len(run.t) and np.isfinite(run["tip/x"]).all()
    assert os_signal.getsignal(os_signal.SIGINT) is before and fractions == sorted(fractions)


def test_an_error_in_a_drive_or_in_progress_comes_out_as_itself():
    def broken(t, position, velocity, tip):
        if t > 0.05:
            raise ZeroDivisionError("mine")
        return [0.0]

    with pytest.raises(ZeroDivisionError, match="mine"):
        twin.simulate(bench_arm(), [0.0, 0.1], broken)
    with pytest.raises(ZeroDivisionError):
        twin.simulate(bench_arm(), [0.0, 0.1], lambda t: [1 / 0])
    with pytest.raises(ZeroDivisionError):
        twin.simulate(bench_arm(), [0.0, 0.1], progress=lambda fraction: 1 / 0)
    with pytest.raises(InputError, match="finite"):
        twin.simulate(bench_arm(), [0.0, 0.1], lambda t, *state: [np.nan if t > 0.05 else 0.0])


def test_a_failing_solver_is_an_error_with_its_time(capfd):
    drive = Drive.force(signals.piecewise([0.0, 0.05], [0.0, 1e7]))
    with pytest.raises(FlexuraError, match=r"stopped at t = 0\.0.* s of 0.2 s: .* smaller step_s"):
        twin.simulate(bench_arm(), [0.0, 0.2], drive, step_s=1e-3)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"stiffening": False}, "stiffening"),
        ({"link.1.damping.alpha_1_s": 0.1}, r"link\[1\]\.damping\.alpha_1_s"),
    ],
)
def test_what_it_does_not_contain_is_refused_by_name(change, key):
    arm = robot(beam(0.5, 0.2, 1.0), rigid(0.1, 0.1, 0.0, 1e-3)).replace(change)
    with pytest.raises(FlexuraError, match=key):
        twin.simulate(arm, [0.0, 0.1])


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"t_eval": [0.1, 0.0]}, "t_eval"),
        ({"qd0": [1.0, 2.0]}, "qd0"),
        ({"beam": "shell"}, "beam"),
        ({"elements": 0}, "elements"),
        ({"step_s": 0.0}, "step_s"),
        ({"step_s": 1e-9}, "step_s"),
        ({"drive": Drive.none(2)}, "drive"),
        ({"drive": "3.0"}, "drive"),
        ({"drive": Drive.pd([1.0], 0.0, 0.0)}, "drive"),
        ({"drive": lambda t: [1.0, 2.0]}, "drive"),
    ],
)
def test_wrong_arguments_are_refused_by_name(arguments, key):
    with pytest.raises(InputError, match=key):
        twin.simulate(bench_arm(), **({"t_eval": [0.0, 0.1]} | arguments))


def test_prescribed_joints_take_the_drives_of_inverse_dynamics():
    """An arm in a vertical plane, from its equilibrium along motions: drives by two programs."""
    arm = robot(
        beam(0.5, 0.5, 10.0, "R", 3, start=0.4, hub_inertia_kg_m2=0.01, viscous_friction=0.05),
        beam(0.4, 0.3, 5.0, "R", 3, start=-0.9, hub_inertia_kg_m2=0.01, rotor_inertia=0.02),
        gravity=(0.0, -9.81),
        payload=0.3,
    )
    t = np.linspace(0, 0.6, 61)
    motions = [signals.polynomial(0.8, 0.5, 0.4), signals.polynomial(-0.5, 0.5, -0.9)]
    native = flexura.inverse(arm, t, motions)
    other = twin.simulate(arm, t, Drive.prescribed(*motions))
    assert native.meta["start"] == other.meta["start"] == "static"
    for i in (1, 2):
        assert other[f"joint/{i}/position"] == pytest.approx(
            native[f"joint/{i}/position"], abs=1e-9
        )
        drive = native[f"joint/{i}/drive"]
        assert np.abs(other[f"joint/{i}/drive"] - drive).max() < 0.01 * np.abs(drive).max()
        assert other[f"joint/{i}/drive"][0] == pytest.approx(flexura.holding(arm)[i - 1], rel=1e-3)


@pytest.mark.parametrize("kind", ["ancf", "ge"])
def test_a_static_start_keeps_the_joint_velocities(kind):
    """A bent arm on a moving cart: both programs start with the same shape and the same motion."""
    arm = robot(
        rigid(0.1, 1.0, 0.05, 1e-3, "Pa"),
        beam(0.5, 0.5, 4.0, "R", 3, start=0.4, hub_inertia_kg_m2=0.01, rotor_inertia=0.02),
        beam(0.4, 0.3, 2.0, "R", 3, start=-0.9, hub_inertia_kg_m2=0.01),
        gravity=(0.0, -9.81),
        payload=0.2,
    )
    t, speeds = np.linspace(0, 0.1, 21), [0.5, -1.0, 2.0]
    system = flexura.assemble(arm)
    qd0 = np.zeros(system.n)
    qd0[system.joint_rows] = speeds
    native = flexura.simulate(arm, t, qd0=qd0)
    other = twin.simulate(arm, t, qd0=speeds, beam=kind, step_s=1e-4)
    assert native.meta["start"] == other.meta["start"] == "static"
    assert abs(native["link/2/tip_deflection"][0]) > 0.05
    assert other["energy/kinetic"][0] == pytest.approx(native["energy/kinetic"][0], rel=1e-3)
    for channel in ("tip/x", "tip/y"):
        path = np.abs(native[channel] - native[channel][0]).max()
        assert np.abs(other[channel] - native[channel]).max() < 0.005 * path


def test_a_static_start_of_a_slider_on_a_flexible_link_is_at_rest():
    arm = robot(
        beam(0.5, 0.5, 4.0, "R", 3),
        rigid(0.1, 0.1, 0.0, 1e-4, "Pa", start=0.25),
        gravity=(0.0, -9.81),
    )
    with pytest.raises(InputError, match="slides on a flexible link"):
        twin.simulate(arm, [0.0, 0.1], qd0=[0.0, 0.1])


def test_it_is_quiet_and_writes_no_files(tmp_path):
    code = (
        "import sys, flexura\nassert 'exudyn' not in sys.modules\n"
        "from flexura import twin\nfrom flexura.robot import Robot\nassert 'exudyn' not in "
        "sys.modules\n"
        "r = Robot.from_dict({'link': [{'length_m': 0.1, 'mass_kg': 1.0, 'inertia_kg_m2': 1.0, "
        "'joint': {'type': 'Pa'}}]})\n"
        "assert twin.simulate(r, [0.0, 0.01]).complete\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert list(tmp_path.iterdir()) == []
