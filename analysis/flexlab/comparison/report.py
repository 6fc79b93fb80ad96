"""The report of a comparison: one self-contained page (HTML with its figures inside), the same as
PDF, and a picture."""

from __future__ import annotations

import html as html_
import io
import json
import re
from textwrap import wrap
from typing import Any

from flexura.optional import Optional, load

from ..runs.labels import EMULATED, called
from .figures import STYLE, figure, heading, is_emulated, saved, together
from .measures import Comparison
from .table import HEADS, notes, rows, title

matplotlib = Optional("matplotlib")

CSS = """
body { font: 15px/1.45 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #30343b; }
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.45rem; margin: 0 0 .3rem; } h2 { font-size: 1.1rem; margin: 2rem 0 .4rem; }
.emulated { background: #fff1d6; border-left: 5px solid #f0a020; padding: .55rem .9rem; 
  margin: .9rem 0; font-weight: 600; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .3rem .55rem; border-bottom: 1px solid #e3e6ea; }
th { border-bottom: 2px solid #9aa0a8; }
th:first-child, td:first-child { text-align: left; }
table.about td { text-align: left; vertical-align: top; font-size: .86rem; }
figure { margin: 1.2rem 0; } figure svg { width: 100%; height: auto; }
figcaption { font-size: .86rem; color: #5a6069; }
ul { padding-left: 1.2rem; font-size: .9rem; }
@media print { figure, table { break-inside: avoid; } }
""".strip()
ROWS = 36  # of the metadata on a page; the rest is in the files
HIDDEN = {"robot", "rig", "events", "phases", "truth", "drive", "firmware"}


def html(c: Comparison) -> str:
    """The page: title, label, table, notes, figures, what the runs say about themselves."""
    text = html_.escape
    head = "".join(f"<th>{text(h)}</th>" for h in HEADS)
    body = "".join(
        "<tr>" + "".join(f"<td>{text(cell)}</td>" for cell in row) + "</tr>" for row in rows(c)
    )
    figures = "".join(
        f"<figure>{_inline(saved(figure(c, d), 'svg', Title=heading(c, d)), f'f{k}-')}"
        f"<figcaption>{text(caption(c, k))}</figcaption></figure>"
        for k, d in enumerate(c.differences)
    )
    runs = "".join(
        f"<tr><td>{text(key)}</td><td>{text(a)}</td><td>{text(b)}</td></tr>"
        for key, a, b in about(c)
    )
    label = (
        f'<p class="emulated">{text(EMULATED[0].upper() + EMULATED[1:])}.</p>'
        if is_emulated(c)
        else ""
    )
    return (
        f'<!doctype html>\n<html lang="en"><head><meta '
        f'charset="utf-8"><title>{text(title(c))}</title>'
        f"<style>{CSS}</style></head><body>\n"
        f"<h1>{text(title(c))}</h1>{label}\n<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>\n"
        f"<ul>{''.join(f'<li>{text(line)}</li>' for line in notes(c))}</ul>\n{figures}\n<h2>The "
        f"runs</h2>\n"
        f'<table class="about"><thead><tr><th></th><th>{text(called(c.simulation))}</th>'
        f"<th>{text(called(c.experiment))}</th></tr></thead>"
        f"<tbody>{runs}</tbody></table>\n</body></html>\n"
    )


def pdf(c: Comparison) -> bytes:
    """Two pages of A4: the figures; the table with the notes and what the runs say about
    themselves."""
    PdfPages = load("matplotlib.backends.backend_pdf").PdfPages

    buffer = io.BytesIO()
    subject = EMULATED if is_emulated(c) else called(c.experiment)
    with (
        matplotlib.rc_context(STYLE),
        PdfPages(
            buffer, metadata={"Title": title(c), "Subject": subject, "CreationDate": None}
        ) as pages,
    ):
        pages.savefig(_front(c))
        pages.savefig(together(c, (8.27, 11.69)))
    return buffer.getvalue()


def png(c: Comparison) -> bytes:
    """All figures in one picture; its text chunks say what it is."""
    return saved(
        together(c),
        "png",
        Title=title(c),
        Description=EMULATED if is_emulated(c) else called(c.experiment),
    )


