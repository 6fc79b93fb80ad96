"""Wrong arguments of a simulation, and what repeated ones leave."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from moved_robots import SMOOTH, arm_with_friction
from robots import beam, bench_arm, robot, system

# Wrong arguments


@pytest.mark.parametrize(
    ("key", "arguments"),
    [
        ("t_eval", {"t_eval": []}),
        ("t_eval", {"t_eval": [0.0, 0.0]}),
        ("t_eval", {"t_eval": [1.0, 0.5]}),
        ("t_eval", {"t_eval": [0.0, np.nan]}),
        ("t_eval", {"t_eval": [[0.0, 1.0]]}),
        ("t_eval", {"t_eval": 1.0}),
        ("rtol", {"rtol": 0.0}),
        ("rtol", {"rtol": -1e-6}),
        ("rtol", {"rtol": 1.0}),
        ("rtol", {"rtol": np.nan}),
        ("method", {"method": "rk4"}),
        ("q0", {"q0": [0.0]}),
        ("q0", {"q0": [np.nan, 0, 0, 0, 0]}),
        ("q0", {"q0": [3.0, 0, 0, 0, 0]}),  # beyond the limits
        ("qd0", {"qd0": np.zeros((5, 1))}),
        ("qd0", {"qd0": [np.inf, 0, 0, 0, 0]}),
        ("drive", {"drive": fx.Drive.none(2)}),
        ("drive", {"drive": lambda t, q: [0.0]}),
        ("drive", {"drive": lambda t: [0.0, 0.0]}),
        ("drive", {"drive": lambda t: [np.nan]}),
    ],
)
def test_wrong_arguments_are_refused_by_name(key, arguments):
    sys = system(beam(0.4, 0.3, 1.0, 2, limits=[-1.0, 1.0]))
    with pytest.raises(fx.InputError) as error:
        fx.simulate(sys, **({"t_eval": [0.0, 0.01]} | arguments))
    assert error.value.key == key and "expected" in str(error.value)


@pytest.mark.parametrize("call", [fx.static, fx.frequencies])
def test_wrong_arguments_of_statics_and_frequencies_are_refused(call):
    sys = system(beam(0.4, 0.3, 1.0, 2))
    with pytest.raises(fx.InputError):
        call(sys, joints=[0.0, 1.0] if call is fx.static else "loose")
    with pytest.raises(fx.InputError):
        call(sys, **({"tip_force": (np.nan, 0.0)} if call is fx.static else {"q": [0.0]}))


@pytest.mark.parametrize("load", [3.0, 5.0, 50.0])
def test_no_unstable_equilibrium_is_taken_for_the_answer(load):
    """Beyond pi^2 EI/(4 L^2) = 2.47 N the nearly straight link is unstable, and bent against the
    force across it: an error, or the buckled shape."""
    sys = system(beam(1.0, 1.0, 1.0, 4))
    try:
        q = fx.static(sys, tip_force=(-load, 0.1))
    except fx.FlexuraError:
        return
    assert fx.tip_pose(sys, q)[1] > 0.1


def test_a_simulation_loads_no_integrators_of_scipy_and_no_twin():
    """What a run of the compiled core does not need costs no time at the start."""
    code = (
        "import sys, flexura as fx\n"
        "from robots import rigid, system\n"
        "fx.simulate(system(rigid(0.1, 1.0, 0.05, 0.0)), [0.0, 0.1])\n"
        "print(*(name for name in ('numba', 'exudyn', 'scipy.integrate', 'matplotlib') if name in "
        "sys.modules))"
    )
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=surroundings,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert done.stdout.split() == []


# Memory


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="Linux")
def test_repeated_runs_do_not_grow():
    def size() -> float:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

    sys, t = arm_with_friction(), np.linspace(0, 0.05, 2001)
    drive = fx.Drive.force(signals.constant(0.02), None)
    for _ in range(10):
        fx.simulate(sys, t, drive)
    before = size()
    for _ in range(60):
        fx.simulate(sys, t, drive)
    assert size() - before < 10  # MiB; the results of one run take 1


def test_two_systems_do_not_share_anything():
    """Runs made in turns are the runs made alone."""
    a, b = bench_arm(4), fx.assemble(robot(beam(0.3, 0.2, 0.4, 4), payload=0.1))
    alone = fx.simulate(a, [0.0, 0.2], SMOOTH)
    fx.simulate(b, [0.0, 0.2], SMOOTH)
    assert np.array_equal(fx.simulate(a, [0.0, 0.2], SMOOTH).states, alone.states)


def test_numerical_damping_can_be_switched_off():
    """Then its account is zero and the energy stays; with it the account says what it took."""
    strip = robot(beam(0.5, 0.2, 5.0, 6))
    start = fx.static(strip, joints=[0.0], tip_force=(0.0, 0.5))
    asked = {"q0": start, "rtol": 1e-4, "method": "exponential"}
    damped = fx.simulate(strip, np.linspace(0, 0.5, 11), fx.Drive.none(1), **asked)
    free = fx.simulate(
        strip, np.linspace(0, 0.5, 11), fx.Drive.none(1), numerical_damping=False, **asked
    )
    assert damped["energy/numerical_loss"][-1] > 0.0 and np.all(
        free["energy/numerical_loss"] == 0.0
    )
    assert max(damped.meta["energy_error"], free.meta["energy_error"]) < 1e-3
