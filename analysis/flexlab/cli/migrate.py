"""The command `flexura migrate`: files of an older flexura with the keys of today; comments and
layout stay."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx
from flexura.io import check_format, read_toml, replaced, write_bytes
from flexura.robot import OldKey, renamed

from .options import Json
from .output import message, print_results

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\]#]*?)\s*\]")
_TOKENS = re.compile(  # texts and comments are left alone
    r'"(?:\\.|[^"\\])*"(?!\s*[=.])|\'[^\']*\'(?!\s*[=.])|#.*'
    r'|(?<![\w-])(?P<quote>["\']?)(?P<key>[A-Za-z_]+)(?P=quote)(?=\s*=)'
)


def migrate(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="robot, manoeuvre, rig or gains files (TOML)"),
    ],
    check: Annotated[
        bool,
        typer.Option("--check", help="write nothing; status 1 if a file has old keys"),
    ] = False,
    json: Json = False,
) -> None:
    """Rename old keys of files.

    Comments and layout stay. Either all files are written or none.

    \b
    Example: flexura migrate my-arm.toml
    """
    done = [(file, *rewritten(file)) for file in files]
    if not check:
        _write_all({file: text.encode() for file, text, old in done if old})
    found = {
        str(file): [{"key": each.path, "new": each.new} for each in old] for file, _, old in done
    }
    if json:
        print_results(True, lambda: None, lambda: found)
    for file, _, old in done:
        lines = [f"{file}: {each.path} is now {each.new}" for each in old]
        message(json, *lines or [f"{file}: nothing to rename"])
    if check and any(old for _, _, old in done):
        raise typer.Exit(1)


def _write_all(new: dict[Path, bytes]) -> None:
    """Write all files or none: no file takes its name before all of them are on the disk."""
    old = {file: file.read_bytes() for file in new}
    try:
        with ExitStack() as drafts:
            for file, data in new.items():
                drafts.enter_context(replaced(file)).write_bytes(data)
    except BaseException:
        for file in new:
            if file.read_bytes() != old[file]:
                write_bytes(file, old[file])
        raise


def rewritten(file: Path) -> tuple[str, list[OldKey]]:
    """The text of a file with the keys of today, and which ones were old.

    Raises:
        InputError: the file is wrong, or its layout is one that cannot be edited in lines.
    """
    data = read_toml(file)
    check_format(data, str(file))
    text = file.read_bytes().decode()
    wanted, old = renamed(data)
    if "link" not in data:
        return text, []
    fx.Robot.from_dict(wanted, file=str(file))
    if not old:
        return text, []
    new = "".join(_lines(text, old))
    if _tables(new) != wanted:
        names = ", ".join(f"{each.path} to {each.new}" for each in old)
        raise fx.InputError(f"expected one key a line; rename by hand: {names}", file=str(file))
    return new, old


def _lines(text: str, old: list[OldKey]) -> Iterator[str]:
    """The lines of a robot file with old keys renamed, link by link."""
    link = 0
    for line in text.splitlines(keepends=True):
        header = _HEADER.match(line)
        if header and header[1] == "[[" and header[2].strip("\"'") == "link":
            link += 1
        yield line if header else _line(line, {e.old: e.new for e in old if e.link == link})


def _line(line: str, names: dict[str, str]) -> str:
    """A line with its keys renamed; a comment at its end stays in its column where it can."""

    def new(found: re.Match[str]) -> str:
        key = names.get(found["key"])
        return f"{found['quote']}{key}{found['quote']}" if key else found[0]

    out = _TOKENS.sub(new, line)
    comment = next((m.start() for m in _TOKENS.finditer(out) if m[0].startswith("#")), None)
    if comment is None or out == line:
        return out
    code = out[:comment].rstrip()
    gap = min(comment - len(code), max(1, comment - len(code) - (len(out) - len(line))))
    return code + " " * gap + out[comment:]


def _tables(text: str) -> dict[str, Any] | None:
    """The tables of a text, None if it is not TOML."""
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))
    except tomllib.TOMLDecodeError:
        return None
