"""How the inner loops are compiled, and where the compiled code is kept."""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numba
from llvmlite import ir
from numba import njit
from numba.core.compiler import Compiler
from numba.cpython import slicing

_HERE = Path(__file__).parent


class _Indexed(Compiler):  # type: ignore[misc]
    """Numba's compiler, but an index or an end of a slice counts from the end only where it is a negative constant, and slices
    lie within their arrays: the code that asks of every number whether it does was a ninth of the time loop's instructions."""

    def compile_extra(self, function: Any) -> Any:
        with patch.multiple(slicing, fix_index=_index, fix_slice=_slice):
            return super().compile_extra(function)


def _index(builder: Any, index: Any, size: Any) -> Any:
    return builder.add(index, size) if isinstance(index, ir.Constant) and index.constant < 0 else index


def _slice(builder: Any, ends: Any, size: Any) -> None:
    ends.start = _index(builder, ends.start, size)
    open_end = isinstance(ends.stop, ir.Constant) and ends.stop.constant == 2**63 - 1
    ends.stop = size if open_end else _index(builder, ends.stop, size)


def compiled(function: Any) -> Any:
    """Compile for the inner loop: cached on disk, IEEE arithmetic, and no memory management at all.

    Nothing is fused: where a compiler fuses products and sums (`fastmath={"contract"}`) depends on what the process has compiled
    before, so that the process that compiled computed other last digits than those that read its cache.

    Without numba's reference counting (`_nrt=False`) an array costs nothing to pass on, which makes the short functions of this
    package about three times faster, and a function that would allocate does not compile. `function.py_func` is the plain
    Python one.
    """
    return _cached(function)


def internal(function: Any, **options: Any) -> Any:
    """The same for a function that only compiled ones call: none is made for Python, whose unpacking of a robot's hundred arrays
    is more code than most functions."""
    return _cached(function, no_cpython_wrapper=True, **options)


def inlined(function: Any) -> Any:
    """An internal one that is expanded where it is called."""
    return _cached(function, forceinline=True, no_cpython_wrapper=True)


def _cached(function: Any, **options: Any) -> Any:
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(_FOLDER)
    try:
        settings = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False, "pipeline_class": _Indexed} | options
        return njit(**settings)(function)
    finally:
        numba.config.CACHE_DIR = before


def _folder() -> Path:
    """A cache folder named after the content of all modules with compiled functions: numba looks only at the file that a function
    stands in, and would run code that was inlined from an older version of another file."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(_HERE.glob("*.py")):
        text = source.read_bytes()
        if b"from .compiled import" in text or source.name in ("compiled.py", "chain.py", "lanes.py", "pinned.py", "tableaus.py"):
            digest.update(text)
    name = f"compiled-{digest.hexdigest()[:16]}"
    for parent in (_HERE / "__pycache__", Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flexura"):
        folder = parent / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            for old in parent.glob("compiled-*"):
                if old != folder:
                    shutil.rmtree(old, ignore_errors=True)
            return folder
    return Path(tempfile.mkdtemp(prefix="flexura-"))


_FOLDER = _folder()


def folder() -> Path:
    """Where the compiled code is kept."""
    return _FOLDER
