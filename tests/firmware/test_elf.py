"""What the emulated board takes for a firmware: whole programs for its processor, and no other file
(r06: simavr crashed)."""

import os
import random
import shutil
import struct
import subprocess

import pytest

from boards import elf
from experiments import command
from flexlab.board.emulator.elf import read
from flexlab.board.emulator.simulator import Simulator
from flexura.errors import FlexuraError, InputError

EXPECTED = "expected an ELF file of a firmware for the ATmega2560; "


def test_flash_and_symbols_are_those_of_binutils():
    """The flash by avr-objcopy, each symbol by avr-nm."""
    found, program = read(elf()), elf()
    binary = program.with_suffix(".bin")
    subprocess.run(["avr-objcopy", "-O", "binary", "-R", ".eeprom", program, binary], check=True)
    assert found.flash == binary.read_bytes()
    told = subprocess.run(["avr-nm", program], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in told.splitlines() if line.split()[1] in "TDBA"]
    assert len(rows) > 100
    assert all(found.symbols[name] == int(address, 16) for address, _, name in rows)


def test_a_program_of_this_machine_is_refused_in_one_sentence(tmp_path):
    process = command("forward", "--firmware", shutil.which("ls"), "--out", "run", cwd=tmp_path)
    said, errors = process.communicate(timeout=120)
    assert process.returncode == 2 and said == ""
    assert errors.count("\n") == 1 and EXPECTED in errors
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "at, value, why",
    [
        (18, 40, "it is for an ARM"),
        (18, 94, "it is for machine 94"),
        (36, 0x85, "it is for another AVR (architecture 5, not 6)"),
        (16, 1, "it is no program: it was not linked"),
        (28, 0xFFFFFF, "it is damaged: its headers are outside the file"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, at, value, why):
    data = bytearray(elf().read_bytes())
    form = "<I" if at in (28, 36) else "<H"
    struct.pack_into(form, data, at, value)
    bad = tmp_path / "bad.elf"
    bad.write_bytes(data)
    with pytest.raises(InputError) as refused:
        Simulator(bad, 500_000)
    assert str(refused.value) == f"{bad}: {EXPECTED}{why}"


def test_a_stripped_program_is_refused(tmp_path):
    bad = tmp_path / "bad.elf"
    subprocess.run(["avr-strip", "-o", bad, elf()], check=True)
    with pytest.raises(InputError, match=r"its symbols|no symbol"):
        Simulator(bad, 500_000)


def survives(path):
    """Loaded and run in a process of its own, or refused: 0 or 3; a crash is another number."""
    child = os.fork()
    if child == 0:
        try:
            simulator = Simulator(path, 500_000)
            simulator.run(20_000)
            simulator.close()
        except FlexuraError:
            os._exit(3)
        except BaseException as error:
            print(repr(error))
            os._exit(4)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def test_a_damaged_program_crashes_nothing(tmp_path):
    """Bytes changed in headers, symbols and anywhere, and files cut off: 100 tries."""
    good, chance = elf().read_bytes(), random.Random(6)
    sections_at = struct.unpack_from("<I", good, 32)[0]
    spots = [*range(148), *range(sections_at, len(good))]
    bad, ends = tmp_path / "bad.elf", []
    for n in range(100):
        data = bytearray(good[: chance.randrange(len(good))] if n % 10 == 0 else good)
        for _ in range(chance.choice([1, 2, 4]) if n % 10 else 0):
            data[chance.choice(spots) if chance.random() < 0.9 else chance.randrange(len(data))] = (
                chance.randrange(256)
            )
        bad.write_bytes(data)
        ends.append(survives(bad))
    assert set(ends) == {0, 3}, ends
