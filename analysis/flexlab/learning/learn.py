"""Trials in order: one is done, judged by what the sensors saw, and teaches the next one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import LearningFilter
from flexura.errors import FlexuraError, InputError

from ..experiment.plan import Plan
from ..experiment.run_experiment import Hooks, OpenBoard, check, conduct
from ..identification.identify import Identified, identify
from ..recordings.unit_conversion import Sensor
from ..rig.board_axes import board_axes
from .model import Knowledge, filter_of
from .task import Task
from .tip import Observer, Witness

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
    lacks: np.ndarray
    sensed_m: float
    sensed_rms_m: float
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


class _Stopped(FlexuraError):
    """A person ended the work between two trials."""


def learn(
    task: Task,
    opened: OpenBoard,
    folder: Path,
    sensor: Sensor,
    trials: int,
    watch: Hooks | None = None,
    *,
    known: Identified | None = None,
    configure: bool = False,
    progress: Callable[[str, float], None] = lambda what, part: None,
    done: Callable[[Learned], None] = lambda learned: None,
) -> Learned:
    """Learn a manoeuvre on a rig, trial by trial.

    The first trial is the manoeuvre as it is. Without `known` the model is identified from it. Each
    further trial adds to the best one's references what the learning filter makes of its error. A
    trial that is worse is left; the next one goes half as far. After two in a row it ends.

    Args:
        task: what is learned.
        opened: the board; its joints stand at 0.
        folder: gets one Run a trial, trial-01, trial-02, ...
        sensor: of the strip, calibrated.
        trials: how many at most.
        watch: what the person sees and says.
        known: an identification of this rig.
        configure: whether the rig's settings may be written into a board that has others.
        progress: called with what is being done and the finished fraction of all.
        done: called after each trial.

    Returns:
        The trials, and why it ended. What was finished is kept, whatever happens later.

    Raises:
        InputError: the rig cannot do the first trial, or has no sensor of the strip.
        FlexuraError: the first trial failed.
    """
    if trials < 1:
        raise InputError("expected 1 or more", key="--trials", value=trials)
    witness = _witness(opened)
    watch = watch or Hooks()
    out = Learned(task, found=known)
    observer: Observer | None = None
    references, worse, note = task.first, 0, ""
    for number in range(1, trials + 1):
        report = lambda part, n=number: progress(f"trial {n}", (n - 1 + part) / trials)
        hooks = dataclasses.replace(watch, observe=_both(watch.observe, report))
        plan = task.plan(references, number, note=note)
        place = folder / f"trial-{number:02d}"
        try:
            result = conduct(
                task.setup, plan, opened, place, sensor, hooks, configure, repeat=number - 1
            )
            if not result.ended.complete:
                out.ended, out.interrupted = result.ended.text, result.ended.interrupted
                return out
            if out.found is None:
                out.found = _identified(result.run, watch, progress)
            if observer is None:
                observer = Observer(out.found)
                out.filter = filter_of(task, Knowledge.of(out.found))
            trial = _judged(task, result.run, place, number, references, observer, witness, note)
        except FlexuraError as error:
            if not out.trials:
                raise
            out.ended, out.interrupted = str(error), isinstance(error, _Stopped)
            return out
        out.trials.append(trial)
        done(out)
        worse = 0 if trial is out.best else worse + 1
        if worse == WORSE:
            out.ended, out.complete = f"{WORSE} trials in a row were worse than the best", True
            return out
        assert out.filter is not None
        if number < trials:
            following = _following(task, out, 0.5**worse)
            if following is None:
                out.ended = "the rig's limits allow no further change"
                out.complete = True
                return out
            references, note = following
    out.ended, out.complete = "all trials are done", True
    return out


def _witness(opened: OpenBoard) -> Witness | None:
    """Stands between an emulated board and its plant from now on."""
    if opened.plant is None:
        return None
    witness = Witness(opened.plant)
    opened.board.plant = witness  # type: ignore[attr-defined]
    return witness


def _both(
    observe: Callable[[np.ndarray, float], None], report: Callable[[float], None]
) -> Callable[[np.ndarray, float], None]:
    def both(reports: np.ndarray, part: float) -> None:
        observe(reports, part)
        report(part)

    return both


def _identified(run: fx.Run, watch: Hooks, progress: Callable[[str, float], None]) -> Identified:
    """The model from the first trial; a person may end it."""

    def report(what: str, part: float) -> None:
        if why := watch.stop_asked():
            raise _Stopped(why)
        progress("identify", part)

    return identify(run, report)


def _judged(
    task: Task,
    run: fx.Run,
    folder: Path,
    number: int,
    references: np.ndarray,
    observer: Observer,
    witness: Witness | None,
    note: str,
) -> Trial:
    """A trial with its errors, which its Run gets as channels and metadata."""
    learned = run.t <= task.t[-1]
    t = run.t[learned]
    lacks = task.error(t, observer.tip(run)[learned])
    sensed = np.linalg.norm(lacks, axis=1)
    sampled = np.column_stack([np.interp(task.t, t, column) for column in lacks.T])
    trial = Trial(number, folder, references, sampled, *_sizes(sensed), note=note)
    channels = {"sensor/tip_error": sensed}
    if witness is not None:
        counts = board_axes(task.settings)[0].counts
        true = np.linalg.norm(task.error(t, witness.tip(run, counts)[learned]), axis=1)
        largest, rms = _sizes(true)
        trial = dataclasses.replace(trial, true_m=largest, true_rms_m=rms)
        channels["sensor/true_tip_error"] = true
    padded = {name: np.full(len(run.t), np.nan) for name in channels}
    for name, values in channels.items():
        padded[name][learned] = values
    meta = run.meta | {"learning": numbers_of(trial)}
    units = run.units | dict.fromkeys(padded, "m")
    dataclasses.replace(run, channels=run.channels | padded, units=units, meta=meta).save(folder)
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
    change = task.blended(out.filter.update(task.at_joints(task.t, best.lacks)))
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


__all__ = ["Learned", "Trial", "check", "learn", "numbers_of"]
