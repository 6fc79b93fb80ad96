"""How the inner loops are compiled."""

from __future__ import annotations

from typing import Any

from numba import njit


def compiled(function: Any) -> Any:
    """Compile for the inner loop: cached on disk, IEEE division, and no memory management at all.

    Without numba's reference counting (`_nrt=False`) an array costs nothing to pass on, which makes the short functions of this
    package about three times faster, and a function that would allocate does not compile. `function.py_func` is the plain Python one.
    """
    return njit(cache=True, error_model="numpy", _nrt=False)(function)
