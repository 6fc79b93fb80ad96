"""Builds a wheel that needs no compiler to be installed, and names it.

    python tools/wheel.py [folder]        by default dist

On Linux the wheel gets the manylinux tag that this machine's libraries allow: on an older system it
is installed on more machines. Of the platforms in pyproject.toml's [tool.cibuildwheel] only Linux
on x86-64 has been tried.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def build(folder: Path) -> Path:
    """The wheel of this checkout for this Python, in `folder`."""
    raw = folder / "unrepaired"
    shutil.rmtree(raw, ignore_errors=True)
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--disable-pip-version-check"]
    run([*pip, "--no-deps", "--no-build-isolation", "-w", str(raw), str(ROOT)])
    (wheel,) = raw.glob("*.whl")
    if sys.platform == "linux":
        repaired = raw / "repaired"
        programs = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        auditwheel = [sys.executable, "-m", "auditwheel", "repair", "--strip"]
        run([*auditwheel, "-w", str(repaired), str(wheel)], env=programs)
        (wheel,) = repaired.glob("*.whl")
    for old in folder.glob("flexura-*.whl"):
        old.unlink()
    out = Path(shutil.move(wheel, folder))
    shutil.rmtree(raw)
    return out


def run(command: list[str], env: dict[str, str] | None = None) -> None:
    """Run a command; its output is shown only where it fails."""
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{done.stdout}{done.stderr}\nthis failed: {' '.join(command)}")


if __name__ == "__main__":
    print(build(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "dist").resolve()))
