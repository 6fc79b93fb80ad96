"""The report of a comparison: one self-contained page (HTML with its figures inside), and a
picture. The same as PDF is made by `pages`."""

from __future__ import annotations

import html as html_
import json
import re
from typing import Any

from flexura.io import EMULATED
from flexura.io.drawing import saved

from .figures import figure, heading, is_emulated, together
from .measures import Comparison
from .table import HEADS, notes, rows, title

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
        f'<table class="about"><thead><tr><th></th><th>{text(c.names[0])}</th>'
        f"<th>{text(c.names[1])}</th></tr></thead>"
        f"<tbody>{runs}</tbody></table>\n</body></html>\n"
    )


def png(c: Comparison) -> bytes:
    """All figures in one picture; its text chunks say what it is."""
    return saved(
        together(c),
        "png",
        Title=title(c),
        Description=EMULATED if is_emulated(c) else c.names[1],
    )


def caption(c: Comparison, k: int) -> str:
    """The caption of a figure in the report.

    Args:
        c: the comparison.
        k: number of the figure, from 0.

    Returns:
        The text.
    """
    like = {"forward": "Figs 4.16 to 4.18", "inverse": "Figs 4.19 to 4.21"}.get(c.experiment_kind)
    both = f"{c.names[0]} and {c.names[1]}"
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
