"""Modules by the names that they had in the release 0.1.0: they answer with the present ones and a
DeprecationWarning."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import sys
import warnings
from collections.abc import Sequence
from types import ModuleType

NEW = {
    "approximate": "simulation.approximate_inverse",
    "batch": "population.batch",
    "drive": "signals.drive",
    "forward": "simulation.dynamics",
    "gains": "control.gains",
    "lqr": "control.linear_quadratic.lqr_design",
    "response": "control.step_metrics",
    "run": "io.run",
    "sampled": "control.sampled",
    "shaping": "signals.shaping",
    "signal": "signals",
    "trials": "simulation.gain_sweep",
}


class OldNames(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds `flexura.drive` and the like where they are now."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """The spec of a module that has moved; None for all others."""
        package, _, old = name.partition(".")
        return (
            importlib.machinery.ModuleSpec(name, self)
            if package == "flexura" and old in NEW
            else None
        )

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType:
        """A module with all names of the one that took its place."""
        new = f"flexura.{NEW[spec.name.partition('.')[2]]}"
        warnings.warn(f"{spec.name} is now {new}", DeprecationWarning, stacklevel=2)
        old = ModuleType(spec.name)
        old.__dict__.update(
            {k: v for k, v in vars(importlib.import_module(new)).items() if not k.startswith("__")}
        )
        return old

    def exec_module(self, module: ModuleType) -> None:
        """Nothing: the module is filled when it is made."""


def answer_old_names() -> None:
    """Let `import flexura.drive` and the like answer, once."""
    if not any(isinstance(finder, OldNames) for finder in sys.meta_path):
        sys.meta_path.append(OldNames())
