"""The table of equations: docs/theory/equations.md, from the chapters, the code and the tests.

    python tools/equations.py            writes the table
    python tools/equations.py --check    status 1 if the table is not up to date
    python tools/equations.py --renumber numbers all equations anew in the order of the chapters,
                                         wherever they are cited: for one that was put between


A numbered equation stands in a chapter as

    <a id="eq-7"></a>**Name.** Source. Also: other words of the field, by commas.

    $$
    ... \\tag{7}
    $$

A docstring of flexura, and a comment of the core or of the firmware's library, cites it as (7), or
several as (7) to (9). A test in tests/docs says in its docstring which equations it evaluates:
"Equations: 7, 8".
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
THEORY, TESTS = "docs/theory", "tests/docs"
LIBRARY = "firmware/lib"
PYTHON, CPP = "model/flexura", ("model/core", LIBRARY)
# where equations are cited
PAGES = ("docs/**/*.md", "*.md", "examples/**/*.md", "examples/**/*.ipynb", "examples/*.py")
PAGES += tuple(f"{part}/**/*.{kind}" for part in ("model", "analysis") for kind in ("py", "md"))
PAGES += ("model/core/**/*.[hc]pp", "firmware/**/*.md", "firmware/lib/**/*.h", "tests/**/*.py")
PAGES += ("firmware/lib/**/*.cpp", "tests/model/core/**/*.[hc]pp")
HEAD = """# Table of equations

`python tools/equations.py` writes this page. Do not edit it.

Search this page for the field's word, such as condensation, Kalman or step size. Behind a name
stand other words for it.

`computed by` names what cites the equation: a function or class of `flexura`, or one of the core or
of the firmware's library with its file. Functions stand before classes, and first what is about
this equation most.
`evaluated by` names the test in `tests/docs` that writes it down anew.

