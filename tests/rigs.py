"""Experiments on emulated rigs drawn at random, and what such a rig truly did, for whoever judges an identification."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from boards import BENCH, elf
from experiments import SETTINGS, experiment
from flexlab.board.emulated import EmulatedBoard, Outputs, Sensors
from flexlab.experiment import plan
from flexlab.experiment.conduct import Done, Opened
from flexlab.identification import excitation
from flexlab.rig.emulation import random_truth
from flexlab.rig.plant import rig_plant


class Seen:
    """A plant with its own tip deflection and angle of joint 2 written down at every step."""

    def __init__(self, plant: Any) -> None:
        self.plant, self.window_s, self.truth = plant, plant.window_s, plant.truth
        self.rows: list[tuple[float, float, float]] = [(0.0, plant.tip_deflection_m, plant.joint_rad)]

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        sensors = self.plant.advance(seconds, outputs)
        self.rows.append((self.rows[-1][0] + seconds, self.plant.tip_deflection_m, self.plant.joint_rad))
        return sensors

    def along(self, run: fx.Run) -> tuple[np.ndarray, np.ndarray]:
        """Tip deflection [m] and angle [rad] (T,) at the run's times; its clock is found by the encoder of joint 2."""
        t, tip, angle = np.array(self.rows).T
        there = np.isfinite(run["joint/2/position"])
        left = lambda late: np.std(np.interp(run.t[there] + late, t, angle) - run["joint/2/position"][there])
        late = min(np.arange(0.0, t[-1] - run.t[-1], 0.002), key=left)
        late = min(late + np.arange(-0.002, 0.002, 1e-4), key=left)
        return np.interp(run.t + late, t, tip), np.interp(run.t + late, t, angle)


def ran(name: str, seed: int, folder: Path) -> tuple[fx.Run, Seen]:
    """One experiment of the rig that `random_truth(seed)` draws: forward, inverse, or excite."""
    asked = excitation.plan(BENCH, SETTINGS) if name == "excite" else getattr(plan, name)(BENCH, SETTINGS)
    seen = Seen(rig_plant(BENCH, seed, truth=random_truth(seed)))
    done = experiment(asked, folder, opened=Opened(EmulatedBoard(elf(), seen), seed, dict(seen.truth), seen))
    assert done.ended.complete
    return done.run, seen


def excited(seed: int, folder: Path) -> Done:
    """The excitation of that rig."""
    seen = Seen(rig_plant(BENCH, seed, truth=random_truth(seed)))
    opened = Opened(EmulatedBoard(elf(), seen), seed, dict(seen.truth), seen)
    return experiment(excitation.plan(BENCH, SETTINGS), folder, opened=opened)
