"""Every branch of firmware/lib is taken by the unit tests and the fuzzer's corpus, or explained in
branches.toml."""

import shutil
import subprocess

import pytest

from board_library import FIRMWARE, HERE, INCLUDES, SOURCES
from branch_coverage import branches, explained, untaken

FLAGS = ["-std=gnu++14", "-O0", "--coverage", "-fno-exceptions", "-fprofile-abs-path", *INCLUDES]
UNIT = sorted(path for path in FIRMWARE.glob("test/test_*/") if path.name != "test_interrupts")
TESTS = {
    **{p.name: [f"-I{FIRMWARE / 'test'}", str(p / "test_main.cpp")] for p in UNIT},
    "replay": ["-DREPLAY", str(HERE / "fuzz_session.cpp")],
    "frames": [str(HERE / "fuzz_frames.cpp")],
}
ARGUMENTS = {
    "replay": [str(path) for path in sorted((HERE / "corpus").iterdir())],
    "frames": ["300000", "1"],
}


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("gcov"), reason="no gcov on this machine")
def test_every_branch_is_taken_or_explained(tmp_path, capsys):
    """g++ without optimization and without exceptions, so that a branch is one of the source."""
    objects = []
    for source in SOURCES:
        objects.append(str(tmp_path / f"{len(objects)}.o"))
        subprocess.run(["g++", *FLAGS, "-c", source, "-o", objects[-1]], check=True)
    for name, arguments in TESTS.items():
        main, program = str(tmp_path / f"{name}.o"), str(tmp_path / name)
        subprocess.run(["g++", *FLAGS, *arguments, "-c", "-o", main], check=True)
        subprocess.run(["g++", "--coverage", main, *objects, "-o", program], check=True)
        subprocess.run([program, *ARGUMENTS.get(name, [])], check=True, stdout=subprocess.DEVNULL)
    found = branches(tmp_path, FIRMWARE / "lib")
    total = sum(map(len, found.values()))
    missed = untaken(found)
    with capsys.disabled():
        print(f"{total - sum(missed.values())} of {total} branches of firmware/lib taken")
    assert missed == explained(HERE / "branches.toml")
    assert total > 700
