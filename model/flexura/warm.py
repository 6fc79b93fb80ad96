"""Fill the compile cache: `python -m flexura.warm`, one to two minutes the first time, nothing afterwards."""

from __future__ import annotations

import numpy as np

from . import signal
from .assembly import assemble
from .batch import Batch
from .control import PID, Controller
from .drive import Drive
from .forward import simulate
from .robot import Robot
from .trials import OF_STRIP, PER_JOINT, run_rows, trial


def main() -> None:
    link = {"length_m": 0.3, "elements": 1, "mass_per_length_kg_m": 0.2, "bending_stiffness_N_m2": 0.3, "joint": {"type": "R"}}
    system = assemble(Robot.from_dict({"link": [link, link | {"modes": 1}]}))
    zero = np.zeros(system.n)
    system.bias(zero, zero)
    for method in ("explicit", "exponential"):
        simulate(system, [0.0, 1e-3], Drive.force(signal.step(0.1), None), method=method)
    simulate(Batch.of([system.robot]), [0.0, 1e-3])
    controller = Controller((PID(signal.step(0.1)), PID(signal.step(0.1))))
    one = trial(system, controller, 0.01, 1e-3, 1e-4)
    width = PER_JOINT * 2 + OF_STRIP
    run_rows(one, np.zeros((2, width)), one.inputs.law.gains[None].copy(), np.full(1, np.inf), np.zeros((1, width)), np.zeros(1))


if __name__ == "__main__":
    main()
