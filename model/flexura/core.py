"""The only interface to the compiled core: flat arrays of float64 in, flat arrays out.

The core (`model/core`, C++) is compiled when flexura is installed, never later. On x86-64 a wheel
has two builds of it: one for processors of the level x86-64-v3 (most since 2013) and a plain one
for all others. Both give the same digits. A checkout has the one for its own processor. The
environment variable FLEXURA_CORE, "plain" or "x86-64-v3", overrides the choice.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

BUILDS = {"plain": "_core_plain", "x86-64-v3": "_core_v3"}


def levels() -> list[str]:
    """The builds that are here and that this processor can run, keys of BUILDS, the best last."""
    return [
        level for level in _able() if importlib.util.find_spec(f".{BUILDS[level]}", __package__)
    ]


def load(level: str) -> ModuleType:
    """The build of the core for processors of a level.

    Args:
        level: a key of BUILDS, or "" for the best that is here and that this processor can run.

    Returns:
        The compiled module.

    Raises:
        ImportError: there is no such level, this processor lacks it, or the core was not compiled
            for it or for this Python, or from other bindings than those of this checkout.
    """
    if level and level not in BUILDS:
        raise ImportError(f"FLEXURA_CORE is {level!r}: expected {' or '.join(BUILDS)}")
    able = _able()
    if level and level not in able:
        raise ImportError(
            f"FLEXURA_CORE asks for {level}, whose instructions this processor does not have"
        )
    here = levels()
    if level and here and level not in here:
        raise ImportError(
            f"FLEXURA_CORE asks for {level}, which was not compiled here: in the checkout type "
            f"cmake -DFLEXURA_PLAIN=ON build/core && make setup"
        )
    core = _module(BUILDS[level or (here or able)[-1]])
    if core.bindings != bindings(Path(__file__).parents[1] / "core" / "bind", core.bindings):
        raise ImportError(
            f"The compiled core, {core.__file__}, is not of this checkout: `make setup` compiles it"
        )
    return core


def bindings(folder: Path, otherwise: str) -> str:
    """What tells the bindings' sources from any others, as bind/CMakeLists.txt computes it.

    Args:
        folder: of the sources.
        otherwise: what is returned where there are none: the core was installed.

    Returns:
        A digest.
    """
    sources = sorted([*folder.glob("*.cpp"), *folder.glob("*.hpp")])
    if not sources:
        return otherwise
    digests = "".join(hashlib.sha256(source.read_bytes()).hexdigest() for source in sources)
    return hashlib.sha256(digests.encode()).hexdigest()


def _able() -> list[str]:
    """The levels that this processor can run."""
    return list(BUILDS) if _module("_processor").has_v3() else ["plain"]


def _module(name: str) -> ModuleType:
    try:
        return importlib.import_module(f".{name}", __package__)
    except ModuleNotFoundError as error:
        raise ImportError(
            f"The compiled core of flexura is missing ({error}). `make setup` in the checkout "
            f"compiles it, or `pip install .`"
        ) from error


_core = load(os.environ.get("FLEXURA_CORE", ""))

level: str = _core.level  # the build in use, a key of BUILDS
compiler: str = _core.compiler  # what compiled it

if TYPE_CHECKING:

    class Compiled:
        """An object of the core, which has no types of its own."""

        def __init__(self, *arguments: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...

    class Mechanics(Compiled):
        """The equations of one robot, from the rows of system/constants.py."""

    class Sampler(Compiled):
        """What is called once a tick: a PythonSampler, or a controller of the core."""

    class Controller(Sampler):
        """The law of a controller for one robot."""

else:
    Mechanics, Sampler, Controller = _core.Mechanics, _core.Sampler, _core.Controller
# what the core refuses: args are the link (from 0; -1: none), the key and what was expected
Fault = _core.Fault
Simulation = _core.Simulation  # a run in progress
PythonSampler = _core.PythonSampler
bends = _core.bends  # tip deflection [m] and slope [rad] of a link
GainSweep = _core.GainSweep  # one robot under many controllers
board_pulses = _core.board_pulses  # joint 2's pulses by the firmware's code
joint_metrics = _core.joint_metrics
strip_metrics = _core.strip_metrics
vibration_lower_bound = _core.vibration_lower_bound
population = _core.population  # many robots at once, from rows of numbers to rows of channels
Drive = _core.Drive  # what acts on robots of a population
Watch = _core.Watch  # what another thread sees of a population, and stops it by
Copies = _core.Copies  # of one robot that take equal steps together
PredictedMotion = _core.PredictedMotion  # the motion ahead of a predictive controller
condensed_program = _core.condensed_program  # of its tick, states eliminated
renewed_program = _core.renewed_program  # its vectors, from a state on
