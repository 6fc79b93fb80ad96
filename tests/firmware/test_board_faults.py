"""The fault matrix: everything that can break is broken on the emulated board while it moves. For
each, the outputs are off in time (in cycles), the reason is right, the host is told, and only a
person's `clear` gets out of it.

The table in firmware/README.md is made of these measurements;
`python tests/support/fault_table.py` writes it.
"""

import pytest

from boards import COMPILERS, TICK
from breakdowns import OTHERS, flipped
from fault_table import agrees, line, table_in_readme
from faults import CASES, measure
from flexlab.board.emulator.simulator import CLOCK_HZ
from flexlab.board.protocol.declaration import Fault

both = pytest.mark.parametrize("compiler", COMPILERS)


@both
@pytest.mark.parametrize("name", CASES)
def test_outputs_off_reason_right_host_told(name, compiler):
    case, row = CASES[name], measure(name, compiler)
    assert 0 < row.after_detection <= TICK
    assert 0 < row.after_cause <= case.within_s * CLOCK_HZ + TICK
    is_in_the_readme(case.what, row, compiler)


@both
@pytest.mark.parametrize("name", OTHERS)
def test_what_no_control_tick_detects(name, compiler):
    other, row = OTHERS[name], OTHERS[name].measure(compiler)
    assert row.fault is other.fault
    assert 0 <= row.after_cause <= other.within_s * CLOCK_HZ + TICK
    assert row.after_detection is None or 0 < row.after_detection <= TICK
    is_in_the_readme(other.what, row, compiler)


def is_in_the_readme(what, row, compiler):
    if compiler == "debian":
        assert agrees(what, row, table_in_readme()), (
            f"python tests/support/fault_table.py; measured: {line(what, row)}"
        )


def test_the_table_in_the_readme_has_no_other_rows():
    told = [row.split(" | ")[0].removeprefix("| ") for row in table_in_readme()[2:]]
    assert told == [case.what for case in (*CASES.values(), *OTHERS.values())]


def test_flipped_bits_of_the_stored_configuration():
    assert flipped("debian", slice(3, None, 41)) >= 40


@pytest.mark.slow
@both
def test_every_flipped_bit_of_the_stored_configuration(compiler):
    assert flipped(compiler, slice(None)) >= 8 * 4 * 51


def test_every_fault_is_broken_somewhere():
    shown = {case.fault for case in (*CASES.values(), *OTHERS.values())} | {Fault.bad_configuration}
    assert set(Fault) - {Fault.none} <= shown
