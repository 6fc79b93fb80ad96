"""The quadratic program of a tick, solved by a dual active set."""

from __future__ import annotations

import numpy as np

from ...optional import Optional

daqp = Optional("daqp")
SOFT, FREE = 8, 1e30  # a constraint that may be broken at a price; no bound


class QuadraticProgram:
    """min 1/2 U^T H U + g^T U with bounds on U and on rows of A U, by daqp (Arnström et al. 2022).

    Rows of A may be broken at a quadratic price, so that there always is a solution. With 40
    variables and 80 rows daqp took 0.08 ms, piqp 2.2, proxqp 2.4 and osqp 5.5.

    Args:
        variables: how many U has.
        rows: how many rows A has.
        price: of the square of what breaks a row.
    """

    def __init__(self, variables: int, rows: int, price: float) -> None:
        self.variables, self.rows = variables, rows
        self.soft = np.zeros(variables + rows, dtype=np.int32)
        self.soft[variables:] = SOFT
        self.settings = {"rho_soft": 1 / price, "iter_limit": 10 * (variables + rows)}
        daqp.solve  # noqa: B018  the package is missed now, not at the first tick

    def solve(
        self,
        H: np.ndarray,
        g: np.ndarray,
        A: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
    ) -> tuple[np.ndarray, bool, int]:
        """The solution U (variables,), whether it is one, and how many iterations it took.

        Args:
            H: (variables, variables), positive definite.
            g: (variables,).
            A: (rows, variables).
            low: of U and of A U (variables + rows,).
            high: as `low`.
        """
        U, _, flag, info = daqp.solve(H, g, A, high, low, self.soft.copy(), **self.settings)
        return np.asarray(U), flag > 0, int(info["iterations"])
