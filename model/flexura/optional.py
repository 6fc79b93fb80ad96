"""Packages that only some need: imported when first used, and missed in one sentence."""

from __future__ import annotations

import importlib
from typing import Any

from .errors import FlexuraError


class Missing(FlexuraError):
    """A package of an extra is not installed."""


class Optional:
    """A module that is imported when an attribute of it is first asked for.

    Args:
        name: the module, for example "matplotlib.pyplot".
        extra: the extra of this distribution that brings it.
    """

    def __init__(self, name: str, extra: str) -> None:
        self._name, self._extra = name, extra

    def __getattr__(self, attribute: str) -> Any:
        """The module's attribute. Raises Missing."""
        return getattr(load(self._name, self._extra), attribute)


def load(name: str, extra: str) -> Any:
    """Import a module of an extra. Raises Missing, with the command that brings it."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != name.partition(".")[0]:
            raise
        package = name.partition(".")[0]
        raise Missing(f'{package} is not installed; type: pip install "flexura[{extra}]"') from None
