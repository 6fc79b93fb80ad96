"""The compiled library of an FMU, which is installed beside the core, and where an FMU keeps it."""

from __future__ import annotations

import platform
import sys
from pathlib import Path

from ...errors import InputError

LIBRARY = Path(__file__).resolve().parents[2] / "_fmu.so"
# folders of binaries in FMI 2.0 and 3.0, and how a library's name ends
SYSTEMS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux", ".so"),
    ("linux", "aarch64"): ("", "aarch64-linux", ".so"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin", ".dylib"),
    ("darwin", "arm64"): ("darwin64", "aarch64-darwin", ".dylib"),
}


def library(fmi: int, name: str) -> tuple[str, bytes]:
    """The library for this machine's system.

    Args:
        fmi: 2 or 3.
        name: its name in the FMU, without an ending.

    Returns:
        Its place in the FMU, and its content.

    Raises:
        InputError: it was not compiled, or this version of FMI has no name for the system.
    """
    here = (sys.platform, platform.machine())
    second, third, ending = SYSTEMS.get(here, ("", "", ""))
    folder = second if fmi == 2 else third
    if not folder:
        expected = f"no FMU of FMI {fmi} is made on {here[0]} on {here[1]}"
        if third:
            expected += ": expected --fmi 3"
        raise InputError(expected, key="fmi", value=fmi)
    try:
        return f"binaries/{folder}/{name}{ending}", LIBRARY.read_bytes()
    except OSError:
        expected = "the library of FMUs was not compiled: `make setup` in a checkout compiles it"
        raise InputError(expected, file=str(LIBRARY)) from None
