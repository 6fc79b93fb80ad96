"""What `make release` makes is the same, byte for byte, wherever and whenever it is made."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]


def copied(folder: Path) -> Path:
    """The files of this checkout that git does not ignore, in another folder, as new as they can
    be."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)
    return folder


def released(root: Path, folder: Path, umask: int) -> dict[str, bytes]:
    """The files of a release of a checkout, made in a folder, by name."""
    surroundings = os.environ | {"SOURCE_DATE_EPOCH": "1700000000"}
    command = [sys.executable, "tools/release.py", folder]
    done = subprocess.run(
        command, cwd=root, env=surroundings, umask=umask, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_release_is_the_same_in_another_folder(tmp_path):
    """This checkout, as it was used, and a copy of its sources with other paths, times, rights."""
    dist, copy = tmp_path / "dist", copied(tmp_path / "a-much-longer-name" / "b")
    one, other = released(ROOT, dist, 0o022), released(copy, copy / "dist", 0o077)
    assert set(one) == set(other) and len(one) == 4
    for name in one:
        assert hashlib.sha256(one[name]).digest() == hashlib.sha256(other[name]).digest(), name
    (wheel,) = dist.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        compiled = [name for name in archive.namelist() if name.endswith(".so")]
        assert len(compiled) >= 2
        for name in compiled:
            assert not [p for p in (tmp_path, ROOT) if str(p).encode() in archive.read(name)]
    (sources,) = dist.glob("*.tar.gz")
    with tarfile.open(sources) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
        assert {"pyproject.toml", "constraints.txt", "model/core/README.md"} <= names
        assert not [name for name in names if name.startswith(("build/", "dist/", ".venv"))]
    (bill,) = dist.glob("*.cdx.json")
    assert json.loads(bill.read_text())["bomFormat"] == "CycloneDX"
    said = dict(line.split("  ")[::-1] for line in one["SHA256SUMS"].decode().splitlines())
    assert said == {n: hashlib.sha256(b).hexdigest() for n, b in one.items() if n != "SHA256SUMS"}
