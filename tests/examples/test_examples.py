"""The examples: scripts meet their analytic answers and can miss them; notebooks run from their
first cell to their last."""

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import flexura

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(EXAMPLES.glob("[0-9]*.py"))
NOTEBOOKS = sorted((EXAMPLES / "notebooks").glob("*.ipynb"))
LIBRARIES = {
    "argparse",
    "collections",
    "comparison",
    "control",
    "flexura",
    "fmpy",
    "gymnasium",
    "numpy",
    "pathlib",
    "scipy",
    "tempfile",
}
MODULES = {
    "flexura.control",
    "flexura.signals.shaping",
    "flexura.signals",
    "flexura.gym",
    "flexura.interchange",
}  # public, though not names of `flexura` itself
ROW = re.compile(r"^.+  +(\S+)  +(\S+)  +(\d\.\de[+-]\d\d)$")
PNG = b"\x89PNG\r\n"


def python(
    *arguments: object, cwd: Path, path: tuple[Path, ...] = ()
) -> subprocess.CompletedProcess[str]:
    """A Python process that finds this checkout, and draws without a screen."""
    found = os.pathsep.join(map(str, (*path, ROOT / "model", ROOT / "analysis")))
    surroundings = os.environ | {
        "PYTHONPATH": found,
        "MPLBACKEND": "Agg",
        "PYTHONIOENCODING": "utf-8",
    }
    line = [sys.executable, *map(str, arguments)]
    return subprocess.run(
        line,
        cwd=cwd,
        env=surroundings,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=280,
    )


def docstring(script: Path) -> str:
    return ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""


def cited(text: str) -> list[str]:
    """The numbers of the equations that a docstring cites, in its order: "Equations (5) and
    (6)"."""
    lists = re.findall(r"Equations? ((?:\(\d+\)(?:, | and )?)+)", text)
    return re.findall(r"\d+", " ".join(lists))


def name(path: Path) -> str:
    return path.stem


def test_the_examples_are_found():
    assert len(SCRIPTS) >= 20 and len(NOTEBOOKS) == 5


# ---- scripts


