"""What a first use loads: the coefficients without SciPy's integrators, and a command that imports no more than it needs."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import DOP853

from flexura import dop853

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    "name, reference",
    [
        ("A", np.vstack([DOP853.A, DOP853.B])), ("C", np.append(DOP853.C, 1.0)), ("E3", DOP853.E3), ("E5", DOP853.E5),
        ("AX", DOP853.A_EXTRA), ("CX", DOP853.C_EXTRA), ("D", DOP853.D),
    ],
)  # fmt: skip
def test_the_coefficients_are_scipys(name, reference):
    assert np.array_equal(getattr(dop853, name), reference)


def test_a_simulation_needs_no_integrators_of_scipy_and_no_twin(tmp_path):
    """The command, from the robot file to the table and the stored run; scipy.linalg is loaded by numba."""
    code = (
        "import sys, flexlab.cli as cli\n"
        "sys.argv[1:] = ['simulate', 'model/robots/rig.toml', '--out', sys.argv[1]]\n"
        "try: cli.main()\n"
        "finally: print('MODULES', *sys.modules)"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "model"), str(ROOT / "analysis")])}
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True, cwd=ROOT, env=environment
    )
    loaded = set(done.stdout.split("MODULES")[1].split())
    assert "joint/1/position" in done.stdout and (tmp_path / "run.parquet").exists()
    assert {"flexura.loop", "numba", "pyarrow"} <= loaded
    unneeded = {"scipy.integrate", "scipy.optimize", "exudyn", "rerun", "matplotlib", "distributed"}
    assert (unneeded | {"flexura.twin", "flexura.population", "flexura.statespace"}) & loaded == set()


def test_the_set_up_compiles_what_simulations_need():
    """After what `python -m flexura.warm` does, the rig, its modes and a population with payloads call nothing that was not
    called before, or with other types."""
    code = """
import sys, numpy as np, flexura as fx
from flexura import warm
from numba.core.dispatcher import Dispatcher
def known():
    each = [(m.__name__, name, v) for m in list(sys.modules.values()) for name, v in vars(m).items() if isinstance(v, Dispatcher)]
    return {f"{module}.{name} {k}" for module, name, v in each if module.startswith("flexura") for k in v.signatures}
warm.main()
before, rig, t = known(), fx.load("model/robots/rig.toml"), np.linspace(0, 0.02, 3)
few = rig.replace({"link.2.modes": 2})
fx.simulate(fx.assemble(rig), t)
fx.simulate(fx.assemble(few), t)
fx.simulate(fx.Batch.vary(few, {"payload.mass_kg": [0.01, 0.1]}), t)
print(len(before), *sorted(known() - before), sep=chr(10))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    count, *new = done.stdout.splitlines()
    assert int(count) > 5 and [line.split()[0] for line in new] == []