def caption(c: Comparison, k: int) -> str:
    like = {"forward": "Figs 4.16 to 4.18", "inverse": "Figs 4.19 to 4.21"}.get(c.experiment_kind)
    both = f"{called(c.simulation)} and {called(c.experiment)}"
    return f"Fig. {k + 1}. {heading(c, c.differences[k])}: {both}; below, their difference." + (
        f" In the manner of the dissertation's {like}." if like else ""
    )


def about(c: Comparison) -> list[tuple[str, str, str]]:
    """What both runs' metadata say, by key; tables and lists are left to the files."""
    pairs = [dict(_flat(run.meta)) for run in (c.simulation, c.experiment)]
    keys = list(dict.fromkeys(key for each in (pairs[1], pairs[0]) for key in each))
    return [(key.replace("_", " "), *(each.get(key, "–") for each in pairs)) for key in keys]  # type: ignore[misc]


def _flat(meta: dict[str, Any]) -> list[tuple[str, str]]:
    out = []
    for key, value in meta.items():
        if key == "firmware" and isinstance(value, dict):
            out += [(f"firmware {k}", str(v)) for k, v in value.items()]
        elif key in ("robot", "rig") and isinstance(value, dict):
            out.append((key, str(value.get("name", "–"))))
        elif key not in HIDDEN and value is not None:
            text = (
                value
                if isinstance(value, str)
                else f"{value:.4g}"
                if isinstance(value, float)
                else json.dumps(value)
            )
            out.append((key, text if len(text) <= 120 else text[:117] + "..."))
    return out


def _inline(svg: bytes, prefix: str) -> str:
    """An SVG to stand inside a page: without its XML head, its identifiers made unlike those of the
    page's other figures."""
    text = svg.decode()
    text = text[text.index("<svg") :]
    text = re.sub(r'\bid="', f'id="{prefix}', text)
    return re.sub(r'(href="#|url\(#)', lambda found: found[1] + prefix, text)


def _front(c: Comparison) -> Any:
    """The PDF's first page."""
    Figure = load("matplotlib.figure").Figure

    page = Figure(figsize=(8.27, 11.69))
    y = 0.955
    for line in wrap(title(c), 72):
        page.text(0.06, y, line, fontsize=14, fontweight="bold", va="top")
        y -= 0.024
    if is_emulated(c):
        page.text(
            0.06,
            y - 0.008,
            f"{EMULATED[0].upper()}{EMULATED[1:]}.",
            fontsize=9,
            va="top",
            bbox={"facecolor": "#fff1d6", "edgecolor": "#f0a020", "pad": 5},
        )
        y -= 0.045
    y = _lay(page, y, [HEADS, *rows(c)], [0.06, 0.38, 0.58, 0.655, 0.755, 0.87, 0.985], 8)
    for note in notes(c):
        for k, line in enumerate(wrap(note, 118)):
            page.text(0.06, y, ("• " if k == 0 else "   ") + line, fontsize=8, va="top")
            y -= 0.0155
    y -= 0.02
    cells = [("", called(c.simulation), called(c.experiment)), *about(c)[:ROWS]]
    _lay(
        page,
        y,
        [tuple("\n".join(wrap(cell, 44)[:3]) for cell in row) for row in cells],
        [0.06, 0.28, 0.64],
        7.5,
        left=True,
    )
    return page


def _lay(
    page: Any,
    y: float,
    cells: list[tuple[str, ...]],
    at: list[float],
    size: float,
    left: bool = False,
) -> float:
    """A table's cells at the abscissas `at` (right ends but for the first; `left`: left ends);
    returns where it ends."""
    for n, row in enumerate(cells):
        height = (
            0.0185
            * size
            / 8
            * max(1, *(cell.count("\n") + 1 for cell in row))
            * (0.8 if "\n" in "".join(row) else 1)
        )
        for k, cell in enumerate(row):
            side = "left" if left or k == 0 else "right"
            weight = "bold" if n == 0 else "normal"
            page.text(
                at[k],
                y - 0.011 * size / 8,
                cell,
                fontsize=size,
                va="baseline",
                ha=side,
                fontweight=weight,
            )
        y -= height
        line = page.add_artist(_rule(y + 0.004))
        line.set(linewidth=1.0 if n == 0 else 0.5, color="#9aa0a8" if n == 0 else "#e3e6ea")
    return y - 0.012


def _rule(y: float) -> Any:
    Line2D = load("matplotlib.lines").Line2D

    return Line2D([0.06, 0.985], [y, y])