@pytest.mark.parametrize("script", SCRIPTS, ids=name)
def test_a_script_meets_its_analytic_answers(script, tmp_path):
    done = python(script, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    title, header, *rows, last = done.stdout.splitlines()
    assert title == docstring(script).splitlines()[0].rstrip(".")
    assert header.split() == ["found", "analytic", "rel.", "diff."]
    differences = [float(ROW.match(row)[3]) for row in rows]
    largest, bound = map(
        float, re.match(r"largest relative difference (\S+), bound (\S+): met$", last).groups()
    )
    assert len(rows) >= 2 and max(differences) == largest <= bound
    assert bound <= 2e-3 and max(map(len, done.stdout.splitlines())) <= 80
    assert list(tmp_path.iterdir()) == []  # no figure unless it is asked for


@pytest.mark.parametrize(
    "script",
    [SCRIPTS[0], *(pytest.param(path, marks=pytest.mark.slow) for path in SCRIPTS[1:])],
    ids=name,
)
def test_a_script_draws_its_figure(script, tmp_path):
    done = python(script, "--plot", "figure.png", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "figure.png").read_bytes().startswith(PNG)


def test_a_script_ends_with_status_1_if_it_misses_its_bound(tmp_path):
    done = python(EXAMPLES / "02_tip_force.py", "--bound", "1e-16", cwd=tmp_path)
    assert done.returncode == 1 and done.stdout.endswith("bound 1.0e-16: MISSED\n")


@pytest.mark.parametrize(
    ("found", "status"), [("1.0 + 1e-7", 0), ("1.0 + 1e-5", 1), ("float('nan')", 1)]
)
def test_one_row_decides(found, status, tmp_path):
    """A value that is not a number misses every bound, in any row."""
    rows = (
        f"show.add('first', 1.0, 1.0); show.add('second', {found}, 1.0); show.add('third', "
        f"2.0, "
        f"2.0)"
    )
    code = (
        f"from comparison import Comparison; show = Comparison('Rows.', 1e-6); {rows}; show.end()"
    )
    assert python("-c", code, cwd=tmp_path, path=(EXAMPLES,)).returncode == status


def test_without_matplotlib_a_script_says_so_and_compares_all_the_same(tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise ImportError('none here')\n")
    done = python(
        EXAMPLES / "01_roll_up.py", "--plot", "figure.png", cwd=tmp_path, path=(tmp_path,)
    )
    assert done.returncode == 0 and done.stdout.endswith(": met\n")
    assert done.stderr == "no figure: matplotlib is missing (pip install matplotlib)\n"
    assert not (tmp_path / "figure.png").exists()


def test_each_script_is_on_an_equation_of_its_own():
    """The first equation that a docstring cites is in the theory, and no other script begins with
    it."""
    theory = "".join(
        path.read_text(encoding="utf-8")
        for path in sorted((ROOT / "docs" / "theory").rglob("*.md"))
    )
    numbers = set(re.findall(r"\\tag\{(\w+)\}", theory))
    firsts = {}
    for script in SCRIPTS:
        found = cited(docstring(script))
        assert found and set(found) <= numbers, script.name
        firsts[script.name] = found[0]
    assert len(set(firsts.values())) == len(firsts), firsts


@pytest.mark.parametrize("script", SCRIPTS, ids=name)
def test_a_script_is_short_and_uses_public_names_only(script):
    text = script.read_text(encoding="utf-8")
    assert 30 <= len(text.splitlines()) <= 80
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            assert {alias.name.split(".")[0] for alias in node.names} <= LIBRARIES
        if isinstance(node, ast.ImportFrom):
            assert node.module.split(".")[0] in LIBRARIES
            inside = node.module.startswith("flexura.")
            assert (
                node.module in MODULES
                if inside
                else node.module != "flexura" or [a.name for a in node.names] == ["twin"]
            )
        if isinstance(node, ast.Attribute):
            assert not node.attr.startswith("_")
            if isinstance(node.value, ast.Name) and node.value.id == "fx":
                assert node.attr in flexura.__all__


def test_the_readme_has_every_example_with_its_equations():
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    rows = {
        row[1]: row[2] for row in re.finditer(r"^\| \[(\S+)\]\(\1\) \|(.*)\|$", text, re.MULTILINE)
    }
    assert set(rows) == {script.name for script in SCRIPTS} | {
        f"notebooks/{notebook.name}" for notebook in NOTEBOOKS
    }
    for script in SCRIPTS:
        shown = re.findall(r"\((\d+)\)", rows[script.name].split("|")[0])
        assert shown == cited(docstring(script)), script.name


# ---- notebooks

RUN = """
import json, pathlib, sys
names = {"__name__": "__main__"}
for cell in json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))["cells"]:
    if cell["cell_type"] == "code":
        exec(compile("".join(cell["source"]), cell["id"], "exec"), names)
"""


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name)
def test_a_notebook_runs(notebook, tmp_path):
    """Its code cells in order, in one namespace, as a kernel would; a notebook's last cell checks
    what it found."""
    done = python("-c", RUN, notebook, cwd=tmp_path)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "Traceback" not in done.stderr and done.stdout


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name)
def test_a_notebook_is_a_valid_one_without_outputs(notebook):
    """What the schema of nbformat 4.5 asks for, as far as these notebooks go."""
    book = json.loads(notebook.read_text(encoding="utf-8"))
    assert set(book) == {"cells", "metadata", "nbformat", "nbformat_minor"}
    assert (book["nbformat"], book["nbformat_minor"]) == (4, 5)
    assert book["metadata"]["kernelspec"] == {
        "display_name": "Python 3",
        "language": "python",
        "name": "python3",
    }
    assert book["metadata"]["language_info"]["name"] == "python"
    cells = book["cells"]
    assert len({cell["id"] for cell in cells}) == len(cells)
    for cell in cells:
        assert re.fullmatch(r"[a-zA-Z0-9_-]{1,64}", cell["id"]) and cell["metadata"] == {}
        assert isinstance(cell["source"], list) and all(
            isinstance(line, str) for line in cell["source"]
        )
        if cell["cell_type"] == "code":
            assert set(cell) == {
                "cell_type",
                "execution_count",
                "id",
                "metadata",
                "outputs",
                "source",
            }
            assert cell["outputs"] == [] and cell["execution_count"] is None
        else:
            assert cell["cell_type"] == "markdown" and set(cell) == {
                "cell_type",
                "id",
                "metadata",
                "source",
            }
    assert cells[0]["cell_type"] == "markdown" and cells[0]["source"][0].startswith("# ")
    assert cells[-1]["cell_type"] == "code" and "assert " in "".join(cells[-1]["source"])
