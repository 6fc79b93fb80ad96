"""The one door to the compiled core: flat arrays of float64 in, flat arrays out.

The core (`model/core`, C++) is compiled when flexura is installed, never later. On x86-64 there are two builds of it: one for
processors of the level x86-64-v3 (most since 2013) and a plain one for all others. The digits are the same. The environment variable
FLEXURA_CORE, "plain" or "x86-64-v3", overrides the choice.
"""

from __future__ import annotations

import importlib
import os
from types import ModuleType

BUILDS = {"plain": "_core_plain", "x86-64-v3": "_core_v3"}


def load(level: str) -> ModuleType:
    """The build of the core for processors of a level.

    Args: level: a key of BUILDS, or "" for the best that this processor can run.

    Raises: ImportError: there is no such level, this processor lacks it, or the core was not compiled for this Python.
    """
    if level and level not in BUILDS:
        raise ImportError(f"FLEXURA_CORE is {level!r}: expected {' or '.join(BUILDS)}")
    able = _module("_processor").has_v3()
    if level == "x86-64-v3" and not able:
        raise ImportError("FLEXURA_CORE asks for x86-64-v3, whose instructions this processor does not have")
    return _module(BUILDS[level or ("x86-64-v3" if able else "plain")])


def _module(name: str) -> ModuleType:
    try:
        return importlib.import_module(f".{name}", __package__)
    except ModuleNotFoundError as error:
        raise ImportError(
            f"The compiled core of flexura is missing ({error}). `make setup` in the checkout compiles it, or `pip install .`"
        ) from error


_core = load(os.environ.get("FLEXURA_CORE", ""))

level: str = _core.level  # the build in use, a key of BUILDS
compiler: str = _core.compiler  # what compiled it
