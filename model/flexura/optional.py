"""Packages that only some need: imported when first used, and missed in one sentence."""

from __future__ import annotations

import importlib
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
    "h5py": "logs",
    "rosbags": "logs",
    "platformio": "board",
    "serial": "board",
    "SCons": "board",
    "distributed": "cluster",
    "pymoo": "tune",
    "rerun": "view",
    "rerun_cli": "view",
    "PIL": "lab",
    "control": "control",
    "gymnasium": "gym",
}


class Missing(InputError, ImportError):
    """A package of an extra is not installed, or does not load."""


class Optional:
    """A module that is imported when an attribute of it is first asked for.

        exu = Optional("exudyn")
        system = exu.SystemContainer()

    Args:
        name: the module, for example "matplotlib.figure".
        extra: the extra that brings its package, by default the one of `EXTRAS`.
    """

    def __init__(self, name: str, extra: str = "") -> None:
        self._name, self._extra = name, extra

    def __getattr__(self, attribute: str) -> Any:
        """The module's attribute. Raises Missing."""
        if attribute.startswith("__") and attribute not in ("__version__", "__file__"):
            raise AttributeError(attribute)
        return getattr(load(self._name, self._extra), attribute)


def load(name: str, extra: str = "") -> Any:
    """Import a module of an extra.

    Args:
        name: the module.
        extra: the extra that brings its package, by default the one of `EXTRAS`.

    Raises:
        Missing: its package is not installed, or a library that it needs is not there.
        MemoryError: a library does not fit into memory.
    """
    package = name.partition(".")[0]
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] == package:
            command = f'pip install "flexura[{extra or EXTRAS[package]}]"'
            raise Missing(f"{package} is not installed; type: {command}") from None
        raise _broken(package, error) from None
    except ImportError as error:
        if "failed to map segment" in str(error):  # the loader of libraries says so
            raise MemoryError(f"{package} does not fit") from None
        raise _broken(package, error) from None


def need(*packages: str) -> None:
    """Ask for packages before the work whose result takes them.

    Raises:
        Missing: one of them is not there.
    """
    for package in packages:
        load(package)


def _broken(package: str, error: ImportError) -> Missing:
    reason = (str(error) or "no reason given").splitlines()[0]
    return Missing(f"{package} does not load ({reason}); flexura doctor says what is missing")
