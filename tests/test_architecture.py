"""Which package may know which, what a bare import costs, and habits that no linter knows."""

import ast
import inspect
import re
import subprocess
import sys
from collections import defaultdict
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
# The rooms of each house, the top floor first: a room imports only what stands on floors below it.
FLOORS = {
    "flexura": [
        {"gym", "interchange"},
        {"api", "moved"},
        {"population"},
        {"simulation"},
        {"control"},
        {"system"},
        {"link"},
        {"twin"},
        {"signals"},
        {"robot"},
        {"io"},
        {"core"},
        {"optional"},
        {"threads"},
        {"errors"},
    ],
    "flexlab": [
        {"cli", "benchmarks"},
        {"tuning"},
        {"studies"},
        {"crosscheck", "learning"},
        {"identification"},
        {"review"},
        {"comparison", "experiment"},
        {"recordings"},
        {"rig"},
        {"board"},
        {"runs", "paths"},
    ],
}
MAX_LINES = 360  # without docstrings, which describe each argument on a line of its own
GENERATED = {"flexlab.board.protocol.declaration"}  # tables, not to be read through
LONGER = {
    "flexlab.review.writer": "one archetype after another",
    "flexlab.cli.bench": "six commands",
    "flexura.twin.solve": "one run of Exudyn, from its settings to its failure",
}
HEAVY = {"distributed", "exudyn", "rerun", "pyarrow", "matplotlib", "PIL", "platformio", "pymoo"}
OUTSIDE_OF_THE_MODEL = ("rich", "typer", "rerun", "serial", "PIL")


def imports(module, *, top_only=False):
    """Full dotted names of the modules, and of the names from them, that a module imports."""
    path = MODULES[module]
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    found = set()
    for node in statements(ast.parse(path.read_text()).body, top_only):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parts = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*parts, base] if base else parts)
            found |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    return found


def statements(body, top_only):
    """All statements, or those only that run when the module is imported: no functions, nothing for
    type checkers."""
    for node in body:
        if top_only and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node
        inner = [
            child
            for child in ast.iter_child_nodes(node)
            if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case)
        ]
        yield from statements(inner, top_only)


def inside(name, package):
    return name == package or name.startswith(package + ".")


def home(name):
    """The module in which an imported name stands, or None for other projects."""
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name or None


def homes(module):
    """The project's modules that a module imports: the most specific of each name."""
    found = {home(name) for name in imports(module)} - {None, module}
    return {m for m in found if not any(other != m and inside(other, m) for other in found)}


def test_the_modules_are_found():
    assert {"flexura", "flexura.robot.link", "flexura.twin.solve", "flexlab.cli.app"} <= set(
        MODULES
    )
    assert "flexura.robot" in homes("flexura.link.section")
    assert "flexura.errors" in homes("flexura.twin.solve")


@pytest.mark.parametrize("module", MODULES)
def test_a_room_imports_only_from_floors_below(module):
    house, *room = module.split(".")
    if not room:
        return
    floor = {name: k for k, names in enumerate(FLOORS[house]) for name in names}
    assert room[0] in floor, f"{room[0]} stands on no floor"
    for used in homes(module):
        other, *part = used.split(".")
        if other != house or not part or part[0] == room[0]:
            continue
        assert floor[part[0]] > floor[room[0]], f"{module} imports {used}"


@pytest.mark.parametrize("module", [m for m in MODULES if inside(m, "flexlab")])
def test_the_laboratory_uses_the_model_by_its_packages(module):
    deep = {
        used
        for used in homes(module)
        if inside(used, "flexura")
        and used not in ("flexura.errors", "flexura.optional", "flexura.core", "flexura.threads")
        and MODULES[used].name != "__init__.py"
    }
    assert deep == set()


@pytest.mark.parametrize("module", [m for m in MODULES if inside(m, "flexura")])
def test_the_model_knows_no_laboratory_no_terminal_and_no_review(module):
    found = imports(module)
    assert not [n for n in found for p in (*OUTSIDE_OF_THE_MODEL, "flexlab") if inside(n, p)]


@pytest.mark.parametrize("module", [m for m in MODULES if inside(m, "flexura.twin")])
def test_the_twin_shares_only_descriptions_with_the_native_solver(module):
    used = {name.split(".")[1] for name in homes(module) if name.startswith("flexura.")}
    assert used <= {"errors", "io", "optional", "robot", "signals", "twin"}


@pytest.mark.parametrize("module", [m for m in MODULES if not inside(m, "flexura.twin")])
def test_the_native_solver_knows_no_twin(module):
    if inside(module, "flexura"):
        found = imports(module)
        assert not [n for n in found if inside(n, "flexura.twin") or inside(n, "exudyn")]


