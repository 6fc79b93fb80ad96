"""The version of the project's file formats: `format = 1` in robot, manoeuvre and rig files, and in
the metadata of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InputError

FORMAT = 1  # the one that is written


def check_format(tables: Mapping[str, Any], file: str = "") -> None:
    """Refuse tables of a format that is not known; an absent key is the present one.

    Args:
        tables: of the file.
        file: its name, for the message.

    Raises:
        InputError: not a whole number from 1 to `FORMAT`: a newer flexura wrote the file.
    """
    value = tables.get("format", FORMAT)
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        expected = f"expected a whole number from 1 to {FORMAT}"
        raise InputError(expected, key="format", value=value, file=file)
    if value > FORMAT:
        newer = "a newer flexura wrote this file; type: pip install --upgrade flexura"
        raise InputError(
            f"{newer}; known here: up to {FORMAT}", key="format", value=value, file=file
        )
