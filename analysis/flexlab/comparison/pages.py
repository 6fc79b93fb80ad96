"""The report of a comparison as PDF: what the HTML page has, on sheets of A4."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from flexura.io import EMULATED
from flexura.io.drawing import STYLE, plain, told
from flexura.optional import load

from .figures import draw, is_emulated
from .measures import Comparison
from .report import about
from .table import HEADS, notes, rows, title

WIDTH_IN, HEIGHT_IN = 8.27, 11.69
LEFT, RIGHT, TOP, BOTTOM = 0.075, 0.94, 0.95, 0.06  # of the sheet
LEADING = 1.45  # lines' distance over the size of their letters
GAP = 0.008  # between columns
PLOT, LOWER, AXIS, HEAD = 0.12, 0.055, 0.036, 0.04  # heights in a figure: curves, difference, ...
RULE, FAINT = "#9aa0a8", "#e3e6ea"


def pdf(c: Comparison) -> bytes:
    """Title, label, table and notes; the figures; what the runs say about themselves.

    Args:
        c: the comparison.

    Returns:
        The file: the same bytes for the same comparison.

    Raises:
        Missing: matplotlib is not installed.
    """
    matplotlib = load("matplotlib")
    pages = load("matplotlib.backends.backend_pdf").PdfPages
    subject = EMULATED if is_emulated(c) else c.names[1]
    about_file = {"Title": title(c), "Subject": subject, "CreationDate": None}
    buffer = io.BytesIO()
    with (
        told(),
        matplotlib.rc_context(STYLE | {"pdf.fonttype": 42}),
        pages(buffer, metadata=about_file) as file,
    ):
        for sheet in drawn(c):
            file.savefig(sheet)
    return buffer.getvalue()


def drawn(c: Comparison) -> list[Any]:
    """The sheets of the report, as figures of matplotlib."""
    with load("matplotlib").rc_context(STYLE):
        sheets = Sheets(title(c))
        _front(sheets, c)
        for entry in c.differences:
            upper, lower = sheets.axes()
            draw(c, entry, upper, lower)
            for axes in (upper, lower):
                axes.yaxis.set_label_coords(-0.078, 0.5)
        _runs(sheets, c)
        return sheets.numbered()


@dataclass(frozen=True)
class Column:
    """One column of a table: its edges as fractions of the sheet, and at which one the texts
    stand."""

    left: float
    right: float
    side: str = "left"

    def lines(self, cell: str, size: float, bold: bool = False) -> list[str]:
        """A cell's text, broken to the column's width; never empty."""
        return broken(cell, self.right - self.left - GAP, size, bold)


def broken(text: str, width: float, size: float, bold: bool = False) -> list[str]:
    """A text in lines that are at most `width` of the sheet wide, as the letters are drawn."""
    font = load("matplotlib.font_manager").FontProperties(
        family=STYLE["font.family"], size=size, weight="bold" if bold else "normal"
    )
    measure = load("matplotlib.textpath").text_to_path.get_text_width_height_descent
    fits = lambda line: measure(line, font, False)[0] <= width * WIDTH_IN * 72
    lines = [""]
    for word in text.split():
        if fits(f"{lines[-1]} {word}".strip()):
            lines[-1] = f"{lines[-1]} {word}".strip()
            continue
        lines.append("")
        for letter in word:  # a word that is wider than a line goes on in the next
            if lines[-1] and not fits(lines[-1] + letter):
                lines.append("")
            lines[-1] += letter
    return [line for line in lines if line] or [""]


class Sheets:
    """Sheets that texts and tables are put on from top to bottom; `name` heads all but the first.

    A row that does not fit on what is left of a sheet begins the next one.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.all: list[Any] = []
        self.y = TOP
        self.begin()

    def begin(self) -> None:
        """A new sheet."""
        figure = load("matplotlib.figure").Figure
        self.all.append(figure(figsize=(WIDTH_IN, HEIGHT_IN)))
        self.y = TOP

    def axes(self) -> tuple[Any, Any]:
        """Room for one figure: the axes of the curves, and below them those of the difference."""
        self.room(HEAD + PLOT + LOWER + 2 * AXIS)
        left, wide = LEFT + 0.085, RIGHT - LEFT - 0.085
        upper = self.y - HEAD - PLOT
        lower = upper - 0.6 * AXIS - LOWER
        self.y = lower - 1.4 * AXIS
        sheet = self.all[-1]
        return sheet.add_axes((left, upper, wide, PLOT)), sheet.add_axes((left, lower, wide, LOWER))

    def lines(self, texts: Sequence[str], size: float, x: float = LEFT, **style: Any) -> None:
        """Lines of text below each other."""
        for text in texts:
            step = self._step(size)
            self.room(step)
            self.all[-1].text(x, self.y - 0.75 * step, plain(text), fontsize=size, **style)
            self.y -= step

    def gap(self, size: float) -> None:
        """Empty space of a line's height."""
        self.y -= self._step(size)

    def table(
        self,
        head: Sequence[str],
        cells: Sequence[Sequence[str]],
        columns: Sequence[Column],
        size: float,
    ) -> None:
        """A table; its head is repeated on every sheet."""
        self._row(head, columns, size, head=True)
        for row in cells:
            if not self._fits(row, columns, size):
                self.begin()
                self._row(head, columns, size, head=True)
            self._row(row, columns, size)

    def numbered(self) -> list[Any]:
        """The sheets, each with its number, and with the name from the second on."""
        for k, sheet in enumerate(self.all, 1):
            sheet.text(RIGHT, 0.028, f"{k} of {len(self.all)}", fontsize=7.5, ha="right")
            if k > 1:
                sheet.text(LEFT, 0.028, plain(self.name), fontsize=7.5)
        return self.all

    def _row(
        self, row: Sequence[str], columns: Sequence[Column], size: float, head: bool = False
    ) -> None:
        step, high = self._step(size), self._height(row, columns, size, head)
        self.room(high)
        for cell, column in zip(row, columns, strict=True):
            for k, line in enumerate(column.lines(cell, size, head)):
                self.all[-1].text(
                    column.left if column.side == "left" else column.right,
                    self.y - 0.25 * step - (k + 0.75) * step,
                    plain(line),
                    fontsize=size,
                    ha=column.side,
                    fontweight="bold" if head else "normal",
                )
        self.y -= high
        line = load("matplotlib.lines").Line2D(
            [columns[0].left, columns[-1].right],
            [self.y, self.y],
            linewidth=1.0 if head else 0.5,
            color=RULE if head else FAINT,
        )
        self.all[-1].add_artist(line)

    def _fits(self, row: Sequence[str], columns: Sequence[Column], size: float) -> bool:
        return self.y - self._height(row, columns, size) >= BOTTOM

    def _height(
        self, row: Sequence[str], columns: Sequence[Column], size: float, head: bool = False
    ) -> float:
        cells = zip(row, columns, strict=True)
        most = max(len(column.lines(cell, size, head)) for cell, column in cells)
        return (most + 0.5) * self._step(size)

    def room(self, height: float) -> None:
        """Begin a new sheet if less than this height is left, as a fraction of the sheet."""
        if self.y - height < BOTTOM:
            self.begin()

    @staticmethod
    def _step(size: float) -> float:
        return LEADING * size / 72 / HEIGHT_IN


