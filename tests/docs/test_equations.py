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
CITATIONS = table.citations(ROOT)
MOST = 3  # numbers in the docstring of a function


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


@pytest.mark.parametrize("equation", EQUATIONS, ids=lambda e: str(e.number))
def test_an_equation_is_cited_by_what_computes_it(equation):
    named = [name for name in CITATIONS.get(equation.number, ()) if not table.is_file(name)]
    assert named, f"no function cites ({equation.number}), {equation.name}"


def test_the_code_cites_equations_that_there_are():
    assert set(CITATIONS) <= {e.number for e in EQUATIONS}


def test_a_function_cites_three_equations_at_most():
    for path in sorted((ROOT / table.PYTHON).rglob("*.py")):
        for name, text in table.docstrings(path):
            assert len(set(table.written(text))) <= MOST, (path.name, name)


def test_citations_are_found_in_docstrings_and_comments(tmp_path):
    text = "The energies (20), (21) to (23); g'' + d g' = 0, g(0) = 0, P_(3), order 4(3), f(x) (9)."
    assert table.cited(text) == {9, 20, 21, 22, 23} and table.written(text) == [20, 21, 23, 9]
    (tmp_path / "a.py").write_text(
        'class A:\n    def f(self):\n        """As (7)."""\n        (8)\n'
    )
    assert dict(table.docstrings(tmp_path / "a.py")) == {"": "", "A": "", "A.f": "As (7)."}
    (tmp_path / "a.hpp").write_text("// From (7)\n// to (9).\nf(5);  // (1)\n")
    found = table.comments(tmp_path / "a.hpp")
    assert [table.cited(text) for _, text in found] == [{7, 8, 9}, {1}]


FIELD = {  # what somebody looks for by a word of the field, and where it is computed
    "point on a bent link": "dynamics/piece/kinematics.hpp: tip_columns",
    "condensation": "dynamics/piece/condensation.hpp: eliminate",
    "out of its sleeve": "dynamics/piece/sleeve.hpp: sleeve_force_row",
    "coulomb friction": "dynamics/friction.hpp: coulomb_friction",
    "exponential predictor": "integration/exponential/predictor_corrector.hpp: predict",
    "anti-windup": "firmware/lib/control/src/pid.h: update",
    "stop at a limit": "integration/time_loop.hpp: stop_at_limit",
    "payload with its rotary inertia": "link/piece_draft.hpp: add_payload",
    "guyan": "dynamics/piece/condensation.hpp: eliminate",
    "articulated-body": "dynamics/forward_dynamics.hpp: eliminate_joint",
    "foreshortening": "system.kinematics.line",
    "shape functions": "link.line.mesh",
    "assumed modes": "link.modes.clamped_modes",
    "tip mass": "link/piece_draft.hpp: add_payload",
    "proportional damping": "robot.damping.rayleigh",
    "coriolis and": "system.assembly.Assembly.bias",
    "newton-raphson": "system.statics.equilibrium",
    "eigenfrequencies": "statics_and_modes/natural_modes.hpp: natural_modes",
    "lanczos": "statics_and_modes/natural_modes.hpp: lowest_modes",
    "linearization": "statics_and_modes/linearization.hpp: linearise",
    "dry friction": "dynamics/friction.hpp: coulomb_friction",
    "back-emf": "control.pid.Motor",
    "computed torque": "dynamics/inverse_dynamics.hpp: forces",
    "low-pass filter": "control.controller.filter_coefficient",
    "lqr": "control.linear_quadratic.riccati.riccati",
    "kalman": "control.linear_quadratic.gaussian_design.gaussian_design",
    "input shaping": "signals.shaping.zv",
    "dormand-prince": "integration/runge_kutta/dop853.hpp: look",
    "step size": "integration/method.hpp: next",
    "rosenbrock": "simulation/copies.hpp: advance",
    "adams-bashforth": "integration/exponential/predictor_corrector.hpp: predict",
    "dense output": "integration/exponential/dense_output.hpp: at",
    "matrix exponential": "simulation.dense.propagator.Modes._double",
    "energy error": "simulation.recorder.energy_error",
    "elastic joint": "robot.joint.Transmission",
    "iterative learning": "control.ilc.LearningLaw.update",
    "gain margin": "control.linear_quadratic.loop_figures.LoopMargins",
    "follower force": "signals.load.Load",
    "pick-up": "system.loads.impact",
    "bearing force": "system.balance.cuts.Balance.reaction",
    "shear force": "system.balance.cuts.Balance.section",
    "disturbance estimate": "firmware/lib/control/src/disturbance_observer.h: update",
}


@pytest.mark.parametrize("word", FIELD)
def test_an_equation_is_found_by_the_fields_word_in_two_look_ups(word):
    """The word is in three rows of the table at most; one names what computes the equation."""
    found = [e.number for e in EQUATIONS if word in f"{e.name}; {e.also}".lower()]
    assert 1 <= len(found) <= 3
    assert any(FIELD[word] in CITATIONS[number] for number in found)


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


def test_renumbering_changes_citations_and_nothing_else(tmp_path):
    """An equation that was put between the first two."""
    chapter = tmp_path / "docs" / "theory" / "01-a.md"
    code = tmp_path / "model" / "flexura" / "a.py"
    for path in (chapter, code):
        path.parent.mkdir(parents=True)
    entry = '<a id="eq-{0}"></a>**Name {0}.**\n\n$$\nx = {0} \\tag{{{0}}}\n$$\n'
    chapter.write_text("".join(entry.format(n) for n in (1, 3, 2)) + "By (1) to (2), (12).\n")
    code.write_text('def f(x):\n    """As (2), (3)."""\n    return (2) + x[(3)]  # (2)\n')
    assert table.renumber(tmp_path) == {3: 2, 2: 3}
    assert [e.number for e in table.equations(tmp_path)] == [1, 2, 3]
    assert "x = 3 \\tag{2}" in chapter.read_text() and "By (1) to (3), (12)." in chapter.read_text()
    assert code.read_text() == (
        'def f(x):\n    """As (3), (2)."""\n    return (2) + x[(3)]  # (3)\n'
    )
    chapter.write_text(entry.format(1) * 2)
    with pytest.raises(ValueError, match="twice"):
        table.renumber(tmp_path)
