"""The table of equations: docs/theory/equations.md, from the chapters beside it and the tests.

    python tools/equations.py            writes the table
    python tools/equations.py --check    status 1 if the table is not up to date

A numbered equation stands in a chapter as

    <a id="eq-7"></a>**Name.** Source.

    $$
    ... \\tag{7}
    $$

A test in tests/docs says in its docstring which equations it evaluates: "Equations: 7, 8".
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
THEORY, TESTS = "docs/theory", "tests/docs"
HEAD = """# Table of equations

`python tools/equations.py` writes this page. Do not edit it.

| number | equation | evaluated by |
| --- | --- | --- |
"""
_EQUATION = re.compile(
    r'<a id="(?P<anchor>[\w-]+)"></a>\*\*(?P<name>.+?)\.\*\*(?P<source>[^\n]*)\n'
    r"(?P<latex>(?:(?!<a id=).)*?\\tag\{(?P<number>\d+)\})",
    re.DOTALL,
)


class Equation(NamedTuple):
    """A numbered equation of a chapter."""

    number: int
    name: str
    source: str
    latex: str
    anchor: str
    chapter: Path


def chapters(root: Path = ROOT) -> list[Path]:
    """The chapters of the theory in their order."""
    return sorted((root / THEORY).glob("[0-9][0-9]-*.md"))


def equations(root: Path = ROOT) -> list[Equation]:
    """All numbered equations in the order in which they stand.

    Raises: ValueError: a tag has no name and anchor in front of it.
    """
    found = []
    for chapter in chapters(root):
        text = chapter.read_text(encoding="utf-8")
        own = [
            Equation(
                int(m["number"]), m["name"], m["source"].strip(), m["latex"], m["anchor"], chapter
            )
            for m in _EQUATION.finditer(text)
        ]
        if len(own) != text.count("\\tag{"):
            raise ValueError(f"{chapter.name}: a \\tag has no <a id> and **name.** in front of it")
        found += own
    return found


def tested(root: Path = ROOT) -> dict[int, list[str]]:
    """By number, the tests that evaluate an equation: `file::function`."""
    found: dict[int, list[str]] = {}
    for path in sorted((root / TESTS).glob("test_*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.FunctionDef) or not node.name.startswith("test_"):
                continue
            said = re.search(
                r"^ *Equations: ([\d, ]+)$", ast.get_docstring(node) or "", re.MULTILINE
            )
            for number in re.findall(r"\d+", said[1]) if said else ():
                found.setdefault(int(number), []).append(f"{path.name}::{node.name}")
    return found


def table(root: Path = ROOT) -> str:
    """The page with the table."""
    tests, out, chapter = tested(root), [HEAD], None
    for e in equations(root):
        if e.chapter != chapter:
            chapter = e.chapter
            title = chapter.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
            out.append(f"| | **[{title}]({chapter.name})** | |\n")
        names = ", ".join(f"`{name.partition('::')[2]}`" for name in tests.get(e.number, ()))
        out.append(f"| [({e.number})]({chapter.name}#{e.anchor}) | {e.name} | {names} |\n")
    return "".join(out)


def main() -> int:
    """Writes the table, or compares it with the file."""
    path, made = ROOT / THEORY / "equations.md", table()
    if "--check" in sys.argv[1:]:
        if path.exists() and path.read_text(encoding="utf-8") == made:
            return 0
        print(f"{path} is not up to date: python tools/equations.py", file=sys.stderr)
        return 1
    path.write_text(made, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
