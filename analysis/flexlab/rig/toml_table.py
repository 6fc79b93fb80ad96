"""The base of all tables of a rig file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Table(BaseModel):
    """A frozen table without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def above(unit: str, what: str, most: float) -> Any:
    """A field for a number above 0, at most `most`."""
    return Field(gt=0, le=most, description=f"{what} in {unit}, above 0 and at most {most:g}")


def from_zero(unit: str, what: str, most: float, default: float | None = None) -> Any:
    """A field for a number from 0 to `most`; required if there is no default."""
    said = f"{what} in {unit}, from 0 to {most:g}"
    if default is None:
        return Field(ge=0, le=most, description=said)
    return Field(float(default), ge=0, le=most, description=said)


def within(what: str, most: float, default: Any = ...) -> Any:
    """A field for a number of either sign, at most `most` in size; without a default required."""
    return Field(default, ge=-most, le=most, description=f"{what}, at most {most:g} in size")


def named_file(file: Path, named: str) -> str | Path:
    """The file that a rig file names: a path from its folder or, where none is there, a shipped
    name."""
    path = file.parent / named
    return path if path.is_file() or Path(named).suffix else named
