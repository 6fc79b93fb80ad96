"""What must hold of a command that was disturbed, and what was computed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import flexura as fx
from flexura.io import DRAFT, read_toml

from .calls import COMMANDS, Command, Place, files
from .programs import Ended


def ready(place: Place, name: str) -> tuple[Command, Path]:
    """A command, and a fresh working folder with what it needs."""
    return COMMANDS[name], place.fresh(COMMANDS[name])


def drafts(work: Path) -> list[str]:
    """What no command may leave when it ends by itself."""
    return [name for name in files(work) if DRAFT in name]


def ended_well(ended: Ended, work: Path, *, killed: bool = False) -> None:
    """A sentence and a status; nothing half-written."""
    assert "Traceback" not in ended.err and "Traceback" not in ended.out, ended.err
    if not killed:
        assert ended.status in (0, 1, 2, 130), (ended.status, ended.err)
        table = "what it costs" in ended.out  # doctor's own, with status 1
        assert ended.status == 0 or ended.err.strip() or table, "no sentence"
        assert not drafts(work), drafts(work)
    readable(work)


def readable(work: Path) -> None:
    """Every file that is kept is whole."""
    for path in sorted(work.rglob("*.parquet")):
        if DRAFT in str(path) or path.is_symlink():
            continue
        if path.name.startswith("run") or path.name == "out.parquet":
            fx.Run.read(path)
    for path in work.rglob("population.json"):
        list(fx.Population.read(path.parent))
    for path in work.rglob("*.toml"):
        if DRAFT not in path.name:
            read_toml(path)
    for path in work.rglob("*.rrd"):
        assert DRAFT in str(path) or b"RRF2FOOT" in path.read_bytes()[-16:]


def numbers(out: Path) -> dict[tuple[str, str], Any]:
    """What was computed: all runs and chunks below a result, and the gains."""
    found: dict[tuple[str, str], Any] = {}
    for path in sorted(out.rglob("*")) if out.is_dir() else [out]:
        if DRAFT in str(path):
            continue
        if path.name in ("run.parquet", "out.parquet"):
            run = fx.Run.read(path)
            found[path.name, path.parent.name] = {k: v.tobytes() for k, v in run.items()}
        elif path.name.startswith("chunk-") or path.suffix == ".toml":
            found[path.name, path.parent.name] = path.read_bytes()
    return found
