"""The reference's tables, made from the code: `{generated} robot-file` in a page stands for one."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterator
from typing import Any, Literal, get_args, get_origin

import annotated_types
import typer
from docutils.nodes import Node
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from sphinx.util.docutils import SphinxDirective

UNITS = {
    "1_s": "1/s",
    "kg_m": "kg/m",
    "kg_m2": "kg m²",
    "kg_m3": "kg/m³",
    "m2": "m²",
    "m4": "m⁴",
    "m_s2": "m/s²",
    "N_m": "N m",
    "N_m2": "N m²",
    "N_m_rad": "N m/rad",
    "N_m_s_rad": "N m s/rad",
    "N_s_m": "N s/m",
} | {unit: unit for unit in ("Hz", "J", "kg", "m", "N", "Pa", "rad", "s", "V")}


def unit(key: str) -> str:
    """The unit that the end of a key names; none: ""."""
    parts = key.split("_")
    ends = ("_".join(parts[k:]) for k in range(1, len(parts)))
    return next((UNITS[end] for end in ends if end in UNITS), "")


def flat(meta: Any) -> list[Any]:
    """The rules of a pydantic Field that stands inside a type, or the rule itself."""
    return list(meta.metadata) if isinstance(meta, FieldInfo) else [meta]


def bounds(field: FieldInfo) -> str:
    """What a number or a list may be."""
    out = []
    inside = [getattr(part, "__metadata__", ()) for part in get_args(field.annotation)]
    for rule in [*field.metadata, *(r for rules in inside for meta in rules for r in flat(meta))]:
        for kind, sign in (("ge", "≥"), ("gt", ">"), ("le", "≤"), ("lt", "<")):
            if hasattr(rule, kind):
                out.append(f"{sign} {getattr(rule, kind):g}")
        if isinstance(rule, annotated_types.MinLen | annotated_types.MaxLen):
            name = "least" if isinstance(rule, annotated_types.MinLen) else "most"
            length = getattr(rule, "min_length", None) or getattr(rule, "max_length", None)
            out.append(f"at {name} {length} long")
    for part in (field.annotation, *get_args(field.annotation)):
        if get_origin(part) is Literal:
            out.append(", ".join(f'`"{value}"`' for value in get_args(part)))
    return ", ".join(out)


def default(field: FieldInfo) -> str:
    """What is taken if the key is absent."""
    if field.is_required():
        return "required"
    value = field.default
    if value is PydanticUndefined:
        made = field.default_factory() if field.default_factory else None  # type: ignore[call-arg]
        return "" if isinstance(made, BaseModel) else f"`{made}`"
    if value is None or value == "":
        return ""
    shown = list(value) if isinstance(value, tuple) else value
    return f"`{json.dumps(shown)}`"


def models(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """A model and those in it, each once, in the order of their keys."""
    seen: list[type[BaseModel]] = []

    def visit(kind: Any) -> None:
        if inspect.isclass(kind) and issubclass(kind, BaseModel) and kind not in seen:
            seen.append(kind)
            for field in kind.model_fields.values():
                visit(field.annotation)
        for part in get_args(kind):
            visit(part)

    visit(model)
    return iter(seen)


def cell(text: str) -> str:
    """What stands in a cell, its signs as they are; `quoted` words are left alone."""
    plain = re.split(r"(`[^`]*`)", text.replace("|", "\\|"))
    return "".join(p if p.startswith("`") else p.replace("<", "&lt;") for p in plain)


def table(heads: tuple[str, ...], rows: Iterator[tuple[str, ...]]) -> str:
    """A table in Markdown."""
    lines = [heads, ("---",) * len(heads), *rows]
    return "".join("| " + " | ".join(map(cell, r)) + " |\n" for r in lines)


def sentence(text: str) -> str:
    """The first paragraph of a docstring, quotes as in Markdown."""
    return " ".join(inspect.cleandoc(text).partition("\n\n")[0].split())


def robot_file() -> str:
    """Every table of the robot file with its keys."""
    from flexura.robot import Robot

    out = []
    for model in models(Robot):
        rows = (
            (f"`{name}`", unit(name), default(f), bounds(f), f.description or "")
            for name, f in model.model_fields.items()
        )
        out.append(f"## {model.__name__}\n\n{sentence(model.__doc__ or '')}\n\n")
        out.append(table(("key", "unit", "default", "bounds", "meaning"), rows) + "\n")
    return "".join(out)


def signals() -> str:
    """Every kind of signal with its arguments, which are the keys of its table."""
    from flexura.signals import KINDS

    def rows() -> Iterator[tuple[str, ...]]:
        for kind, function in KINDS.items():
            keys = []
            for name, p in inspect.signature(function).parameters.items():
                given = "" if p.default is p.empty else f" ({p.default:g})"
                keys.append(f"`{name}`{given}")
            yield f"`{kind}`", ", ".join(keys), sentence(function.__doc__ or "")

    return table(("kind", "keys (default)", "what it is"), rows())


def commands() -> str:
    """Every command with its help, arguments and options."""
    from flexlab.cli.app import app

    group = typer.main.get_command(app)
    context = group.make_context("flexura", [], resilient_parsing=True)
    return "".join(_command(group, context, name) for name in group.list_commands(context))


def _command(group: Any, context: Any, name: str, above: str = "flexura") -> str:
    command, title = group.get_command(context, name), f"{above} {name}"
    text = inspect.cleandoc((command.help or "").replace("\b", ""))
    text = re.sub(r"^ *Examples?: *(.*)", r"\n```text\n\1\n```\n", text, flags=re.M | re.S)
    inside = command.make_context(name, [], resilient_parsing=True, parent=context)
    rows = []
    for param in command.get_params(inside):
        if param.name != "help":
            record = param.get_help_record(inside)
            label = record[0] if record else param.make_metavar(inside)
            said = record[1] if record else getattr(param, "help", None)
            rows.append((f"`{label}`", " ".join((said or "").split())))
    out = f"## {title}\n\n{text}\n\n" + (table(("argument", "meaning"), iter(rows)) if rows else "")
    for sub in getattr(command, "commands", {}):
        out += "\n" + _command(command, inside, sub, title)
    return out + "\n"


MADE: dict[str, Callable[[], str]] = {
    "robot-file": robot_file,
    "signals": signals,
    "commands": commands,
}


class Generated(SphinxDirective):
    """A table that is made when the site is built."""

    required_arguments = 1

    def run(self) -> list[Node]:
        """Parse the table as a part of the page."""
        return self.parse_text_to_nodes(MADE[self.arguments[0]](), allow_section_headings=True)


def setup(app: Any) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("generated", Generated)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
