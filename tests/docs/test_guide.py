"""The guide's pages are run: the first robot as a stranger would, and all blocks of Python."""

import io
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from flexlab.cli.app import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ROOT / "docs" / "guide"
MOST_COMMANDS = 10
SET_UP = ("make setup", ". .venv/bin/activate")  # the tests run in what these make


def blocks(page: Path) -> list[tuple[str, str]]:
    """The fenced blocks of a page: (language, text)."""
    text = page.read_text(encoding="utf-8")
    return re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def commands(page: Path) -> list[str]:
    """The commands of a page in their order."""
    return [
        line
        for kind, text in blocks(page)
        if kind == "sh"
        for line in text.replace("\\\n", " ").splitlines()
    ]


@pytest.mark.slow
def test_the_path_of_a_stranger(tmp_path):
    page = GUIDE / "first-robot.md"
    assert len(commands(page)) <= MOST_COMMANDS
    run, files = [], set()
    for kind, text in blocks(page):
        if kind == "toml":
            name = text.splitlines()[0].removeprefix("# ")
            (tmp_path / name).write_text(text, encoding="utf-8")
            files.add(name)
        for line in text.splitlines() if kind == "sh" else ():
            word, *rest = shlex.split(line)
            if line in SET_UP:
                continue
            assert word == "flexura"
            done = subprocess.run(
                [sys.executable, "-m", "flexlab.cli.app", *rest],
                cwd=tmp_path,
                capture_output=True,
                text=True,
            )
            assert done.returncode == 0, (line, done.stderr)
            run.append(rest[0])
        if kind == "python":
            subprocess.run([sys.executable, "-c", text], cwd=tmp_path, check=True)
    assert files == {"my-arm.toml", "reach.toml"}
    assert {"new", "simulate", "frequencies", "inverse", "crosscheck"} <= set(run)
    assert {"plot", "animate"} <= set(run)
    assert (tmp_path / "runs" / "from-python" / "run.parquet").exists()
    assert (tmp_path / "reach.pdf").stat().st_size and (tmp_path / "reach.gif").stat().st_size


@pytest.mark.slow
@pytest.mark.parametrize("page", sorted(GUIDE.glob("*.md")), ids=lambda path: path.stem)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    python = [text for kind, text in blocks(page) if kind == "python"]
    if page.stem == "first-robot":
        robot = next(text for kind, text in blocks(page) if kind == "toml")
        (tmp_path / "my-arm.toml").write_text(robot, encoding="utf-8")
    names: dict[str, object] = {"__name__": "__main__"}
    with redirect_stdout(io.StringIO()):
        for text in python:
            exec(compile(text, str(page), "exec"), names)


def test_pages_name_commands_that_there_are():
    """Each command and each file of this project that a page types exists."""
    for page in sorted(GUIDE.glob("*.md")):
        for line in commands(page):
            words = shlex.split(line, comments=True)
            if words[0] == "flexura":
                assert words[1] in set(COMMANDS), (page.name, line)
            for word in words[1:]:
                if word.startswith(("model/", "firmware/")):
                    assert (ROOT / word).exists(), (page.name, word)


def test_the_example_of_the_readme_runs_and_its_commands_are_there(tmp_path, monkeypatch):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `flexura (\w+)", text, re.MULTILINE)
    assert len(listed) > 12 and set(listed) <= set(COMMANDS)
    (tmp_path / "model").symlink_to(ROOT / "model")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "svg")
    (code,) = [block for kind, block in blocks(ROOT / "README.md") if kind == "python"]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "tip-deflection.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    "page",
    [path for path in ROOT.glob("*.md")]
    + [ROOT / name / "README.md" for name in ("model", "model/core", "analysis", "examples")]
    + [ROOT / name / "README.md" for name in ("firmware", "logs")],
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_links_of_a_page_lead_to_files(page):
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if not target.startswith(("http:", "https:")):
            assert (page.parent / target).exists(), target
