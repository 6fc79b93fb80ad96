"""Which branches of model/core its tests take.

    python tests/support/core_coverage.py FOLDER [--missed FILE...]

It builds the core and its module for gcov in FOLDER (minutes, without optimisation), and runs the
C++ tests and those of PYTHON there. It prints one row a file. --missed prints the lines of these
files with branches that no test took. branch_coverage.py says what a branch is.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import cmake
import ninja

from branch_coverage import Line, branches, missed
from flexura import core

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "model" / "core"
CMAKE, NINJA = Path(cmake.CMAKE_BIN_DIR) / "cmake", Path(ninja.BIN_DIR) / "ninja"

# Tests in Python that take what the C++ tests do not: the bindings, and runs of whole robots.
PYTHON = [
    "tests/model/control/test_backlash.py",
    "tests/model/control/test_controller.py",
    "tests/model/control/test_gain_sweep_under_loads.py",
    "tests/model/control/test_references.py",
    "tests/model/core/test_bindings.py",
    "tests/model/link/test_pieces.py",
    "tests/model/population/test_acting.py",
    "tests/model/population/test_population.py",
    "tests/model/simulation/test_loads.py",
    "tests/model/simulation/test_method_choice.py",
    "tests/model/simulation/test_run_ends.py",
    "tests/model/system/test_core.py",
    "tests/model/system/test_one_link.py",
    "tests/model/system/test_sleeves.py",
    "tests/model/system/test_statespace.py",
    "tests/model/system/test_statics.py",
    "tests/model/test_identities.py",
    "tests/model/test_masses_and_springs.py",
    "tests/model/test_massless_and_soft_links.py",
    "tests/model/test_transmissions.py",
]
# It has another program go on, which loads the core as it was built for use: that is refused.
NOT = "tests/model/population/test_population.py::test_a_stopped_population_goes_on_where_it_was"


def measured(folder: Path, jobs: int = 1) -> dict[Line, list[int]]:
    """How often each branch of the core was taken by its tests, built and run in a folder."""
    copy = folder / "python"
    for old in folder.rglob("*.gcda"):
        old.unlink()
    settings = {
        "FLEXURA_COVERAGE": "ON",
        "FLEXURA_MODULE": "ON",
        "FLEXURA_LEVEL": "" if core.level == "plain" else core.level,
        "CMAKE_BUILD_TYPE": "Debug",
        "CMAKE_MAKE_PROGRAM": NINJA,
        "Python_EXECUTABLE": sys.executable,
    }
    options = [f"-D{name}={value}" for name, value in settings.items()]
    run(CMAKE, "-S", ROOT, "-B", folder, "-G", "Ninja", *options)
    run(CMAKE, "--build", folder, "--parallel", jobs, "--target", "core_tests")
    run(
        CMAKE,
        "--build",
        folder,
        "--parallel",
        jobs,
        "--target",
        core.BUILDS[core.level],
        "_processor",
    )
    run(CMAKE.with_name("ctest"), "--test-dir", folder, "--output-on-failure")
    shutil.rmtree(copy, ignore_errors=True)
    leave = shutil.ignore_patterns("*.so", "__pycache__")
    shutil.copytree(ROOT / "model", copy, ignore=leave)
    for made in (folder / "model/core/bind").glob("_*.so"):
        shutil.copy(made, copy / "flexura")
    paths = os.pathsep.join(map(str, (copy, ROOT / "analysis")))
    pytest = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--timeout", "3600"]
    chosen = ["-m", "not slow and not long", "--deselect", NOT]
    run(*pytest, *chosen, *PYTHON, PYTHONPATH=paths, FLEXURA_CORE=core.level)
    return branches(folder, CORE)


def run(*command: object, **environment: str) -> None:
    """A command that must succeed, in the checkout."""
    subprocess.run([*map(str, command)], cwd=ROOT, env=os.environ | environment, check=True)


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
    parser.add_argument("--missed", nargs="+", default=[], metavar="FILE")
    asked = parser.parse_args()
    found = measured(asked.folder.resolve())
    rows = table(found)
    for file, taken, all_ in rows:
        print(f"| {file} | {taken} | {all_} | {100 * taken / all_:.0f} % |")
    taken, all_ = (sum(row[k] for row in rows) for k in (1, 2))
    print(f"| model/core | {taken} | {all_} | {100 * taken / all_:.1f} % |")
    for line, count in missed(found).items():
        if line.file in asked.missed:
            print(f"{line.file}:{line.number}: {line.function}: {count}: {line.text}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
