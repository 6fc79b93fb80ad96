"""The emulator itself, under a small program whose behaviour the data sheet tells: what the
firmware's tests stand on."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from flexlab.board.base import Board
from flexlab.board.emulator.emulated import LABEL, EmulatedBoard, Outputs, Sensors
from flexlab.board.emulator.simulator import CLOCK_HZ, Simulator
from flexlab.board.protocol.declaration import PINS
from flexura.errors import FlexuraError

SOURCE = Path(__file__).with_name("emulator_probe.c")
BYTE_CYCLES = 11 * CLOCK_HZ // 500_000


class Bench:
    """A plant that does what the test says and remembers what the board did."""

    def __init__(self):
        self.sensors, self.speed = Sensors(), 0.0
        self.duties = []

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        self.duties.append(outputs.duty[0])
        self.sensors.encoder_1 += self.speed * seconds
        return self.sensors


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    assert shutil.which("avr-gcc"), "avr-gcc is missing: make setup installs it"
    out = tmp_path_factory.mktemp("probe") / "probe.elf"
    options = [
        "-mmcu=atmega2560",
        "-Os",
        "-Wall",
        "-Werror",
        "-std=gnu11",
        "-fno-ipa-icf",
    ]  # both edge interrupts take as long
    subprocess.run(["avr-gcc", *options, "-o", out, SOURCE], check=True)
    return out


@pytest.fixture
def board(program):
    board = EmulatedBoard(program, Bench())
    board.wait(0.002)
    yield board
    assert board.simulator.log() == ""
    board.close()
    board.close()


def ask(board, command, size=0, *arguments):
    board.read()
    board.write(command.encode() + b"".join(int(a).to_bytes(2, "little") for a in arguments))
    board.wait(0.003)
    answer = board.read()
    assert len(answer) == size
    return int.from_bytes(answer, "little")


def hit(board, switch):
    board.wait(0.001)
    assert PINS[switch].port == "A"
    return bool(ask(board, "i", 1) >> PINS[switch].bit & 1)


def duty(board):
    board.wait(0.01)
    return board.plant.duties[-1]


@pytest.mark.parametrize("compare", [0, 1, 199, 400, 798, 799])
def test_pwm_is_on_for_compare_plus_one_of_800_cycles(board, compare):
    """Data sheet, fast PWM: OCR + 1 cycles of TOP + 1; with OCR = TOP always on."""
    ask(board, "e")
    ask(board, "p", 0, compare)
    assert duty(board) == pytest.approx((compare + 1) / 800, abs=2e-3)
    ask(board, "o")
    assert duty(board) == 0.0
    ask(board, "q", 0, compare)
    assert duty(board) == pytest.approx(-(compare + 1) / 800, abs=2e-3)


def test_without_the_enable_there_is_no_voltage(board):
    ask(board, "p", 0, 799)
    assert duty(board) == 0.0 and not any(board.outputs.motor_on)
    ask(board, "e")
    assert duty(board) == 1.0 and board.outputs.motor_on
    ask(board, "d")
    assert (
        duty(board) == 0.0
        and board.simulator.window.driven_cycle < board.simulator.cycle - 0.01 * CLOCK_HZ
    )


def test_steps_count_with_their_direction_while_the_driver_is_on(board):
    for command, steps in (
        ("s", 0),
        ("u", 0),
        ("s", 1),
        ("s", 2),
        ("v", 2),
        ("s", 1),
        ("s", 0),
        ("s", -1),
    ):
        ask(board, command)
        assert board.outputs.steps == steps
    assert board.outputs.stepper_on


def test_steps_of_a_window_count_for_the_time_that_they_were_there(board):
    """The mean over the window of a count that each rising edge changes at its own cycle."""
    ask(board, "s"), ask(board, "u")
    board.simulator.trace(board.lines["step"], True)
    board.simulator.edges()
    board.write(b"s" * 40)
    before, stepped = 0, 0
    while before < 40:
        begin = board.simulator.cycle
        board.step()
        end = board.simulator.cycle
        ups = [cycle for cycle, _, level in board.simulator.edges() if level]
        assert board.outputs.steps == pytest.approx(
            before + sum(end - cycle for cycle in ups) / (end - begin), abs=1e-9
        )
        stepped += bool(ups)
        before += len(ups)
    assert stepped >= 3  # the bytes come 22 us apart, a window has 250 us
    board.step()
    assert board.outputs.steps == 40.0 == board.simulator.window.steps


def test_a_compare_pin_stays_set_until_it_is_to_be_cleared(board):
    """Data sheet: without PWM only the match changes the pin; neither the timer's overflow nor a
    write to OCR5A does."""
    ask(board, "v")
    board.simulator.trace(board.lines["step"], True)
    board.simulator.edges()
    for k in range(12):
        ask(board, "x", 0, 200 + 37 * k)
        board.wait(0.035)  # more than a turn of the timer, and 35 writes to OCR5A
        ask(board, "y", 0, 200 + 41 * k)
    levels = [level for _, _, level in board.simulator.edges()]
    assert levels == [1, 0] * 12 and board.outputs.steps == -12


@pytest.mark.parametrize("speed", [12_345.0, -20_000.0])
def test_every_encoder_edge_arrives(board, speed):
    board.plant.speed = speed
    board.wait(0.2)
    board.plant.speed = 0.0
    counts = abs(int(np.floor(board.plant.sensors.encoder_1)))
    assert ask(board, "n", 4) & 0xFFFF == counts > 2000


def test_edges_arrive_at_their_own_cycle(board):
    """The time between two single edges, by the processor's own timer, is that of the plant:
    windows leave no trace."""
    stamps, speed = [], 37.0  # a count in 27 ms
    board.plant.speed = speed
    for _ in range(8):
        board.wait(1 / speed - 0.003)
        stamps.append(ask(board, "t", 2))
    apart = np.diff(stamps[1:]) & 0xFFFF
    assert (
        np.abs(apart - CLOCK_HZ / speed % 65536).max() <= 6
    )  # the instruction under way is finished first


def test_a_cut_wire_is_high_and_a_mended_one_follows_again(board):
    before = ask(board, "n", 4) & 0xFFFF
    board.cut("encoder_1_a")
    board.plant.speed = 10_000.0
    board.wait(0.1)
    board.plant.speed = 0.0
    half = (ask(board, "n", 4) & 0xFFFF) - before
    assert half == pytest.approx(500, abs=3)  # every other edge is A's
    assert not hit(board, "limit_low")
    board.cut("limit_low")
    assert hit(board, "limit_low")
    board.mend("limit_low")
    assert not hit(board, "limit_low")
    board.plant.sensors.limit_low = True
    assert hit(board, "limit_low") and not hit(board, "limit_high")


def test_a_timer_interrupt_that_falls_due_behind_its_mask_comes_when_it_is_let_through(board):
    """As on the chip, where the flag stays; simavr by itself forgets it, and the timer's next match
    is 33 ms away."""
    ask(board, "m")
    board.wait(0.005)
    before = ask(board, "n", 4) >> 16
    ask(board, "M")
    after = ask(board, "n", 4) >> 16
    assert after > before


@pytest.mark.parametrize(
    "volts, reading", [(0.0, 0), (2.5, 511), (4.0, 818), (5.0, 1023), (7.0, 1023)]
)
def test_adc(board, volts, reading):
    board.plant.sensors.flex_V = volts
    board.wait(0.001)
    assert ask(board, "a", 2) == pytest.approx(reading, abs=1)


def test_bytes_arrive_at_the_lines_pace(board):
    begin = board.simulator.cycle
    board.write(b"?" * 100)
    board.write(b"c")
    while not (answer := board.read()):
        board.wait(0.00025)
    assert answer == b"\x01" and board.simulator.unsent == 0  # power-on
    assert 101 * BYTE_CYCLES < board.simulator.cycle - begin < 103 * BYTE_CYCLES + 4000


def test_after_a_reset_outputs_rest_and_inputs_keep_their_levels(board):
    board.plant.sensors.limit_high = True
    ask(board, "e")
    ask(board, "p", 0, 799)
    ask(board, "u")
    assert board.outputs.motor_on[0] and board.outputs.stepper_on
    board.simulator.reset("brown-out")
    board.wait(0.0003)
    assert (
        not any(board.outputs.motor_on)
        and not board.outputs.stepper_on
        and board.simulator.window.resets == 1
    )
    assert not board.simulator.level("H", 3)
    board.wait(0.002)
    assert ask(board, "c", 1) == 4
    assert (
        hit(board, "limit_high")
        and not hit(board, "limit_low")
        and not hit(board, "emergency_stop")
    )


def test_eeprom_outlives_a_reset(board):
    board.simulator.write_eeprom(7, b"\x5a")
    assert ask(board, "r", 1) == 0x5A
    board.write(b"w\xa5")
    board.wait(0.02)
    board.reset()
    board.wait(0.005)
    assert ask(board, "r", 1) == 0xA5 and board.simulator.read_eeprom(6, 3) == b"\xff\xa5\xff"


def test_interrupts_are_timed(board):
    """1000 ticks a second, each a few dozen cycles from entry to return."""
    board.wait(0.1)
    entries, total, longest, own = board.simulator.interrupts()[47]
    assert entries == pytest.approx(board.now() * 1000, abs=2)
    assert 20 < own == longest < 100 and total <= entries * longest
    assert board.simulator.interrupts()[0][1] >= total


def test_a_hang_and_its_cure(board):
    address = board.simulator.symbol("take")
    word = board.simulator.flash[address] | board.simulator.flash[address + 1] << 8
    board.simulator.patch(address, [0xCFFF])
    board.write(b"cc")
    board.wait(0.01)
    assert board.read() == b""
    board.simulator.patch(address, [word])
    board.wait(0.01)
    assert board.read() == b"\1\1"


@pytest.mark.parametrize(
    "number", [0, 100, 0x7FFF, 0x8000, 0xFF00, 0xFFF1, 0xFFFE, 12, 0x0C0C, 0x0118]
)
def test_skips_pass_over_one_instruction(board, number):
    """By the instruction set manual: a skip passes over the next instruction, and ADIW and SBIW are
    one word long."""
    expected = number
    if expected & 0x8000:
        expected = expected + 15 & 0xFFFF
    if not expected & 0x8000:
        expected = expected - 12 & 0xFFFF
    if expected & 255 != expected >> 8:
        expected = expected + 31 & 0xFFFF
    assert ask(board, "k", 2, number) == expected


def test_the_board_is_a_board_and_says_that_it_is_emulated(board):
    def takes(board: Board) -> str:
        return board.label

    assert takes(board) == LABEL and LABEL.startswith("emulated") and board.emulated
    assert board.now() == board.simulator.cycle / CLOCK_HZ


def test_what_is_no_firmware_is_refused(tmp_path):
    bad = tmp_path / "firmware.elf"
    for content in (None, b"", b"not an ELF file"):
        if content is not None:
            bad.write_bytes(content)
        with pytest.raises(
            FlexuraError,
            match=r"firmware\.elf: expected an ELF file of a firmware for the ATmega2560",
        ):
            Simulator(bad, 500_000)
