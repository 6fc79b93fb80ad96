"""Each numbered equation of docs/theory stands once, has a test, and is in the table."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
_SPEC = importlib.util.spec_from_file_location("equations_table", ROOT / "tools" / "equations.py")
table = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(table)
EQUATIONS = table.equations(ROOT)
TESTS = table.tested(ROOT)


def test_the_numbers_run_from_one_in_the_order_of_the_chapters():
    assert [e.number for e in EQUATIONS] == list(range(1, len(EQUATIONS) + 1))
    assert len(EQUATIONS) > 90


@pytest.mark.parametrize("equation", EQUATIONS, ids=lambda e: str(e.number))
def test_an_equation_has_a_name_and_an_anchor(equation):
    assert equation.name and equation.anchor == f"eq-{equation.number}"
    assert equation.latex.count("\\tag") == 1 and equation.latex.count("{") == equation.latex.count(
        "}"
    )


@pytest.mark.parametrize("equation", EQUATIONS, ids=lambda e: str(e.number))
def test_an_equation_is_evaluated_by_a_test(equation):
    assert TESTS.get(equation.number), (
        f"no test in tests/docs names ({equation.number}), {equation.name}"
    )


def test_tests_name_equations_that_there_are():
    assert set(TESTS) <= {e.number for e in EQUATIONS}


def test_references_in_the_chapters_lead_to_equations():
    last = len(EQUATIONS)
    for chapter in table.chapters(ROOT):
        text = re.sub(r"\$\$.*?\$\$", "", chapter.read_text(), flags=re.S)
        text = re.sub(r"\$[^$]*\$", "", text)
        for number in re.findall(r"(?<![\w)])\((\d{1,3})\)", text):
            assert 1 <= int(number) <= last, (chapter.name, number)


def test_every_symbol_table_comes_before_its_equations():
    for chapter in table.chapters(ROOT):
        text = chapter.read_text()
        assert 0 < text.find("| symbol | unit | meaning |") < text.find("\\tag{"), chapter.name


def test_the_table_is_up_to_date():
    made = (ROOT / "docs" / "theory" / "equations.md").read_text()
    assert made == table.table(ROOT), "python tools/equations.py writes it"


def test_a_number_without_a_name_is_refused(tmp_path):
    (tmp_path / "docs" / "theory").mkdir(parents=True)
    (tmp_path / "docs" / "theory" / "01-x.md").write_text("$$ a = b \\tag{1} $$")
    with pytest.raises(ValueError, match=r"01-x\.md"):
        table.equations(tmp_path)
