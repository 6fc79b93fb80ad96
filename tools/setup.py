"""Makes what the targets of the Makefile need: system packages, the environment .venv, the compiled
core.

    python3 tools/setup.py             system packages and .venv; ends with the stamp .venv/.ready
    python3 tools/setup.py core        the compiled core, beside flexura/core.py; ends with the
    stamp .venv/.core

Standard library only; an older Python runs it too, to say that a newer one is missing. A stamp is
written last and holds the checkout's place: with another place in it, the environment was moved.
"""

from __future__ import annotations

import ctypes
import fcntl
import glob
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
OLDEST, NEWEST = (3, 11), (3, 14)  # Pythons for which everything in constraints.txt has a wheel


class Stop(Exception):
    """A message for the person at the terminal: what is missing, and what to type."""


class Need(NamedTuple):
    what: str  # looked for on the machine
    package: str  # brings it, on Debian
    without: str  # what is lost
    vital: bool  # the project does not work without it


class Python(NamedTuple):
    path: str
    version: tuple[int, int]
    of_system: bool  # under /usr: Debian keeps this one's ensurepip in a package of its own
    has_venv: bool


NO_EXUDYN, NO_PICTURE = (
    "exudyn cannot be imported: no cross-check, no demo",
    "no pictures of the review, only its recording",
)
LIBRARIES = [
    Need("libGL.so.1", "libgl1", NO_EXUDYN, True),
    Need("libX11.so.6", "libx11-6", NO_EXUDYN, True),
    Need("libvulkan.so.1", "libvulkan1", NO_PICTURE, False),
]
COMPILER = Need("a C++ compiler", "g++", "the core of the solver cannot be compiled", True)
COMPILERS = ["c++", "g++", "clang++"]
ELSEWHERE = (
    "For a C++ compiler type `xcode-select --install` on macOS, `dnf install gcc-c++` on "
    "Fedora, `pacman -S gcc` on Arch."
)
NO_FIRMWARE, NO_EMULATOR = "the board's firmware cannot be built", "no emulated board"
BOARD = [
    Need("avr-g++", "gcc-avr", NO_FIRMWARE, False),
    Need("/usr/lib/avr/include/avr/io.h", "avr-libc", NO_FIRMWARE, False),
    Need(
        "/usr/share/arduino/hardware/arduino/avr/platform.txt",
        "arduino-core-avr",
        NO_FIRMWARE,
        False,
    ),
    Need("avrdude", "avrdude", "the firmware cannot be loaded into a board", False),
    Need("g++", "g++", "the firmware's library cannot be tested, and " + NO_EMULATOR, False),
    Need("/usr/include/simavr/sim_avr.h", "libsimavr-dev", NO_EMULATOR, False),
    Need("simavr", "simavr", "no unit tests on the AVR", False),
]
# For continuous integration.
CLANG = [
    Need("clang++", "clang", "the core is not tried with a second compiler", False),
    Need(
        "/usr/lib/llvm-*/lib/clang/*/lib/linux/libclang_rt.fuzzer-*.a",
        "libclang-rt-dev",
        "the board's receiver is not tried by a fuzzer",
        False,
    ),
]
# The environment is linked to the Python files in this checkout; build_core puts the compiled
# modules beside them.
LINKED = ["--no-build-isolation", "-C", "editable.mode=inplace", "-C", "wheel.cmake=false"]
DRIVER = Need("a Vulkan driver", "mesa-vulkan-drivers", NO_PICTURE, False)


def has(what: str) -> bool:
    """Whether the dynamic loader finds a library, the PATH a program, the disk a file (a pattern
    of names will do)."""
    if what.startswith("/"):
        return bool(glob.glob(what))
    if ".so" not in what:
        return shutil.which(what) is not None
    try:
        return bool(ctypes.CDLL(what))
    except OSError:
        return False


def without_compiler(has: Callable[[str], bool]) -> list[Need]:
    """The need of a C++ compiler, if none of those that CMake would take is there."""
    return (
        []
        if any(has(name) for name in [*os.environ.get("CXX", "").split()[:1], *COMPILERS])
        else [COMPILER]
    )


def vulkan_drivers() -> list[str]:
    """The driver descriptions that the Vulkan loader would read."""
    named = ":".join(
        os.environ.get(name, "") for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")
    ).split(":")
    folders = [
        "/etc",
        "/usr/share",
        "/usr/local/share",
        *os.environ.get("XDG_DATA_DIRS", "").split(":"),
    ]
    return [
        *filter(os.path.exists, named),
        *(str(f) for d in filter(None, folders) for f in Path(d).glob("vulkan/icd.d/*.json")),
    ]


