"""The site builds without a warning, which a dead link is; its tables have what the code has."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import flexura as fx
from flexura.simulation import channel_units

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site: its folder."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", "-b", "html"]
    done = subprocess.run(
        [*command, "-d", str(out / "doctrees"), str(DOCS), str(out / "html")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return out / "html"


@pytest.mark.slow
def test_the_site_has_every_page_and_needs_no_network(site):
    pages = [path.relative_to(DOCS).with_suffix(".html") for path in DOCS.rglob("*.md")]
    assert len(pages) > 30
    for page in pages:
        text = (site / page).read_text(encoding="utf-8")
        assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="https?:', text), page
    assert (site / "_static" / "mathjax.js").stat().st_size > 1_000_000


@pytest.mark.slow
def test_the_site_has_every_equation_key_command_and_name(site):
    numbered = "".join(
        path.read_text(encoding="utf-8") for path in sorted((site / "theory").glob("[0-9]*.html"))
    )
    pages = sorted((DOCS / "theory").glob("[0-9]*.md"))
    written = "".join(page.read_text(encoding="utf-8") for page in pages)
    shown = [int(n) for n in re.findall(r"\\tag\{(\d+)\}", numbered)]
    assert len(shown) > 140 and sorted(shown) == list(range(1, written.count("\\tag{") + 1))
    robot = (site / "reference" / "robot-file.html").read_text(encoding="utf-8")
    for key in ("young_modulus_Pa", "hub_inertia_kg_m2", "gravity_m_s2", "beta_s", "at_m"):
        assert f">{key}<" in robot
    assert "kg/m³" in robot and "≤ 200" in robot and ">required<" in robot
    from flexlab.cli.app import COMMANDS

    commands = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    for name in COMMANDS:
        assert f">flexura {name}<" in commands
    python = (site / "reference" / "python.html").read_text(encoding="utf-8")
    for name in set(fx.__all__) - {"signals"}:
        assert f'id="flexura.{name}"' in python or f".{name}" in python, name
    assert "Args:" not in python  # headings were read


def test_every_public_name_has_its_place_in_the_reference():
    text = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    assert [name for name in fx.__all__ if not re.search(rf"\b{name}\b", text)] == []


@pytest.mark.slow
def test_a_dead_link_stops_the_build(tmp_path):
    (tmp_path / "conf.py").write_text((DOCS / "conf.py").read_text(encoding="utf-8"))
    (tmp_path / "_site").symlink_to(DOCS / "_site")
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html"]
    for text, missing in (("[nowhere](no-page.md)", "no-page.md"), ("Equation (108)", "eq-108")):
        (tmp_path / "index.md").write_text(f"# A page\n\n{text}\n")
        done = subprocess.run(
            [*command, str(tmp_path), str(tmp_path / "out")],
            capture_output=True,
            text=True,
            env={"PATH": "", "PYTHONPATH": str(DOCS)},
        )
        assert done.returncode != 0 and missing in done.stderr


def test_every_channel_is_described():
    """The page has each channel of a simulation, numbers as letters."""
    rows = (DOCS / "reference" / "channels.md").read_text(encoding="utf-8")
    robot = fx.load(ROOT / "model" / "robots" / "type-1-rr.toml")
    for name, unit in channel_units(robot).items():
        general = re.sub(r"/\d+$", "/k", re.sub(r"/\d+/", "/i/", name))
        row = next((row for row in rows.splitlines() if f"`{general}`" in row), None)
        assert row is not None, name
        assert unit in row, name


def test_pages_are_in_the_table_of_contents():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    for path in DOCS.rglob("*.md"):
        if path.name != "index.md":
            assert path.relative_to(DOCS).with_suffix("").as_posix() in index, path


@pytest.mark.slow
def test_tables_of_keys_have_units_defaults_and_bounds(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    from _site import tables

    assert tables.unit("hub_inertia_kg_m2") == "kg m²" and tables.unit("elements") == ""
    text = tables.robot_file()
    assert "| `elements` |  | `0` | ≥ 0, ≤ 200 |" in text
    assert "| `beta_s` | s | `0.0` | ≥ 0, ≤ 10 |" in text
    assert "| `mass_per_length_kg_m` | kg/m |  | ≥ 0, ≤ 1e+06 |" in text
    assert "| `cycloid` | `end`, `duration_s`, `start` (0), `at_s` (0) |" in tables.signals()
    assert "## flexura bench inverse" in tables.commands()
