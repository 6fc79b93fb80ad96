"""The pins of protocol.toml: what each function needs of a pin, and the C++ header made of them.

A map is refused if a pin appears twice, does not exist, or cannot do what its function needs.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


class Mistake(Exception):
    """What is wrong in the declaration."""


ONE_LINE = "one line of text without control characters and backslashes"


def is_text(value: Any) -> bool:
    """Whether a value can stand in a comment of C++ and in a row of a table."""
    return isinstance(value, str) and value.isprintable() and "\\" not in value


def cell(text: str) -> str:
    """A text as a cell of a table in Markdown."""
    return text.replace("|", r"\|").replace("<", "&lt;")


def _runs(*runs: str) -> dict[str, str]:
    """Numbers of the Mega 2560 and their ports: '22 A0..7' means 22 = PA0 to 29 = PA7."""
    out = {}
    for run in runs:
        first, port, *bits = run.split()
        for place, bit in enumerate(bits):
            prefix, number = ("A", int(first[1:])) if first.startswith("A") else ("", int(first))
            out[f"{prefix}{number + place}"] = f"P{port}{bit}"
    return out


_UP, _DOWN = "0 1 2 3 4 5 6 7", "7 6 5 4 3 2 1 0"
# Numbers on the board's headers. A0 to A15 are 54 to 69 too.
MEGA = _runs(
    "0 E 0 1 4 5",
    "4 G 5",
    "5 E 3",
    "6 H 3 4 5 6",
    "10 B 4 5 6 7",
    "14 J 1 0",
    "16 H 1 0",
    "18 D 3 2 1 0",
    f"22 A {_UP}",
    f"30 C {_DOWN}",
    "38 D 7",
    "39 G 2 1 0",
    f"42 L {_DOWN}",
    "50 B 3 2 1 0",
    f"54 F {_UP}",
    f"62 K {_UP}",
    f"A0 F {_UP}",
    f"A8 K {_UP}",
)
BITS = {port: 6 if port == "G" else 8 for port in "ABCDEFGHJKL"}
SERIAL = {"PE0", "PE1"}  # the host's line
# Compare outputs of the 16-bit timers. Timer 5 gives the control tick (OC5A) and the steps.
COMPARE = {
    "PB5": "OC1A",
    "PB6": "OC1B",
    "PB7": "OC1C",
    "PE3": "OC3A",
    "PE4": "OC3B",
    "PE5": "OC3C",
    "PH3": "OC4A",
    "PH4": "OC4B",
    "PH5": "OC4C",
    "PL3": "OC5A",
    "PL4": "OC5B",
    "PL5": "OC5C",
}
INTERRUPTS = {f"P{'D' if n < 4 else 'E'}{n}": f"INT{n}" for n in range(8)}
CHANNELS = {f"PF{n}": f"ADC{n}" for n in range(8)}


@dataclass(frozen=True)
class Need:
    """What a function needs of a pin, in words and as the units that a port can have."""

    words: str
    unit: Callable[[str], str]  # of a port; "" where it has none that serves


def _pwm(port: str) -> str:
    unit = COMPARE.get(port, "")
    return unit if unit[2:3] in ("1", "3", "4") else ""


ANY = Need("any free pin", lambda port: "digital")
PWM = Need("a compare output of timer 1, 3 or 4 (OC1A to OC1C, OC3A to OC3C, OC4A to OC4C)", _pwm)
STEP = Need(
    "compare output OC5B (PL4, pin 45) or OC5C (PL5, pin 44)",
    lambda port: COMPARE.get(port, "") if port in ("PL4", "PL5") else "",
)
EDGE = Need(
    "an external interrupt (INT0 to INT3 at PD0 to PD3, INT4 at PE4, INT5 at PE5; INT6 at PE6 and "
    "INT7 at PE7 have no header)",
    lambda port: INTERRUPTS.get(port, ""),
)
ANALOG = Need(
    "an input of the converter (ADC0 to ADC7 at PF0 to PF7, pins A0 to A7)",
    lambda port: CHANNELS.get(port, ""),
)

NEEDS = {
    "motor_forward": PWM,
    "motor_reverse": PWM,
    "motor_enable": ANY,
    "motor_2_forward": PWM,
    "motor_2_reverse": PWM,
    "motor_2_enable": ANY,
    "encoder_1_a": EDGE,
    "encoder_1_b": EDGE,
    "encoder_2_a": EDGE,
    "encoder_2_b": EDGE,
    "step": STEP,
    "step_direction": ANY,
    "step_disable": ANY,
    "emergency_stop": ANY,
    "limit_low": ANY,
    "limit_high": ANY,
    "flex": ANALOG,
    "supply": ANALOG,
    "busy": ANY,
    "lamp": ANY,
}

# Those of the table [second_motor]; without them joint 2 has no motor.
MOTOR_2 = ("motor_2_forward", "motor_2_reverse", "motor_2_enable")


def place_of(entry: Any) -> str:
    """As `port_of`, of an entry that may be anything."""
    return f"P{entry.get('port')}{entry.get('bit')}" if isinstance(entry, dict) else ""


def port_of(entry: dict[str, Any]) -> str:
    """PA4 for port A, bit 4."""
    return f"P{entry['port']}{entry['bit']}"


def number_of(entry: dict[str, Any]) -> str:
    """The number printed on the board, or its port where the board has no number for it."""
    return str(
        entry["pin"]
        if "pin" in entry
        else next((n for n, port in MEGA.items() if port == port_of(entry)), port_of(entry))
    )


def unit_of(name: str, entry: dict[str, Any]) -> str:
    """The part of the chip that serves the function: OC4A, INT3, ADC0, digital."""
    return NEEDS[name].unit(port_of(entry))


def _check_place(name: str, entry: Any) -> None:
    """The entry names one pin of the chip, and the number on the board is that pin's."""
    if (
        not isinstance(entry, dict)
        or not {"port", "bit"} <= set(entry)
        or set(entry) - {"pin", "port", "bit", "text"}
    ):
        raise Mistake(
            f"pins.{name}: expected port, bit and text, and pin if the board has a number for it"
        )
    if not is_text(entry.get("text", "")):
        raise Mistake(f"pins.{name}: text = {entry['text']!r}: expected {ONE_LINE}")
    port, bit = entry["port"], entry["bit"]
    if (
        not isinstance(port, str)
        or port not in BITS
        or type(bit) is not int
        or not 0 <= bit < BITS[port]
    ):
        raise Mistake(
            f"pins.{name}: port {port!r}, bit {bit!r}: the ATmega2560 has "
            "ports A to H, J, K and L with bits 0 to 7 (G: 0 to 5)"
        )
    said = entry.get("pin", port_of(entry))
    if type(said) not in (str, int):
        raise Mistake(f'pins.{name}: pin {said!r}: expected a number on the board, as "13" or "A0"')
    if MEGA.get(str(said), str(said)) != port_of(entry):
        known = (
            f"pin {said} is {MEGA[str(said)]}"
            if str(said) in MEGA
            else f"the Mega 2560 has no pin {str(said) or repr(said)}"
        )
        raise Mistake(f"pins.{name}: {known}, not {port_of(entry)}; say which of the two is meant")


