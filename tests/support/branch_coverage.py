"""Branches of C++ sources that no test took, from what gcov wrote, and lists that explain them.

How branches are counted, where g++ compiles without optimization:

- A branch is one direction of a decision: a condition has two, a switch one for each of its labels.
- A call that may end by an exception is no decision. gcov gives it two directions, which are left
  out.
- A line without a word of the language that decides has none: what gcov finds there is the
  compiler's own, as a test whether memory is to be given back.
- gcov gives a line once for each function and instance of a template that it is in; a line of a
  lambda once, the branches of all instances one after the other. A branch is taken if it is taken
  in one of them. Instances with as many branches as each other are added up; where the compiler
  left some out, what it kept counts by itself, if it was ever entered.
"""

from __future__ import annotations

import gzip
import json
import re
import subprocess
import tomllib
from collections import Counter, defaultdict
from pathlib import Path
from typing import NamedTuple

DECIDES = re.compile(
    r"\b(if|for|while|case|switch|default)\b|\?|&&|\|\||\b(?!MODULE)[A-Z_]{3,}\("
)  # or a macro, but for what the binding library makes of a module


class Line(NamedTuple):
    """A line of a source: a list of exceptions keeps file, function and text, which survive
    changes of other lines."""

    file: str
    number: int
    function: str
    text: str


def function_name(demangled: str) -> str:
    """A function without its arguments and those of its templates; a lambda is one of where it
    stands."""
    name = demangled.replace("(anonymous namespace)::", "").replace("operator()", "call")
    name = name.replace("[abi:cxx11]", "")
    name = re.sub(r"operator(<<=?|>>=?|<=|>=|<|>|->\*?)", "operator", name)
    while (shorter := re.sub(r"<[^<>]*>|\([^()]*\)|#\d+", "", name)) != name:
        name = shorter
    name = [word for word in name.split() if word != "const"][-1]
    return name.removeprefix("flexura::").split("::{lambda}")[0]


def decisions(found: list[dict]) -> list[int]:
    """How often the directions of decisions were taken. Where a call may end by an exception, its
    return stands in front of the exception, as what falls through."""
    out: list[int] = []
    for one in found:
        if one["throw"]:
            out.pop()
        else:
            out.append(one["count"])
    return out


def placed(line: dict, functions: list[dict]) -> tuple[str, list[int]]:
    """The function of a line, and how often its branches were taken, instances added up.

    Where gcov names no function the line is in a lambda, the last that begins before. "": gcov
    tells nothing but the lambda.
    """
    taken = decisions(line["branches"])
    names = {one["name"]: one["demangled_name"] for one in functions}
    if "function_name" in line:
        return function_name(names[line["function_name"]]), taken
    begun = sorted((one["start_line"], one["name"]) for one in functions)
    begun = [one for one in begun if one[0] <= line["line_number"]]
    instances = sum(start == begun[-1][0] for start, _ in begun)
    each, rest = divmod(len(taken), max(instances, 1))
    if not rest:
        taken = [sum(taken[k::each]) for k in range(each)]
    around = [names[name] for _, name in begun if not re.search(r"\{lambda|^_Z", names[name])]
    return function_name(around[-1]) if around else "", taken


def reported(objects: Path) -> list[dict]:
    """What gcov says of each file of each object below a folder, in JSON."""
    found = sorted(objects.rglob("*.gcda"))
    assert found, f"no program below {objects} left its counts"
    out = []
    for data in found:
        command = ["gcov", "-b", "-c", "--json-format", "--stdout", str(data)]
        text = subprocess.run(command, cwd=objects, capture_output=True, check=True).stdout
        if text[:2] == b"\x1f\x8b":
            text = gzip.decompress(text)
        for document in text.splitlines():
            out += json.loads(document)["files"]
    return out


def branches(objects: Path, sources: Path) -> dict[Line, list[int]]:
    """How often each branch was taken: by line, for files below `sources`, from the .gcda files
    below the folder `objects`."""
    counts: dict[tuple[str, int, str], dict[int, list[int]]] = defaultdict(dict)
    texts: dict[str, list[str]] = {}
    for file in reported(objects):
        path = Path(file["file"])
        if not path.is_relative_to(sources):
            continue
        name = str(path.relative_to(sources))
        if name not in texts:
            texts[name] = path.read_text(encoding="utf-8").splitlines()
        for line in file["lines"]:
            number = line["line_number"]
            function, taken = placed(line, file["functions"])
            text = texts[name][number - 1].split("//")[0]
            if not taken or not DECIDES.search(text) or "= default;" in text:
                continue
            by_size = counts[name, number, function]
            before = by_size.get(len(taken), [0] * len(taken))
            by_size[len(taken)] = [a + b for a, b in zip(before, taken, strict=True)]
    for name, number, function in list(counts):
        named = [key for key in counts if key[:2] == (name, number) and key[2]]
        if not function and named:
            for size, taken in counts.pop((name, number, "")).items():
                before = counts[named[0]].get(size, [0] * size)
                counts[named[0]][size] = [a + b for a, b in zip(before, taken, strict=True)]
    return {
        Line(name, number, function, texts[name][number - 1].strip()): [
            count
            for _, taken in sorted(by_size.items())
            if any(taken) or not any(map(any, by_size.values()))
            for count in taken
        ]
        for (name, number, function), by_size in sorted(counts.items())
    }


Place = tuple[str, str, str]  # file, function, text of the line


def missed(found: dict[Line, list[int]]) -> dict[Line, int]:
    """The lines with branches that were not taken, and how many of them."""
    return {line: taken.count(0) for line, taken in found.items() if 0 in taken}


def untaken(found: dict[Line, list[int]]) -> dict[Place, int]:
    """How many branches were not taken, by what stays the same when lines move."""
    out: Counter[Place] = Counter()
    for line, count in missed(found).items():
        out[line.file, line.function, line.text] += count
    return dict(out)


def explained(path: Path) -> dict[Place, int]:
    """What a list says of branches that no test takes: how many of them stand in a line.

    Each [[branch]] has file, function, text (the line), missed (how many) and a reason.
    """
    listed = tomllib.loads(path.read_text(encoding="utf-8"))["branch"]
    assert all(len(one["reason"]) > 40 for one in listed)
    out = {(one["file"], one["function"], one["text"]): one["missed"] for one in listed}
    assert len(out) == len(listed), "a line stands in the list twice"
    return out
