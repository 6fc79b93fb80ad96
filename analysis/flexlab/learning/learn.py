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
from flexura.errors import FlexuraError, InputError

from ..experiment.plan import Plan
from ..experiment.run_experiment import ExperimentResult, RefusedToStart
from ..identification.identify_rig import Identified, identify
from ..rig import Check
from ..rig.axes import motor_axes
from .knowledge import Knowledge
from .model import RigModel
from .task import Task
from .tip import Observer

WORSE = 2  # trials in a row that end the learning
SMALLEST = 1 / 16  # share of a change, below which limits end the learning
GUARD = 1.5  # of the first trial's error: what no robot that may be meant may predict


@dataclass(frozen=True)
class Trial:
    """One trial.

    Attributes:
        number: from 1.
        folder: of its Run.
        references: of the joints at the task's times (T, J) [m or rad].
        motions: the joints' motions that the references are for (T, J) [m or rad].
        run: what was measured.
        lacks: what the tip lacks by the sensors, at the task's times (T, J) [m].
        sensed_m: largest distance of the tip from its path by the sensors [m].
        sensed_rms_m: root of its mean square [m].
        true_m: the same of an emulated plant's own tip [m].
        true_rms_m: and its root mean square [m].
        drives_V: largest voltage of each motor [V], by its joint.
        note: what was special, or "".
    """

    number: int
    folder: Path
    references: np.ndarray
    motions: np.ndarray
    run: fx.Run
    lacks: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    sensed_m: float = math.nan
    sensed_rms_m: float = math.nan
    true_m: float | None = None
    true_rms_m: float | None = None
    drives_V: dict[int, float] = field(default_factory=dict)
    note: str = ""


@dataclass
class Learned:
    """What came of it.

    Attributes:
        task: what was learned.
        trials: the complete ones.
        found: the identified model.
        model: the rig's model, with the law of learning.
        ended: why it ended.
        complete: whether all trials were done, or no further one would help.
        interrupted: whether a person ended it.
    """

    task: Task
    trials: list[Trial] = field(default_factory=list)
    found: Identified | None = None
    model: RigModel | None = None
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
    further trial adds to the best one's joint motions what the law of learning makes of its error.
    A trial that is worse is left; from then on changes go half as far, and a model that was given
    is identified anew from the best trial. After two in a row it ends.

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
    out, observer, given = Learned(task, found=known), None, known is not None
    following = _Following(task.first, task.first, [], "")
    worse, missed, kept = 0, 0, ""
    for number in range(1, trials + 1):
        report = lambda part, n=number: progress(f"trial {n}", (n - 1 + part) / trials)
        references, motions, note = following.references, following.motions, following.note
        moved = None if number == 1 else motions
        plan = task.plan(references, number, moved, following.checks, note=note)
        try:
            result = rig.perform(plan, number, report)
            if not result.ended.complete:
                out.ended, out.interrupted = result.ended.text, result.ended.interrupted
                return out
            if out.found is None:
                out.found = _identified(result.run, rig.stop_asked, progress)
            if observer is None or out.model is None:
                observer = Observer(out.found)
                out.model = RigModel(task, Knowledge.of(out.found))
                motions = out.model.moved(observer.followed(result.run))
            trial = Trial(number, result.folder, references, motions, result.run, note=note)
            out.trials.append(_judged(task, trial, observer, rig))
            done(out)
            worse = 0 if out.trials[-1] is out.best else worse + 1
            missed += worse > 0
            if worse == 1 and given and number < trials:
                given = False
                observer, kept = _identify_anew(out, rig, observer, progress)
            last = worse == WORSE or number == trials
            found = None if last else _following(out, max(0.5**missed, SMALLEST))
            if found and kept:
                found, kept = dataclasses.replace(found, note=f"{found.note}; {kept}"), ""
        except FlexuraError as error:
            if not out.trials:
                raise
            out.ended, out.interrupted = str(error), isinstance(error, RefusedToStart)
            return out
        if worse == WORSE:
            out.ended = f"{WORSE} trials in a row were no better than the best"
        elif number == trials:
            out.ended = "all trials are done"
        elif found is None:
            out.ended = "the rig's limits allow no further change"
        else:
            following = found
            continue
        out.complete = True
        break
    return out


