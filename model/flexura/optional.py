"""Packages that only some need: imported when first used, and missed in one sentence."""

from __future__ import annotations

import importlib
import importlib.metadata
from typing import Any

from .errors import InputError

# The extra of this distribution that brings a package; pyproject.toml has the same.
EXTRAS = {
    "exudyn": "twin",
    "matplotlib": "lab",
    "pandas": "export",
    "xarray": "export",
    "mcap": "export",
    "nptdms": "export",
    "platformio": "board",
    "serial": "board",
    "SCons": "board",
    "distributed": "cluster",
    "pymoo": "tune",
    "rerun": "view",
    "rerun_cli": "view",
    "PIL": "lab",
}


class Missing(InputError, ImportError):
    """A package of an extra is not installed, or does not load."""


class Optional:
    """A module that is imported when an attribute of it is first asked for.

        exu = Optional("exudyn")
        system = exu.SystemContainer()

    Args:
        name: the module, for example "matplotlib.figure"; its package is in `EXTRAS`.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        """The module's attribute. Raises Missing."""
        if attribute.startswith("__") and attribute not in ("__version__", "__file__"):
            raise AttributeError(attribute)
        return getattr(require(self._name), attribute)


def require(name: str) -> Any:
    """Import a module of an extra.

    Raises:
        Missing: its package is not installed, or a library that it needs is not there.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise explained(error, name) from None


def explained(error: ImportError, name: str = "") -> ImportError:
    """`Missing`, with the command that brings the package; another error as it is.

    Args:
        error: what an import raised.
        name: the module that was asked for, by default the one that the error names.
    """
    package = (name or error.name or "").partition(".")[0]
    if package not in EXTRAS:
        return error
    absent = isinstance(error, ModuleNotFoundError)
    if absent and (error.name or "").partition(".")[0] == package:
        command = f'pip install "flexura[{EXTRAS[package]}]"'
        return Missing(f"{package} is not installed; type: {command}")
    reason = (str(error) or "no reason given").splitlines()[0]
    return Missing(f"{package} does not load ({reason}); flexura doctor says what is missing")
