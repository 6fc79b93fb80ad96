"""Builds a wheel that needs no compiler to be installed, and names it.

    python tools/wheel.py [folder]        by default dist

The same sources give the same bytes: files carry the time of the last commit, or SOURCE_DATE_EPOCH,
and no path of the machine. On Linux the wheel gets the manylinux tag that this machine's libraries
allow: on an older system it is installed on more machines. Of the platforms in pyproject.toml's
[tool.cibuildwheel] only Linux on x86-64 has been tried.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

fcntl: Any = None  # of Unix
with contextlib.suppress(ImportError):
    import fcntl

ROOT = Path(__file__).resolve().parents[1]


def moment(root: Path) -> str:
    """SOURCE_DATE_EPOCH, or the time of the last commit, or the beginning of 2020 [s]."""
    command = ["git", "-C", str(root), "log", "-1", "--format=%ct"]
    try:
        said = subprocess.run(command, capture_output=True, text=True).stdout.strip()
    except OSError:
        said = ""
    return os.environ.get("SOURCE_DATE_EPOCH") or said or "1577836800"


def build(folder: Path, root: Path = ROOT) -> Path:
    """The wheel of a checkout, by default this one, for this Python, in `folder`."""
    raw = folder / "unrepaired"
    shutil.rmtree(raw, ignore_errors=True)
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--disable-pip-version-check"]
    dated = os.environ | {"SOURCE_DATE_EPOCH": moment(root)}
    with open(root / "pyproject.toml") as lock:  # one build of a checkout at a time
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        run([*pip, "--no-deps", "--no-build-isolation", "-w", str(raw), str(root)], env=dated)
    (wheel,) = raw.glob("*.whl")
    if sys.platform == "linux":
        repaired = raw / "repaired"
        programs = dated | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        auditwheel = [sys.executable, "-m", "auditwheel", "repair", "--strip"]
        run([*auditwheel, "-w", str(repaired), str(wheel)], env=programs)
        (wheel,) = repaired.glob("*.whl")
    for old in folder.glob("flexura-*.whl"):
        old.unlink()
    out = folder / wheel.name
    without_rights(wheel, out)
    shutil.rmtree(raw)
    return out


def without_rights(wheel: Path, out: Path) -> None:
    """The same wheel; the rights of its files are the usual ones, not those of this checkout."""
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for about in old.infolist():
            made = zipfile.ZipInfo(about.filename, about.date_time)
            made.create_system = 3  # Unix
            made.external_attr = 0o100644 << 16
            made.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(made, old.read(about))


def run(command: list[str], env: dict[str, str] | None = None) -> None:
    """Run a command; its output is shown only where it fails."""
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{done.stdout}{done.stderr}\nthis failed: {' '.join(command)}")


if __name__ == "__main__":
    print(build(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "dist").resolve()))
