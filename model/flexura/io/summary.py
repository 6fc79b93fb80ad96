"""What an object shows of itself: a few lines in a terminal, a small table in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

LINES, COLUMNS = 12, 80  # at most, in a terminal

Rows = Sequence[tuple[str, str]]


def text(title: str, rows: Rows) -> str:
    """A title and one line a row, cut to LINES and COLUMNS.

    Args:
        title: the first line.
        rows: pairs of a name and what is said of it.

    Returns:
        The lines, without a line end after the last.
    """
    wide = min(max((len(name) for name, _ in rows), default=0), 24)
    lines = [title, *(f"  {name:<{wide}}  {said}".rstrip() for name, said in rows)]
    if len(lines) > LINES:
        lines = [*lines[: LINES - 1], f"  ... and {len(lines) - LINES + 1} more"]
    return "\n".join(_cut(one_line(line)) for line in lines)


def html(title: str, rows: Rows) -> str:
    """The same as a table of plain HTML, all texts escaped, no row left out."""
    cells = "".join(
        f'<tr><th style="text-align:left">{escape(one_line(name))}</th>'
        f'<td style="text-align:left">{escape(one_line(said))}</td></tr>'
        for name, said in rows
    )
    head = f'<caption style="text-align:left">{escape(one_line(title))}</caption>'
    return f"<table>{head}<tbody>{cells}</tbody></table>"


def listed(items: Iterable[object], room: int = 54) -> str:
    """As many items as fit into a line, and how many there are in all."""
    texts = [str(item) for item in items]
    shown: list[str] = []
    while len(shown) < len(texts) and len(", ".join([*shown, texts[len(shown)]])) <= room:
        shown.append(texts[len(shown)])
    if len(shown) == len(texts):
        return ", ".join(shown)
    return f"{', '.join(shown or [texts[0][:room]])}, ... ({len(texts)})"


def numbers(found: Iterable[int]) -> str:
    """Whole numbers as ranges: 1, 2, 3, 7 -> "1-3, 7"."""
    ascending = sorted(set(found))
    spans: list[list[int]] = []
    for n in ascending:
        if spans and n == spans[-1][1] + 1:
            spans[-1][1] = n
        else:
            spans.append([n, n])
    return ", ".join(f"{a}" if a == b else f"{a}-{b}" for a, b in spans)


def one_line(line: str) -> str:
    """Line ends and what no terminal shows, from a name, as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def _cut(line: str) -> str:
    return line if len(line) <= COLUMNS else f"{line[: COLUMNS - 3]}..."
