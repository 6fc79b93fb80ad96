"""The command `flexura new`."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import Annotated

import typer

from flexura.io import write_text

from .options import ForceFile, Json
from .output import message, print_results
from .results import file_result

TEMPLATE = Path(__file__).with_name("new_robot.toml")


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="the robot file to write")],
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Write a commented robot file to begin with.

    It has two links, and every common key with its meaning.

    \b
    Example: flexura new my-arm.toml
    """
    named = f"name = {json_.dumps(file.stem[:200], ensure_ascii=False)}"
    with file_result(file, "FILE", force=force, suffix=".toml") as draft:
        write_text(draft, TEMPLATE.read_text("utf-8").replace('name = "my robot"', named, 1))
    if json:
        print_results(True, lambda: None, lambda: {"robot": str(file)})
    message(
        json,
        f"wrote {file}",
        "next:",
        f"  flexura frequencies {file}",
        f"  flexura simulate {file}",
    )
