"""What the loop of a linear controller bears: margins of gain, phase, delay, sensitivity, discs.

Broken at one place, input or measurement i, with all others closed, the loop has the response
l_i(z), z = exp(j w T); broken at all of them L(z) (128).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InputError
from ...io import choice
from ...system import FrequencyResponse
from .gaussian_design import Design

POINTS = 1500
NEAR = np.concatenate([-np.geomspace(0.1, 30, 12)[::-1], [0.0], np.geomspace(0.1, 30, 12)])
ALL_GAINS = 1e-9  # a smallest gain that counts as none at all


@dataclass(frozen=True)
class LoopMargins:
    """Margins of a loop broken at one place (129), (130); infinite where nothing bounds them.

    Attributes:
        place: the drive or the measurement.
        gain: lowest and highest factor on the loop's gain with which it stays stable.
        phase_rad: change of phase that it bears, of either sign.
        delay_s: further delay that it bears, the phase of a delay being w times it; exact for whole
            ticks.
        crossover_Hz: the highest frequency at which |l| = 1; 0 if there is none.
        sensitivity: largest |1 / (1 + l)|.
        disc: the disc margin alpha: a factor (1 + d/2) / (1 - d/2), |d| < alpha complex, on the
            loop leaves it stable.
    """

    place: str
    gain: tuple[float, float]
    phase_rad: float
    delay_s: float
    crossover_Hz: float
    sensitivity: float
    disc: float


@dataclass(frozen=True)
class LoopFigures:
    """A loop's margins at each place, and for changes at all of them together (128) to (130).

    `disc` is a lower bound of the disc margin for independent changes at all places at once;
    `responses` are l_i up to half the rate, with their Bode and Nyquist plots.
    """

    at: str
    margins: tuple[LoopMargins, ...]
    responses: tuple[FrequencyResponse, ...]
    disc: float

    def rows(self) -> list[tuple[str, ...]]:
        """A table: a head, and a row a place, in words and with units."""
        head = ("place", "gain", "phase [deg]", "delay [ms]", "cross [Hz]", "peak of S", "disc")
        out: list[tuple[str, ...]] = [head]
        for m in self.margins:
            gain = f"{m.gain[0]:.3g} to {m.gain[1]:.3g}"
            numbers = (np.degrees(m.phase_rad), 1e3 * m.delay_s, m.crossover_Hz, m.sensitivity)
            out.append((m.place, gain, *(f"{x:.3g}" for x in numbers), f"{m.disc:.3g}"))
        if len(self.margins) > 1:
            out.append(("all at once", "", "", "", "", "", f"{self.disc:.3g}"))
        return out

    def __str__(self) -> str:
        rows = self.rows()
        wide = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        lines = ["  ".join(x.rjust(w) for x, w in zip(row, wide, strict=True)) for row in rows]
        return "\n".join(lines)


def loop_figures(design: Design, at: str = "drives") -> LoopFigures:
    """The figures of the loop that a design closes around its own robot.

    Args:
        design: of `lqg` or `lqr`.
        at: where the loop is broken, "drives" or "measurements".

    Returns:
        The LoopFigures.

    Raises:
        InputError: an argument is not what is expected.
    """
    if not isinstance(design, Design):
        raise InputError("expected a Design, as from lqg", key="design", value=design)
    choice(at, "at", ("drives", "measurements"))
    loop = _Loop(design, at)
    w = loop.frequencies()
    L = loop(w)
    S = np.linalg.inv(np.eye(L.shape[1]) + L)
    names = (
        [f"joint/{i + 1}/drive" for i in design.inputs] if at == "drives" else list(design.outputs)
    )
    responses, margins = [], []
    for i, name in enumerate(names):
        single = _broken_at(loop, i)
        values = single(w)
        responses.append(FrequencyResponse(w / (2 * np.pi), values, name, "its own loop", "1"))
        margins.append(_margins(name, single, w, values, loop.T))
    disc = 1 / float(structured(S - np.eye(L.shape[1]) / 2).max())
    return LoopFigures(at, tuple(margins), tuple(responses), disc)


def structured(X: np.ndarray) -> np.ndarray:
    """Upper bounds (F,) of the structured singular values of X (F, m, m) for one complex change a
    place: the largest singular values of D X D^-1 with the diagonal D of Perron's vectors of |X|.
    No unit of a place changes them."""
    size = np.abs(X) + 1e-12 * np.abs(X).max(axis=(1, 2), keepdims=True)
    values, right = np.linalg.eig(size)
    best = np.argmax(values.real, axis=1)
    right = np.abs(np.take_along_axis(right, best[:, None, None], axis=2)[..., 0])
    values, left = np.linalg.eig(np.swapaxes(size, 1, 2))
    best = np.argmax(values.real, axis=1)
    left = np.abs(np.take_along_axis(left, best[:, None, None], axis=2)[..., 0])
    d = np.sqrt(left / right)
    return np.linalg.svd(d[:, :, None] * X / d[:, None, :], compute_uv=False)[:, 0]


class _Loop:
    """L(z), the loop broken at all drives or all measurements (128)."""

    def __init__(self, d: Design, at: str) -> None:
        n, p = len(d.F), len(d.C)
        left = np.eye(n) - d.L @ d.C
        Ac, Bc = (d.F - d.G @ d.K) @ left, (d.F - d.G @ d.K) @ d.L
        Cc, Dc = -d.K @ left, -d.K @ d.L
        zero = np.zeros((n, n))
        if at == "drives":  # v into the robot, u out of the controller
            self.A = np.block([[d.F, zero], [Bc @ d.C, Ac]])
            self.B = np.vstack([d.G, np.zeros_like(d.G)])
            self.C = -np.hstack([Dc @ d.C, Cc])
        else:  # a measurement into the controller, y out of the robot
            self.A = np.block([[d.F, d.G @ Cc], [zero, Ac]])
            self.B = np.vstack([d.G @ Dc, Bc])
            self.C = -np.hstack([d.C, np.zeros((p, n))])
        self.T = 1 / d.rate_Hz
        self.closed = np.linalg.eigvals(self.A - self.B @ self.C)

    def __call__(self, w: np.ndarray) -> np.ndarray:
        """L at angular frequencies (F,) [rad/s], (F, m, m)."""
        z = np.exp(1j * w * self.T)[:, None, None]
        push = np.broadcast_to(self.B.astype(complex), (len(w), *self.B.shape))
        return self.C @ np.linalg.solve(z * np.eye(len(self.A)) - self.A, push)

    def frequencies(self) -> np.ndarray:
        """Angular frequencies (F,) [rad/s], dense about the poles, up to half the rate."""
        poles = np.concatenate([np.linalg.eigvals(self.A), self.closed])
        s = np.log(poles[np.abs(poles) > 1e-6].astype(complex)) / self.T
        end = np.pi / self.T
        slow = np.abs(s[np.abs(s) > 1e-3])
        low = max(min(slow.min(initial=end), end) / 100, 1e-6 * end)
        near = s.imag[:, None] + np.maximum(np.abs(s.real), 1e-6 * end)[:, None] * NEAR
        found = np.concatenate([np.geomspace(low, end, POINTS), near.ravel(), s.imag])
        return np.unique(found[(found >= low) & (found <= end)])


def _broken_at(loop: _Loop, i: int) -> Callable[[np.ndarray], np.ndarray]:
    """l_i(w) (F,), the loop broken at place i with all others closed."""

    def single(w: np.ndarray) -> np.ndarray:
        L = loop(w)
        others = [k for k in range(L.shape[1]) if k != i]
        if not others:
            return L[:, 0, 0]
        inner = np.eye(len(others)) + L[:, others][:, :, others]
        back = np.linalg.solve(inner, L[:, others, i][..., None])[..., 0]
        return L[:, i, i] - np.einsum("fk,fk->f", L[:, i, others], back)

    return single


def _margins(
    name: str,
    single: Callable[[np.ndarray], np.ndarray],
    w: np.ndarray,
    values: np.ndarray,
    T: float,
) -> LoopMargins:
    """The margins (129), (130) of one loop from its response, crossings refined."""
    at = lambda x: complex(single(np.array([x]))[0])
    crossings = [at(x).real for x in _crossings(w, values.imag, lambda x: at(x).imag)]
    crossings += [complex(values[-1]).real] if abs(w[-1] * T - np.pi) < 1e-9 else []
    factors = [-1 / x for x in crossings if x < 0]
    low = max((x for x in factors if x < 1), default=0.0)
    high = min((x for x in factors if x > 1), default=np.inf)
    unity = _crossings(w, np.abs(values) - 1, lambda x: abs(at(x)) - 1)
    angles = np.array([np.angle(-at(x)) for x in unity])  # 0: on the point -1
    delays = [(a % (2 * np.pi)) / x for a, x in zip(angles, unity, strict=True)]
    S = 1 / (1 + values)
    return LoopMargins(
        name,
        (0.0 if low < ALL_GAINS else float(low), float(high)),
        float(np.abs(angles).min(initial=np.inf)),
        float(min(delays, default=np.inf)),
        float(max(unity, default=0.0)) / (2 * np.pi),
        float(np.abs(S).max()),
        float(1 / np.abs(S - 0.5).max()),
    )


def _crossings(
    w: np.ndarray, values: np.ndarray, function: Callable[[float], float]
) -> list[float]:
    """Where a function changes its sign between two of the frequencies (F,) at which it has
    `values`."""
    from scipy.optimize import brentq

    out: list[Any] = []
    for k in np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0):
        if np.sign(function(w[k])) * np.sign(function(w[k + 1])) < 0:
            out.append(brentq(function, w[k], w[k + 1], xtol=1e-12 * w[k + 1], rtol=1e-12))
    return [float(x) for x in out]
