"""Packages of extras: one table says what brings them, and a missing one is one sentence."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura import twin
from flexura.optional import EXTRAS, Missing, Optional, load

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [
    path
    for folder in ("model/flexura", "analysis/flexlab")
    for path in (ROOT / folder).rglob("*.py")
]
DISTRIBUTIONS = {
    "serial": "pyserial",
    "PIL": "pillow",
    "rerun": "rerun-sdk",
    "rerun_cli": "rerun-sdk",
}


@pytest.mark.parametrize("package", EXTRAS)
def test_the_table_agrees_with_what_an_installation_brings(package):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {
        extra: [re.match(r"[\w.-]+", text)[0].lower() for text in texts]
        for extra, texts in project["optional-dependencies"].items()
    }
    name = DISTRIBUTIONS.get(package, package).lower()
    assert name in extras[EXTRAS[package]]
    assert name not in [re.match(r"[\w.-]+", text)[0].lower() for text in project["dependencies"]]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_packages_of_extras_are_asked_for_in_one_way(path):
    """No `import exudyn` but for type checkers: it would end in a ModuleNotFoundError."""
    found = []
    for node in plain(ast.parse(path.read_text(encoding="utf-8")).body):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
        found += [name for name in names if name.partition(".")[0] in EXTRAS]
    assert found == []


def plain(body):
    for node in body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            yield from plain(node.orelse)
            continue
        yield node
        yield from plain(
            child
            for child in ast.iter_child_nodes(node)
            if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case)
        )


def without(monkeypatch, package):
    for name in [name for name in sys.modules if name.partition(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)


@pytest.mark.parametrize("package", EXTRAS)
def test_a_missing_package_is_one_sentence_with_the_command(package, monkeypatch):
    without(monkeypatch, package)
    expected = f'{package} is not installed; type: pip install "flexura[{EXTRAS[package]}]"'
    for ask in (lambda: load(package), lambda: Optional(package).anything):
        with pytest.raises(Missing) as caught:
            ask()
        assert str(caught.value) == expected
        assert isinstance(caught.value, ImportError) and isinstance(caught.value, fx.InputError)


def test_a_package_that_misses_another_says_which(monkeypatch, tmp_path):
    (tmp_path / "mcap.py").write_text("import absent_package")
    without(monkeypatch, "mcap")
    monkeypatch.delitem(sys.modules, "mcap")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(Missing, match=r"mcap does not load \(No module named 'absent_package'\)"):
        load("mcap")


def test_library_calls_say_it_too(monkeypatch):
    without(monkeypatch, "exudyn")
    arm = fx.load("single-r")
    with pytest.raises(Missing, match="exudyn is not installed"):
        twin.simulate(arm, np.linspace(0, 0.1, 3), fx.Drive.force(fx.signals.constant(0.0)))


def test_nothing_is_imported_before_it_is_used():
    code = (
        f"import sys; sys.path[:0] = {[str(ROOT / 'model'), str(ROOT / 'analysis')]}\n"
        "from flexlab.cli.app import COMMANDS\nimport importlib\n"
        "for name in COMMANDS:\n"
        "    importlib.import_module('flexlab.cli.' + (name if name != 'import' else 'import_'))\n"
        "print(*sys.modules)"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert not set(EXTRAS) & set(loaded.stdout.split())
