"""Modes with damping, films of modes, frequency responses, and what other tools get of them."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import InputError


def arm(beta=2e-3):
    data = fx.load("single-r").to_dict()
    data["link"][0]["damping"] = {"beta_s": beta}
    return fx.Robot.from_dict(data)


def test_damping_ratios_are_those_of_the_complex_eigenvalues():
    robot = arm()
    found = fx.modes(robot, count=3)
    assert found.frequencies_Hz.shape == (3,) and found.shapes.shape[1] == 3
    omega = 2 * np.pi * found.frequencies_Hz
    assert found.damping_ratios == pytest.approx(2e-3 * omega / 2, rel=1e-9)
    poles = fx.linearize(robot, joints="locked").poles
    first = poles[np.argmin(np.abs(np.abs(poles) - omega[0]))]
    assert found.damping_ratios[0] == pytest.approx(-first.real / abs(first), rel=1e-6)


def test_modes_at_another_posture_and_with_free_joints():
    robot = fx.load("type-1-rr")
    q = fx.static(robot, [0.3, 0.8])
    free = fx.modes(robot, q, 4, joints="free")
    assert free.frequencies_Hz[:2] == pytest.approx([0.0, 0.0])
    assert free.damping_ratios[:2] == pytest.approx([0.0, 0.0])
    assert not np.allclose(
        free.frequencies_Hz, fx.modes(robot, None, 4, joints="free").frequencies_Hz
    )


def test_a_mode_as_a_run_moves_as_far_as_it_is_told_and_keeps_its_energy():
    found = fx.modes(arm(0.0), count=2)
    run = found.run(1, amplitude_m=1e-3)
    assert np.hypot(run["tip/x"] - 0.6, run["tip/y"]).max() == pytest.approx(1e-3, rel=1e-3)
    assert run.t[-1] == pytest.approx(1 / found.frequencies_Hz[0])
    energy = run["energy/kinetic"] + run["energy/strain"]
    assert np.ptp(energy) < 1e-4 * energy.max()
    with pytest.raises(InputError, match="from 1 to 2"):
        found.run(3)


@pytest.mark.slow
def test_a_mode_as_a_film(tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("PIL")
    path = fx.modes(arm(), count=1).animate(tmp_path / "mode.gif", frame_rate=5, duration=1.0)
    assert path.read_bytes()[:6] == b"GIF89a"


def test_a_response_is_what_the_state_space_says_and_static_stiffness_at_its_foot():
    robot = arm()
    lin = fx.linearize(robot)
    f = np.array([0.5, 3.0, 20.0])
    found = fx.frequency_response(robot, "joint/1/drive", "tip/y", f)
    k = lin.outputs.index("tip/y")
    direct = [
        (lin.C @ np.linalg.solve(2j * np.pi * x * np.eye(len(lin.A)) - lin.A, lin.B))[k, 0]
        for x in f
    ]
    assert found.values == pytest.approx(np.array(direct), rel=1e-6)
    assert found.unit == "m/N m"
    speed = fx.frequency_response(robot, "joint/1/drive", "joint/1/velocity", f)
    place = fx.frequency_response(robot, "joint/1/drive", "joint/1/position", f)
    assert speed.values == pytest.approx(2j * np.pi * f * place.values)


def test_a_response_is_what_a_simulation_shows():
    robot, f = arm(2e-2), 4.0
    found = fx.frequency_response(robot, "joint/1/drive", "link/1/tip_deflection", [f])
    t = np.linspace(0.0, 6.0, 3001)
    run = fx.simulate(robot, t, lambda s: [1e-3 * np.cos(2 * np.pi * f * s)], rtol=1e-8)
    late = t > 4.0
    wave = np.column_stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t), np.ones_like(t)])
    a, b, _ = np.linalg.lstsq(wave[late], run["link/1/tip_deflection"][late], rcond=None)[0]
    assert complex(a, -b) / 1e-3 == pytest.approx(complex(found.values[0]), rel=1e-3)


def test_a_bode_plot_is_written(tmp_path):
    pytest.importorskip("matplotlib")
    found = fx.frequency_response("rig", "joint/1/drive", "tip/x")
    found.bode(tmp_path / "bode.svg")
    assert (tmp_path / "bode.svg").read_bytes().startswith(b"<?xml")
    assert len(found.frequencies_Hz) == 600
    with pytest.raises(InputError, match="\\.pdf"):
        found.bode(tmp_path / "bode.bmp")


@pytest.mark.parametrize(
    ("drive", "channel", "key"),
    [("joint/3/drive", "tip/x", "drive"), ("joint/1/drive", "tip/z", "channel")],
)
def test_unknown_names_are_refused(drive, channel, key):
    with pytest.raises(InputError) as caught:
        fx.frequency_response("rig", drive, channel)
    assert caught.value.key == key


def test_python_control_gets_names_and_poles():
    control = pytest.importorskip("control")
    lin = fx.linearize("rig")
    made = lin.to_control()
    assert made.input_labels == list(lin.inputs) and made.output_labels == list(lin.outputs)
    theirs, mine = (np.sort(np.abs(x)) for x in (control.poles(made), lin.poles))
    assert theirs == pytest.approx(mine, rel=1e-6, abs=1e-3)


def test_matlab_gets_the_state_space_with_names(tmp_path):
    from scipy.io import loadmat

    from commands import run

    fx.save(arm(), tmp_path / "arm.toml")
    status, _, err = run(["export", str(tmp_path / "arm.toml"), "--to", "mat"])
    assert status == 0, err
    found, lin = loadmat(tmp_path / "arm.mat"), fx.linearize(arm())
    assert found["A"] == pytest.approx(lin.A) and found["C"] == pytest.approx(lin.C)
    assert [str(x[0]) for x in found["outputs"].ravel()] == list(lin.outputs)
    status, _, err = run(["export", str(tmp_path / "arm.toml"), "--to", "csv"])
    assert status == 2 and "mat" in err