def test_no_circle_of_imports():
    """Each module after those that it imports; packages stand for the modules that they offer."""
    graph = {m: homes(m) for m in MODULES}
    state = {}

    def visit(module, way):
        if state.get(module) == "done":
            return
        assert state.get(module) != "open", " -> ".join([*way[way.index(module) :], module])
        state[module] = "open"
        for used in sorted(graph[module]):
            if not inside(module, used):  # a package that is being filled
                visit(used, [*way, module])
        state[module] = "done"

    for module in MODULES:
        visit(module, [])


@pytest.mark.parametrize("module", MODULES)
def test_no_import_of_the_project_hides_in_a_function(module):
    hidden = imports(module) - imports(module, top_only=True)
    assert not [name for name in hidden if inside(name, "flexura") or inside(name, "flexlab")]


@pytest.mark.parametrize("module", MODULES)
def test_what_is_heavy_is_imported_where_it_is_used(module):
    assert not {name.split(".")[0] for name in imports(module, top_only=True)} & HEAVY


@pytest.mark.parametrize("module", MODULES)
def test_no_private_name_of_another_module_is_imported(module):
    path = MODULES[module]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            private = [a.name for a in node.names if a.name.startswith("_")]
            assert not [p for p in private if not p.startswith("__")], private


def test_a_folder_has_at_most_fourteen_rooms():
    """Of each package; in cli/ each command is a file, and FLOORS lists the rooms of a house."""
    for house, folder in ROOTS.items():
        rooms = defaultdict(set)
        for package in [p.parent for p in folder.rglob("__init__.py")]:
            rooms[package] = {
                p.name
                for p in package.iterdir()
                if p.suffix == ".py" or (p / "__init__.py").exists()
            } - {"__init__.py"}
        wide = {str(p.relative_to(folder)): len(r) for p, r in rooms.items() if len(r) > 14}
        assert set(wide) <= {"cli", "."}, (house, wide)


def test_a_bare_import_of_the_laboratory_costs_nothing():
    code = f"import sys; sys.path[:0] = {[str(r.parent) for r in ROOTS.values()]}; import flexlab"
    code += "; print(*sys.modules)"
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert not {"numpy", "flexura"} & set(loaded.stdout.split())


def test_a_bare_import_of_the_model_loads_nothing_heavy():
    code = f"import sys; sys.path[:0] = {[str(ROOTS['flexura'].parent)]}; import flexura"
    code += ", flexura.twin; print(*sys.modules)"
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    found = set(loaded.stdout.split())
    assert "flexura.twin" in found and not (HEAVY | set(OUTSIDE_OF_THE_MODEL)) & found


@pytest.mark.parametrize("module", MODULES)
def test_a_module_can_be_read_in_one_sitting(module):
    text = MODULES[module].read_text()
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    described = [
        node.body[0].end_lineno - node.body[0].lineno + 1
        for node in ast.walk(ast.parse(text))
        if isinstance(node, documented) and ast.get_docstring(node) is not None
    ]
    lines = len(text.splitlines()) - sum(described)
    assert module in GENERATED or lines <= (410 if module in LONGER else MAX_LINES)


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
    assert [f.__name__ for f in public if not inspect.getdoc(getattr(f, "__func__", f))] == []


def test_every_public_name_is_listed():
    assert set(flexura.__all__) <= set(dir(flexura))
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = flexura.simulat


def test_no_file_names_a_place_on_somebodys_machine():
    """Absolute paths of a home folder, a mounted work folder or a temporary one."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    folders = (b"home", b"Users", b"root", b"work", b"workspace", b"tmp")
    places = re.compile(rb"(?<![\w.<}~])/(?:%s)/\w" % b"|".join(folders))
    found = []
    for name in listed.stdout.decode().split("\0"):
        path = ROOT / name
        if name and path.is_file() and not path.is_symlink():
            for k, line in enumerate(path.read_bytes().splitlines(), 1):
                if places.search(line):
                    found.append(f"{name}:{k}: {line[:100].decode(errors='replace')}")
    assert found == []


# Modules of the standard library that Windows lacks.
POSIX = {"crypt", "fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"}


def test_what_windows_lacks_is_imported_under_a_test_of_the_platform():
    bare, guarded = [], []
    for module, path in MODULES.items():
        tree = ast.parse(path.read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                found = [f"{module}: {a.name}" for a in node.names if a.name in POSIX]
                (bare if node in tree.body else guarded).extend(found)
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module in POSIX:
                bare.append(f"{module}: {node.module}")
    assert not bare
    assert len(guarded) >= 3