def without_header(pins: dict[str, Any]) -> list[str]:
    """A sentence for each function at a port that an Arduino Mega 2560 leads nowhere."""
    return [
        f"pins.{name}: {port_of(entry)} has no header on the Mega 2560; another board is needed"
        for name, entry in pins.items()
        if port_of(entry) not in MEGA.values()
    ]


def check(pins: dict[str, Any]) -> None:
    """Every function has a pin of its own that can do what it needs. Raises Mistake."""
    for name in NEEDS:
        if name not in pins and (name not in MOTOR_2 or any(other in pins for other in MOTOR_2)):
            raise Mistake(f"pins.{name}: missing; it needs {NEEDS[name].words}")
    users: dict[str, str] = {}
    for name, entry in pins.items():
        if name not in NEEDS:
            raise Mistake(f"pins.{name}: no such function; expected {', '.join(NEEDS)}")
        _check_place(name, entry)
        port = port_of(entry)
        where = f"{port} (pin {number_of(entry)})"
        if port in SERIAL:
            raise Mistake(
                f"pins.{name}: {where} is the serial line to the host; {name} needs another pin"
            )
        if port in users:
            raise Mistake(f"pins.{name}: {where} is {users[port]} already; a pin has one function")
        users[port] = name
        if not unit_of(name, entry):
            raise Mistake(f"pins.{name}: {where} cannot serve; {name} needs {NEEDS[name].words}")
    for motor in motors(pins):
        forward, reverse = (
            unit_of(name, pins[name]) for name in (f"{motor}_forward", f"{motor}_reverse")
        )
        if forward[:3] != reverse[:3]:
            raise Mistake(
                f"pins.{motor}_reverse: {reverse} belongs to timer {reverse[2]}, "
                f"{motor}_forward ({forward}) to timer {forward[2]}; "
                f"{motor}_reverse needs a compare output of the same timer"
            )


