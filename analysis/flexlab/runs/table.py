"""Tables for the terminal. They fit its width, and no digit is cut.

A number is never wrapped. The unit of a column stands on a line of its own. A table that is too
wide is transposed if it has few rows. Otherwise it continues below with its first column repeated.
Texts are shown as they are: markup in a name has no effect, control characters are escaped.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from .formatting import printable

WIDTH = 80  # columns where there is no terminal
FEW = 4  # rows of a table that may be transposed
GAP = 2  # blanks between two columns
LONGEST = 28  # a longer word, as a path, may be wrapped


@dataclass(frozen=True)
class Styled:
    """A cell in colour."""

    text: str
    style: str


Cell = str | Styled


@dataclass
class Table:
    """Heads, as "peak [m]", rows of cells, and notes below. `words`: heads of columns of text."""

    title: str
    heads: Sequence[str]
    words: Sequence[str] = ()
    rows: list[tuple[Cell, ...] | None] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, *cells: Cell) -> None:
        """One row, a cell a head. Columns that stay empty are left out."""
        if len(cells) != len(self.heads):
            raise ValueError(f"{len(cells)} cells for {len(self.heads)} heads")
        self.rows.append(cells)

    def rule(self) -> None:
        """A line below the last row."""
        self.rows.append(None)

    def __rich_console__(self, console: Any, options: Any) -> Iterator[Any]:
        """The title, one or more tables of at most the console's width, and the notes."""
        from rich.text import Text

        yield Text(_lines(self.title), style="bold", overflow="fold")
        for k, part in enumerate(self.parts(options.max_width) if self.rows else []):
            yield from ([Text("")] if k else [])
            yield _drawn(part)
        for note in self.notes:
            yield Text(_lines(note), overflow="fold")

    def parts(self, width: int) -> list[Block]:
        """The table as blocks that are at most `width` wide."""
        shown = [
            k
            for k, _ in enumerate(self.heads)
            if k == 0 or any(row is not None and text(row[k]) for row in self.rows)
        ]
        rows = [None if row is None else tuple(row[k] for k in shown) for row in self.rows]
        heads = [self.heads[k] for k in shown]
        words = [head in self.words for head in heads]
        whole = Block(heads, words, rows)
        if whole.least <= width or len(heads) <= 2:
            return [whole.fitted(width)]
        full = [row for row in rows if row is not None]
        if len(full) <= FEW and words[0]:
            turned = Block(
                [heads[0], *(text(row[0]) for row in full)],
                [True] + [False] * len(full),
                [(head, *(row[k] for row in full)) for k, head in enumerate(heads) if k],
            )
            if turned.least <= width:
                return [turned.fitted(width)]
        return [part.fitted(width) for part in whole.split(width)]


@dataclass(frozen=True)
class Block:
    """Columns that stand side by side; `widths` of the columns once they are fitted."""

    heads: list[str]
    words: list[bool]
    rows: list[tuple[Cell, ...] | None]
    widths: tuple[int, ...] = ()

    def column(self, k: int) -> list[str]:
        """The cells of column k, as they are shown."""
        return [text(row[k]) for row in self.rows if row is not None]

    def needs(self, k: int, *, whole: bool = False) -> int:
        """The width that column k needs; `whole`: if no text is wrapped."""
        head = max(map(_cells, _tokens(self.heads[k])), default=0)
        if self.words[k] and not whole:
            every = (word for cell in self.column(k) for word in cell.split())
            longest = [min(_cells(word), LONGEST) for word in every]
        else:
            longest = [_cells(cell) for cell in self.column(k)]
        return max([head, *longest, 1])

    @property
    def least(self) -> int:
        """The least width of all columns."""
        return sum(self.needs(k) for k in range(len(self.heads))) + GAP * (len(self.heads) - 1)

    def fitted(self, width: int) -> Block:
        """The block with its columns' widths. Columns of text share what the numbers leave."""
        widths = [self.needs(k) for k in range(len(self.heads))]
        texts = sorted((k for k, words in enumerate(self.words) if words), key=lambda k: widths[k])
        room = width - GAP * (len(widths) - 1) - sum(widths)
        for k in texts if room >= 0 else reversed(texts):
            change = min(room, self.needs(k, whole=True) - widths[k])
            change = max(change, 1 - widths[k])
            widths[k] += change
            room -= change
        return Block(self.heads, self.words, self.rows, tuple(widths))

    def split(self, width: int) -> Iterator[Block]:
        """Blocks with the first column repeated, each as wide as fits."""
        group: list[int] = []
        for k in range(1, len(self.heads)):
            if group and self._chosen([*group, k]).least > width:
                yield self._chosen(group)
                group = []
            group.append(k)
        yield self._chosen(group)

    def _chosen(self, columns: list[int]) -> Block:
        every = [0, *columns]
        return Block(
            [self.heads[k] for k in every],
            [self.words[k] for k in every],
            [
                None if row is None else tuple(row[k] for k in every)
                for row in self.rows
                if row is None or any(text(row[k]) for k in columns)
            ],
        )


def text(cell: Cell) -> str:
    """What a cell shows."""
    return printable(cell.text if isinstance(cell, Styled) else cell)


def _drawn(block: Block) -> Any:
    """The block as a table of rich."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table as Drawing
    from rich.text import Text

    out = Drawing(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
    for head, words, width in zip(block.heads, block.words, block.widths, strict=True):
        out.add_column(
            Text(_wrapped(head, width)),
            justify="left" if words else "right",
            width=width,
            no_wrap=not words,
            overflow="fold",
            vertical="top",
        )
    for row in block.rows:
        if row is None:
            out.add_section()
            continue
        out.add_row(*(Text(text(c), style=c.style if isinstance(c, Styled) else "") for c in row))
    return out


def _tokens(head: str) -> list[str]:
    """The words of a head; a unit in brackets is one."""
    return re.findall(r"\[[^\]]*\]|\S+", printable(head))


def _wrapped(head: str, width: int) -> str:
    """A head in lines of at most `width`, its unit on one of its own."""
    lines: list[str] = []
    for token in _tokens(head):
        fits = lines and _cells(lines[-1]) + 1 + _cells(token) <= width
        if fits and not token.startswith("["):
            lines[-1] += f" {token}"
        else:
            lines.append(token)
    return "\n".join(lines)


def _lines(value: str) -> str:
    """A text of several lines, each without control characters."""
    return "\n".join(map(printable, value.split("\n")))


def _cells(value: str) -> int:
    from rich.cells import cell_len

    return cell_len(value)
