"""Rows of gains under loads on links: the figures of the runs under them."""

import numpy as np
import pytest

import flexura as fx
from flexura import control, signals
from flexura.simulation import gain_sweep
from robots import beam, rigid, system


def test_a_row_of_gains_under_a_load_is_a_run_under_it():
    """The figures of the run, and others than without the load; a run's effort is that of the
    instants that it shows."""
    strip = beam(0.3, 0.157, 0.3333, 4, modes=2, damping={"beta_s": 2e-4}, rotor_inertia=1e-3)
    robot = system(rigid(0.1, 0.6, 0.05, 5e-4, "Pa"), strip, payload=0.02)
    drive = fx.Controller(
        (
            fx.PID(signals.step(0.05), fx.Motor(13.0, 120.0), kp=300, limit=6, setpoint_Hz=2.0),
            fx.PID(
                signals.step(0.4),
                fx.Stepper(20.0, 0.01),
                kp=20,
                limit=6,
                slew=60,
                setpoint_Hz=2.0,
                delay_s=1e-3,
            ),
        )
    )
    push = fx.Load(2, force_N=(0.0, signals.pulse(0.05, 0.1, 0.3)))
    many = gain_sweep.prepare_gain_sweep(robot, drive, 1.0, 0.005, 1e-5, loads=push)
    figures, _ = many.run(drive.gains()[None])
    t = np.arange(0, 1001, 5) * 1e-3
    run = fx.simulate(robot, t, drive, rtol=1e-5, loads=push)
    references = [np.array([joint.reference(at)[0] for at in t]) for joint in drive.joints]
    found = control.step_response(run, references, [joint.limit for joint in drive.joints])
    told = np.concatenate([found.joints.ravel(), found.strip])
    rest = np.setdiff1d(np.arange(len(told)), [control.EFFORT, len(control.JOINT) + control.EFFORT])
    assert figures[0, rest] == pytest.approx(told[rest], rel=1e-9, nan_ok=True)
    plain = gain_sweep.prepare_gain_sweep(robot, drive, 1.0, 0.005, 1e-5)
    without, _ = plain.run(drive.gains()[None])
    assert np.nanmax(np.abs(without - figures)) > 1e-3
