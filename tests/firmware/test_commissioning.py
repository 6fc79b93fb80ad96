"""The proof of the emergency stop: nothing is armed before the board has seen it pressed and
released with its own firmware."""

from zlib import crc32

import pytest

from boards import BENCH, Rigged, configured, elf
from experiments import SETTINGS, experiment
from flexlab import rig
from flexlab.board import commissioning
from flexlab.board.base import BoardError
from flexlab.board.commissioning import commission, program
from flexlab.board.emulator.emulated import EmulatedBoard
from flexlab.board.protocol.declaration import PINS_HASH, Fault, Result, StopTrial
from flexlab.board.protocol.session import Link, Refused
from flexlab.experiment import plan as plans
from flexlab.experiment.run_experiment import Hooks, OpenBoard, RefusedToStart, conduct
from flexlab.recordings.strip_sensor import sensor_of
from flexlab.rig.plant.rigid_plant import RigidPlant

PROVEN_AT = 16 + 4 + 4 * len(SETTINGS)  # in the EEPROM: after the declaration and the settings


class Real:
    """An emulated board that nobody tells so: it has no button of its own, as a real one."""

    def __init__(self, inner, moves=lambda now: None):
        self.inner, self.moves = inner, moves
        self.label, self.emulated = inner.label, inner.emulated

    def wait(self, seconds):
        self.moves(self.inner.now())
        self.inner.wait(seconds)

    def __getattr__(self, name):
        if name == "press_stop":
            raise AttributeError(name)
        return getattr(self.inner, name)


def unproven():
    """A board with the rig's settings whose stop was never pressed."""
    board = EmulatedBoard(elf(), RigidPlant(BENCH))
    image = bytearray(configured("debian", ()))
    assert any(image[PROVEN_AT : PROVEN_AT + 4])
    link = Link(board, sequence=3)
    link.connect()
    link.write_configuration(rig.configuration(BENCH))
    board.reset()
    return board


def vibration(board, folder, watch=None):
    plan = plans.free_vibration(BENCH, SETTINGS, 0.1, 1.1)
    return experiment(plan, folder, watch, OpenBoard(board, 0, {}, None))


def test_the_proof_is_the_firmwares_own_and_outlives_a_reset():
    with Rigged() as r:
        found = program(r.link)
        assert found.may_move and found.proven == found.firmware != 0
        assert found.pins == PINS_HASH and found.stop is StopTrial.untried
        r.board.reset()
        r.link.connect()
        assert program(r.link).may_move


@pytest.mark.parametrize("bit", [0, 13, 31])
def test_another_firmwares_proof_is_none(bit):
    """A bit of the stored hash changed, with the checksum that belongs to it: as if another
    firmware had been loaded."""
    image = bytearray(configured("debian", ()))
    image[PROVEN_AT + bit // 8] ^= 1 << bit % 8
    checksum = crc32(bytes(image[16 : PROVEN_AT + 4]))
    image[PROVEN_AT + 4 : PROVEN_AT + 8] = checksum.to_bytes(4, "little")
    with Rigged(blank=True, eeprom=bytes(image)) as r:
        assert r.link.identity.fault is Fault.none and not program(r.link).may_move
        r.link.command("reference", position_1=0, position_2=0, steps=0)
        for _ in range(2):
            with pytest.raises(Refused) as refused:
                r.link.command("arm", mode=2)
            assert refused.value.result is Result.stop_unproven
        with pytest.raises(Refused) as refused:
            r.link.command("commission")
        assert refused.value.result is Result.stop_unproven and not r.driven


def test_an_emulated_board_presses_its_own_stop_at_the_declared_pin():
    board = unproven()
    link = Link(board, sequence=9)
    link.connect()
    assert not program(link).may_move
    assert commission(link).may_move
    board.close()


def test_with_the_stops_wire_cut_nothing_is_proven():
    board = unproven()
    board.cut("emergency_stop")
    link = Link(board, sequence=9)
    link.connect()
    assert commission(link).stop is StopTrial.pressed and not program(link).may_move
    board.close()


def test_a_person_presses_once_and_never_again(tmp_path):
    """The self-test waits for the press, the board keeps it, the next experiment asks nothing."""
    inner, said = unproven(), []
    begin = inner.now()
    real = Real(inner, lambda now: inner.press_stop(2.5 < now - begin < 2.9))
    plan, sensor = plans.free_vibration(BENCH, SETTINGS, 0.1, 1.1), sensor_of(BENCH)
    for name in ("first", "second"):
        watch, opened = Hooks(say=said.append), OpenBoard(real, 0, {}, None)
        done = conduct(BENCH, plan, opened, tmp_path / name, sensor, watch)
        assert done.run.complete and len(said) == 1
        assert "emergency stop proven" in [finding.what for finding in done.findings]
        inner.reset()
    assert "press the emergency stop and release it (pin 26, PA4)" in said[0]
    assert int(done.run.meta["firmware"]["hash"], 16) != 0
    inner.close()


def test_nobody_presses_and_nothing_moves(tmp_path, monkeypatch):
    monkeypatch.setattr(commissioning, "PRESS_S", 2.0)
    inner = unproven()
    with pytest.raises(BoardError, match=r"emergency stop proven: never pressed; .*press it"):
        vibration(Real(inner), tmp_path / "run")
    assert inner.simulator.window.driven_cycle == 0 == inner.simulator.window.step_cycle
    assert not (tmp_path / "run").exists()


def test_who_gives_up_waiting_starts_nothing(tmp_path):
    inner = unproven()
    watch = Hooks(stop_asked=lambda: "interrupted" if inner.now() > 3.0 else "")
    with pytest.raises(RefusedToStart, match="interrupted"):
        vibration(Real(inner), tmp_path / "run", watch)
    assert inner.simulator.window.driven_cycle == 0 and not (tmp_path / "run").exists()
