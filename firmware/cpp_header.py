"""The board's side of protocol.toml: a C++ header of messages, commands and settings."""

from __future__ import annotations

import struct
import textwrap
from typing import Any

from layout import ENUMERATIONS, TYPES, camel, split, struct_format


def _comment(text: str, indent: str = "") -> list[str]:
    """A comment of lines that fit 100 columns."""
    return textwrap.wrap(text, 100, initial_indent=f"{indent}// ", subsequent_indent=f"{indent}// ")


def _described(line: str, text: str) -> list[str]:
    """A line with its comment above it."""
    return [*(_comment(text, "  ") if text else []), line]


def _enumerations(declared: dict[str, Any]) -> list[str]:
    out = []
    for key, title in ENUMERATIONS.items():
        out += ["", f"enum class {title} : uint8_t {{"]
        for name, entry in declared[key].items():
            out += _described(f"  {name} = {entry['code']},", entry["text"])
        out.append("};")
    return out


def _messages(declared: dict[str, Any]) -> list[str]:
    out = []
    for message in declared["message"]:
        title = camel(message["name"])
        out += ["", *_comment(message["text"])]
        out += [
            f"struct __attribute__((packed)) {title} {{",
            f"  static constexpr uint8_t kCode = {message['code']};",
            f"  static constexpr uint8_t kSize = {struct.calcsize(struct_format(message))};",
        ]
        for field in message["fields"]:
            kind, length = split(field["type"])
            said = "; ".join(filter(None, [field.get("unit"), field.get("text")]))
            many = f"[{length}]" if length > 1 else ""
            out += _described(f"  {TYPES[kind][0]} {field['name']}{many};", said)
        out.append("};")
        if message["fields"]:
            out.append(f'static_assert(sizeof({title}) == {title}::kSize, "layout");')
    return out


def _rows(name: str, parameters: str, rows: list[str], said: str) -> list[str]:
    """A table as a macro that takes another: one line a row, the backslashes in one column."""
    lines = [f"#define {name}({parameters})", *(f"  {row}" for row in rows)]
    width = max(map(len, lines)) + 1
    return ["", *_comment(said), *(f"{line:{width}}\\" for line in lines[:-1]), lines[-1]]


def _commands(declared: dict[str, Any]) -> list[str]:
    """Which class handles which command."""
    out = []
    for handler in ("rig", "session"):
        rows = [
            f"X({camel(message['name'])})"
            for message in declared["message"]
            if message["code"] < 128 and message.get("handler", "rig") == handler
        ]
        said = f"X(message) of every command that {handler.capitalize()} handles."
        out += _rows(f"FLEXURA_{handler.upper()}_COMMANDS", "X", rows, said)
    return out


def _settings(declared: dict[str, Any]) -> list[str]:
    items = declared["config"]
    out = ["", "// Numbers of the settings.", "enum class Item : uint8_t {"]
    out += [f"  {name} = {number}," for number, name in enumerate(items)]
    out += ["};", f"constexpr uint8_t kConfigItems = {len(items)};", ""]
    out += ["// The settings in use, by number and by name.", "struct Config {"]
    out += ["  float values[kConfigItems];", ""]
    for number, (name, item) in enumerate(items.items()):
        out += _comment(item["text"], "  ")
        out += [
            f"  float &{name}() {{ return values[{number}]; }}",
            f"  float {name}() const {{ return values[{number}]; }}",
        ]
    out.append("};")
    rows = [
        f"X({name}, {', '.join(f'{float(item[key])!r}f' for key in ('default', 'min', 'max'))})"
        for name, item in items.items()
    ]
    return out + _rows(
        "FLEXURA_CONFIG", "X", rows, "X(name, default, least, greatest) of every setting."
    )


def header(declared: dict[str, Any], digest: int, said: str) -> str:
    """The text of the header.

    Args:
        declared: the checked declaration.
        digest: its hash.
        said: where the file comes from.

    Returns:
        C++11 that needs stdint.h only.
    """
    out = [f"// {said}", "#pragma once", "#include <stdint.h>", "", "namespace flexura {", ""]
    out += [
        f"constexpr uint32_t kDeclaration = 0x{digest:08X};",
        f"constexpr uint8_t kProtocolVersion = {declared['version']};",
    ]
    for name, value in declared["constants"].items():
        out.append(
            f"constexpr {'uint32_t' if value > 65535 else 'uint16_t'} k{camel(name)} = {value};"
        )
    out += [
        *_enumerations(declared),
        *_messages(declared),
        *_commands(declared),
        *_settings(declared),
    ]
    return "\n".join([*out, "", "}  // namespace flexura", ""])
