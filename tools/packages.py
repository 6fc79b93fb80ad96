"""The packages that the project is tested with: exact versions, licences, bill of materials.

    python tools/packages.py lock [options of uv]   constraints.txt anew, with hashes of all files
    python tools/packages.py licences               a table: package, version, licence
    python tools/packages.py sbom FILE              CycloneDX 1.5 in JSON

`lock` keeps the versions that stand in constraints.txt. `--upgrade`, or `--upgrade-package NAME`,
takes newer ones. The versions are those of all supported Pythons and systems together: a line may
have a condition, and each package has the hashes of all its files.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "constraints.txt"
OLDEST = "3.11"
HEAD = """\
# The exact versions that are tested, with the hashes of their files for all systems and Pythons.
# `make setup` and CI install these and nothing else. pyproject.toml has the bounds.
# `make lock` makes this file; make lock LOCK=--upgrade takes newer versions.
"""


class Locked(NamedTuple):
    """One line of constraints.txt."""

    name: str
    version: str
    marker: str  # the condition, or ""
    hashes: tuple[str, ...]  # SHA-256

    @property
    def here(self) -> bool:
        """Whether this machine and Python install it."""
        return not self.marker or Marker(self.marker).evaluate()


def locked(text: str | None = None) -> list[Locked]:
    """The packages of constraints.txt, or of a text like it."""
    text = LOCK.read_text(encoding="utf-8") if text is None else text
    text = re.sub(r"^#.*\n", "", text, flags=re.MULTILINE).replace("\\\n", " ")
    found = []
    for line in filter(str.strip, text.splitlines()):
        wanted, *hashes = re.split(r"\s+--hash=sha256:", line.strip())
        requirement = Requirement(wanted)
        (exact,) = requirement.specifier
        marker = str(requirement.marker or "")
        found.append(Locked(requirement.name, exact.version, marker, tuple(hashes)))
    return found


def lock(options: list[str]) -> None:
    """Write constraints.txt. The public index is asked, whatever this machine has set for uv."""
    surroundings = {k: v for k, v in os.environ.items() if not k.startswith("UV_")}
    uv = [sys.executable, "-m", "uv", "pip", "compile", "--no-config", "-q", *options]
    kind = ["--universal", "--python-version", OLDEST, "--generate-hashes"]
    form = ["--no-annotate", "--no-header", "-o", str(LOCK)]
    given = [str(ROOT / "pyproject.toml"), "--extra", "test"]
    subprocess.run([*uv, *kind, *form, *given], env=surroundings, check=True)
    LOCK.write_text(HEAD + LOCK.read_text(encoding="utf-8"), encoding="utf-8")


# The metadata of these have the licence's text in place of its name.
BY_THEIR_TEXT = {"fmpy": "BSD-2-Clause", "graphemeu": "MIT"}


def licence(name: str) -> str:
    """The licence of an installed package, as its own metadata say it."""
    about = metadata.metadata(name)
    if said := about.get("License-Expression"):
        return said
    classifiers = [
        c.rpartition(" :: ")[2] for c in about.get_all("Classifier", []) if c.startswith("License")
    ]
    classifiers = [c for c in classifiers if c not in ("OSI Approved", "DFSG approved")]
    if classifiers:
        return " AND ".join(classifiers)
    said = (about.get("License") or "").strip()
    return BY_THEIR_TEXT.get(canonicalize_name(name), "" if said == "UNKNOWN" else said)


def licences() -> dict[str, tuple[str, str]]:
    """Version and licence of each package that is installed here for the project."""
    found = {}
    for package in locked():
        if package.here:
            installed = metadata.version(package.name)
            found[package.name] = (installed, licence(package.name))
    return found


def sbom() -> dict:
    """The bill of materials: the project, its packages with hashes, and who needs whom."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    said, packages = licences(), locked()
    names = {package.name for package in packages}

    def reference(package: Locked) -> str:
        return f"pkg:pypi/{package.name}@{package.version}"

    by_name: dict[str, list[str]] = {}
    for package in packages:
        by_name.setdefault(package.name, []).append(reference(package))

    def needs(requirements: list[str]) -> list[str]:
        wanted = {canonicalize_name(Requirement(text).name) for text in requirements} & names
        return sorted(r for name in wanted for r in by_name[name])

    components, dependencies = [], []
    for package in packages:
        one = {
            "type": "library",
            "bom-ref": reference(package),
            "name": package.name,
            "version": package.version,
            "purl": reference(package),
            "externalReferences": [
                {
                    "type": "distribution",
                    "url": reference(package),
                    "hashes": [{"alg": "SHA-256", "content": h} for h in package.hashes],
                }
            ],
        }
        if package.marker:
            one["properties"] = [{"name": "flexura:condition", "value": package.marker}]
        installed, text = said.get(package.name, ("", ""))
        if installed == package.version and text:
            one["licenses"] = [{"license": {"name": text}}]
            asked = metadata.requires(package.name) or []
            plain = [text for text in asked if "extra ==" not in text]
            dependencies.append({"ref": reference(package), "dependsOn": needs(plain)})
        components.append(one)
    itself = f"pkg:pypi/{project['name']}@{project['version']}"
    wanted = [text for extra in project["optional-dependencies"].values() for text in extra]
    everything = needs(project["dependencies"] + wanted)
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": itself,
                "name": project["name"],
                "version": project["version"],
                "purl": itself,
                "licenses": [{"license": {"id": project["license"]}}],
            }
        },
        "components": components,
        "dependencies": [{"ref": itself, "dependsOn": everything}, *dependencies],
    }


def main(argv: list[str]) -> int:
    if argv[:1] == ["lock"]:
        lock(argv[1:])
    elif argv == ["licences"]:
        for name, (version, text) in licences().items():
            print(f"{name:30} {version:14} {text}")
    elif len(argv) == 2 and argv[0] == "sbom":
        text = json.dumps(sbom(), indent=1) + "\n"
        Path(argv[1]).write_text(text, encoding="utf-8")
    else:
        print(__doc__, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
