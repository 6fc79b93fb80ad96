"""Fills a PlatformIO core directory with stand-ins from Debian and PyPI packages, where its package
server is out of reach.

    python tools/pio_offline/fill.py CORE_DIR [--avr-bin FOLDER]        then:
    PLATFORMIO_CORE_DIR=CORE_DIR pio run ...

    tool-scons              SCons of this Python
    toolchain-atmelavr      the avr-gcc in FOLDER, Debian's gcc-avr by default
    framework-arduino-avr   Debian's arduino-core-avr
    atmelavr, native        platforms/ beside this file: they build, test, and upload with avrdude

Stand-ins are folders of links. Each carries the version of what it is made of and the owner
"local", so that nobody takes it for PlatformIO's own; only tool-scons must have the owner
"platformio", or PlatformIO would not find it.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

HERE = Path(__file__).resolve().parent
ARDUINO = Path("/usr/share/arduino/hardware/arduino/avr")
DEBIAN_BIN = Path("/usr/bin")
PACKAGES = "gcc-avr binutils-avr avr-libc arduino-core-avr"
SCONS_VERSION = re.compile(r"(\d+)\.(\d+)(\d\d)(\d\d)\.\d+")  # 4.41101.0 is SCons 4.11.1


class Missing(Exception):
    """What is not there, and what to type."""


def register(folder: Path, kind: str, name: str, number: str, owner: str = "local") -> Path:
    """Make a folder known to PlatformIO as an installed package."""
    folder.mkdir(parents=True, exist_ok=True)
    spec = {"owner": owner, "id": None, "name": name, "requirements": None, "uri": None}
    (folder / ".piopm").write_text(
        json.dumps({"type": kind, "name": name, "version": number, "spec": spec})
    )
    return folder


def tool(core: Path, name: str, number: str, what: str, owner: str = "local") -> Path:
    """An empty tool package in the core directory."""
    folder = register(core / "packages" / name, "tool", name, number, owner)
    manifest = {"name": name, "version": number, "description": what, "system": "*"}
    (folder / "package.json").write_text(json.dumps(manifest, indent=2))
    return folder


def scons(core: Path) -> None:
    from platformio.dependencies import get_core_dependencies
    from semantic_version import SimpleSpec, Version

    wanted = get_core_dependencies()["tool-scons"]
    try:
        found = version("scons")
    except PackageNotFoundError:
        found = "0.0.0"
    major, minor, patch = (int(part) for part in found.split(".")[:3])
    number = f"{major}.{major}{minor:02d}{patch:02d}.0"
    if Version(number) not in SimpleSpec(wanted):
        needed = SCONS_VERSION.search(wanted)
        what = ".".join(str(int(n)) for n in needed.groups()[1:]) if needed else wanted
        raise Missing(
            f"SCons {found} does not suit this PlatformIO (tool-scons {wanted}); type: pip install "
            f"scons=={what}"
        )
    launcher = (
        tool(core, "tool-scons", number, f"SCons {found} of this Python", "platformio") / "scons.py"
    )
    launcher.write_text("from SCons.Script import main\n\nmain()\n")


def toolchain(core: Path, avr_bin: Path) -> str:
    """Returns the stand-in's version."""
    if not (avr_bin / "avr-g++").exists():
        raise Missing(
            f"there is no avr-g++ in {avr_bin}; on Debian type: apt-get install {PACKAGES}"
        )
    said = subprocess.run(
        [avr_bin / "avr-gcc", "-dumpversion"], capture_output=True, text=True, check=True
    ).stdout.strip()
    major, minor, patch = (int(part) for part in said.split("."))
    number = f"1.{major}{minor:02d}{patch:02d}.0"
    programs = tool(core, "toolchain-atmelavr", number, f"avr-gcc {said} in {avr_bin}") / "bin"
    programs.mkdir()
    for program in avr_bin.glob("avr-*"):
        (programs / program.name).symlink_to(program)
    return number


def arduino(core: Path) -> str:
    """Returns the stand-in's version."""
    if not (ARDUINO / "platform.txt").is_file():
        raise Missing(
            f"the Arduino core is not in {ARDUINO}; on Debian type: apt-get install {PACKAGES}"
        )
    found = re.search(
        r"^version=(\S+)", (ARDUINO / "platform.txt").read_text(encoding="utf-8"), re.MULTILINE
    )
    number = found.group(1) if found else "0.0.0"
    folder = tool(core, "framework-arduino-avr", number, f"Debian's arduino-core-avr {number}")
    for part in ("cores", "variants", "libraries"):
        (folder / part).symlink_to(ARDUINO / part)
    return number


def platform(core: Path, name: str, versions: dict[str, str]) -> None:
    folder = core / "platforms" / name
    shutil.copytree(HERE / "platforms" / name, folder, ignore=shutil.ignore_patterns("__pycache__"))
    manifest = json.loads((folder / "platform.json").read_text(encoding="utf-8"))
    for package, options in manifest["packages"].items():
        options["version"] = versions[package]
    (folder / "platform.json").write_text(json.dumps(manifest, indent=2))
    register(folder, "platform", name, manifest["version"])


def fill(core: Path, avr_bin: Path = DEBIAN_BIN) -> None:
    """Make the core directory's packages and platforms anew. Raises Missing, and then leaves no
    half of them."""
    for part in ("packages", "platforms"):
        shutil.rmtree(core / part, ignore_errors=True)
    try:
        scons(core)
        versions = {
            "toolchain-atmelavr": toolchain(core, avr_bin),
            "framework-arduino-avr": arduino(core),
        }
        for name in ("atmelavr", "native"):
            platform(core, name, versions)
    except BaseException:
        for part in ("packages", "platforms"):
            shutil.rmtree(core / part, ignore_errors=True)
        raise


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("core", type=Path, metavar="CORE_DIR")
    parser.add_argument(
        "--avr-bin", type=Path, default=DEBIAN_BIN, metavar="FOLDER", help="where avr-gcc is"
    )
    asked = parser.parse_args()
    try:
        fill(asked.core.resolve(), asked.avr_bin.resolve())
    except Missing as missing:
        print(f"fill: {missing}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
