"""Branches of C++ sources that no test took, from what gcov wrote.

gcov gives a line once for each function and template instance that it is in. Branches of instances
are added up if there are equally many; where the compiler left some out, what it kept counts by
itself.
"""

from __future__ import annotations

import gzip
import json
import subprocess
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple


class Line(NamedTuple):
    """A line of a source, with what it says: a list of exceptions survives other lines' changes."""

    file: str
    number: int
    text: str


def branches(objects: Path, sources: Path) -> dict[Line, list[int]]:
    """How often each branch was taken: by line, for files below `sources`, from the .gcda files
    below the folder `objects`."""
    found = sorted(objects.rglob("*.gcda"))
    assert found, f"no program below {objects} left its counts"
    counts: dict[tuple[str, int], dict[int, list[int]]] = defaultdict(dict)
    for data in found:
        command = ["gcov", "-b", "-c", "--json-format", "--stdout", str(data)]
        done = subprocess.run(command, cwd=objects, capture_output=True, check=True)
        text = done.stdout
        if text[:2] == b"\x1f\x8b":
            text = gzip.decompress(text)
        for document in text.splitlines():
            for file in json.loads(document)["files"]:
                path = Path(file["file"])
                if not path.is_relative_to(sources):
                    continue
                for line in file["lines"]:
                    taken = [b["count"] for b in line["branches"] if not b["throw"]]
                    if not taken:
                        continue
                    by_size = counts[str(path), line["line_number"]]
                    before = by_size.get(len(taken), [0] * len(taken))
                    by_size[len(taken)] = [a + b for a, b in zip(before, taken, strict=True)]
    texts: dict[str, list[str]] = {}
    out = {}
    for (file, number), by_size in sorted(counts.items()):
        lines = texts.setdefault(file, Path(file).read_text(encoding="utf-8").splitlines())
        where = Line(str(Path(file).relative_to(sources)), number, lines[number - 1].strip())
        out[where] = [count for _, taken in sorted(by_size.items()) for count in taken]
    return out


def missed(found: dict[Line, list[int]]) -> dict[Line, int]:
    """The lines with branches that were not taken, and how many of them."""
    return {line: taken.count(0) for line, taken in found.items() if 0 in taken}