| number | equation | computed by | evaluated by |
| --- | --- | --- | --- |
"""
_EQUATION = re.compile(
    r'<a id="(?P<anchor>[\w-]+)"></a>\*\*(?P<name>.+?)\.\*\*(?P<source>[^\n]*)\n'
    r"(?P<latex>(?:(?!<a id=).)*?\\tag\{(?P<number>\d+)\})",
    re.DOTALL,
)
_CITATION = re.compile(r"(?<![\w)\]'])\(([1-9]\d{0,2})\)(?:\s+to\s+\((\d{1,3})\))?(?![\w(\[])")
# at the beginning of a line, or in a class: a class, or a function with its parameters
_DECLARED = re.compile(
    r"(?:^|(?<=^  ))(?:(?:struct|class) (\w+)|"
    r"(?!namespace|template|using|constexpr|static_assert|return|else|for|if|while|switch|case)"
    r"[A-Za-z_][\w:<>,*& ]*?[ *&](?:[\w<>]+::)*(\w+)\()",
    re.MULTILINE,
)
_BEFORE = re.compile(r"\s*(?:template [^\n]*\n\s*)?")  # between a comment and what it is of
_COMMENT = re.compile(r"(?:^[ \t]*//.*\n)+|//.*", re.MULTILINE)
_ALSO = re.compile(r"(?:^|(?<=\. ))Also: ([^.]+)\.")


class Equation(NamedTuple):
    """A numbered equation of a chapter. `also`: other words of the field for it."""

    number: int
    name: str
    source: str
    latex: str
    anchor: str
    chapter: Path

    @property
    def also(self) -> str:
        """Other words of the field, by commas; "": none."""
        found = _ALSO.search(self.source)
        return found[1] if found else ""


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


def written(text: str) -> list[int]:
    """The numbers that stand in a docstring or comment, as they are written."""
    return [int(n) for found in _CITATION.finditer(text) for n in found.groups() if n]


def cited(text: str) -> set[int]:
    """The equations that a docstring or comment cites: of "(7) to (9)" also (8)."""
    return {
        n
        for found in _CITATION.finditer(text)
        for n in range(int(found[1]), int(found[2] or found[1]) + 1)
    }


def docstrings(path: Path) -> Iterator[tuple[str, str]]:
    """The docstrings of a Python file with their dotted names in it; the module itself is ""."""

    def inside(node: ast.AST, name: str) -> Iterator[tuple[str, str]]:
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield name, ast.get_docstring(node, clean=False) or ""
            for child in node.body:
                own = getattr(child, "name", None)
                if own:
                    yield from inside(child, f"{name}.{own}" if name else own)

    return inside(ast.parse(path.read_text(encoding="utf-8")), "")


def comments(path: Path) -> list[tuple[str, str]]:
    """The comments of a C++ file, lines that follow each other as one, without their slashes; each
    with the function or class that it stands before or in, "" at the head of the file."""
    text = path.read_text(encoding="utf-8")
    names = [(m.start(), m[1] or m[2]) for m in _DECLARED.finditer(text)]
    found = []
    for c in _COMMENT.finditer(text):
        head = text[: c.start()].strip() == ""
        skipped = _BEFORE.match(text, c.end())
        after = skipped.end() if skipped else c.end()
        own = [name for at, name in names if at == after]
        last = [name for at, name in names if at < c.start()][-1:]
        name = "" if head else (own or last or [""])[0]
        found.append((name, re.sub(r"^\s*//+", " ", c[0], flags=re.MULTILINE)))
    return found


def citations(root: Path = ROOT) -> dict[int, list[str]]:
    """By number, what computes an equation: functions and classes by name, those of C++ with their
    file. Functions stand before classes, and what cites few equations first: it is about this one.
    A file stands for itself, and last, if it cites an equation at its head and none of its
    functions does."""
    found: dict[int, list[str]] = {}

    def note(text: str, name: str) -> None:
        for number in cited(text):
            if name not in found.setdefault(number, []):
                found[number].append(name)

    for path in sorted((root / PYTHON).rglob("*.py")):
        module = ".".join(path.relative_to(root / PYTHON).with_suffix("").parts)
        for name, text in docstrings(path):
            if name:
                note(text, f"{module}.{name}")
    for folder in CPP:
        for path in sorted((root / folder).rglob("*.[hc]*")):
            file = path.relative_to(root / folder if folder != LIBRARY else root).as_posix()
            for name, text in comments(path):
                note(text, f"{file}: {name}" if name else file)
    count = Counter(name for names in found.values() for name in names)
    out = {}
    for number, names in found.items():
        inside = {name.partition(": ")[0] for name in names if ": " in name}
        kept = [name for name in names if name not in inside]
        out[number] = sorted(kept, key=lambda name: (is_file(name), _is_class(name), count[name]))
    return out


def _is_class(name: str) -> bool:
    return re.split(r"[. ]", name)[-1][0].isupper()


def is_file(name: str) -> bool:
    """Whether a name of `citations` is that of a file alone."""
    return "/" in name and ": " not in name


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
    code, tests, out, chapter = citations(root), tested(root), [HEAD], None
    for e in equations(root):
        if e.chapter != chapter:
            chapter = e.chapter
            title = chapter.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
            out.append(f"| | **[{title}]({chapter.name})** | | |\n")
        computed = ", ".join(f"`{name}`" for name in code.get(e.number, ()))
        evaluated = ", ".join(f"`{name.partition('::')[2]}`" for name in tests.get(e.number, ()))
        number = f"[({e.number})]({chapter.name}#{e.anchor})"
        name = f"{e.name}; {e.also}" if e.also else e.name
        out.append(f"| {number} | {name} | {computed} | {evaluated} |\n")
    return "".join(out)


def renumber(root: Path = ROOT) -> dict[int, int]:
    """Numbers the equations from 1 in the order in which they stand, and all that cites them.

    Citations are looked for in pages, in comments and strings of Python, in comments of C++.

    Returns: the numbers that change, by the old ones.

    Raises: ValueError: a number stands twice.
    """
    old = [e.number for e in equations(root)]
    if twice := sorted({n for n in old if old.count(n) > 1}):
        raise ValueError(f"numbers that stand twice: {twice}")
    new = {n: k for k, n in enumerate(old, 1) if n != k}
    number = lambda found: str(new.get(int(found[0]), int(found[0])))
    cite = lambda found: re.sub(r"\d+", number, found[0])

    def prose(text: str) -> str:
        text = re.sub(
            r"\beq-\d+|\\tag\{\d+\}|^ *Equations: [\d, ]+$", cite, text, flags=re.MULTILINE
        )
        return _CITATION.sub(cite, text)

    for path in sorted(p for kind in PAGES for p in root.glob(kind)):
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".py":
            changed = _prose_of_python(text, prose)
        elif path.suffix in (".cpp", ".hpp", ".h"):
            changed = _COMMENT.sub(lambda comment: prose(comment[0]), text)
        else:
            changed = prose(text)
        if changed != text:
            path.write_text(changed, encoding="utf-8")
    return new


def _prose_of_python(text: str, change: Callable[[str], str]) -> str:
    """A Python source with its comments and strings changed, and nothing else."""
    lines, out = text.splitlines(keepends=True), []
    row, column = 1, 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in (tokenize.COMMENT, tokenize.STRING):
            continue
        out += _between(lines, (row, column), token.start), change(token.string)
        row, column = token.end
    return "".join([*out, _between(lines, (row, column), (len(lines) + 1, 0))])


def _between(lines: list[str], start: tuple[int, int], end: tuple[int, int]) -> str:
    """The text from one place, its row from 1 and its column, to another one."""
    if start[0] == end[0]:
        return lines[start[0] - 1][start[1] : end[1]]
    last = lines[end[0] - 1][: end[1]] if end[0] <= len(lines) else ""
    return "".join([lines[start[0] - 1][start[1] :], *lines[start[0] : end[0] - 1], last])


def main() -> int:
    """Writes the table, or compares it with the file."""
    if "--renumber" in sys.argv[1:]:
        print("\n".join(f"({a}) is ({b})" for a, b in renumber().items()))
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
