"""Which branches of model/core its tests take.

    python tests/support/core_coverage.py FOLDER [--python TESTS...] [--missed FILE...]

It builds the core for gcov in FOLDER (minutes, without optimisation) and runs the C++ tests there.
--python also builds the Python module in FOLDER, and runs these tests with it. It prints one row a
file. --missed prints the lines of these files with branches that no test took.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

from branch_coverage import Line, branches, missed

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "model" / "core"


def built(folder: Path, *options: str, target: str = "all") -> None:
    """Configure and build with branches counted."""
    coverage = ["-DFLEXURA_COVERAGE=ON", "-DCMAKE_BUILD_TYPE=Debug", *options]
    subprocess.run(["cmake", "-S", str(ROOT), "-B", str(folder), *coverage], check=True)
    subprocess.run(["cmake", "--build", str(folder), "--target", target], check=True)


def run_python(folder: Path, tests: list[str]) -> None:
    """Tests in Python, with the module that counts in the place of the installed one."""
    options = [
        "-DFLEXURA_MODULE=ON",
        "-DFLEXURA_PLAIN=OFF",
        f"-DPython_EXECUTABLE={sys.executable}",
    ]
    built(folder / "module", *options)
    copy = folder / "model"
    shutil.rmtree(copy, ignore_errors=True)
    leave = shutil.ignore_patterns("*.so", "__pycache__")
    shutil.copytree(ROOT / "model", copy, ignore=leave)
    for made in (folder / "module").rglob("_*.so"):
        shutil.copy(made, copy / "flexura")
    paths = os.pathsep.join(map(str, (copy, ROOT / "analysis")))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--timeout", "3600"]
    # a test that fails by its time says nothing of branches
    subprocess.run([*command, *tests], cwd=ROOT, env=os.environ | {"PYTHONPATH": paths})


def table(found: dict[Line, list[int]]) -> list[tuple[str, int, int]]:
    """File, branches taken, branches; those that lack most first."""
    files: dict[str, list[int]] = defaultdict(list)
    for line, taken in found.items():
        files[line.file] += taken
    rows = [(file, len(taken) - taken.count(0), len(taken)) for file, taken in files.items()]
    return sorted(rows, key=lambda row: row[1] - row[2])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--python", nargs="+", default=[], metavar="TESTS")
    parser.add_argument("--missed", nargs="+", default=[], metavar="FILE")
    asked = parser.parse_args()
    folder = asked.folder.resolve()
    for old in folder.rglob("*.gcda") if folder.exists() else ():
        old.unlink()
    built(folder / "core")
    subprocess.run(["ctest", "--test-dir", str(folder / "core")], check=True)
    if asked.python:
        run_python(folder, asked.python)
    found = branches(folder, CORE)
    rows = table(found)
    for file, taken, all_ in rows:
        print(f"| {file} | {taken} | {all_} | {100 * taken / all_:.0f} % |")
    taken, all_ = (sum(row[k] for row in rows) for k in (1, 2))
    print(f"| model/core | {taken} | {all_} | {100 * taken / all_:.1f} % |")
    for line, count in missed(found).items():
        if line.file in asked.missed:
            print(f"{line.file}:{line.number}: {count}: {line.text}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
