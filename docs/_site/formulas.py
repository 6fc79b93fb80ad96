"""Formulas by MathJax from the site's own folder, so that pages need no network."""

from __future__ import annotations

import html
import re
from importlib.metadata import files
from pathlib import Path
from shutil import copyfile
from typing import Any

from docutils import nodes

SCRIPT = "tex-svg-full.js"  # with its glyphs inside: one file is all of MathJax that is needed
SETTINGS = """window.MathJax = {
  tex: {inlineMath: [["\\\\(", "\\\\)"]], displayMath: [["\\\\[", "\\\\]"]]},
  options: {enableMenu: false, processHtmlClass: "math"},
  startup: {pageReady: () => MathJax.startup.defaultPageReady().then(() => {
    for (const formula of document.querySelectorAll("div.math")) {
      const share = formula.clientWidth / formula.scrollWidth;
      if (share < 1) formula.style.fontSize = 100 * Math.max(share, 0.7) + "%";
    }
  })}
};"""
# A display formula wider than the page is set smaller, to 70 % at most; wider still, it is moved
# sideways.
_ANCHOR = re.compile(r'<a id="(eq-\d+)"></a>')
# formulas, code, links and targets are passed over, and what follows a number; left is (7)
_NUMBER = re.compile(
    r"\$\$.*?\$\$|\$[^$\n]*\$|```.*?```|`[^`\n]*`|\[[^\]\n]*\]\([^)\n]*\)|\(eq-\d+\)="
    r"|(?<![\w)\]])(?<!\d )\(([1-9]\d{0,2})\)(?!\w)",
    re.DOTALL,
)


def inline(self: Any, node: nodes.Element) -> None:
    """A formula in a line of text."""
    self.body.append(f'<span class="math">\\({html.escape(node.astext())}\\)</span>')
    raise nodes.SkipNode


def display(self: Any, node: nodes.Element) -> None:
    """A formula of its own, with its number if it has a tag."""
    self.body.append(f'<div class="math">\\[{html.escape(node.astext())}\\]</div>\n')
    raise nodes.SkipNode


def link(found: re.Match[str]) -> str:
    """A number in the text as a link to its equation."""
    return f"[({found[1]})](#eq-{found[1]})" if found[1] else found[0]


def anchors(app: Any, name: str, source: list[str]) -> None:
    """Anchors of equations as targets that Sphinx knows and checks, and their numbers as links."""
    source[0] = _NUMBER.sub(link, _ANCHOR.sub(r"(\1)=\n", source[0]))


def script(app: Any, error: Exception | None) -> None:
    """Put MathJax into the site."""
    if error is None and app.builder.format == "html":
        found = next(f for f in files("sphinx-mathjax-offline") or () if f.name == SCRIPT)
        copyfile(str(found.locate()), Path(app.outdir) / "_static" / "mathjax.js")


def setup(app: Any) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathjax-offline", (inline, None), (display, None))
    app.add_js_file(None, body=SETTINGS, priority=400)
    app.add_js_file("mathjax.js", loading_method="defer")
    app.connect("source-read", anchors)
    app.connect("build-finished", script)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
