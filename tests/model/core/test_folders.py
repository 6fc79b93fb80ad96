"""The folders of the core: no circle among them, and at most nine names in each."""

import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

CORE = Path(__file__).resolve().parents[3] / "model" / "core"
FILES = [path for path in CORE.rglob("*") if path.suffix in (".hpp", ".cpp")]
FOLDERS = sorted({path.parent for path in FILES} | {CORE})
MOST = 9


def included(path: Path) -> list[Path]:
    """The core's own headers that a file includes."""
    names = re.findall(r'^#include "([^"]+)"', path.read_text(), re.MULTILINE)
    return [CORE / name for name in names if (CORE / name).exists()]


def test_folders_use_each_other_in_one_direction():
    uses: dict[str, set[str]] = {}
    for path in FILES:
        for header in included(path):
            if header.parent != path.parent:
                uses.setdefault(str(path.parent), set()).add(str(header.parent))
    assert len(uses) > 8
    list(TopologicalSorter(uses).static_order())  # raises CycleError, which names the circle


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_a_folder_has_at_most_nine_names(folder):
    names = {
        path.stem for path in folder.iterdir() if path.is_dir() or path.suffix in (".hpp", ".cpp")
    }
    assert 0 < len(names) <= MOST
