"""Every branch of model/core is taken by the core's tests, or explained in branches.toml."""

import shutil
from pathlib import Path

import pytest

import core_coverage
from branch_coverage import explained, function_name, untaken

LIST = Path(__file__).with_name("branches.toml")


def test_a_function_has_its_name_without_arguments_and_instances():
    for demangled, name in {
        "flexura::Loop<double>::go_on(double, bool)": "Loop::go_on",
        "void flexura::at<flexura::Pack<4> >(std::vector<int, std::allocator<int> > const&)": "at",
        "flexura::run(int, double*)::{lambda(auto:1)#2}::operator()<int>(int) const": "run",
        "flexura::(anonymous namespace)::Worker::of(int) const": "Worker::of",
        "flexura::Pack<4> flexura::operator<< <4>(flexura::Pack<4>, double)": "operator",
    }.items():
        assert function_name(demangled) == name


def test_what_is_explained_stands_in_its_file():
    for file, _, text in explained(LIST):
        assert text in (core_coverage.CORE / file).read_text(encoding="utf-8")


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.skipif(not shutil.which("gcov"), reason="no gcov on this machine")
def test_every_branch_is_taken_or_explained(tmp_path, capsys):
    found = core_coverage.measured(tmp_path)
    missed = untaken(found)
    total = sum(map(len, found.values()))
    with capsys.disabled():
        print(f"{total - sum(missed.values())} of {total} branches of model/core taken")
    assert missed == explained(LIST)
    assert total > 5000
