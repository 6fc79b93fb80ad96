"""The figure of a measured robot: the gauge of each run, measured and simulated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import flexura as fx
from flexura.io.drawing import LETTERS, plain, saved
from flexura.optional import load

from .measured import GAUGE, Measured
from .measured_fit import MeasuredFit


def png(robot: fx.Robot, found: Sequence[Measured], fit: MeasuredFit | None = None) -> bytes:
    """Draw measurement and simulation of all runs.

    Args:
        robot: the simulated robot.
        found: the runs, one or more.
        fit: the robot fitted to one of them.

    Returns:
        A PNG picture.
    """
    with load("matplotlib").rc_context(LETTERS):
        return saved(_drawn(robot, found, fit), "png", dpi=150)


def _drawn(robot: fx.Robot, found: Sequence[Measured], fit: MeasuredFit | None) -> Any:
    drawing = load("matplotlib.figure").Figure(
        figsize=(8, 1.0 + 1.9 * len(found)), layout="constrained"
    )
    places = drawing.subplots(len(found), 1, sharex=True, squeeze=False)[:, 0]
    fitted = {p.name: p for p in fit.runs} if fit else {}
    for axes, m in zip(places, found, strict=True):
        axes.plot(m.experiment.t, 1e3 * m.experiment[GAUGE], color="C1", label="measured")
        axes.plot(
            m.simulation.t, 1e3 * m.simulation[GAUGE], color="C0", linewidth=1, label="simulated"
        )
        if m.name in fitted:
            gauge = fitted[m.name].gauge
            axes.plot(m.experiment.t, 1e3 * gauge, color="C2", linewidth=1, label="fitted")
        axes.set_title(
            f"{plain(m.name)}: {m.ring_Hz:.3f} Hz measured, {m.simulated_Hz:.3f} Hz simulated",
            fontsize="small",
            loc="left",
        )
        axes.set_ylabel("gauge [mrad]")
        axes.grid(alpha=0.3)
    places[0].legend(frameon=False, loc="upper right")
    places[-1].set_xlabel("t [s]")
    drawing.suptitle(f"{plain(robot.name)}: hub motion as measured", fontsize="medium")
    return drawing
