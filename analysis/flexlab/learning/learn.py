"""Trials in order: one is done, judged by what the sensors saw, and teaches the next one."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

import flexura as fx
from flexura.control import LearningFilter
from flexura.errors import FlexuraError, InputError

from ..experiment.plan import Plan
from ..experiment.run_experiment import ExperimentResult, RefusedToStart
from ..identification.identify import Identified, identify
from .model import Knowledge, filter_of
from .task import Task
from .tip import Observer

WORSE = 2  # trials in a row that end the learning
SMALLEST = 1 / 16  # share of a change, below which limits end the learning


@dataclass(frozen=True)
class Trial:
    """One trial.

    Attributes:
        number: from 1.
        folder: of its Run.
        references: of the joints at the task's times (T, J) [m or rad].
        lacks: what the tip lacks by the sensors, at the task's times (T, J) [m].
        sensed_m: largest distance of the tip from its path by the sensors [m].
        sensed_rms_m: root of its mean square [m].
        true_m: the same of an emulated plant's own tip [m].
        true_rms_m: and its root mean square [m].
        note: what was special, or "".
    """

    number: int
    folder: Path
    references: np.ndarray
    lacks: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    sensed_m: float = math.nan
    sensed_rms_m: float = math.nan
    true_m: float | None = None
    true_rms_m: float | None = None
    note: str = ""


@dataclass
class Learned:
    """What came of it.

    Attributes:
        task: what was learned.
        trials: the complete ones.
        found: the identified model.
        filter: the learning filter.
        ended: why it ended.
        complete: whether all trials were done, or no further one would help.
        interrupted: whether a person ended it.
    """

    task: Task
    trials: list[Trial] = field(default_factory=list)
    found: Identified | None = None
    filter: LearningFilter | None = None
    ended: str = ""
    complete: bool = False
    interrupted: bool = False

    @property
    def best(self) -> Trial:
        """The trial with the least error by the sensors."""
        return min(self.trials, key=lambda trial: trial.sensed_rms_m)


class Rig(Protocol):
    """A rig on which trials are done."""

    def perform(self, plan: Plan, number: int, report: Callable[[float], None]) -> ExperimentResult:
        """Do a trial; its joints then stand at 0 again."""

    def stop_asked(self) -> str:
        """Why to end early, or ""."""

    def true_tip(self, run: fx.Run) -> np.ndarray | None:
        """Where the tip truly was at the times of the newest run (T, 2) [m], if that is known."""


def learn(
    task: Task,
    rig: Rig,
    trials: int,
    *,
    known: Identified | None = None,
    progress: Callable[[str, float], None] = lambda what, part: None,
    done: Callable[[Learned], None] = lambda learned: None,
) -> Learned:
    """Learn a manoeuvre on a rig, trial by trial.

    The first trial is the manoeuvre as it is. Without `known` the model is identified from it. Each
    further trial adds to the best one's references what the learning filter makes of its error. A
    trial that is worse is left; from then on changes go half as far. After two in a row it ends.

    Args:
        task: what is learned.
        rig: where, as `BoardTrials`.
        trials: how many at most.
        known: an identification of this rig.
        progress: called with what is being done and the finished fraction of all.
        done: called after each trial.

    Returns:
        The trials, and why it ended. What was finished is kept, whatever happens later.

    Raises:
        InputError: the rig cannot do the first trial, or has no sensor of the strip.
        RefusedToStart: a person did not want the first trial, or its identification.
        FlexuraError: the first trial failed.
    """
    if trials < 1:
        raise InputError("expected 1 or more", key="--trials", value=trials)
    out = Learned(task, found=known)
    observer: Observer | None = None
    references, worse, missed, note = task.first, 0, 0, ""
    for number in range(1, trials + 1):
        report = lambda part, n=number: progress(f"trial {n}", (n - 1 + part) / trials)
        try:
            result = rig.perform(task.plan(references, number, note=note), number, report)
            if not result.ended.complete:
                out.ended, out.interrupted = result.ended.text, result.ended.interrupted
                return out
            if out.found is None:
                out.found = _identified(result.run, rig.stop_asked, progress)
            if observer is None:
                observer = Observer(out.found)
                out.filter = filter_of(task, Knowledge.of(out.found))
            trial = Trial(number, result.folder, references, note=note)
            trial = _judged(task, trial, result.run, observer, rig)
        except FlexuraError as error:
            if not out.trials:
                raise
            out.ended, out.interrupted = str(error), isinstance(error, RefusedToStart)
            return out
        out.trials.append(trial)
        done(out)
        worse = 0 if trial is out.best else worse + 1
        missed += worse > 0
        if worse == WORSE:
            out.ended = f"{WORSE} trials in a row were no better than the best"
        elif number == trials:
            out.ended = "all trials are done"
        elif (following := _following(task, out, max(0.5**missed, SMALLEST))) is None:
            out.ended = "the rig's limits allow no further change"
        else:
            references, note = following
            continue
        out.complete = True
        break
    return out


def _identified(
    run: fx.Run, stop_asked: Callable[[], str], progress: Callable[[str, float], None]
) -> Identified:
    """The model from the first trial; a person may end it."""

    def report(what: str, part: float) -> None:
        if why := stop_asked():
            raise RefusedToStart(why)
        progress("identify", part)

    return identify(run, report)


def _judged(task: Task, trial: Trial, run: fx.Run, observer: Observer, rig: Rig) -> Trial:
    """The trial with its errors, which its Run gets as channels and metadata."""
    learned = run.t <= task.t[-1]
    t = run.t[learned]
    lacks = task.error(t, observer.tip(run)[learned])
    sampled = np.column_stack([np.interp(task.t, t, column) for column in lacks.T])
    sensed = np.linalg.norm(lacks, axis=1)
    largest, rms = _sizes(sensed)
    trial = dataclasses.replace(trial, lacks=sampled, sensed_m=largest, sensed_rms_m=rms)
    channels = {"sensor/tip_error": sensed}
    if (tip := rig.true_tip(run)) is not None:
        true = np.linalg.norm(task.error(t, tip[learned]), axis=1)
        largest, rms = _sizes(true)
        trial = dataclasses.replace(trial, true_m=largest, true_rms_m=rms)
        channels["sensor/true_tip_error"] = true
    padded = {name: np.full(len(run.t), np.nan) for name in channels}
    for name, values in channels.items():
        padded[name][learned] = values
    meta = run.meta | {"learning": numbers_of(trial)}
    units = run.units | dict.fromkeys(padded, "m")
    made = dataclasses.replace(run, channels=run.channels | padded, units=units, meta=meta)
    made.save(trial.folder)
    return trial


def _sizes(distance: np.ndarray) -> tuple[float, float]:
    return float(distance.max()), float(np.sqrt(np.mean(distance**2)))


def numbers_of(trial: Trial) -> dict[str, Any]:
    """A trial for scripts.

    `error_m` is the plant's own where there is one, else what the sensors saw.
    """
    true = trial.true_m is not None
    return {
        "trial": trial.number,
        "error_m": trial.true_m if true else trial.sensed_m,
        "error_rms_m": trial.true_rms_m if true else trial.sensed_rms_m,
        "error_of": "the emulated plant's own tip" if true else "the tip by the sensors",
        "sensed_error_m": trial.sensed_m,
        "sensed_error_rms_m": trial.sensed_rms_m,
        "note": trial.note,
    }


def _following(task: Task, out: Learned, share: float) -> tuple[np.ndarray, str] | None:
    """The next trial's references, within the rig's limits, and what was special; None where
    nothing is left."""
    assert out.filter is not None
    best = out.best
    change = out.filter.update(best.lacks, task.basis, task.directions, task.share)
    notes = [] if best is out.trials[-1] else [f"from trial {best.number}"]
    failed: Plan | None = None
    while share >= SMALLEST:
        references = best.references + share * change
        plan = task.plan(references, best.number + 1)
        if not plan.failed:
            if failed is not None:
                notes.append(f"limit: {failed.failed[0].what}")
            if share < 1:
                notes.append(f"{share:.3g} of the change")
            return references, ", ".join(notes)
        failed, share = plan, share / 2
    return None
