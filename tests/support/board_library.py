"""The firmware's portable library compiled for this computer, with programs of the tests."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE, HERE = ROOT / "firmware", ROOT / "tests" / "firmware"
SOURCES = [str(path) for path in sorted(FIRMWARE.glob("lib/*/src/*.cpp"))]
INCLUDES = [f"-I{path}" for path in sorted(FIRMWARE.glob("lib/*/src"))]
STRICT = ["-Wall", "-Wextra", "-Werror", "-g", "-fno-sanitize-recover=all"]


def compiled(out: Path, *arguments: str) -> Path:
    """The library with what the arguments name, by g++."""
    assert SOURCES and shutil.which("g++"), "g++ is missing: apt-get install g++"
    subprocess.run(["g++", *STRICT, *INCLUDES, *arguments, *SOURCES, "-o", str(out)], check=True)
    return out