def motors(pins: dict[str, Any]) -> list[str]:
    """The motors of a map: their pins' names begin with these."""
    return ["motor", "motor_2"] if MOTOR_2[0] in pins else ["motor"]


def digest(pins: dict[str, Any]) -> int:
    """Hash of which function is where."""
    where = {name: port_of(entry) for name, entry in sorted(pins.items())}
    return int.from_bytes(hashlib.sha256(json.dumps(where).encode()).digest()[:4], "little")


def _special(name: str, unit: str) -> list[str]:
    """Registers and bits of the unit behind a pin."""
    if unit.startswith("INT"):
        return [f"  static constexpr uint8_t interrupt = {unit[3:]};"]
    if unit.startswith("ADC"):
        return [f"  static constexpr uint8_t channel = {unit[3:]};"]
    if not unit.startswith("OC"):
        return []
    timer, letter = unit[2], unit[3]
    out = [f"  static volatile uint16_t &compare() {{ return OCR{timer}{letter}; }}"]
    com = f"COM{timer}{letter}"
    if name != "step":
        return [*out, f"  static constexpr uint8_t connected = _BV({com}1);"]
    return [
        *out,
        f"  static constexpr uint8_t set_on_match = _BV({com}1) | _BV({com}0);",
        f"  static constexpr uint8_t clear_on_match = _BV({com}1);",
        f"  static constexpr uint8_t force = _BV(FOC{timer}{letter});",
        f"  static constexpr uint8_t match_interrupt = _BV(OCIE{timer}{letter});",
        f"  static constexpr uint8_t match_flag = _BV(OCF{timer}{letter});",
    ]


def header(pins: dict[str, Any], said: str) -> str:
    """The C++ header: a struct a pin. Registers are references: one instruction sets a bit."""
    out = [f"// {said}", "#pragma once", "#include <avr/io.h>", "", "namespace pin {", ""]
    out.append(f"constexpr uint32_t kHash = 0x{digest(pins):08X};  // which function is where")
    for name, entry in pins.items():
        port, bit, unit = entry["port"], entry["bit"], unit_of(name, entry)
        out += [
            "",
            f"// {number_of(entry)}, {unit}: {entry.get('text', '')}",
            f"struct {name} {{",
            f"  static constexpr uint8_t bit = {bit};",
            f"  static constexpr uint8_t mask = {1 << bit};",
            f"  static constexpr bool bit_addressable = {str(port in 'ABCDEFG').lower()};",
            f"  static volatile uint8_t &port() {{ return PORT{port}; }}",
            f"  static volatile uint8_t &direction() {{ return DDR{port}; }}",
            f"  static volatile uint8_t &input() {{ return PIN{port}; }}",
            *_special(name, unit),
            "};",
        ]
    for motor in motors(pins):
        timer = unit_of(f"{motor}_forward", pins[f"{motor}_forward"])[2]
        out += [
            "",
            f"// The timer of {motor}_forward and {motor}_reverse.",
            f"struct {motor}_timer {{",
            f"  static volatile uint8_t &control_a() {{ return TCCR{timer}A; }}",
            f"  static volatile uint8_t &control_b() {{ return TCCR{timer}B; }}",
            f"  static volatile uint16_t &top() {{ return ICR{timer}; }}",
            "};",
        ]
    out += [
        "",
        "}  // namespace pin",
        "",
        f"#define FLEXURA_MOTORS {len(motors(pins))}",
        "",
        "// Names of interrupts are macros: a struct cannot hold them.",
    ]
    for name in ("encoder_1_a", "encoder_1_b", "encoder_2_a", "encoder_2_b"):
        out.append(f"#define FLEXURA_{name.upper()}_VECTOR {unit_of(name, pins[name])}_vect")
    out.append(f"#define FLEXURA_STEP_VECTOR TIMER5_COMP{unit_of('step', pins['step'])[3]}_vect")
    return "\n".join([*out, ""])


def table(pins: dict[str, Any]) -> list[str]:
    """Rows of the README's table."""
    rows = ["| name | Mega | port | unit | what |", "| --- | --- | --- | --- | --- |"]
    for name, entry in pins.items():
        cells = [f"`{name}`", number_of(entry), port_of(entry), unit_of(name, entry)]
        rows.append(f"| {' | '.join(cells)} | {cell(entry.get('text', ''))} |")
    return rows
