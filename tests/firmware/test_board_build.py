"""firmware/build.py and the stand-ins of tools/pio_offline: two compilers, the same image anywhere,
clear words on failure."""

import hashlib
import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from boards import COMPILERS, Rigged, elf

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("fill", ROOT / "tools" / "pio_offline" / "fill.py")
fill = importlib.util.module_from_spec(spec)
spec.loader.exec_module(fill)


def image(program):
    """The bytes that go into flash."""
    return hashlib.sha256(program.with_suffix(".hex").read_bytes()).hexdigest()


@pytest.mark.parametrize("compiler, version", [("debian", "5.4.0"), ("7.3", "7.3.0")])
def test_the_board_says_which_compiler_built_it(compiler, version):
    with Rigged(compiler) as r:
        assert r.link.identity.compiler == version


@pytest.fixture
def checkout(tmp_path):
    """The firmware and its tools at another place."""
    for part in ("firmware", "tools", "analysis/flexlab/board"):
        shutil.copytree(
            ROOT / part, tmp_path / part, ignore=shutil.ignore_patterns(".pio", "__pycache__")
        )
    return tmp_path


def build(checkout, *options):
    command = [sys.executable, checkout / "firmware" / "build.py", *options]
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_same_sources_give_the_same_image_anywhere(checkout, compiler):
    done = build(checkout, "--compiler", compiler)
    assert done.returncode == 0, done.stderr
    assert image(Path(done.stdout.strip())) == image(elf(compiler))


def test_a_mistake_in_the_sources_ends_in_the_compilers_words(checkout):
    main = checkout / "firmware" / "src" / "main.cpp"
    main.write_text(
        main.read_text(encoding="utf-8") + "\nint mistake = missing;\n", encoding="utf-8"
    )
    done = build(checkout, "--compiler", "debian")
    assert done.returncode == 1 and done.stdout == ""
    assert "missing" in done.stderr and "this failed: pio run -e megaatmega2560" in done.stderr


def test_stand_ins_say_what_they_are(tmp_path):
    fill.fill(tmp_path)
    for package in (tmp_path / "packages").iterdir():
        record = json.loads((package / ".piopm").read_text())
        assert record["spec"]["owner"] == (
            "platformio" if package.name == "tool-scons" else "local"
        )
        assert json.loads((package / "package.json").read_text())["version"] == record["version"]
    assert {p.name for p in (tmp_path / "platforms").iterdir()} == {"atmelavr", "native"}


def test_without_a_compiler_it_says_what_to_type_and_leaves_nothing(tmp_path):
    with pytest.raises(
        fill.Missing, match=r"no avr-g\+\+ in .*/nowhere; on Debian type: apt-get install gcc-avr"
    ):
        fill.fill(tmp_path / "core", tmp_path / "nowhere")
    assert not any((tmp_path / "core").glob("*"))


def test_only_pio_commands_are_passed_on():
    done = build(ROOT, "run")
    assert done.returncode == 2 and "expected pio and its arguments, not run" in done.stderr
