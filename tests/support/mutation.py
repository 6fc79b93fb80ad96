"""Runs the tests of the board's library, or of the host's protocol, against mutants of them.

    python tests/support/mutation.py [--part K/N] [NAME...]

NAME is safety, protocol, control, rig or link; without it all. K/N takes every N-th mutant from the
K-th on, so that one long run may be done in parts. Each mutant that no test notices is printed; the
last line has the counts. What is equivalent to the original is listed in equivalent.toml.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import tomllib
from functools import partial
from pathlib import Path
from typing import NamedTuple

import mutants
from board_library import FIRMWARE, HERE, ROOT

LIST = HERE / "equivalent.toml"
LIB = FIRMWARE / "lib"
# Of processor time for one program, and for a file of the host's tests; what needs more hangs.
SECONDS, HOST_SECONDS = 20, 400

# What is mutated, below lib/. Of a header all sources and programs are compiled again.
BOARD = {
    "safety": ["safety/src/fault_monitor.cpp"],
    "protocol": ["protocol/src/frame.cpp", "session/src/session.cpp"],
    "control": [
        "control/src/pid.h",
        "control/src/numbers.h",
        "control/src/filter.h",
        "control/src/disturbance_observer.h",
    ],
    "rig": ["rig/src/rig.cpp", "rig/src/commands.cpp"],
}
PROTOCOL = ROOT / "analysis/flexlab/board/protocol"
HOST = {
    "link": {
        "frames.py": ["test_board_frames.py", "test_board_link.py"],
        "round_trip.py": ["test_round_trip.py"],
        "session.py": ["test_session.py", "test_board_link.py", "test_commissioning.py"],
    }
}
NAMES = [*BOARD, *HOST]

UNIT = sorted(path for path in FIRMWARE.glob("test/test_*/") if path.name != "test_interrupts")
MAINS = {
    **{p.name: [f"-I{FIRMWARE / 'test'}", str(p / "test_main.cpp")] for p in UNIT},
    "frames": [str(HERE / "fuzz_frames.cpp")],
    "replay": ["-DREPLAY", str(HERE / "fuzz_session.cpp")],
}
ARGUMENTS = {
    "frames": ["100000", "7"],
    "replay": [str(path) for path in sorted((HERE / "corpus").iterdir())],
}
# Undefined behaviour ends the program: of a mutant it is noticed, too. A message's last array has
# a length as well.
TRAPS = ["-fsanitize=undefined,bounds-strict", "-fsanitize-undefined-trap-on-error"]
CXX = ["g++", "-std=gnu++14", "-O0", "-w", *TRAPS]


class Outcome(NamedTuple):
    """What became of the mutants of a name."""

    killed: int
    equivalent: int
    survived: list[mutants.Mutant]

    @property
    def score(self) -> float:
        """The share of those that are not listed as equivalent that a test noticed."""
        return self.killed / max(1, self.killed + len(self.survived))


def passes(command: list[str], seconds: int = SECONDS, **more: object) -> bool:
    """Whether a program ends well within its time."""

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    try:
        done = subprocess.run(command, preexec_fn=limited, timeout=1800, **quiet, **more)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


class Board:
    """A copy of the library, compiled once. A mutant needs one source anew, or all of them."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.lib = folder, folder / "lib"
        shutil.copytree(LIB, self.lib)
        self.includes = [f"-I{path}" for path in sorted(self.lib.glob("*/src"))]
        self.sources = sorted(self.lib.glob("*/src/*.cpp"))
        self.order = list(MAINS)
        self.made: dict[str, Path] = {}  # objects of the original
        assert self.notices(None) is None, "without a mutant all must pass"

    def compiled(self, made: dict[str, Path], name: str, *arguments: str) -> str:
        """An object of the original, or of a mutant that changes it."""
        if name not in made:
            kind = "original" if made is self.made else "mutant"
            out = self.folder / f"{Path(name).stem}_{kind}.o"
            command = [*CXX, *self.includes, *arguments, "-c", "-o", str(out)]
            subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
            made[name] = out
        return str(made[name])

    def notices(self, mutant: mutants.Mutant | None) -> str | None:
        """The name of the first program that fails; None: no program notices the mutant."""
        if not mutant:
            return self.fails(self.made)
        place = self.folder / Path(mutant.file).relative_to("firmware")
        original = place.read_text(encoding="utf-8")
        place.write_text(mutant.apply(original), encoding="utf-8")
        kept = {} if place.suffix == ".h" else self.made
        try:
            return self.fails({name: out for name, out in kept.items() if name != str(place)})
        except subprocess.CalledProcessError:
            return "the compiler"
        finally:
            place.write_text(original, encoding="utf-8")

    def fails(self, made: dict[str, Path]) -> str | None:
        """The first program that fails, with objects that are there and others made now."""
        objects = [self.compiled(made, str(source), str(source)) for source in self.sources]
        for name in self.order:
            program = str(self.folder / name)
            main = self.compiled(made, name, *MAINS[name])
            subprocess.run(["g++", main, *objects, "-o", program], check=True)
            if not passes([program, *ARGUMENTS.get(name, [])]):
                self.order.remove(name)
                self.order.insert(0, name)  # the next mutant is often noticed by the same
                return name
        return None


