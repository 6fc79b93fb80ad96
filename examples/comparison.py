"""What all examples share: two options, a table of found and analytic values, a figure."""

from __future__ import annotations

import argparse
import sys
from typing import Any

import numpy as np


class Comparison:
    """A table of found and analytic values, which ends the script with status 1 beyond the bound.

    `plot` is true if a figure is asked for with --plot FILE and matplotlib can draw it.
    """

    def __init__(self, text: str, bound: float) -> None:
        """Read the command line.

        Args:
            text: the script's docstring; its first line is the title.
            bound: largest relative difference that is accepted; --bound replaces it.
        """
        self.title = text.strip().splitlines()[0].rstrip(".")
        parser = argparse.ArgumentParser(
            description=text, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        parser.add_argument(
            "--bound", type=float, default=bound, help=f"relative difference; default {bound:g}"
        )
        parser.add_argument("--plot", metavar="FILE", help="draw a figure into this file (PNG)")
        chosen = parser.parse_args()
        self.bound, self._file, self._rows = chosen.bound, chosen.plot, []
        self.plot = self._file is not None and _matplotlib()
        self._figure: Any = None

    def add(self, quantity: str, found: float, analytic: float, scale: float | None = None) -> None:
        """Add a row.

        Args:
            quantity: what it is, with its unit.
            found: the program's value.
            analytic: the value that does not come from the program.
            scale: what the difference is relative to; by default the analytic value.
        """
        size = abs(analytic if scale is None else scale)
        shown = [0.0 if abs(value) < 1e-12 * size else value for value in (found, analytic)]
        self._rows.append((quantity, *shown, abs(found - analytic) / size))

    def axes(self, x: str, y: str, **options: Any) -> Any:
        """Matplotlib axes with these labels, on a new figure; `options` go to the axes.

        Labelled lines get a legend below the axes.
        """
        from matplotlib.figure import Figure

        self._figure = Figure(figsize=(6.4, 4.8), layout="constrained")
        axes = self._figure.add_subplot(xlabel=x, ylabel=y, **options)
        axes.set_title(self.title, fontsize="medium")
        axes.grid(color="0.9")
        axes.set_axisbelow(True)
        return axes

    def end(self) -> None:
        """Write the figure, print the table, and exit with status 1 if a row misses the bound."""
        if self.plot and self._figure is None:
            print("this example has no figure: --plot is not followed", file=sys.stderr)
        elif self.plot:
            names = self._figure.axes[0].get_legend_handles_labels()[1]
            self._figure.legend(loc="outside lower center", ncols=3 if len(names) == 3 else 2)
            self._figure.savefig(self._file, dpi=150)
        wide = max(len(row[0]) for row in self._rows)
        print(self.title)
        print(f"{'':{wide}}  {'found':>13}  {'analytic':>13}  rel. diff.")
        for quantity, found, analytic, difference in self._rows:
            print(f"{quantity:{wide}}  {found:13.7g}  {analytic:13.7g}  {difference:10.1e}")
        worst = np.max([row[3] for row in self._rows])  # not a number if one of them is not
        met = bool(worst <= self.bound)
        print(
            f"largest relative difference {worst:.1e}, bound {self.bound:.1e}: "
            f"{'met' if met else 'MISSED'}"
        )
        sys.exit(0 if met else 1)


def _matplotlib() -> bool:
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        print("no figure: matplotlib is missing (pip install matplotlib)", file=sys.stderr)
        return False
    return True
