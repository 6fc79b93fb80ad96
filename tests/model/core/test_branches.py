"""Branches of model/core: of the files that branches.toml names, each is taken by the core's tests
or explained there. Of the others it is counted how many are not taken."""

import shutil
import tomllib
from pathlib import Path

import pytest

import core_coverage
from branch_coverage import explained, function_name, untaken

LIST = Path(__file__).with_name("branches.toml")
HELD = tomllib.loads(LIST.read_text(encoding="utf-8"))["held"]


def test_a_function_has_its_name_without_arguments_and_instances():
    for demangled, name in {
        "flexura::Loop<double>::go_on(double, bool)": "Loop::go_on",
        "void flexura::at<flexura::Pack<4> >(std::vector<int, std::allocator<int> > const&)": "at",
        "flexura::run(int, double*)::{lambda(auto:1)#2}::operator()<int>(int) const": "run",
        "flexura::(anonymous namespace)::Worker::of(int) const": "Worker::of",
        "flexura::Pack<4> flexura::operator<< <4>(flexura::Pack<4>, double)": "operator",
    }.items():
        assert function_name(demangled) == name


def test_what_is_explained_stands_in_a_file_that_is_held():
    assert HELD == sorted(set(HELD))
    for file in HELD:
        assert (core_coverage.CORE / file).exists(), file
    for file, _, text in explained(LIST):
        assert file in HELD
        assert text in (core_coverage.CORE / file).read_text(encoding="utf-8")


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.skipif(not shutil.which("gcov"), reason="no gcov on this machine")
def test_every_branch_is_taken_or_explained(tmp_path, capsys):
    found = core_coverage.measured(tmp_path)
    missed = untaken(found)
    with capsys.disabled():
        for name, chosen in ("held", True), ("others", False):
            here = {line: taken for line, taken in found.items() if (line.file in HELD) == chosen}
            total, lost = sum(map(len, here.values())), sum(untaken(here).values())
            print(f"{total - lost} of {total} branches of model/core taken: {name}")
    assert {place: n for place, n in missed.items() if place[0] in HELD} == explained(LIST)
    assert {line.file for line in found} >= set(HELD)
