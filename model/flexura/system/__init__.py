"""The system: a robot's equations of motion. `landed` serves the solvers; `assembly` is the same theory, dense and readable."""

from .landed import System, jacobian, limits, stack

__all__ = ["System", "jacobian", "limits", "stack"]
