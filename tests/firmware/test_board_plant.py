"""The firmware on the emulated rig: the dissertation's inverse law followed, the same bytes every
time."""

import math

import numpy as np
import pytest

from boards import BENCH, COMPILERS, configured, elf, finish
from experiments import SETTINGS, experiment
from flexlab import rig
from flexlab.benchmarks.problems import firmware_load
from flexlab.board.emulator.emulated import EmulatedBoard
from flexlab.board.protocol.declaration import Fault, State
from flexlab.board.protocol.player import Player, setpoints
from flexlab.board.protocol.session import Link
from flexlab.experiment import plan as plans
from flexlab.experiment.run_experiment import open_board
from flexlab.rig.board_axes import board_axes
from flexlab.rig.plant.plant import RigPlant, rig_plant
from flexura.signals import harmonic

AMPLITUDE_M, AMPLITUDE_RAD = 0.012, math.pi / 6


class Recorded(EmulatedBoard):
    """Keeps every byte that the board sent."""

    def __init__(self, plant: RigPlant) -> None:
        super().__init__(elf(), plant)
        self.bytes = bytearray()

    def read(self) -> bytes:
        new = super().read()
        self.bytes += new
        return new


def session(seed, seconds, watch=None):
    """Follow the inverse law's motions from rest; returns the board, the link and the plant at the
    end."""
    plant, settings = rig_plant(BENCH, seed), rig.configuration(BENCH)
    board = Recorded(plant)
    board.simulator.write_eeprom(0, configured("debian", ()))
    link = Link(board, sequence=1)
    link.connect()
    link.command("reference", position_1=0, position_2=0, steps=0)
    carriage, joint = (
        harmonic(amplitude, 1.0, math.pi, amplitude) for amplitude in (AMPLITUDE_M, AMPLITUDE_RAD)
    )
    player = Player(
        link,
        setpoints((carriage, joint), seconds + 1.0, [a.setpoints for a in board_axes(settings)]),
    )
    player.start()
    for _ in range(round(seconds / 0.01)):
        player.run(0.01)
        if watch is not None:
            watch(board, plant)
    return board, link, plant


def rings(seed, seconds, folder, compiler="debian"):
    """Joint 2 moves once and holds while the strip rings: no fault for as long as it rings."""
    plan = plans.free_vibration(BENCH, SETTINGS, 0.1, seconds)
    done = experiment(plan, folder, opened=open_board(BENCH, None, seed, elf(compiler)))
    assert done.ended.complete, done.ended.text
    assert done.run.t[-1] > seconds - 0.1


def test_a_strip_that_rings_is_no_fault(tmp_path):
    """Its motor trembles on an edge of the encoder; the watch on the wires once took that for a
    broken one, after 15 s."""
    rings(0, 20.0, tmp_path / "run")


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("compiler", COMPILERS)
def test_ten_minutes_of_ringing(compiler, tmp_path):
    rings(1, 600.0, tmp_path / "run", compiler)


def test_the_emulated_rig_follows_the_inverse_law():
    """No fault, and a strip that bends as much as the dissertation's does: 5 to 15 mm from rest."""
    seen = []
    board, link, _ = session(
        0,
        1.5,
        lambda board, p: seen.append(
            (board.now(), p.positions[0], p.positions[1], p.tip_deflection_m)
        ),
    )
    assert (
        State(link.newest["state"]) is State.running and Fault(link.newest["fault"]) is Fault.none
    )
    _, carriage, joint, deflection = np.array(seen).T
    assert carriage.max() == pytest.approx(2 * AMPLITUDE_M, rel=0.02)
    assert joint.max() == pytest.approx(2 * AMPLITUDE_RAD, rel=0.02)
    assert 0.005 < np.abs(deflection).max() < 0.015
    table = link.telemetry()
    measured = table["position_1"] / rig.configuration(BENCH)["motor_counts_per_m"]
    play = BENCH.rig.carriage.backlash_m
    assert (
        abs(measured.max() - carriage.max()) < play
    )  # the motor's encoder does not see the nut's play
    flex = table["flex"] / np.median(table["flex"])
    assert np.ptp(flex) > 0.02  # the sensor sees the bend
    finish(board)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others():
    sent = []
    for seed in (1, 1, 2):
        board, _, _ = session(seed, 0.3)
        sent.append(bytes(board.bytes))
        finish(board)
    assert len(sent[0]) > 5000
    assert sent[0] == sent[1] != sent[2]


def test_the_bench_measures_an_emulated_experiment():
    """The row of `make bench`; how fast is for it to say, not for a test."""
    fast, alone = firmware_load.experiment(elf(), BENCH, 0.2)
    assert 0 < fast < alone
