"""Builds of the core: without Python, with another compiler, and for two levels of processor with
the same digits."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import cmake
import ninja
import numpy as np
import pytest

from flexura import core

ROOT = Path(__file__).resolve().parents[3]
FUNCTIONS = ["sin", "cos", "exp", "log", "tanh"]
CMAKE, NINJA = Path(cmake.CMAKE_BIN_DIR) / "cmake", Path(ninja.BIN_DIR) / "ninja"
CLANG = next(
    filter(
        None, map(shutil.which, ["clang++", *(f"clang++-{version}" for version in range(14, 25))])
    ),
    None,
)
needs_clang = pytest.mark.skipif(
    not CLANG and not os.environ.get("REQUIRE_CLANG"), reason="no clang++ on this machine"
)


class Build:
    """The library and its C++ tests in a folder, made with nothing on the PATH but compiler and
    linker."""

    def __init__(self, folder: Path, *settings: str):
        self.programs = programs = folder / "programs"
        programs.mkdir()
        for name in (
            "c++",
            "g++",
            "clang++",
            "as",
            "ld",
            "ar",
            "ranlib",
            "nm",
            "dsymutil",
            "xcrun",
        ):
            if path := shutil.which(name):
                (programs / name).symlink_to(path)
        self.folder, self.environment = folder / "build", {"PATH": str(programs)}
        settings = ("-DFLEXURA_STRICT=ON", f"-DCMAKE_MAKE_PROGRAM={NINJA}", *settings)
        self.run(CMAKE, "-S", ROOT, "-B", self.folder, "-G", "Ninja", *settings)

    def run(self, *command: object) -> str:
        arguments = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True}
        done = subprocess.run(
            [*map(str, command)], env=self.environment, cwd=self.programs, **arguments
        )
        assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
        return done.stdout

    def make(self, *targets: str) -> None:
        self.run(
            CMAKE,
            "--build",
            self.folder,
            "--parallel",
            "2",
            *(f"--target={name}" for name in targets),
        )

    def test(self, *arguments: str) -> str:
        return self.run(
            CMAKE.with_name("ctest"), "--test-dir", self.folder, "--output-on-failure", *arguments
        )


def test_the_library_is_made_without_python(tmp_path):
    build = Build(tmp_path)
    known = (build.folder / "CMakeCache.txt").read_text().splitlines()
    assert not [line for line in known if line.startswith(("Python", "nanobind"))]
    build.make("test_scalars")
    assert "100% tests passed" in build.test("-R", "test_scalars$")


@needs_clang
def test_clang_gives_the_same_digits_and_no_warning(tmp_path):
    build = Build(tmp_path, f"-DCMAKE_CXX_COMPILER={CLANG}")
    build.make("test_scalars", "test_scalars_portable")
    assert "100% tests passed" in build.test("-R", "test_scalars")


@pytest.mark.slow
@pytest.mark.timeout(1800)  # all of the core is compiled
@pytest.mark.parametrize(
    "settings",
    [
        pytest.param("-DFLEXURA_SANITIZE=ON", id="sanitizers"),
        pytest.param("-DFLEXURA_PORTABLE=ON", id="portable"),
        pytest.param(f"-DCMAKE_CXX_COMPILER={CLANG}", id="clang", marks=needs_clang),
    ],
)
def test_all_of_the_core_in_other_builds(tmp_path, settings):
    build = Build(tmp_path, settings)
    build.make()
    assert "100% tests passed" in build.test()


def numbers() -> np.ndarray:
    random = np.random.default_rng(1)
    return np.concatenate(
        [
            [0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 709.0, -745.0],
            random.uniform(-100.0, 100.0, 1001),
            10.0 ** random.uniform(-300.0, 5.0, 1000),
        ]
    )


@pytest.mark.parametrize("name", FUNCTIONS)
def test_builds_give_the_same_digits_one_by_one_and_in_packs(name):
    x = numbers()
    results = [
        getattr(core.load(level), name)(x, packed=packed)
        for level in core.levels()
        for packed in (False, True)
    ]
    for result in results[1:]:
        np.testing.assert_array_equal(result.view(np.int64), results[0].view(np.int64))
    with np.errstate(all="ignore"):
        right = getattr(np, name)(x)
    usable = np.isfinite(x) & np.isfinite(right) & ((name != "log") | (x > 1e-300))
    np.testing.assert_allclose(results[0][usable], right[usable], rtol=1e-15, atol=1e-15)


RUN = """
import sys
import numpy as np
import flexura as fx
from flexura import core
from flexura.signals import constant, cycloid

assert core.level == sys.argv[1], core.level
for name in sys.argv[2:]:
    system = fx.assemble(fx.load(name))
    joints = len(system.robot.links)
    drive = fx.Drive.force(*[constant(0.05)] * joints)
    t = np.linspace(0.0, 0.2, 11)
    for method in ("explicit", "implicit", "exponential"):
        run = fx.simulate(system, t, drive, method=method, rtol=1e-5)
        print(name, method, run["tip/x"].tobytes().hex(), run["energy/loss"].tobytes().hex())
