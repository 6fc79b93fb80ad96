"""What is installed here, what is missing, and what that costs."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import platform
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import typer

from flexura import core
from flexura.errors import FlexuraError
from flexura.optional import Missing, load

from ..board.emulator.simulator import CLOCK_HZ, compile_shim
from ..board.serial_port import ports
from ..experiment.flash import RIG
from ..rig import check_capability as check
from ..rig import load as load_rig
from ..runs.table import Styled, Table
from .options import Json, RigFile
from .output import print_results


@dataclass(frozen=True)
class Finding:
    """One part of the installation.

    Attributes:
        what: its name.
        state: "ok", "missing", "absent" (an extra), "wrong" or "note".
        found: what was found.
        cost: what does not work without it.
    """

    what: str
    state: str
    found: str
    cost: str = ""


# Installed with every flexura.
_NEEDED = ("numpy", "scipy", "pydantic", "pyarrow", "rich", "tomli-w", "typer")
# What an extra of flexura is for, and its packages.
_EXTRAS = {
    "twin": ("no cross-check and no emulated rig (flexura crosscheck)", ["exudyn"]),
    "view": ("no review (flexura review)", ["rerun-sdk"]),
    "lab": ("no figures, reports and pictures", ["matplotlib", "pillow"]),
    "board": ("the firmware cannot be built or flashed", ["platformio", "pyserial", "scons"]),
    "export": ("no export to these programs", ["mcap", "npTDMS", "pandas", "xarray"]),
    "tune": ("no search of gains (flexura tune)", ["pymoo"]),
    "cluster": ("no populations on several machines (--scheduler)", ["distributed"]),
}


def check_installation(rig: Path | None = None) -> list[Finding]:
    """Everything that flexura needs on this machine, the boards that are plugged in, and what the
    rig can do; one finding each.

    `rig` is a rig file, the project's own if None. Raises InputError for a wrong one.
    """
    return [*_python(), *_packages(), *_native_libraries(), *_core(), *_board(), *_rig(rig)]


def _python() -> Iterator[Finding]:
    version = platform.python_version()
    good = sys.version_info >= (3, 11)
    yield Finding(
        "Python",
        "ok" if good else "missing",
        version,
        "" if good else "flexura needs Python 3.11 or newer",
    )
    yield Finding("processor", "note", f"{platform.machine()}, {os.cpu_count()} cores")


def _packages() -> Iterator[Finding]:
    for name in _NEEDED:
        yield _package(name, "flexura is not installed whole; type: pip install flexura", "missing")
    for extra, (cost, names) in _EXTRAS.items():
        for name in names:
            yield _package(name, f'{cost}; type: pip install "flexura[{extra}]"', "absent")


def _package(name: str, cost: str, state: str) -> Finding:
    try:
        return Finding(name, "ok", importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, state, "not installed", cost)


def _native_libraries() -> Iterator[Finding]:
    if importlib.util.find_spec("exudyn") is not None:
        try:
            load("exudyn")
            yield Finding("exudyn's libraries", "ok", "libGL, libX11 load")
        except Missing as error:
            cost = "no cross-check; on Debian type: apt-get install libgl1 libx11-6"
            yield Finding("exudyn's libraries", "missing", str(error), cost)
    drivers = [
        icd
        for place in ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d")
        for icd in Path(place).glob("*.json")
    ]
    if drivers:
        yield Finding("Vulkan driver", "ok", f"{len(drivers)} found")
    elif sys.platform == "linux":
        cost = (
            "no pictures (flexura review --picture); on Debian type: apt-get install "
            "mesa-vulkan-drivers libvulkan1"
        )
        yield Finding("Vulkan driver", "missing", "none found", cost)
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        yield Finding(
            "display",
            "note",
            "none",
            "the review can be saved (--save) and drawn (--picture), not opened in a window",
        )


def _core() -> Iterator[Finding]:
    slow = "x86-64-v3" in core.BUILDS and core.level == "plain"
    cost = "3 to 8 times slower than on a processor with AVX2" if slow else ""
    yield Finding("compiled core", "note" if slow else "ok", f"{core.level}, {core.compiler}", cost)


def _board() -> Iterator[Finding]:
    try:
        compile_shim()
        yield Finding("emulated board", "ok", f"simavr, ATmega2560 at {CLOCK_HZ / 1e6:g} MHz")
    except FlexuraError as error:
        yield Finding(
            "emulated board",
            "missing",
            str(error).splitlines()[0],
            "no emulated board (flexura flash --emulated)",
        )
    try:
        found = list(ports())
    except Missing:  # told above
        return
    for port in found:
        usable = os.access(port.device, os.R_OK | os.W_OK)
        cost = (
            ""
            if usable
            else "not yours to open; on Debian type: sudo adduser $USER dialout, and log in again"
        )
        yield Finding("board", "ok" if usable else "missing", f"{port.device}: {port.what}", cost)
    if not found:
        yield Finding(
            "board", "note", "none plugged in", "experiments run on the emulated board only"
        )


def _rig(rig: Path | None) -> Iterator[Finding]:
    bench = load_rig(rig or RIG)
    checks = check(bench)
    for c in checks:
        if not c.passed:
            cost = f"cannot follow {bench.manoeuvre.name!r}: {c.advice}"
            yield Finding(
                f"rig: {c.what}", "wrong", f"needed: {c.found}; available: {c.expected}", cost
            )
    if all(c.passed for c in checks):
        yield Finding("rig", "ok", f"{Path(bench.file).name}: {len(checks)} checks passed")


def doctor(rig: RigFile = None, json: Json = False) -> None:
    """Check the installation: list missing parts and the features they disable.

    It also checks whether the rig can follow its manoeuvre.

    \b
    Example: flexura doctor
    """
    findings = check_installation(rig)
    print_results(json, lambda: _table(findings), lambda: [vars(f) for f in findings])
    if any(f.state in ("missing", "wrong") for f in findings):
        raise typer.Exit(1)


_COLOURS = {"ok": "green", "missing": "red", "wrong": "red"}


def _table(findings: list[Finding]) -> Table:
    heads = ("state", "", "found", "what it costs")
    out = Table("installation", heads, heads)
    for f in findings:
        out.add(Styled(f.state, _COLOURS.get(f.state, "")), f.what, f.found, f.cost)
    return out
