"""Faults put into the board's library and the host's protocol on purpose: the tests notice at
least nine of ten that are no other words for the original. tests/support/mutation.py does it in
parts."""

from pathlib import Path

import pytest

import mutants
import mutation


def test_a_mutant_is_one_small_change():
    source = "int f(int a) {\n  if (a < 2 && !b) ++n;  // < 3\n  x = y(a);\n}"
    found = sorted(mutants.of_cpp("f.cpp", source))
    assert {(m.line, m.old, m.new) for m in found} >= {
        (2, "<", "<="),
        (2, "<", ">="),
        (2, "2", "3"),
        (2, "&&", "||"),
        (2, "!", ""),
        (2, "++", "--"),
        (3, "x = y(a);", ";"),
    }
    assert not [m for m in found if m.old == "3"]  # a comment
    for mutant in found:
        assert mutant.apply(source) != source
    source = "def f(a):\n    return a + 1 if not a < 2 else self.b\n"
    news = {(m.old, m.new) for m in mutants.of_python("f.py", source)}
    assert news == {
        ("+", "-"),
        ("1", "(1 + 1)"),
        ("not ", ""),
        ("<", "<="),
        ("<", ">="),
        ("2", "(2 + 1)"),
    }


def test_each_equivalent_mutant_is_one_of_the_sources():
    """A list that nobody looks at grows old."""
    known = set()
    for files, folder in ((mutation.BOARD, mutation.LIB), (mutation.HOST, mutation.PROTOCOL)):
        for name in files:
            for file in files[name]:
                known |= {m.name for m in mutants.of(Path(folder / file), mutation.ROOT)}
    listed = mutation.equivalent()
    assert set(listed) <= known, set(listed) - known
    assert all(len(reason) > 20 for reason in listed.values())


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("name", mutation.NAMES)
def test_nine_of_ten_mutants_are_noticed(name, capsys):
    with capsys.disabled():
        done = mutation.run(name)
    with capsys.disabled():
        counts = f"{done.killed} | {len(done.survived)} | {done.equivalent}"
        print(f"| {name} | {counts} |  {100 * done.score:.1f} %")
    assert done.score >= 0.9, done