def _front(sheets: Sheets, c: Comparison) -> None:
    """Title, label, table and notes."""
    sheets.lines(broken(title(c), RIGHT - LEFT, 13, True), 13, fontweight="bold")
    sheets.gap(4)
    if is_emulated(c):
        box = {"facecolor": "#fff1d6", "edgecolor": "#f0a020", "pad": 5}
        sheets.gap(5)
        text = f"{EMULATED[0].upper()}{EMULATED[1:]}."
        sheets.lines([text], 9, LEFT + 0.008, bbox=box)
        sheets.gap(8)
    edges = (LEFT, 0.32, 0.42, 0.59, 0.652, 0.742, 0.842, RIGHT)
    sides = ["left", *["right"] * (len(edges) - 2)]
    columns = [Column(a, b, s) for (a, b), s in zip(pairwise(edges), sides, strict=True)]
    sheets.table(HEADS, rows(c), columns, 7.5)
    sheets.gap(8)
    for note in notes(c):
        first, *rest = broken(note, RIGHT - LEFT - 0.011, 8)
        sheets.lines([f"• {first}"], 8)
        sheets.lines(rest, 8, LEFT + 0.011)
    sheets.gap(8)


def _runs(sheets: Sheets, c: Comparison) -> None:
    """What the runs' metadata say, side by side."""
    sheets.gap(6)
    sheets.room(0.2)
    sheets.lines(["The runs"], 11, fontweight="bold")
    sheets.gap(3)
    head = ("", c.names[0], c.names[1])
    edges = (LEFT, 0.27, 0.60, RIGHT)
    columns = [Column(a, b) for a, b in pairwise(edges)]
    sheets.table(head, about(c), columns, 7.5)
