"""The wheel in an environment of its own, without extras: its weight, and every command from a
folder that knows nothing of the checkout."""

import importlib.util
import json
import os
import re
import subprocess
import venv
from pathlib import Path

import pytest

from flexlab.cli.app import COMMANDS
from flexura.io import shipped_files
from flexura.optional import EXTRAS

ROOT = Path(__file__).resolve().parents[1]
MOST_PACKAGES, MOST_BYTES = 18, 400e6
pytestmark = [pytest.mark.slow, pytest.mark.timeout(3000)]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The folder of the programs of an environment with the wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    spec = importlib.util.spec_from_file_location("flexura_wheel", ROOT / "tools" / "wheel.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    wheel = module.build(folder / "dist")
    assert "linux" not in wheel.name or "manylinux" in wheel.name
    venv.create(folder / "venv", with_pip=True)
    programs = folder / "venv" / "bin"
    pip = [programs / "python", "-m", "pip", "install", "-q", "--no-compile"]
    versions = folder / "versions.txt"  # the hashes would ask for one of the wheel too
    pattern = re.compile(r"^[a-z0-9-]+==\S+(?: ; [^\\]+)?", re.MULTILINE)
    versions.write_text("\n".join(pattern.findall((ROOT / "constraints.txt").read_text())))
    subprocess.run([*pip, "-c", versions, wheel], check=True)
    return programs


@pytest.fixture(scope="module")
def away(tmp_path_factory):
    return tmp_path_factory.mktemp("away")


@pytest.fixture
def flexura(installed, away):
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    clean |= {"PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": "80"}

    def run(*arguments):
        return subprocess.run(
            [installed / "flexura", *map(str, arguments)],
            cwd=away,
            env=clean,
            capture_output=True,
            text=True,
            timeout=600,
            stdin=subprocess.DEVNULL,
        )

    return run


def test_the_weight_without_extras(installed):
    (packages,) = installed.parent.glob("lib/python*/site-packages")
    tools = ("pip", "setuptools", "_distutils_hack", "distutils-precedence", "pkg_resources")
    names = {p.name for p in packages.glob("*.dist-info") if not p.name.startswith(tools)}
    files = [
        p
        for p in packages.rglob("*")
        if p.is_file()
        and "__pycache__" not in p.parts
        and not p.relative_to(packages).parts[0].startswith(tools)
    ]
    assert len(names) <= MOST_PACKAGES, sorted(names)
    assert sum(p.stat().st_size for p in files) <= MOST_BYTES
    assert not {p.relative_to(packages).parts[0] for p in files} & set(EXTRAS)


def test_the_first_commands_run_from_any_folder(flexura):
    assert flexura("--version").stdout.startswith("flexura ")
    listed = json.loads(flexura("robots", "--json").stdout)
    assert {row["name"] for row in listed} == set(shipped_files("robots"))
    done = flexura("simulate", "rig", "rig-inverse-law", "--controller", "rig", "--out", "run")
    assert done.returncode == 0, done.stderr
    assert flexura("new", "my-arm.toml").returncode == 0
    assert flexura("frequencies", "my-arm.toml").returncode == 0
    assert flexura("inverse", "rig", "rig-inverse-law", "--out", "inv").returncode == 0
    assert flexura("export", "run", "--to", "csv", "--out", "run.csv").returncode == 0
    varied = flexura("simulate", "rig", "--vary", "payload.mass_kg=0:0.1:3", "--out", "many")
    assert varied.returncode == 0, varied.stderr


def test_the_demonstration_does_what_it_can_and_says_what_is_missing(flexura, away):
    done = flexura("demo", "--out", "demo")
    assert done.returncode == 0, done.stderr
    assert 'no cross-check: exudyn is not installed; type: pip install "flexura[twin]"' in (
        " ".join(done.stdout.split())
    )
    assert "no experiment: the firmware's sources are not in an installed package" in done.stdout
    assert list((away / "demo").rglob("run.parquet"))


@pytest.mark.parametrize(
    ("arguments", "package"),
    [
        (["crosscheck", "rig"], "exudyn"),
        (
            ["study", "payload", "type-1-rr", "type-1-bang-bang", "--values", "0:0.1:2"],
            "matplotlib",
        ),
        (["tune", "rig", "rig-step", "--controller", "rig"], "pymoo"),
        (["review", "run", "--save", "run.rrd"], "rerun"),
        (["export", "run", "--to", "tdms"], "nptdms"),
        (["export", "run", "--to", "mcap"], "mcap"),
        (["bench", "forward"], "exudyn"),
        (["flash"], "serial"),
    ],
    ids=lambda value: value if isinstance(value, str) else value[0],
)
def test_a_missing_extra_is_one_sentence(flexura, away, arguments, package):
    flexura("simulate", "rig", "--out", "run")
    before = sorted(p for p in away.rglob("*") if p.is_file())
    done = flexura(*arguments)
    said = f'flexura: {package} is not installed; type: pip install "flexura[{EXTRAS[package]}]"\n'
    assert (done.returncode, done.stderr) == (2, said)
    assert sorted(p for p in away.rglob("*") if p.is_file()) == before


def test_the_firmware_says_where_it_is(flexura):
    done = flexura("flash", "--emulated")
    assert done.returncode == 2 and "in a checkout of the project" in done.stderr


def test_doctor_tells_what_extras_are_for(flexura):
    found = {f["what"]: f for f in json.loads(flexura("doctor", "--json").stdout)}
    assert found["numpy"]["state"] == "ok" and found["rig"]["state"] == "ok"
    for name, extra in (("exudyn", "twin"), ("matplotlib", "lab"), ("pymoo", "tune")):
        assert found[name]["state"] == "absent"
        assert found[name]["cost"].endswith(f'pip install "flexura[{extra}]"')


@pytest.mark.parametrize("name", COMMANDS)
def test_help_needs_no_extra(flexura, name):
    done = flexura(name, "--help")
    assert done.returncode == 0 and "Usage" in done.stdout and done.stderr == ""


def test_types_are_shipped(installed):
    (packages,) = installed.parent.glob("lib/python*/site-packages")
    assert all((packages / name / "py.typed").is_file() for name in ("flexura", "flexlab"))
