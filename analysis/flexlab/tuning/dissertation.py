"""`flexura tune --dissertation`: both cases of types III and IV, as in tables 3.10 and 3.12.

The requirements of case 2 are compared with what was reached, with an LQR tuned for the same
objective (`lqr_reference.py`), and with the drives' limits: the shortest time in which each joint
can cover its distance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import ERROR, OVERSHOOT, RESIDUAL, SETTLING, StepResponse, strip_metrics

from ..runs.formatting import number
from ..runs.table import Table
from ..studies.transmission_zeros import transmission
from .cases import PUBLISHED, STRUCTURES, TABLE
from .closed_loop import closed_loop_controller
from .executor import make_executor
from .history import History
from .lqr_reference import LqrBaseline, tune_lqr_baseline
from .result import TuningResult, numbers, result, save
from .search import Search, search
from .task import Task

OVERSHOOT_MOST, SETTLING_PART, ERROR_MOST, RESIDUAL_PART = 0.05, 0.5, 1e-3, 0.1


@dataclass(frozen=True)
class TwoCases:
    """Both cases of a structure, and an LQR.

    `residual_m`: residual vibration of each, from when the later of both cases has settled.
    `shortest_s`: shortest times of the joints. `zeros_1_s`: right-half-plane zeros by drive.
    """

    name: str
    results: tuple[TuningResult, TuningResult]
    lqr: LqrBaseline
    residual_m: tuple[float, float, float]
    shortest_s: tuple[float, ...]
    zeros_1_s: dict[str, float]

    def response(self, case: int) -> StepResponse:
        """The step response of a case."""
        return self.results[case - 1].responses[0]

    def verdicts(self) -> list[tuple[str, bool, str]]:
        """The requirements of case 2: text, whether it is reached, and the numbers."""
        joints, published = self.response(2).joints, np.array(PUBLISHED[self.name, 2])
        parts = joints[:, SETTLING] / published[:, 1]
        ratio = self.residual_m[1] / self.residual_m[0]
        most, error = joints[:, OVERSHOOT].max(), joints[:, ERROR].max()
        return [
            ("overshoot at most 5 %", bool(most <= OVERSHOOT_MOST), f"{100 * most:.2g} %"),
            (
                "settling at most half the dissertation's",
                bool((parts <= SETTLING_PART).all()),
                ", ".join(
                    f"{s:.3g} s of {p:g} s"
                    for s, p in zip(joints[:, SETTLING], published[:, 1], strict=True)
                ),
            ),
            ("no state error (0.1 %)", bool(error <= ERROR_MOST), f"{100 * error:.1g} %"),
            (
                "residual vibration at most a tenth of case 1",
                bool(ratio <= RESIDUAL_PART),
                f"{ratio:.2g} of it",
            ),
        ]


def study(
    names: list[str],
    how: Search,
    folder: Path,
    scheduler: str | None = None,
    jobs: int | None = None,
    report: Callable[[History], None] = lambda history: None,
) -> tuple[list[TwoCases], bool]:
    """Tune both cases of the named structures and an LQR, each stored in a folder of its own.

    Args:
        names: keys of `STRUCTURES`.
        how: the search.
        folder: where results are stored.
        scheduler: address of a Dask scheduler, or None.
        jobs: number of threads, by default all cores.
        report: called after each generation.

    Returns:
        The results, and False if the search was interrupted.
    """
    out: list[TwoCases] = []
    for name in names:
        structure, found = STRUCTURES[name](), []
        for case in (1, 2):
            task, own = structure.task(case), folder / f"type-{name}-case-{case}"
            history = History.open(own, task.digest(how.identity()))
            with make_executor(task, scheduler, jobs) as runs:
                if not search(task, how, runs, history, report):
                    return out, False
            found.append(result(task, how, history, True))
            save(found[-1], own)
        lqr = tune_lqr_baseline(structure, folder / f"type-{name}-lqr", report)
        if lqr is None:
            return out, False
        out.append(compare_cases(name, found[0], found[1], lqr))
    return out, True


def compare_cases(
    name: str, first: TuningResult, second: TuningResult, lqr: LqrBaseline
) -> TwoCases:
    """Put two cases and the LQR side by side, with the limits of both."""
    settled, left = (
        float(np.nanmax([r.responses[0].joints[:, SETTLING] for r in (first, second)])),
        [],
    )
    for run in (first.runs[0], second.runs[0], lqr.run):
        left.append(float(strip_metrics(run.t, run["link/2/tip_deflection"], settled)[RESIDUAL]))
    zeros = {
        row.drive: float(row.unstable.real.min()) for row in _zeros(first.task) if len(row.unstable)
    }
    return TwoCases(
        name, (first, second), lqr, (left[0], left[1], left[2]), _shortest(first.task), zeros
    )


def _zeros(task: Task) -> list[Any]:
    """Transmission zeros of the tip, across a link that lies in joint 1's direction."""
    system = fx.assemble(task.robots[0])
    return [row for row in transmission(fx.linearize(system)) if row.output == "tip/y"]


