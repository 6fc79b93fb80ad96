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