def missing(
    python: Python, has: Callable[[str], bool], drivers: list[str], system: str
) -> list[Need]:
    """The needs that the machine does not meet."""
    needs = []
    if not python.has_venv:
        package = "python{}.{}-venv".format(*python.version) if python.of_system else ""
        needs.append(
            Need(
                f"ensurepip for {python.path}",
                package,
                "no environment for the packages can be made",
                True,
            )
        )
    needs += without_compiler(has)
    if system == "linux":  # on macOS the wheels use the system's own frameworks
        needs += [need for need in [*LIBRARIES, *BOARD] if not has(need.what)]
        needs += [] if drivers else [DRIVER]
        clang = CLANG if os.environ.get("REQUIRE_CLANG") else []
        needs += [need for need in clang if not has(need.what)]
    return needs


def inspect(path: str) -> Python | None:
    """The Python at this path, or None if it does not run (a pyenv shim whose version is not
    chosen, for example)."""
    code = (
        "import sys, importlib.util as u; print(*sys.version_info[:2], int(sys.base_prefix == "
        "'/usr'), "
        "int(bool(u.find_spec('venv') and u.find_spec('ensurepip'))))"
    )
    try:
        output = subprocess.run(
            [path, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True
        ).stdout
        major, minor, of_system, has_venv = map(int, output.split())
    except (OSError, ValueError, subprocess.CalledProcessError):
        return None
    return Python(path, (major, minor), bool(of_system), bool(has_venv))


def choose(paths: list[str], inspect: Callable[[str], Python | None]) -> Python:
    """The first Python of a fit version; one that can make environments as it is goes before one
    that cannot."""
    found = [python for python in map(inspect, dict.fromkeys(paths)) if python]
    fit = [python for python in found if OLDEST <= python.version <= NEWEST]
    if not fit:
        here = (
            ", ".join("{} ({}.{})".format(python.path, *python.version) for python in found)
            or "none"
        )
        raise Stop(
            "Python {}.{} to {}.{} is missing. Found: {}.\nInstall one of these versions and run "
            "this again, or name "
            "one that is not on the PATH: make PYTHON=/path/to/python3.11 ...".format(
                *OLDEST, *NEWEST, here
            )
        )
    return next((python for python in fit if python.has_venv), fit[0])


def verdict(needs: list[Need], apt: bool, sudo: str = "") -> tuple[bool, str]:
    """(stop, message) about needs that stayed unmet. Without apt a library that was not found does
    not stop: what looks for it later may know better, and the person may do without what it costs.
    Without ensurepip nothing can go on."""
    packages = " ".join(dict.fromkeys(need.package for need in needs if need.package))
    lines = [
        f"  {need.what}"
        + (f" (on Debian: {need.package})" if need.package else "")
        + f": {need.without}"
        for need in needs
    ]
    stop = any(need.vital and (apt or need not in LIBRARIES) for need in needs)
    how = "Install what is missing in this system's own way." + f"\n{ELSEWHERE}" * (
        COMPILER in needs
    )
    if apt and packages:
        how = (
            f"To install{'' if sudo else ', as root'}, type:\n"
            f"  {sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {packages}"
        )
    return stop, "\n".join(
        ["Missing on this machine:", *lines, how, *["Then run make again."] * stop]
    ) if needs else ""


def step(text: str, command: list[str], may_fail: bool = False) -> None:
    """Runs a command with its output kept back: one line with the time taken, or the end of the
    output on failure."""
    print(f"  {text} ... ", end="", flush=True)
    start = time.monotonic()
    done = subprocess.run(
        command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    if done.returncode == 0:
        print(f"{time.monotonic() - start:.0f} s", flush=True)
        return
    print(
        "failed\n" + "\n".join(done.stdout.decode(errors="replace").splitlines()[-25:]), flush=True
    )
    if not may_fail:
        raise Stop(f"This failed: {' '.join(command)}")


def install(needs: list[Need]) -> None:
    """Asks apt for the packages, given apt and the right to use it. What came of it is for the
    caller to look up."""
    sudo = [] if os.geteuid() == 0 else ["sudo", "-n"]
    may = not sudo or (
        shutil.which("sudo")
        and subprocess.run([*sudo, "true"], stderr=subprocess.DEVNULL).returncode == 0
    )
    if not may or not shutil.which("apt-get") or not any(need.package for need in needs):
        return
    apt = [
        *sudo,
        "env",
        "DEBIAN_FRONTEND=noninteractive",
        "apt-get",
        "-qq",
        "-y",
        "-o",
        "DPkg::Lock::Timeout=300",
    ]
    step(
        "list of system packages", [*apt, "update"], may_fail=True
    )  # one bad source must not stop the others
    for vital in (True, False):  # a driver for pictures must not stop the rest
        if names := list(
            dict.fromkeys(need.package for need in needs if need.package and need.vital == vital)
        ):
            step(
                f"system packages {' '.join(names)}",
                [*apt, "install", "--no-install-recommends", *names],
                may_fail=True,
            )


def set_up(venv: Path) -> None:
    """System packages, the environment, its packages."""
    names = ["python3", *(f"python3.{minor}" for minor in range(OLDEST[1], NEWEST[1] + 1))]
    python = choose([sys.executable, *filter(None, map(shutil.which, names))], inspect)
    print(
        "Setting up {} with Python {}.{} ({}).".format(venv, *python.version, python.path),
        flush=True,
    )
    install(missing(python, has, vulkan_drivers(), sys.platform))
    needs = missing(inspect(python.path) or python, has, vulkan_drivers(), sys.platform)
    sudo = "sudo " if os.geteuid() and shutil.which("sudo") else ""
    stop, message = verdict(needs, bool(shutil.which("apt-get")), sudo)
    if stop:
        raise Stop(message)
    print(message, end="\n" * bool(message), flush=True)

    inside, stamp, unfinished = (
        str(venv / "bin/python"),
        venv / ".ready",
        venv.with_name(".venv.unfinished"),
    )
    moved, current = stamp.exists() and stamp.read_text().strip() != str(ROOT), inspect(inside)
    has_pip = (
        current
        and subprocess.run([inside, "-m", "pip", "--version"], capture_output=True).returncode == 0
    )
    sound = (
        has_pip and not moved and not unfinished.exists() and OLDEST <= current.version <= NEWEST
    )
    unfinished.touch()
    stamp.unlink(missing_ok=True)
    if not sound:
        shutil.rmtree(
            ROOT / "build", ignore_errors=True
        )  # CMake's folders know the place and the Python too
        step("environment", [python.path, "-m", "venv", "--clear", str(venv)])
    pip = [inside, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    step(
        "Python packages (about 400 MB to download the first time)",
        [*pip, "--require-hashes", "--only-binary", ":all:", "-r", "constraints.txt"],
    )
    step("the project itself", [*pip, "--no-deps", *LINKED, "-e", "."])
    for link in venv.glob("lib/python*/site-packages/_editable_*flexura.pth"):
        paths = [line for line in link.read_text().splitlines() if not line.startswith("import ")]
        link.write_text(
            "\n".join([*paths, ""])
        )  # the hook that the first line loads would go before PYTHONPATH
    unfinished.unlink()


def level() -> str:
    """The instructions that the core may use here, its module and its C++ tests. Empty: those of
    any processor."""
    flags = Path("/proc/cpuinfo")
    return (
        "x86-64-v3"
        if flags.exists() and {"avx2", "bmi2", "fma", "movbe"} <= set(flags.read_text().split())
        else ""
    )


def build_core(venv: Path) -> None:
    """Compiles what is new in the core and puts its modules beside flexura/core.py."""
    python, cmake = str(venv / "bin/python"), str(venv / "bin/cmake")
    if needs := without_compiler(has):
        raise Stop(
            verdict(
                needs,
                bool(shutil.which("apt-get")),
                "sudo " if os.geteuid() and shutil.which("sudo") else "",
            )[1]
        )
    folder, strict = ROOT / "build" / "core", "ON" if os.environ.get("STRICT") else "OFF"
    settings = [
        "-DFLEXURA_MODULE=ON",
        f"-DFLEXURA_LEVEL={level()}",
        f"-DFLEXURA_STRICT={strict}",
        f"-DCMAKE_MAKE_PROGRAM={venv / 'bin/ninja'}",
        f"-DPython_EXECUTABLE={python}",
    ]
    step(
        "configuring the core",
        [cmake, "-S", str(ROOT), "-B", str(folder), "-G", "Ninja", *settings],
    )
    jobs = str(os.cpu_count() or 1)
    step(
        "compiling the core (half a minute the first time)",
        [cmake, "--build", str(folder), "--parallel", jobs],
    )
    for old in (ROOT / "model/flexura").glob("_core_*"):  # of another level or Python
        old.unlink()
    step(
        "installing the core",
        [cmake, "--install", str(folder), "--component", "module", "--prefix", f"{ROOT / 'model'}"],
    )


def main(argv: list[str]) -> int:
    works = {"": (set_up, ".ready"), "core": (build_core, ".core")}
    work, name = works["".join(argv)]
    stamp = ROOT / ".venv" / name
    signal.signal(
        signal.SIGTERM, signal.default_int_handler
    )  # so that what runs below ends with this
    try:
        with open(__file__) as lock:  # one set-up of this checkout at a time
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                print("waiting for another make that is setting up here", flush=True)
                fcntl.flock(lock, fcntl.LOCK_EX)
                if stamp.exists():
                    return 0
            start = time.time()
            work(stamp.parent)
            stamp.write_text(f"{ROOT}\n")
            os.utime(stamp, (start, start))  # a file edited meanwhile is newer than the stamp
    except Stop as message:
        print(f"\n{message}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\ninterrupted; the same command goes on from here", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