def _shortest(task: Task) -> tuple[float, ...]:
    """Time of each joint to 98 % of its step with its output at the limit, others locked [s]."""
    times = []
    for i in range(len(task.robots[0].links)):
        data = task.robots[0].to_dict()
        for k, link in enumerate(data["link"]):
            link["joint"]["locked"] = k != i
        system = fx.assemble(fx.Robot.from_dict(data))
        controller = closed_loop_controller(system, task.manoeuvre, task.gains)
        joints = list(controller.joints)
        joints[i] = replace(joints[i], kp=1e9, ki=0.0, kd=0.0)  # type: ignore[arg-type]  # at its limit until it is there
        run = fx.simulate(
            system, task.manoeuvre.t, replace(controller, joints=tuple(joints)), rtol=1e-5
        ).uninterrupted()
        y = run[f"joint/{i + 1}/position"]
        there = (y - y[0]) / (run[f"joint/{i + 1}/reference"][-1] - y[0]) >= 0.98
        times.append(float(run.t[there.argmax()]) if there.any() else float("nan"))
    return tuple(times)


def table(found: list[TwoCases]) -> list[Table]:
    """Tables 3.10 and 3.12, each figure with the dissertation's in brackets, and the verdicts."""
    return [_table(each) for each in found]


def _table(each: TwoCases) -> Table:
    task = each.results[0].task
    kinds = ["turns" if link.joint.type == "R" else "translates" for link in task.robots[0].links]
    heads = [""]
    for i, kind in enumerate(kinds, 1):
        link = f"link {i} {kind}:"
        heads += [f"{link} case 1", f"{link} case 2", f"{link} deviation", f"{link} LQR"]
    title = f"type {each.name}: this project (the dissertation's {TABLE[each.name]})"
    out = Table(title, heads, ("",))
    rows = (
        ("rise time [s]", 1.0),
        ("settling time [s]", 1.0),
        ("overshoot [%]", 100.0),
        ("state error [%]", 100.0),
    )
    for k, (text, factor) in enumerate(rows):
        cells = []
        for i in range(len(kinds)):
            ours = [factor * each.response(case).joints[i, k] for case in (1, 2)]
            theirs = [PUBLISHED[each.name, case][i][k] for case in (1, 2)]
            pairs = [
                *zip(ours, theirs, strict=True),
                (abs(ours[0] - ours[1]), abs(theirs[0] - theirs[1])),
            ]
            cells += [f"{_figure(a)} ({b:.3g})" for a, b in pairs] + [
                _figure(factor * each.lqr.response.joints[i, k])
            ]
        out.add(text, *cells)
    peaks = [1e3 * r.strip[0] for r in (each.response(1), each.response(2), each.lqr.response)]
    for text, values in (
        ("largest w [mm]", peaks),
        ("residual w [mm]", [1e3 * x for x in each.residual_m]),
    ):
        one, two, lqr = values
        out.add(
            text,
            "",
            "",
            "",
            "",
            *(number(x, 3, missing="never") for x in (one, two, abs(one - two), lqr)),
        )
    lines = [
        f"{'reached' if ok else 'NOT reached'}: {demand} ({words})"
        for demand, ok, words in each.verdicts()
    ]
    drives = ", ".join(f"joint {i} {s:.3g} s" for i, s in enumerate(each.shortest_s, 1))
    lines += [f"a drive at its limit, the other joint locked: {drives} to 98 %"]
    lines += [
        f"zeros in the right half plane, drive to tip: "
        f"{', '.join(f'{n} {z:.3g} 1/s' for n, z in each.zeros_1_s.items())}"
    ]
    for case, r in enumerate(each.results, 1):
        lines.append(
            f"case {case}: J = {r.best[0]:.4g}, {r.history.evaluations} evaluations; "
            f"{r.task.weights.text()}"
        )
    lines.append(
        f"LQR, what is possible: J = {each.lqr.J:.4g}, {each.lqr.evaluations} designs{_other(each)}"
    )
    lines.append(
        "rise: 10 to 90 %; settling: to within 2 %; state error: mean of the last tenth of the "
        "time; residual: half of"
    )
    lines.append(
        "w's range from the instant at which the later of both cases has settled. The dissertation "
        "defines none."
    )
    out.notes += lines
    return out


def _figure(value: float) -> str:
    return "0.000" if value <= 5e-4 else number(value, 3, missing="never")


def _other(each: TwoCases) -> str:
    """Where the LQR's drives are not those of the cases."""
    theirs, ours = STRUCTURES[each.name]().lqr_limits.settings, each.results[0].task.gains.settings
    limits = [
        f"{name} = {value:g}"
        for name, value in theirs.items()
        if "_max_" in name and name not in ours
    ]
    return f"; in place of the stepper's rate {', '.join(limits)}" if limits else ""


def data(found: list[TwoCases]) -> dict[str, Any]:
    """The results for JSON."""
    return {
        f"type {each.name}": {
            "cases": [numbers(r) for r in each.results],
            "residual_m": list(each.residual_m),
            "shortest_s": list(each.shortest_s),
            "right_half_plane_zeros_1_s": each.zeros_1_s,
            "published": [PUBLISHED[each.name, case] for case in (1, 2)],
            "lqr": {"J": each.lqr.J, "weights": each.lqr.weights} | each.lqr.response.numbers(),
            "verdicts": [{"demand": d, "reached": ok, "words": w} for d, ok, w in each.verdicts()],
        }
        for each in found
    }