def _identify_anew(
    out: Learned, rig: Rig, observer: Observer, progress: Callable[[str, float], None]
) -> tuple[Observer, str]:
    """Identify the model from the best trial, and judge that trial by it.

    Returns:
        The observer by this model. Where the trial does not tell one, the old model is kept: its
        observer, and why.
    """
    best = out.best
    try:
        found = _identified(best.run, rig.stop_asked, progress)
        model, observer = RigModel(out.task, Knowledge.of(found)), Observer(found)
    except InputError as error:
        return observer, f"the model is kept: {error}"
    out.found, out.model = found, model
    again = dataclasses.replace(best, lacks=_sampled(out.task, best.run, observer)[1])
    out.trials[out.trials.index(best)] = again
    return observer, ""


def _identified(
    run: fx.Run, stop_asked: Callable[[], str], progress: Callable[[str, float], None]
) -> Identified:
    """The model from the first trial; a person may end it."""

    def report(what: str, part: float) -> None:
        if why := stop_asked():
            raise RefusedToStart(why)
        progress("identify", part)

    return identify(run, report)


def _judged(task: Task, trial: Trial, observer: Observer, rig: Rig) -> Trial:
    """The trial with its errors, which its Run gets as channels and metadata."""
    run = trial.run
    learned = run.t <= task.t[-1]
    t = run.t[learned]
    lacks, sampled = _sampled(task, run, observer)
    sensed = np.linalg.norm(lacks, axis=1)
    largest, rms = _sizes(sensed)
    drives = {
        axis.number: float(np.nanmax(np.abs(run[f"joint/{axis.number}/voltage"][learned])))
        for axis in motor_axes(task.setup.rig)
    }
    trial = dataclasses.replace(
        trial, lacks=sampled, sensed_m=largest, sensed_rms_m=rms, drives_V=drives
    )
    channels = {"sensor/tip_error": sensed}
    if (tip := rig.true_tip(run)) is not None:
        true = np.linalg.norm(task.error(t, tip[learned]), axis=1)
        largest, rms = _sizes(true)
        trial = dataclasses.replace(trial, true_m=largest, true_rms_m=rms)
        channels["sensor/true_tip_error"] = true
    padded = {name: np.full(len(run.t), np.nan) for name in channels}
    for name, values in channels.items():
        padded[name][learned] = values
    meta = run.meta | {"learning": run.meta.get("learning", {}) | numbers_of(trial)}
    units = run.units | dict.fromkeys(padded, "m")
    made = dataclasses.replace(run, channels=run.channels | padded, units=units, meta=meta)
    made.save(trial.folder, overwrite=True)
    return dataclasses.replace(trial, run=made)


def _sampled(task: Task, run: fx.Run, observer: Observer) -> tuple[np.ndarray, np.ndarray]:
    """What the tip lacks by the sensors, at the run's times and at the task's."""
    learned = run.t <= task.t[-1]
    t = run.t[learned]
    lacks = task.error(t, observer.tip(run)[learned])
    return lacks, np.column_stack([np.interp(task.t, t, column) for column in lacks.T])


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
        "peak_drive_V": {f"joint/{n}": volts for n, volts in trial.drives_V.items()},
        "note": trial.note,
    }


@dataclass(frozen=True)
class _Following:
    """The next trial.

    Attributes:
        references: set-points of the joints, a row a time.
        motions: the joint motions that they shall give.
        checks: the rig's limits, each with what the trial needs of it.
        note: on which trial it builds, and why the change was cut; "" for the whole change.
    """

    references: np.ndarray
    motions: np.ndarray
    checks: list[Check]
    note: str


def _following(out: Learned, share: float) -> _Following | None:
    """The next trial within the rig's limits and the guard; None where nothing is left."""
    assert out.model is not None
    task, best, law = out.task, out.best, out.model.law
    change = law.update(best.lacks)
    most = GUARD * out.trials[0].sensed_m
    notes = [] if best is out.trials[-1] else [f"from trial {best.number}"]
    held, beyond = "", out.model.beyond(best.run, best.motions)
    while share >= SMALLEST:
        parts = np.split(share * change, np.cumsum(law.counts)[:-1])
        moves = [basis @ part for basis, part in zip(task.basis, parts, strict=True)]
        motions = best.motions + np.column_stack(moves)
        made = out.model.drives(motions, beyond)
        plan = task.plan(made.references, best.number + 1, motions, made.checks)
        if plan.failed:
            held = f"limit: {plan.failed[0].what}"
        elif law.predicted(best.lacks, share * change).max() > most:
            held = f"{GUARD:g} times the first error is predicted for more"
        else:
            notes += [held] if held else []
            notes += [f"{share:.3g} of the change"] if share < 1 else []
            return _Following(made.references, motions, made.checks, ", ".join(notes))
        share /= 2
    return None
