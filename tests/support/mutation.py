"""Runs the tests of the board's library, or of the host's protocol, against mutants of them.

    python tests/support/mutation.py [--part K/N] [--out FILE] [NAME...]

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
from pathlib import Path
from typing import NamedTuple

import mutants
from board_library import FIRMWARE, HERE, INCLUDES, ROOT, SOURCES

LIST = HERE / "equivalent.toml"
LIB = FIRMWARE / "lib"
# Of processor time for one program, and for a file of the host's tests; what needs more hangs.
SECONDS, HOST_SECONDS = 20, 400

# What is mutated, and which source is compiled again for it.
BOARD = {
    "safety": {"safety/src/fault_monitor.cpp": "safety/src/fault_monitor.cpp"},
    "protocol": {
        "protocol/src/frame.cpp": "protocol/src/frame.cpp",
        "session/src/session.cpp": "session/src/session.cpp",
    },
    "control": {
        "control/src/pid.h": "control/src/pid.cpp",
        "control/src/numbers.h": "control/src/pid.cpp",
        "control/src/filter.h": "rig/src/rig.cpp",
    },
    "rig": {
        "rig/src/rig.cpp": "rig/src/rig.cpp",
        "rig/src/commands.cpp": "rig/src/commands.cpp",
    },
}
PROTOCOL = ROOT / "analysis/flexlab/board/protocol"
HOST = {
    "link": {
        "frames.py": ["test_board_frames.py", "test_board_link.py"],
        "round_trip.py": ["test_round_trip.py"],
        "session.py": ["test_board_link.py", "test_round_trip.py", "test_commissioning.py"],
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
# Undefined behaviour ends the program: of a mutant it is noticed, too.
TRAPS = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
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
    """The library compiled once; a mutant needs one source anew and the programs linked."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.objects = {source: self.compiled(Path(source)) for source in SOURCES}
        self.mains, self.order = {}, list(MAINS)
        for name, arguments in MAINS.items():
            self.mains[name] = folder / f"main_{name}.o"
            command = [*CXX, *INCLUDES, *arguments, "-c", "-o", str(self.mains[name])]
            subprocess.run(command, check=True)
        assert self.notices(None, LIB / "rig/src/rig.cpp") is None, "without a mutant all must pass"

    def compiled(self, source: Path, *before: str, out: str = "") -> Path:
        made = self.folder / (out or f"{source.stem}.o")
        command = [*CXX, *before, *INCLUDES, f"-I{source.parent}", "-c", str(source)]
        subprocess.run([*command, "-o", str(made)], check=True, stderr=subprocess.DEVNULL)
        return made

    def notices(self, mutant: mutants.Mutant | None, source: Path) -> str | None:
        """The name of the first program that fails; None: no program notices the mutant. Of a
        header the unit tests are compiled again too: they have objects of its classes."""
        mutated, mains = self.objects[str(source)], dict(self.mains)
        if mutant:
            place = self.folder / "mutant"
            shutil.rmtree(place, ignore_errors=True)
            # With all that stands beside it: a header is looked for beside the one that names it.
            shutil.copytree((ROOT / mutant.file).parent, place)
            text = (ROOT / mutant.file).read_text(encoding="utf-8")
            (place / Path(mutant.file).name).write_text(mutant.apply(text), encoding="utf-8")
            own = place / source.name
            if not own.exists():
                shutil.copy(source, own)
            try:
                mutated = self.compiled(own, f"-I{place}", out="mutant.o")
                for name in ("test_lib", "test_refusals") if mutant.file.endswith(".h") else ():
                    mains[name] = place / f"{name}.o"
                    before = [*CXX, f"-I{place}", *INCLUDES, *MAINS[name], "-c"]
                    subprocess.run([*before, "-o", str(mains[name])], check=True)
            except subprocess.CalledProcessError:
                return "the compiler"
        others = [str(o) for s, o in self.objects.items() if s != str(source)]
        for name in self.order:
            program = str(self.folder / name)
            linked = ["g++", str(mutated), str(mains[name]), *others, "-o", program]
            subprocess.run(linked, check=True)
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
    known, killed, same, survived = equivalent(), 0, 0, []
    with tempfile.TemporaryDirectory(prefix="flexura-mutants-") as made:
        folder = Path(made)
        board = Board(folder) if name in BOARD else None
        todo = []
        for file, again in (BOARD | HOST)[name].items():
            path = (LIB if board else PROTOCOL) / file
            todo += [(mutant, again) for mutant in mutants.of(path, ROOT)]
            if not board:
                assert host(folder, None, list(again)) is None, "without a mutant all must pass"
        for mutant, again in todo[k - 1 :: n]:
            if mutant.name in known:
                same += 1
                continue
            if board:
                by = board.notices(mutant, LIB / str(again))
            else:
                by = host(folder, mutant, list(again))
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
