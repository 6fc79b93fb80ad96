"""Makes what a release consists of, in a folder: the same sources give the same bytes.

    python tools/release.py [folder]        by default dist

That is the wheel (tools/wheel.py), the archive of the sources, the bill of materials
(tools/packages.py), and SHA256SUMS of these three.
"""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

import packages
import wheel


def sources(folder: Path, root: Path = wheel.ROOT) -> Path:
    """The archive of the sources of a checkout, in `folder`."""
    for old in folder.glob("flexura-*.tar.gz"):
        old.unlink()
    code = (
        "import os, sys; from scikit_build_core.build import build_sdist; os.chdir(sys.argv[1]); "
        "build_sdist(sys.argv[2])"
    )
    dated = os.environ | {"SOURCE_DATE_EPOCH": wheel.moment(root)}
    wheel.run([sys.executable, "-c", code, str(root), str(folder)], env=dated)
    (out,) = folder.glob("flexura-*.tar.gz")
    return out


def release(folder: Path) -> list[Path]:
    """All files of the release; SHA256SUMS comes last."""
    folder.mkdir(parents=True, exist_ok=True)
    archive = sources(folder)
    bill = folder / archive.name.replace(".tar.gz", ".cdx.json")
    packages.main(["sbom", str(bill)])
    files = [archive, wheel.build(folder), bill]
    sums = folder / "SHA256SUMS"
    lines = [f"{hashlib.sha256(f.read_bytes()).hexdigest()}  {f.name}\n" for f in files]
    sums.write_text("".join(lines), encoding="utf-8")
    return [*files, sums]


if __name__ == "__main__":
    for made in release(Path(sys.argv[1] if len(sys.argv) > 1 else wheel.ROOT / "dist").resolve()):
        print(made)
