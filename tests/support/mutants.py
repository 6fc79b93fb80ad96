"""Mutants: a source with one small fault each, to see whether the tests notice.

An operator becomes its neighbour, a number grows by one, a truth value turns round, a condition is
negated, or a statement goes. C++ is read as clang-format leaves it: binary operators have spaces,
brackets of templates have none.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple


class Mutant(NamedTuple):
    """The text `old` of a line is replaced by `new`, at one place."""

    file: str
    line: int  # counted from 1
    column: int
    old: str
    new: str
    text: str  # the whole line, as it was

    @property
    def name(self) -> str:
        """What stays the same when lines are added elsewhere."""
        changed = self.text[: self.column] + self.new + self.text[self.column + len(self.old) :]
        return f"{self.file}: {self.text.strip()}  ->  {changed.strip()}"

    def apply(self, source: str) -> str:
        """The source with this fault."""
        lines = source.split("\n")
        line = lines[self.line - 1]
        assert line[self.column :].startswith(self.old), self
        end = self.column + len(self.old)
        lines[self.line - 1] = line[: self.column] + self.new + line[end:]
        return "\n".join(lines)


NEIGHBOURS = {
    "<": ["<=", ">="],
    ">": [">=", "<="],
    "<=": ["<", ">"],
    ">=": [">", "<"],
    "==": ["!="],
    "!=": ["=="],
    "&&": ["||"],
    "||": ["&&"],
    "+": ["-"],
    "-": ["+"],
    "*": ["+"],
    "/": ["*"],
    "&": ["|"],
    "|": ["&"],
    "^": ["|"],
    "<<": [">>"],
    ">>": ["<<"],
    "+=": ["-="],
    "-=": ["+="],
}
_OPERATOR = re.compile(
    r"(?<= )(" + "|".join(map(re.escape, sorted(NEIGHBOURS, key=len)[::-1])) + r")(?= )"
)
_NUMBER = re.compile(r"(?<![\w.\[])(0x[0-9A-Fa-f]+|\d+)(?=[uULl]*(?![\w.\]]))")
_TRUTH = re.compile(r"\b(true|false)\b")
_NOT = re.compile(r"!(?=[\w(])")
_STEP = re.compile(r"(\+\+|--)(?=\w)|(?<=\w)(\+\+|--)")
_CONDITION = re.compile(r"\bif \((.*)\)(?= |$)")
_STATEMENT = re.compile(
    r"^\s*(?:[\w.>\[\]-]+ [-+|&]?= [^;]*|[\w.]+(?:->|::)?[\w.]*\([^;]*\)|(?:\+\+|--)[\w.\[\]]+);$"
)


def of_cpp(file: str, source: str) -> Iterator[Mutant]:
    """All mutants of a C++ source; comments and lines of the preprocessor are left alone."""
    for number, text in enumerate(source.split("\n"), 1):
        code = re.sub(r'"(?:[^"\\]|\\.)*"', lambda m: " " * len(m[0]), text).split("//")[0]
        if re.match(r"\s*#|\s*(static_assert|template|using|namespace)\b", code) or "\\" in code:
            continue

        def mutant(column: int, old: str, new: str, number=number, text=text) -> Mutant:
            return Mutant(file, number, column, old, new, text)

        for found in _OPERATOR.finditer(code):
            for new in NEIGHBOURS[found[0]]:
                yield mutant(found.start(), found[0], new)
        for found in _NUMBER.finditer(code):
            yield mutant(found.start(), found[0], str(int(found[0], 0) + 1))
        for found in _TRUTH.finditer(code):
            yield mutant(found.start(), found[0], "false" if found[0] == "true" else "true")
        for found in _NOT.finditer(code):
            yield mutant(found.start(), "!", "")
        for found in _STEP.finditer(code):
            yield mutant(found.start(), found[0], "--" if found[0] == "++" else "++")
        found = _CONDITION.search(code)
        if found and not _OPERATOR.search(found[1]) and not found[1].startswith("!"):
            yield mutant(found.start(1), found[1], f"!({found[1]})")
        if _STATEMENT.match(code) and not re.match(r"\s*(return|const|u?int)", code):
            start = len(code) - len(code.lstrip())
            yield mutant(start, code.strip(), ";")


_PYTHON = {
    ast.Lt: ["<=", ">="],
    ast.Gt: [">=", "<="],
    ast.LtE: ["<", ">"],
    ast.GtE: [">", "<"],
    ast.Eq: ["!="],
    ast.NotEq: ["=="],
    ast.Is: ["is not"],
    ast.IsNot: ["is"],
    ast.In: ["not in"],
    ast.NotIn: ["in"],
    ast.And: ["or"],
    ast.Or: ["and"],
    ast.Add: ["-"],
    ast.Sub: ["+"],
    ast.Mult: ["+"],
    ast.Div: ["*"],
    ast.FloorDiv: ["*"],
    ast.Mod: ["+"],
    ast.BitAnd: ["|"],
    ast.BitOr: ["&"],
    ast.LShift: [">>"],
    ast.RShift: ["<<"],
}


def of_python(file: str, source: str) -> Iterator[Mutant]:
    """All mutants of a Python source; annotations and docstrings are left alone."""
    lines = source.split("\n")
    tree = ast.parse(source)
    skipped = {
        id(inner)
        for node in ast.walk(tree)
        for kind in ("annotation", "returns")
        if (outer := getattr(node, kind, None)) is not None
        for inner in ast.walk(outer)
    }

    def between(first: ast.expr, second: ast.expr, news: list[str]) -> Iterator[Mutant]:
        """The operator between two operands of one line."""
        if first.end_lineno != second.lineno:
            return
        text = lines[second.lineno - 1]
        # Columns count bytes.
        start = len(text.encode()[: first.end_col_offset].decode())
        gap = text[start : len(text.encode()[: second.col_offset].decode())]
        old = gap.strip(" ()")
        if old:
            for new in news:
                yield Mutant(file, second.lineno, start + gap.index(old), old, new, text)

    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Compare):
            operands = [node.left, *node.comparators]
            for k, kind in enumerate(node.ops):
                yield from between(operands[k], operands[k + 1], _PYTHON.get(type(kind), []))
        elif isinstance(node, ast.BoolOp):
            for first, second in zip(node.values, node.values[1:], strict=False):
                yield from between(first, second, _PYTHON[type(node.op)])
        elif isinstance(node, ast.BinOp):
            yield from between(node.left, node.right, _PYTHON.get(type(node.op), []))
        elif isinstance(node, ast.Constant) and node.lineno == node.end_lineno:
            text = lines[node.lineno - 1]
            column = len(text.encode()[: node.col_offset].decode())
            old = text[column : len(text.encode()[: node.end_col_offset].decode())]
            if isinstance(node.value, bool):
                yield Mutant(file, node.lineno, column, old, str(not node.value), text)
            elif isinstance(node.value, int | float):
                yield Mutant(file, node.lineno, column, old, f"({old} + 1)", text)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            text = lines[node.lineno - 1]
            column = len(text.encode()[: node.col_offset].decode())
            yield Mutant(file, node.lineno, column, "not ", "", text)
        elif (
            isinstance(node, ast.Assign | ast.AugAssign | ast.Expr)
            and node.lineno == node.end_lineno
            and not isinstance(node.value, ast.Constant)
            and "self." in lines[node.lineno - 1]
        ):
            text = lines[node.lineno - 1]
            column = len(text) - len(text.lstrip())
            yield Mutant(file, node.lineno, column, text.strip(), "pass", text)


def of(path: Path, root: Path) -> list[Mutant]:
    """All mutants of a source, in order; those that give the same text once."""
    make = of_python if path.suffix == ".py" else of_cpp
    found = make(str(path.relative_to(root)), path.read_text(encoding="utf-8"))
    return list({(m.line, m.column, m.new): m for m in sorted(found)}.values())
