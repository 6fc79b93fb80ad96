"""`flexura bench ... --cut NAME`: the wire of any entry of [pins] is broken; the experiment ends
with a status other than 0 and that name."""

import pytest

from boards import elf
from experiments import command
from flexlab.board.protocol.declaration import PINS

SHORT = ("free-vibration", "--duration-s", 1.1, "--firmware")
SLOW = pytest.mark.slow
NOTICED = {  # by the self-test before anything moves, or by a fault while it does
    "emergency_stop": "fault: emergency_stop: ",
    "limit_low": "fault: limit_low: ",
    "limit_high": "fault: limit_high: ",
    "flex": "flex sensor: 0.0000",
    "supply": "supply: 0.00",
    "encoder_2_a": "fault encoder_2",
    "encoder_2_b": "fault encoder_2",
    "step": "fault stall_2",
    "step_disable": "fault stall_2",
}
QUICK = ("emergency_stop", "supply", "encoder_2_a", "step", "motor_forward")


def ended(*arguments, cwd):
    process = command(*SHORT, elf(), *arguments, cwd=cwd)
    _, said = process.communicate(timeout=280)
    return process.returncode, said


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in QUICK else SLOW) for n in PINS])
def test_a_cut_wire_ends_the_experiment_and_is_named(name, tmp_path):
    status, said = ended("--cut", name, "--out", "run", cwd=tmp_path)
    assert status == 1, said
    last = said.strip().splitlines()[-1]
    where = f"(pin {PINS[name].pin}, P{PINS[name].port}{PINS[name].bit}) cut"
    assert f"wire of {name} {where}" in last
    if name in NOTICED:
        assert NOTICED[name] in last


def test_only_wires_that_are_there_can_be_cut(tmp_path):
    status, said = ended("--cut", "limit_left", "--out", "run", cwd=tmp_path)
    assert status == 2 and "--cut = 'limit_left'" in said and "limit_low" in said
    assert not (tmp_path / "run").exists()
