"""Docstrings of public names are complete: what a package's `__all__` lists, and the methods of its
classes."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import pytest

import flexlab
import flexura
from flexura.twin.links.part import Part


def packages(root: ModuleType) -> Iterator[ModuleType]:
    yield root
    for found in pkgutil.walk_packages(root.__path__, root.__name__ + "."):
        if found.ispkg:
            yield importlib.import_module(found.name)


def public() -> dict[str, Any]:
    """Classes and functions of this project in the lists of its packages, each once."""
    every = [
        getattr(package, name)
        for root in (flexura, flexlab)
        for package in packages(root)
        for name in getattr(package, "__all__", ())
    ]
    return {
        f"{x.__module__}.{x.__qualname__}": x
        for x in every
        if (inspect.isclass(x) or inspect.isfunction(x))
        and x.__module__.partition(".")[0] in ("flexura", "flexlab")
    }


def functions() -> dict[str, Callable[..., Any]]:
    """The functions among them, and the methods of the classes."""
    out: dict[str, Callable[..., Any]] = {}
    for name, x in public().items():
        if inspect.isfunction(x):
            out[name] = x
            continue
        for own, member in vars(x).items():
            method = getattr(member, "__func__", member)
            if inspect.isfunction(method) and not own.startswith("_"):
                out[f"{name}.{own}"] = method
    return out


PUBLIC, FUNCTIONS = public(), functions()
SECTIONS = ("Args", "Returns", "Yields", "Raises")


def section(text: str, title: str) -> str | None:
    """What stands under a heading; None without it."""
    found = re.search(rf"^{title}:\n(.*?)(?=^(?:{'|'.join(SECTIONS)}):\n|\Z)", text, re.M | re.S)
    return found and found[1]


def test_the_walk_finds_the_public_names():
    assert {"flexura.api.simulate", "flexura.system.system.System"} <= set(PUBLIC)
    assert "flexura.system.system.System.mass" in FUNCTIONS and len(FUNCTIONS) > 200


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_has_a_docstring(name):
    assert (inspect.getdoc(PUBLIC[name]) or "").strip()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_arguments_results_and_errors_are_described(name):
    function = FUNCTIONS[name]
    if inspect.getdoc(function) == "See `Part`.":
        function = getattr(Part, function.__name__)
    text = inspect.getdoc(function) or ""
    signature = inspect.signature(function)
    arguments = [p for p in signature.parameters if p not in ("self", "cls")]
    described = re.findall(r"^ {4}\**(\w+):", section(text, "Args") or "", re.M)
    more = any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values())
    assert (described[: len(arguments)] if more else described) == arguments
    gives = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    assert not (arguments and gives) or section(text, "Returns") or section(text, "Yields")
    if re.search(r"^\s+raise [A-Z]", inspect.getsource(function), re.M):
        assert section(text, "Raises")


def annotated() -> dict[str, Any]:
    """What `import flexura` gives: functions, classes, and their public functions."""
    out: dict[str, Any] = {}
    for name in flexura.__all__:
        x = getattr(flexura, name)
        if inspect.isfunction(x):
            out[name] = x
        elif inspect.isclass(x):
            out[name] = x
            for own, member in vars(x).items():
                for f in ("fget", "func", "__func__"):
                    member = getattr(member, f, member)
                if inspect.isfunction(member) and not own.startswith("_"):
                    out[f"{name}.{own}"] = member
        elif inspect.ismodule(x) and hasattr(x, "__all__"):
            out |= {
                f"{name}.{own}": getattr(x, own)
                for own in x.__all__
                if inspect.isfunction(getattr(x, own))
            }
    return out


ANNOTATED = annotated()


@pytest.mark.parametrize("name", ANNOTATED)
def test_public_names_say_what_they_take_and_give(name):
    given = inspect.get_annotations(ANNOTATED[name])
    vague = {k: v for k, v in given.items() if k[0] != "_" and re.search(r"\bAny\b", str(v))}
    assert not vague
    if inspect.isfunction(ANNOTATED[name]):
        asked = set(inspect.signature(ANNOTATED[name]).parameters) - {"self", "cls"}
        assert asked | {"return"} <= set(given)
