"""Compiled code: the same bits from the process that compiled it and from those that read its cache."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flexura.compiled import compiled

ROOT = Path(__file__).resolve().parents[2]
RUN = """
import hashlib
import numpy as np
import flexura as fx
from flexura import signal
from tunings import ROBOT, task
system = fx.assemble(ROBOT)
system.mass(np.zeros(system.n)), system.bias(np.zeros(system.n), np.zeros(system.n))
fx.simulate(system, np.linspace(0, 0.05, 6), fx.Drive.force(signal.step(0.1)), method="explicit")
one = task()
figures, _ = one.run(one.trials(), np.random.default_rng(3).random((60, 3)))
print(hashlib.sha256(figures.tobytes()).hexdigest())
"""


def plus_product(a: float, b: float, c: float) -> float:
    return a * b + c


def test_products_are_rounded_before_they_are_added():
    """(1 + x)^2 - (1 + 2 x) is 0 rounded twice, and x^2 where the compiler fuses."""
    x = 2.0**-30
    assert compiled(plus_product)(1 + x, 1 + x, -(1 + 2 * x)) == 0.0


@pytest.mark.slow
@pytest.mark.timeout(2000)
def test_the_process_that_compiles_computes_the_bits_of_those_that_come_after(tmp_path):
    """Two processes on a copy without a cache: the first compiles other functions, then a population's loop, the second reads."""
    for name in ("model", "analysis"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    path = os.pathsep.join([str(tmp_path / "model"), str(tmp_path / "analysis"), str(ROOT / "tests")])
    line, environment = [sys.executable, "-c", RUN], os.environ | {"PYTHONPATH": path}
    first, second = (subprocess.run(line, capture_output=True, text=True, check=True, env=environment).stdout for _ in "12")
    assert list((tmp_path / "model").rglob("compiled-*")) and first == second
