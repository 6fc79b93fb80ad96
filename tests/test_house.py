"""Who may import whom, what a bare import costs, and a few habits of the house that no linter
knows."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import flexura

ROOT = Path(__file__).resolve().parents[1]
ROOTS = {"flexura": ROOT / "model" / "flexura", "flexlab": ROOT / "analysis" / "flexlab"}
MODULES = {
    ".".join([package, *path.relative_to(folder).with_suffix("").parts]).removesuffix(
        ".__init__"
    ): path
    for package, folder in ROOTS.items()
    for path in sorted(folder.rglob("*.py"))
}
MAX_LINES = 400
LONGER = {
    "flexura.loop": "both methods and their step control run in one compiled piece",
    "flexlab.board.protocol.declaration": "generated: tables, not to be read through",
}
TWIN_MAY_USE = {"errors", "robot", "run", "drive", "signals", "twin"}
HEAVY = {"distributed", "exudyn", "rerun", "pyarrow", "matplotlib", "PIL", "platformio", "pymoo"}
ADAPTERS = {
    "rerun": "flexlab.review"
}  # the one package that adapts it, and is itself imported only when used


def imports(module, *, top_only=False):
    """Full dotted names of the modules, and of the names from them, that a module imports."""
    path = MODULES[module]
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    found = set()
    for node in nodes(ast.parse(path.read_text()).body, top_only):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parts = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*parts, base] if base else parts)
            found |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    return found


def nodes(body, top_only):
    """All statements, or those only that run when the module is imported: no functions, no `if
    TYPE_CHECKING`."""
    for node in body:
        if top_only and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if top_only and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node
        inner = [
            child
            for child in ast.iter_child_nodes(node)
            if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case)
        ]
        yield from nodes(inner, top_only)


def inside(name, package):
    return name == package or name.startswith(package + ".")


def test_the_modules_are_found():
    assert {
        "flexura",
        "flexura.robot.robot",
        "flexura.twin",
        "flexura.twin.solve",
        "flexlab.cli.app",
    } <= set(MODULES)
    assert "flexura.robot.robot" in imports("flexura.link.section") and "flexura.errors" in imports(
        "flexura.twin.solve"
    )


@pytest.mark.parametrize("module", [m for m in MODULES if inside(m, "flexura")])
def test_the_model_knows_no_laboratory(module):
    assert not [name for name in imports(module) if inside(name, "flexlab")]


@pytest.mark.parametrize("module", [m for m in MODULES if inside(m, "flexura.twin")])
def test_the_twin_shares_only_descriptions_with_the_native_solver(module):
    used = {name.split(".")[1] for name in imports(module) if name.startswith("flexura.")}
    assert used <= TWIN_MAY_USE


@pytest.mark.parametrize(
    "module", [m for m in MODULES if inside(m, "flexura") and not inside(m, "flexura.twin")]
)
def test_the_native_solver_knows_no_twin(module):
    assert not [
        name for name in imports(module) if inside(name, "flexura.twin") or inside(name, "exudyn")
    ]


@pytest.mark.parametrize("module", [m for m in MODULES if inside(m, "flexura")])
def test_the_model_has_no_terminal_no_plots_and_no_review(module):
    assert not [
        n
        for n in imports(module)
        for p in ("rich", "typer", "matplotlib", "rerun", "serial", "PIL")
        if inside(n, p)
    ]


@pytest.mark.parametrize("module", MODULES)
def test_what_is_heavy_is_imported_where_it_is_used(module):
    at_top = {name.split(".")[0] for name in imports(module, top_only=True)} & HEAVY
    assert {name for name in at_top if not inside(module, ADAPTERS.get(name, "none"))} == set()


@pytest.mark.parametrize(
    "module", [m for m in MODULES if not any(inside(m, adapter) for adapter in ADAPTERS.values())]
)
def test_an_adapter_of_something_heavy_is_itself_imported_where_it_is_used(module):
    assert not [
        name
        for name in imports(module, top_only=True)
        for adapter in ADAPTERS.values()
        if inside(name, adapter)
    ]


# Parts of the command that import nothing themselves.
COMMANDS = (
    "flexlab.cli.output",
    "flexlab.cli.compare",
    "flexlab.cli.bench",
    "flexlab.cli.export",
    "flexlab.cli.identify",
    "flexlab.cli.tune",
    "flexlab.cli.demo",
)


@pytest.mark.parametrize("module", ["flexlab.cli.app", *COMMANDS])
def test_the_command_imports_nothing_of_the_project_at_its_top(module):
    """But what its parts share, which itself imports nothing."""
    found = imports(module, top_only=True)
    parts = {package for part in COMMANDS for package in (part, part.rpartition(".")[0])}
    own = [
        name
        for name in found
        if inside(name, "flexlab")
        and name not in parts
        and not any(inside(name, c) for c in COMMANDS)
    ]
    assert not [n for n in found if inside(n, "flexura")] and not own


@pytest.mark.parametrize(
    "package, without",
    [
        ("flexura", {"flexura.core", "pydantic", "numpy", "scipy"}),
        ("flexlab", {"numpy", "flexura"}),
    ],
)
def test_a_bare_import_costs_nothing(package, without):
    code = (
        f"import sys; sys.path[:0] = {[str(r.parent) for r in ROOTS.values()]}; import "
        f"{package}; print(*sys.modules)"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    ).stdout.split()
    assert package in loaded and not without & set(loaded)


def test_the_twin_needs_no_exudyn_until_it_is_used():
    code = (
        f"import sys; sys.path[:0] = {[str(r.parent) for r in ROOTS.values()]}; import "
        f"flexura.twin; print(*sys.modules)"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    ).stdout.split()
    assert "flexura.twin" in loaded and "exudyn" not in loaded
    assert not {
        "flexura.core",
        "flexura.link",
        "flexura.system",
        "flexura.simulation.simulate",
    } & set(loaded)


@pytest.mark.parametrize("module", MODULES)
def test_a_module_can_be_read_in_one_sitting(module):
    lines = len(MODULES[module].read_text().splitlines())
    assert lines <= (500 if module in LONGER else MAX_LINES)


@pytest.mark.parametrize("module", MODULES)
def test_a_module_says_what_it_is(module):
    assert ast.get_docstring(ast.parse(MODULES[module].read_text()))


@pytest.mark.parametrize("name", flexura.__all__)
def test_a_public_name_says_what_it_is(name):
    """Classes and functions, their public methods and properties too."""
    thing = getattr(flexura, name)
    assert (thing.__doc__ or "").strip()
    if inspect.isfunction(thing):
        return
    own = {
        k: v for k, v in vars(thing).items() if not k.startswith("_") and not k.startswith("model_")
    }
    public = [
        v
        for v in own.values()
        if inspect.isfunction(v) or isinstance(v, staticmethod | classmethod)
    ]
    unsaid = [
        f.__name__
        for f in public
        if not inspect.getdoc(getattr(f, "__func__", f))
        and len(inspect.getsource(f).splitlines()) > 4
    ]
    assert unsaid == []


def test_every_public_name_has_a_home_and_is_listed():
    assert set(flexura.__all__) == set(flexura._HOME) and set(flexura.__all__) <= set(dir(flexura))
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = flexura.simulat


def test_no_file_names_a_place_on_somebodys_machine():
    """Absolute paths of a home folder, a mounted work folder or a temporary one."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    places = re.compile(
        rb"(?<![\w.<}~])/(?:%s)/\w"
        % b"|".join((b"home", b"Users", b"root", b"work", b"workspace", b"tmp"))
    )
    found = []
    for name in listed.stdout.decode().split("\0"):
        path = ROOT / name
        if name and path.is_file() and not path.is_symlink():
            for k, line in enumerate(path.read_bytes().splitlines(), 1):
                if places.search(line):
                    found.append(f"{name}:{k}: {line[:100].decode(errors='replace')}")
    assert found == []
