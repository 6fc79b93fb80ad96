"""The command `flexura` of this checkout in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def environment(columns: int = 120) -> dict[str, str]:
    """This one, with the checkout's packages, and tables so many columns wide."""
    paths = os.pathsep.join(map(str, (ROOT / "model", ROOT / "analysis")))
    return os.environ | {"PYTHONPATH": paths, "COLUMNS": str(columns)}


def command_line(*arguments: object) -> list[str]:
    """`flexura ARGUMENTS` as a list of words."""
    return [sys.executable, "-m", "flexlab.cli.app", *map(str, arguments)]


def flexura(
    *arguments: object, cwd: Path, columns: int = 120, timeout: float = 250
) -> subprocess.CompletedProcess[str]:
    """Run `flexura ARGUMENTS` in a folder to its end, without a person to ask."""
    return subprocess.run(
        command_line(*arguments),
        cwd=cwd,
        env=environment(columns),
        capture_output=True,
        text=True,
        timeout=timeout,
        stdin=subprocess.DEVNULL,
    )