def host(folder: Path, mutant: mutants.Mutant | None, tests: list[str]) -> str | None:
    """The first test file of the host that fails with this mutant, or without one."""
    copy = folder / "analysis"
    if not copy.exists():
        shutil.copytree(ROOT / "analysis", copy)
        (folder / "firmware").symlink_to(FIRMWARE)  # flexlab looks for it beside itself
    place = folder / mutant.file if mutant else copy / "flexlab/__init__.py"
    original = place.read_text(encoding="utf-8")
    surroundings = os.environ | {
        "PYTHONPATH": f"{copy}:{ROOT / 'model'}",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    pytest = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "--no-header"]
    chosen = ["-m", "not slow and not long", "--timeout", "60"]
    place.write_text(mutant.apply(original) if mutant else original, encoding="utf-8")
    try:
        for name in tests:
            command = [*pytest, *chosen, str(HERE / name)]
            if not passes(command, HOST_SECONDS, env=surroundings, cwd=ROOT):
                return name
    finally:
        place.write_text(original, encoding="utf-8")
    return None


def equivalent() -> dict[str, str]:
    """The mutants that are the original in other words, by name, with the reason."""
    listed = tomllib.loads(LIST.read_text(encoding="utf-8"))["mutant"]
    return {one["name"]: one["reason"] for one in listed}


def run(name: str, part: tuple[int, int] = (1, 1), say=print) -> Outcome:
    """Try the mutants of a name, or every N-th of them from the K-th on."""
    k, n = part
    known, killed, same, survived, todo = equivalent(), 0, 0, [], []
    with tempfile.TemporaryDirectory(prefix="flexura-mutants-") as made:
        folder = Path(made)
        if name in BOARD:
            board = Board(folder)
            for file in BOARD[name]:
                todo += [(mutant, board.notices) for mutant in mutants.of(LIB / file, ROOT)]
        else:
            for file, tests in HOST[name].items():
                notices = partial(host, folder, tests=tests)
                assert notices(None) is None, "without a mutant all must pass"
                todo += [(mutant, notices) for mutant in mutants.of(PROTOCOL / file, ROOT)]
        for mutant, notices in todo[k - 1 :: n]:
            if mutant.name in known:
                same += 1
                continue
            by = notices(mutant)
            if by is None:
                survived.append(mutant)
                say(f"line {mutant.line}: {mutant.name}")
            else:
                killed += 1
    return Outcome(killed, same, survived)


def main(argv: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", choices=[*NAMES, []])
    parser.add_argument("--part", default="1/1")
    chosen = parser.parse_args(argv)
    k, n = map(int, chosen.part.split("/"))
    for name in chosen.names or NAMES:
        done = run(name, (k, n), lambda text: print(text, flush=True))
        print(
            f"{name}: {done.killed} killed, {len(done.survived)} survived, "
            f"{done.equivalent} equivalent: {100 * done.score:.1f} %",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
