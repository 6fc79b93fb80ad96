"""Docstrings as they are written here, in plain text, made fit for Sphinx."""

from __future__ import annotations

import re
from typing import Any

_QUOTED = re.compile(r"``[^`]*``|`[^`]*`")
_SIGNS = re.compile(r"([\\*|_])")
_SECTIONS = re.compile(r"^( *)(Args|Returns|Raises): (?=\S)", re.MULTILINE)


def plain(text: str) -> str:
    """Text in which only `quoted` words are marked: no other sign has a meaning."""
    parts, last = [], 0
    for quoted in _QUOTED.finditer(text):
        one_line = " ".join(quoted[0].split())
        parts += [_SIGNS.sub(r"\\\1", text[last : quoted.start()]), one_line]
        last = quoted.end()
    return "".join([*parts, _SIGNS.sub(r"\\\1", text[last:])])


def prepare(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Escape what reStructuredText would read; "Args: robot: ..." on one line becomes two."""
    lines[:] = _SECTIONS.sub(r"\1\2:\n\1    ", plain("\n".join(lines))).split("\n")


def setup(app: Any) -> dict[str, bool]:
    """Register before napoleon."""
    app.connect("autodoc-process-docstring", prepare, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
