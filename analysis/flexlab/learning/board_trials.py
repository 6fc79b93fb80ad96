"""Trials on a board, one experiment after another.

A real rig goes back to its zero and waits until its strip is at rest. An emulated one is made anew
for each trial, which is the same and quicker; its noise is another each time. Of an emulated rig it
is written down where the tip truly was.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx

from ..board.emulator.emulated import Outputs, Sensors
from ..experiment.plan import Plan
from ..experiment.run_experiment import ExperimentResult, Hooks, OpenBoard, conduct
from ..recordings.unit_conversion import Sensor
from ..rig import RigSetup
from ..rig.board_axes import board_axes

BEFORE_S = 6.0  # of an experiment, in which the rig is tested
FADES, SETTLE_S = 4.0, 60.0  # e-folds of the first mode between two trials, and at most so long


class Witness:
    """A plant whose own tip is written down at every step.

    It is a plant itself, and stands between the board and the plant.
    """

    def __init__(self, plant: Any) -> None:
        """Args: plant: an emulated rig."""
        self.plant, self.window_s, self.truth = plant, plant.window_s, plant.truth
        self._rows: list[tuple[float, ...]] = [(0.0, *plant.mechanics.tip_m, 0.0)]

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        """Advance the plant, as the plant itself does."""
        sensors = self.plant.advance(seconds, outputs)
        time = self._rows[-1][0] + seconds
        self._rows.append((time, *self.plant.mechanics.tip_m, sensors.encoder_1))
        return sensors

    def tip(self, run: fx.Run, counts: float) -> np.ndarray:
        """The plant's own tip at the times of a run, the newest one (T, 2) [m].

        The run's clock is where its reports have the counts that the encoder of joint 1 had. The
        mechanics are a window behind the encoder.

        Args:
            run: the run.
            counts: of joint 1's encoder for 1 m or 1 rad.
        """
        rows = np.array(self._rows)
        t, x, y, encoder = rows[rows[:, 0] > rows[-1, 0] - (run.t[-1] - run.t[0]) - BEFORE_S].T
        position = run["joint/1/position"]
        there = np.isfinite(position)
        seen = np.round(position[there] * counts)

        def wrong(late: float) -> int:
            off = np.floor(np.interp(run.t[there] + late, t, encoder)) - seen
            return int((off != np.median(off)).sum())

        late = min(np.arange(t[0], t[-1] - run.t[-1], 1e-3), key=wrong)
        late = min(late + np.arange(-1e-3, 1e-3, 2e-5), key=wrong) + self.window_s
        return np.column_stack([np.interp(run.t + late, t, place) for place in (x, y)])


class BoardTrials:
    """What `learn` asks of a rig, on a board."""

    def __init__(
        self,
        setup: RigSetup,
        open_one: Callable[[int], OpenBoard],
        folder: Path,
        sensor: Sensor,
        watch: Hooks | None = None,
        configure: bool = False,
    ) -> None:
        """Open the board for the first trial.

        Args:
            setup: the rig.
            open_one: opens the board for a trial, by its number; of a real one called once, with
                its joints at 0.
            folder: gets one recording with its Run a trial: trial-01, trial-02, ...
            sensor: of the strip, calibrated.
            watch: what the person sees and says.
            configure: whether the rig's settings may be written into a board that has others.
        """
        self.setup, self.folder, self.sensor = setup, folder, sensor
        self.watch, self.configure = watch or Hooks(), configure
        self._open_one = open_one
        self._open(1)

    def _open(self, number: int) -> None:
        self.opened = self._open_one(number)
        self._witness: Witness | None = None
        if self.opened.plant is not None:
            self._witness = Witness(self.opened.plant)
            self.opened.board.plant = self._witness  # type: ignore[attr-defined]

    def close(self) -> None:
        """Close the board."""
        self.opened.board.close()

    def perform(self, plan: Plan, number: int, report: Callable[[float], None]) -> ExperimentResult:
        """One trial, as `conduct` does it.

        Args:
            plan: the trial.
            number: from 1.
            report: called with its finished fraction.
        """

        def observe(reports: np.ndarray, part: float) -> None:
            self.watch.observe(reports, part)
            report(part)

        emulated = self.opened.board.emulated
        if number > 1 and emulated:
            self.close()
            self._open(number)
        elif number > 1:
            self._let_settle()
        return conduct(
            self.setup,
            plan,
            self.opened,
            self.folder / f"trial-{number:02d}",
            self.sensor,
            dataclasses.replace(self.watch, observe=observe),
            self.configure,
            reference=number == 1 or emulated,
        )

    def _let_settle(self) -> None:
        """Wait until the strip of a real rig no longer vibrates; a stop is seen by the trial."""
        slowest = np.min(-fx.linearize(self.setup.robot, joints="locked").poles.real)
        end = self.opened.board.now() + min(SETTLE_S, FADES / max(float(slowest), 1e-9))
        while self.opened.board.now() < end and not self.watch.stop_asked():
            self.opened.board.wait(0.2)

    def stop_asked(self) -> str:
        """Why to end early, or ""."""
        return self.watch.stop_asked()

    def true_tip(self, run: fx.Run) -> np.ndarray | None:
        """The plant's own tip at the times of the newest run (T, 2) [m]; None of a real rig.

        Args:
            run: the run.
        """
        if self._witness is None:
            return None
        return self._witness.tip(run, board_axes(run.meta["settings"])[0].counts)
