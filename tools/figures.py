"""The figures of the documentation that are drawn: python tools/figures.py

docs/reference/channels.svg: a bent arm with the channels of a Run, computed and drawn to scale.
docs/tip-deflection.svg: what the example of README.md draws.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

import flexura as fx

ROOT = Path(__file__).resolve().parent.parent
BASE, LINE, HINT, MARK = "#202124", "#1f5fa8", "#6b7280", "#c2410c"


def arm() -> fx.Robot:
    """Two soft links with joints R."""
    link = {
        "elements": 6,
        "mass_per_length_kg_m": 0.2,
        "joint": {"type": "R"},
    }
    stiff, soft = {"bending_stiffness_N_m2": 0.40}, {"bending_stiffness_N_m2": 0.10}
    links = [link | stiff | {"length_m": 0.55}, link | soft | {"length_m": 0.45}]
    return fx.Robot.from_dict({"link": links})


def channels(path: Path) -> None:
    """Draw the channels of an arm that a force at its tip has bent."""
    system = fx.assemble(arm())
    q = fx.static(system, joints=[0.25, 0.40], tip_force=(-0.40, 0.15))
    figure, axes = plt.subplots(figsize=(8.0, 5.6))
    axes.set_aspect("equal")
    axes.axis("off")
    ends = []
    for i in (1, 2):
        x, y, angle = system.line(q, i, np.linspace(0, system.robot.links[i - 1].length_m, 80))
        axes.plot(x, y, color=LINE, lw=3.5, solid_capstyle="round", zorder=3)
        ends.append(((x[0], y[0], angle[0]), (x[-1], y[-1], angle[-1])))
    (hub1, tip1), (hub2, tip2) = ends
    arrow = {"arrowstyle": "-|>", "color": BASE, "lw": 1.2}
    for dx, dy, name in ((0.22, 0, "x"), (0, 0.22, "y")):
        axes.annotate("", (dx, dy), (0, 0), arrowprops=arrow)
        axes.text(dx * 1.12, dy * 1.12, name, color=BASE, ha="center", va="center")
    axes.plot([0], [0], "o", ms=9, color=BASE, zorder=4)
    axes.text(-0.03, -0.045, "base", color=BASE, ha="right")

    _tangent(axes, hub1, 0.62)
    _tangent(axes, tip1, 0.30)
    _tangent(axes, hub2, 0.52)
    _angle(axes, (0, 0), 0.0, hub1[2], 0.17, "joint/1/position", (0.22, -0.035))
    _angle(axes, hub2[:2], tip1[2], hub2[2], 0.22, "joint/2/position", (0.33, 0.20))
    _deflection(axes, hub1, tip1, "link/1/tip_deflection")
    _deflection(axes, hub2, tip2, "link/2/tip_deflection")
    axes.plot(*hub2[:2], "o", ms=9, color="white", mec=BASE, mew=1.8, zorder=5)
    axes.annotate(
        "link/2/x, link/2/y",
        hub2[:2],
        (hub2[0] - 0.06, hub2[1] + 0.09),
        color=BASE,
        va="center",
        ha="right",
        arrowprops={"arrowstyle": "-", "color": HINT, "lw": 0.8, "shrinkB": 6},
    )
    axes.plot([tip2[0]], [tip2[1]], "s", ms=8, color=MARK, zorder=5)
    axes.annotate(
        "tip/x, tip/y", tip2[:2], (tip2[0] - 0.03, tip2[1] + 0.05), color=BASE, ha="right"
    )
    axes.text(
        0.62,
        -0.09,
        "positive: counter-clockwise,\nand to the left, seen along the link",
        color=HINT,
        va="top",
        ha="center",
    )
    axes.set_xlim(-0.32, 0.85)
    axes.set_ylim(-0.16, tip2[1] + 0.14)
    matplotlib.rcParams["svg.hashsalt"] = "flexura"
    figure.savefig(path, bbox_inches="tight", metadata={"Date": None})
    plt.close(figure)


def _tangent(axes: plt.Axes, frame: tuple[float, float, float], length: float) -> None:
    x, y, angle = frame
    axes.plot(
        [x, x + length * np.cos(angle)],
        [y, y + length * np.sin(angle)],
        "--",
        color=HINT,
        lw=1.0,
        zorder=1,
    )


def _angle(axes, at, start, end, radius, text, label) -> None:  # type: ignore[no-untyped-def]
    """An arc from one direction to another with an arrow at its end, and its name."""
    turns = np.linspace(start, end, 40)
    x, y = at[0] + radius * np.cos(turns), at[1] + radius * np.sin(turns)
    axes.plot(x, y, color=MARK, lw=1.4)
    arrow = {"arrowstyle": "-|>", "color": MARK}
    axes.annotate("", (x[-1], y[-1]), (x[-4], y[-4]), arrowprops=arrow)
    axes.text(at[0] + label[0], at[1] + label[1], text, color=MARK, va="center", ha="center")


def _deflection(axes, hub, tip, text) -> None:  # type: ignore[no-untyped-def]
    """The distance of a tip from its hub's tangent line."""
    t = np.array([np.cos(hub[2]), np.sin(hub[2])])
    foot = np.array(hub[:2]) + t * ((np.array(tip[:2]) - hub[:2]) @ t)
    axes.annotate(
        "",
        tip[:2],
        tuple(foot),
        arrowprops={"arrowstyle": "<|-|>", "color": MARK, "lw": 1.2, "shrinkA": 0, "shrinkB": 4},
    )
    middle = (foot + tip[:2]) / 2
    axes.text(middle[0] + 0.08, middle[1], text, color=MARK, va="center")


def example() -> None:
    """Run the example of README.md, and leave its figure in docs."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.search(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert code is not None
    matplotlib.rcParams["svg.hashsalt"] = "flexura"
    os.environ["SOURCE_DATE_EPOCH"] = "0"  # no date in the file
    os.chdir(ROOT)
    exec(compile(code[1], "README.md", "exec"), {"__name__": "__main__"})
    (ROOT / "tip-deflection.svg").rename(ROOT / "docs/tip-deflection.svg")


if __name__ == "__main__":
    channels(ROOT / "docs/reference/channels.svg")
    example()
