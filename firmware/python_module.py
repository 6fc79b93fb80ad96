"""The host's side of protocol.toml: a Python module with enumerations and tables for struct."""

from __future__ import annotations

import json
from typing import Any

from layout import ENUMERATIONS, split, struct_format
from pins import digest as hash_of_pins
from pins import number_of

_TYPES = '''
class Field(NamedTuple):
    """A field of a message."""

    name: str
    unit: str
    length: int


class Message(NamedTuple):
    """A message; `layout` is the format of the struct module."""

    name: str
    code: int
    layout: str
    fields: tuple[Field, ...]


class Item(NamedTuple):
    """A setting of the board; SI units, as the names say."""

    number: int
    default: float
    least: float
    greatest: float
    text: str


class Pin(NamedTuple):
    """A pin: its number on the board, its port and bit."""

    pin: str
    port: str
    bit: int
    text: str
'''


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _call(indent: str, name: str, arguments: list[str]) -> list[str]:
    """name(arguments),: on one line where 100 columns hold it, else one argument a line."""
    line = f"{indent}{name}({', '.join(arguments)}),"
    if len(line) <= 100:
        return [line]
    return [
        f"{indent}{name}(",
        *(f"{indent}    {argument}," for argument in arguments),
        f"{indent}),",
    ]


def _messages(declared: dict[str, Any]) -> list[str]:
    out = ["", "MESSAGES: dict[str, Message] = {"]
    for message in declared["message"]:
        head = [
            _quoted(message["name"]),
            str(message["code"]),
            _quoted(struct_format(message)),
        ]
        fields = []
        for field in message["fields"]:
            said = [_quoted(field["name"]), _quoted(field.get("unit", ""))]
            fields.append(f"Field({', '.join([*said, str(split(field['type'])[1])])})")
        inner = f"({', '.join(fields)}{',' * (len(fields) == 1)})"
        line = f"    {_quoted(message['name'])}: Message({', '.join([*head, inner])}),"
        if len(line) <= 100:
            out.append(line)
            continue
        out += [
            f"    {_quoted(message['name'])}: Message(",
            *(f"        {part}," for part in head),
        ]
        if len(inner) <= 90:
            out += [f"        {inner},", "    ),"]
        else:
            out += [
                "        (",
                *(f"            {field}," for field in fields),
                "        ),",
                "    ),",
            ]
    return [*out, "}"]


def module(declared: dict[str, Any], digest: int, said: str) -> str:
    """The text of the module.

    Args:
        declared: the checked declaration.
        digest: its hash.
        said: where the file comes from.

    Returns:
        Python, formatted as `ruff format` does at 100 columns.
    """
    out = [
        "# ruff: noqa: E501",
        f'"""The protocol of the board.\n\n{said}\n"""',
        "",
        "from __future__ import annotations",
        "",
    ]
    out += ["from enum import IntEnum", "from typing import NamedTuple", ""]
    out += [f"NAME = {_quoted(declared['name'])}", f"VERSION = {declared['version']}"]
    out.append(f"DECLARATION = 0x{digest:08X}")
    out += [f"{name.upper()} = {value}" for name, value in declared["constants"].items()]
    for key, title in ENUMERATIONS.items():
        out += ["", "", f"class {title}(IntEnum):", f'    """Codes of [{key}]."""', ""]
        out += [f"    {name} = {entry['code']}" for name, entry in declared[key].items()]
    out += ["", "", "# What each means, and what the person at the bench does about it."]
    out.append("FAULTS: dict[Fault, tuple[str, str]] = {")
    for name, entry in declared["faults"].items():
        pair = [_quoted(entry[key]) for key in ("text", "remedy")]
        out += _call("    ", f"Fault.{name}: ", pair)
    out += ["}", "", "RESULTS: dict[Result, str] = {"]
    out += [
        f"    Result.{name}: {_quoted(entry['text'])},"
        for name, entry in declared["results"].items()
    ]
    out += ["}", "", _TYPES, *_messages(declared), "", "CONFIG: dict[str, Item] = {"]
    for number, (name, item) in enumerate(declared["config"].items()):
        values = [
            str(number),
            *(repr(item[key]) for key in ("default", "min", "max")),
            _quoted(item["text"]),
        ]
        out += _call("    ", f"{_quoted(name)}: Item", values)
    out += ["}", "", f"PINS_HASH = 0x{hash_of_pins(declared['pins']):08X}"]
    out += ["PINS: dict[str, Pin] = {"]
    for name, entry in declared["pins"].items():
        values = [_quoted(number_of(entry)), _quoted(entry["port"]), str(entry["bit"])]
        out += _call("    ", f"{_quoted(name)}: Pin", [*values, _quoted(entry.get("text", ""))])
    return "\n".join([*out, "}", ""])
