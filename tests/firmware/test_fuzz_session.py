"""The board's receiver, session and control tick under libFuzzer, with sanitizers. The corpus is in
the folder `corpus`: each input reaches what no other does."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from board_library import HERE, INCLUDES, SOURCES, compiled

CORPUS = HERE / "corpus"
PROGRAM = str(HERE / "fuzz_session.cpp")
needs_clang = pytest.mark.skipif(
    not shutil.which("clang++") and not os.environ.get("REQUIRE_CLANG"),
    reason="no clang++ on this machine",
)


def fuzzer(folder: Path) -> Path:
    """The program with libFuzzer, or a skip where clang comes without it."""
    sanitizers = ["-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all"]
    out = folder / "fuzz"
    command = ["clang++", "-std=gnu++14", "-g", "-O1", *sanitizers, *INCLUDES, PROGRAM, *SOURCES]
    done = subprocess.run([*command, "-o", out], capture_output=True, text=True)
    if "libclang_rt.fuzzer" in done.stderr and not os.environ.get("REQUIRE_CLANG"):
        pytest.skip("clang is here without libFuzzer")
    assert done.returncode == 0, done.stderr[-2000:]
    return out


def fuzz(folder: Path, seconds: int, seed: int) -> int:
    """How many inputs were tried from the corpus on; what was found is in folder/found."""
    found = folder / "found"
    found.mkdir()
    options = [f"-max_total_time={seconds}", f"-seed={seed}", "-max_len=600", "-verbosity=0"]
    command = [fuzzer(folder), *options, "-print_final_stats=1", found, CORPUS]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=seconds + 240
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return int(re.search(r"number_of_executed_units: (\d+)", done.stderr)[1])


def test_the_corpus_as_it_is(tmp_path):
    """With g++ and its sanitizers, so without clang too."""
    names = sorted(map(str, CORPUS.iterdir()))
    options = ["-std=gnu++14", "-O1", "-DREPLAY", "-fsanitize=address,undefined", PROGRAM]
    program = compiled(tmp_path / "replay", *options)
    done = subprocess.run([program, *names], capture_output=True, text=True)
    assert len(names) > 80
    assert (done.returncode, done.stdout) == (0, f"{len(names)} inputs\n"), done.stderr[-3000:]


@needs_clang
def test_five_seconds_of_new_inputs(tmp_path):
    assert fuzz(tmp_path, 5, seed=1) > len(list(CORPUS.iterdir()))


@needs_clang
@pytest.mark.long
@pytest.mark.timeout(4000)
def test_an_hour_of_new_inputs(tmp_path, capsys):
    """What it found goes into the corpus by libFuzzer's own -merge=1, if it reaches new edges."""
    tried = fuzz(tmp_path, 3600, seed=int(os.environ.get("SEED", "2")))
    with capsys.disabled():
        print(f"{tried} inputs, {len(list((tmp_path / 'found').iterdir()))} of them new")
    assert tried > 100_000
