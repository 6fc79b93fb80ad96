"""Numbers, shares and names as text: one definition for tables, pages and reports."""

from __future__ import annotations

import math
import unicodedata
from typing import Any


def number(value: float, digits: int = 4, missing: str = "-") -> str:
    """A number with so many significant digits; `missing` if it is not finite."""
    return f"{value:.{digits}g}" if math.isfinite(value) else missing


def percent(value: float, digits: int = 2, missing: str = "-") -> str:
    """A share of 1 in percent, without an exponent for large ones; `missing` if not finite."""
    if not math.isfinite(value):
        return missing
    share = 100 * value
    whole = abs(share) >= 10**digits - 0.5
    return f"{share:.0f} %" if whole else f"{share:.{digits}g} %"


def duration(seconds: float) -> str:
    """A time in milliseconds below one second, else in seconds."""
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def finite(value: Any) -> Any:
    """A value for JSON: NumPy's numbers as Python's, None if not finite."""
    if isinstance(value, bool | str) or value is None:
        return value
    return float(value) if math.isfinite(value) else None


def printable(text: str) -> str:
    """A text from a file for a terminal: control characters and line ends as escapes."""
    shown = lambda c: c.isprintable() or unicodedata.category(c) == "Zs"
    return "".join(c if shown(c) else c.encode("unicode_escape").decode() for c in text)


def file_name(text: str) -> str:
    """A text as a part of a file's name: letters, digits, dot, hyphen and underscore."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in text)
    return kept.strip(".-") or "unnamed"


def markdown(text: str) -> str:
    """A text from a file for a page in Markdown: its marks are shown as they are, in one line."""
    escaped = "".join(f"\\{c}" if c in "\\`*_[]<>#|~" else c for c in text.replace("\n", " "))
    return printable(escaped)