"""


@pytest.mark.slow
@pytest.mark.timeout(1800)  # all of the core is compiled
def test_the_build_for_any_processor_gives_the_digits_of_the_other(tmp_path):
    """Compiled as a checkout asks for it, chosen by FLEXURA_CORE; whole runs, to the last bit."""
    if core.level == "plain":
        pytest.skip("this processor has the build for any processor alone")
    shutil.copytree(ROOT / "model" / "flexura", tmp_path / "flexura")
    settings = [
        "-DFLEXURA_MODULE=ON",
        "-DFLEXURA_PLAIN=ON",
        "-DFLEXURA_LEVEL=x86-64-v3",
        f"-DCMAKE_MAKE_PROGRAM={NINJA}",
        f"-DPython_EXECUTABLE={sys.executable}",
    ]
    build = [*map(str, (CMAKE, "-S", ROOT, "-B", tmp_path / "build", "-G", "Ninja")), *settings]
    make = [str(CMAKE), "--build", str(tmp_path / "build"), "--target", "_core_plain", "_processor"]
    for command in (build, make):
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
    for compiled in (tmp_path / "build").rglob("_*.so"):
        shutil.copy(compiled, tmp_path / "flexura")
    robots = [str(ROOT / "model" / "robots" / f"{name}.toml") for name in ("single-r", "rig")]
    printed = []
    for level in ("plain", "x86-64-v3"):
        surroundings = os.environ | {"PYTHONPATH": str(tmp_path), "FLEXURA_CORE": level}
        command = [sys.executable, "-c", RUN, level, *robots]
        done = subprocess.run(command, env=surroundings, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-4000:]
        printed.append(done.stdout)
    assert len(printed[0].splitlines()) == 6 and printed[0] == printed[1]


@pytest.mark.parametrize("wrong", [np.zeros((2, 2)), np.zeros(3, complex), [1.0], None])
def test_what_is_no_vector_is_refused(wrong):
    with pytest.raises(TypeError):
        core.load("").sin(wrong)


@pytest.mark.parametrize(
    "other", [np.arange(4), np.arange(8.0)[::2], np.zeros(3, np.float32), np.zeros(0)]
)
def test_a_vector_of_another_type_or_order_is_converted(other):
    np.testing.assert_allclose(core.load("").sin(other), np.sin(other), rtol=1e-7)


def in_a_new_process(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    surroundings = os.environ | {"PYTHONPATH": str(ROOT / "model")} | environment
    return subprocess.run(
        [sys.executable, "-c", code], env=surroundings, capture_output=True, text=True
    )


def test_the_environment_chooses_the_build():
    code = "from flexura import core; print(core.level)"
    for level in core.levels():
        assert in_a_new_process(code, FLEXURA_CORE=level).stdout == f"{level}\n"
    assert in_a_new_process(code, FLEXURA_CORE="").stdout == f"{core.levels()[-1]}\n"
    wrong = in_a_new_process(code, FLEXURA_CORE="fast")
    assert (
        wrong.returncode == 1
        and "FLEXURA_CORE is 'fast': expected plain or x86-64-v3" in wrong.stderr
    )


def test_what_was_not_compiled_is_said(tmp_path):
    """A checkout without the build for any processor, and one with it alone."""
    if core.level == "plain":
        pytest.skip("this processor has the build for any processor alone")
    without = shutil.ignore_patterns("_core_plain*", "__pycache__")
    shutil.copytree(ROOT / "model" / "flexura", tmp_path / "flexura", ignore=without)
    code = "from flexura import core; print(core.level)"
    chosen = in_a_new_process(code, PYTHONPATH=str(tmp_path))
    assert chosen.stdout == "x86-64-v3\n"
    asked = in_a_new_process(code, PYTHONPATH=str(tmp_path), FLEXURA_CORE="plain")
    assert asked.returncode == 1 and "FLEXURA_CORE asks for plain, which was not" in asked.stderr
    assert "cmake -DFLEXURA_PLAIN=ON build/core && make setup" in asked.stderr


def test_without_compiled_modules_the_message_says_what_to_type(tmp_path):
    compiled = shutil.ignore_patterns("_*.so", "_*.pyd", "__pycache__")
    shutil.copytree(ROOT / "model" / "flexura", tmp_path / "flexura", ignore=compiled)
    done = in_a_new_process("import flexura.core", PYTHONPATH=str(tmp_path))
    assert (
        done.returncode == 1
        and "The compiled core of flexura is missing" in done.stderr
        and "make setup" in done.stderr
    )


def test_a_core_of_other_bindings_is_refused(monkeypatch, tmp_path):
    (tmp_path / "module.cpp").write_text("// of another version")
    other = core.bindings(tmp_path, "none")
    assert core.bindings(tmp_path / "no such folder", "none") == "none"
    monkeypatch.setattr(core, "bindings", lambda folder, otherwise: other)
    with pytest.raises(ImportError, match="not of this checkout: `make setup`"):
        core.load("")
