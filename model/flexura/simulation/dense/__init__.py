"""Simulations of robots that the compiled core does not have: the dissertation's linear line (7),
sliding from node to node.

`equations` is dz/dt from the dense equations (25) in NumPy: 0.1 to 0.5 ms an evaluation.
`integration` goes through time with DOP853 or Radau of SciPy, or with `exponential`, whose steps
solve the linear part in closed form (`propagator`). `weights` says what an error weighs, as in
docs/theory/10-time-integration.md.
"""

from .integration import Integration, solve

__all__ = ["Integration", "solve"]
