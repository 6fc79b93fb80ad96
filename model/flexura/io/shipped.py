"""Files that come with flexura, found by name: robots, manoeuvres, controllers, rigs.

An installed package has them in folders of its own. A checkout has them beside the package, and the
rigs in `firmware`.
"""

from __future__ import annotations

import difflib
import logging
import os
import re
from pathlib import Path

from ..errors import InputError

PACKAGE = Path(__file__).resolve().parents[1]
KINDS = {"robots": "robot", "manoeuvres": "manoeuvre", "controllers": "gains", "rigs": "rig"}


def shipped_files(kind: str) -> dict[str, Path]:
    """The files of a kind by their names, which are the files' own without `.toml`.

    Args:
        kind: a key of `KINDS`.

    Returns:
        Paths by name.
    """
    beside = PACKAGE.parent / kind
    if kind == "rigs":
        beside = PACKAGE.parents[1] / "firmware"
    folder = next((f for f in (PACKAGE / kind, beside) if f.is_dir()), beside)
    pattern = "rig*.toml" if kind == "rigs" else "*.toml"
    return {path.stem: path for path in sorted(folder.glob(pattern))}


_log = logging.getLogger("flexura")


def find(path: str | os.PathLike[str], kind: str) -> Path:
    """The file at a path or, where none is there, the shipped one of this name.

    Args:
        path: a path, or a name without folder and suffix, for example "rig".
        kind: a key of `KINDS`.

    Returns:
        The file's path.

    Raises:
        InputError: neither; names that are near are said.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError("expected a path or a name", key="path", value=path)
    given = Path(path)
    name = os.fspath(path)
    known = (
        shipped_files(kind) if re.fullmatch(r"[\w-]+", name) and not os.path.isfile(path) else None
    )
    if known is None or name in known:
        found = given if known is None else known[name]
        _log.debug("%s file %s", KINDS[kind], found)
        return found
    near = difflib.get_close_matches(name, known, 3, 0.4)
    said = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(known) or 'none'}"
    expected = f"no such file, and no {KINDS[kind]} file of this name comes with flexura; {said}"
    raise InputError(expected, file=name)
