"""What is installed here, what is missing, and what that costs."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Finding:
    """One thing looked at: `state` is "ok", "missing" or "note"; `cost` says what doesn't work without it."""

    what: str
    state: str
    found: str
    cost: str = ""


_PACKAGES = {
    "numpy": "nothing works",
    "scipy": "nothing works",
    "numba": "nothing works",
    "pydantic": "robot files cannot be read",
    "pyarrow": "runs cannot be stored or read",
    "exudyn": "no cross-check (flexura crosscheck, flexura demo)",
    "rerun-sdk": "no review and no pictures (flexura review)",
    "matplotlib": "no figures",
    "platformio": "the firmware cannot be built or flashed",
}


def examine() -> list[Finding]:
    """Everything that flexura needs on this machine, one finding each."""
    return [*_python(), *_packages(), *_native_libraries(), *_cache()]


def _python() -> Iterator[Finding]:
    version = platform.python_version()
    good = sys.version_info >= (3, 11)
    yield Finding("Python", "ok" if good else "missing", version, "" if good else "flexura needs Python 3.11 or newer")
    yield Finding("processor", "note", f"{platform.machine()}, {os.cpu_count()} cores")


def _packages() -> Iterator[Finding]:
    for name, cost in _PACKAGES.items():
        try:
            yield Finding(name, "ok", importlib.metadata.version(name))
        except importlib.metadata.PackageNotFoundError:
            yield Finding(name, "missing", "not installed", f"{cost}; type: pip install {name}")


def _native_libraries() -> Iterator[Finding]:
    try:
        import exudyn  # noqa: F401

        yield Finding("exudyn's libraries", "ok", "libGL, libX11 load")
    except ImportError as error:
        yield Finding(
            "exudyn's libraries",
            "missing",
            str(error).splitlines()[0],
            "no cross-check; on Debian type: apt-get install libgl1 libx11-6",
        )
    drivers = [icd for place in ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d") for icd in Path(place).glob("*.json")]
    if drivers:
        yield Finding("Vulkan driver", "ok", f"{len(drivers)} found")
    elif sys.platform == "linux":
        cost = "no pictures (flexura review --picture); on Debian type: apt-get install mesa-vulkan-drivers libvulkan1"
        yield Finding("Vulkan driver", "missing", "none found", cost)
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        yield Finding("display", "note", "none", "the review can be saved (--save) and drawn (--picture), not opened in a window")


def _cache() -> Iterator[Finding]:
    from flexura.compiled import folder

    filled = len(list(folder().glob("**/*.nbc")))
    yield Finding(
        "compiled code",
        "ok" if filled else "note",
        str(folder()),
        "" if filled else "the first simulation compiles for about a minute; or type: python -m flexura.warm",
    )
