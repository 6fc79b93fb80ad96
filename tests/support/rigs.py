"""Experiments on emulated rigs drawn at random, and what such a rig truly did, for whoever judges
an identification."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from boards import BENCH, elf
from experiments import SETTINGS, experiment
from flexlab.board.emulator.emulated import EmulatedBoard, Outputs, Sensors
from flexlab.experiment import excitation, plan
from flexlab.experiment.run_experiment import ExperimentResult, OpenBoard
from flexlab.rig.emulation import random_true_parameters
from flexlab.rig.plant.plant import rig_plant


class Seen:
    """A plant with its own tip deflection and angle of joint 2, and what encoder 1 says, written
    down at every step."""

    def __init__(self, plant: Any) -> None:
        self.plant, self.window_s, self.truth = plant, plant.window_s, plant.truth
        self.rows: list[tuple[float, ...]] = [
            (0.0, plant.tip_deflection_m, plant.positions[1], 0.0)
        ]

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        sensors, plant = self.plant.advance(seconds, outputs), self.plant
        self.rows.append(
            (
                self.rows[-1][0] + seconds,
                plant.tip_deflection_m,
                plant.positions[1],
                sensors.encoder_1,
            )
        )
        return sensors

    def along(self, run: fx.Run) -> tuple[np.ndarray, np.ndarray]:
        """Tip deflection [m] and angle [rad] (T,) at the run's times. Its clock is where most
        reports have the very count that the encoder of joint 1 had; the mechanics are a window
        behind the encoders."""
        t, tip, angle, encoder = np.array(self.rows).T
        there = np.isfinite(run["joint/1/position"])
        counts = np.round(
            run["joint/1/position"][there] * run.meta["settings"]["motor_counts_per_m"]
        )

        def wrong(late: float) -> int:
            off = np.floor(np.interp(run.t[there] + late, t, encoder)) - counts
            return int(
                (off != np.median(off)).sum()
            )  # where the run has its zero is its own affair

        late = min(np.arange(0.0, t[-1] - run.t[-1], 1e-3), key=wrong)
        late = min(late + np.arange(-1e-3, 1e-3, 2e-5), key=wrong) + self.window_s
        return np.interp(run.t + late, t, tip), np.interp(run.t + late, t, angle)


def ran(name: str, seed: int, folder: Path) -> tuple[fx.Run, Seen]:
    """One experiment of the rig that `random_truth(seed)` draws: forward, inverse, or excite."""
    asked = (
        excitation.plan(BENCH, SETTINGS)
        if name == "excite"
        else getattr(plan, name)(BENCH, SETTINGS)
    )
    seen = Seen(rig_plant(BENCH, seed, truth=random_true_parameters(seed)))
    done = experiment(
        asked, folder, opened=OpenBoard(EmulatedBoard(elf(), seen), seed, dict(seen.truth), seen)
    )
    assert done.ended.complete
    return done.run, seen


def excited(seed: int, folder: Path) -> ExperimentResult:
    """The excitation of that rig."""
    seen = Seen(rig_plant(BENCH, seed, truth=random_true_parameters(seed)))
    opened = OpenBoard(EmulatedBoard(elf(), seen), seed, dict(seen.truth), seen)
    return experiment(excitation.plan(BENCH, SETTINGS), folder, opened=opened)
