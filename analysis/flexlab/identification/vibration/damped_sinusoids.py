"""Sums of damped sinusoids fitted to a free vibration by nonlinear least squares.

    y(t) = a0 + a1 t + sum_m Re{ c_m exp(s_m t) },  s = -zeta w0 + i w0 sqrt(1 - zeta^2)

w0 = 2 pi f is the undamped frequency, zeta the damping ratio. Modes are found one after the other
at the highest peak of the remainder's spectrum (RELAX: Li and Stoica 1996, IEEE Trans. Signal
Processing 44, 281-295), and all are fitted together. A mode is kept if it makes the fit better
than noise does, and one near another if a single mode that changes does not explain both. Intervals
come from the Jacobian and the remainder's variance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .least_squares import (
    amplitudes_of,
    columns,
    derivatives,
    left_by_a_changing_mode,
    line,
    solve,
)
from .remainder import NEAR, coloured, lacking, level, peak

FOUR = 4  # numbers a mode: frequency, damping ratio, two amplitudes
PENALTY = 6.0  # of a mode, times ln(samples): noise makes a false one in far less than 1 of 1000
SMALLEST = 1e-4  # of the vibration's energy: what is less is no mode
SAME = 0.25  # resolutions: two modes that are nearer are one
LACKING, LEFT = 0.01, 3.0  # by the vibration, and by the noise: more is told
DEGREES = (4, 6)  # of the polynomials of a mode that changes


@dataclass(frozen=True)
class Mode:
    """Frequency [Hz] and damping ratio with their standard deviations, amplitude at the start.

    `low` and `high` are the ends of the 95 % intervals.
    """

    frequency: float
    frequency_std: float
    ratio: float
    ratio_std: float
    amplitude: float
    quantile: float

    def interval(self, what: str) -> tuple[float, float, float]:
        """Value, low and high of "frequency" or "ratio"."""
        value, std = getattr(self, what), getattr(self, f"{what}_std")
        return value, value - self.quantile * std, value + self.quantile * std

    def power(self, length: float) -> float:
        """The integral of the envelope's square over a record of this length [s]."""
        decay = 4 * np.pi * max(self.ratio, 1e-9) * self.frequency
        return self.amplitude**2 * float(-np.expm1(-decay * length)) / decay


@dataclass(frozen=True)
class Fit:
    """The modes by frequency, the fitted values (T,), the noise's standard deviation."""

    modes: tuple[Mode, ...]
    values: np.ndarray
    noise: float


def fit(t: np.ndarray, y: np.ndarray, most: int = 4) -> Fit:
    """Fit damped sinusoids.

    Args:
        t: ascending times (T,) [s].
        y: values (T,), finite.
        most: modes, at most.

    Returns:
        The modes that stand out of the noise; none if nothing rings.
    """
    from scipy.stats import t as student

    t = t - t[0]
    scale = float(np.abs(y - y.mean()).max())
    if scale == 0.0 or len(y) < 2 * FOUR + 4:
        return Fit((), np.full(len(y), float(y.mean())), 0.0)
    z = y / scale
    shapes = np.zeros((0, 2))  # w0, zeta of each mode
    left = z - line(t, z)
    energy = left_energy = float(left @ left)
    refused: list[float] = []
    while len(shapes) < most:
        start = peak(t, left, refused)
        if start is None:
            break
        tried, rest = _with_another(t, z, shapes, start)
        now = float(rest @ rest)
        if now <= 0.0 or len(z) - FOUR * len(tried) - 2 < 1:
            shapes, left, left_energy = tried, rest, now
            break
        floor = now * max(level(t, rest, start[0]), 1.0)
        gain = len(z) * np.log1p(max(left_energy - now, 0.0) / floor)
        enough = gain >= PENALTY * FOUR * np.log(len(z)) and left_energy - now >= SMALLEST * energy
        if enough and _apart(t, z, tried, rest):
            shapes, left, left_energy = tried, rest, now
        elif _near(start[0], shapes, t).any():
            refused.append(start[0])  # no mode is there; one may be elsewhere
        else:
            break
    if not len(shapes):
        return Fit((), scale * (z - left), float(np.std(left)) * scale)
    basis, slopes = columns(t, shapes)
    amplitudes = amplitudes_of(t, z, shapes)
    jacobian = np.hstack([basis, derivatives(slopes, amplitudes, len(shapes))])
    degrees = max(len(z) - jacobian.shape[1], 1)
    variance = left_energy / degrees
    size = np.linalg.norm(jacobian, axis=0)
    covariance = np.linalg.pinv((jacobian / size).T @ (jacobian / size))
    stds = np.sqrt(variance * np.diag(covariance)) / size
    quantile = float(student.ppf(0.975, degrees))
    modes = []
    for m, (w0, zeta) in enumerate(shapes):
        own = np.sqrt(coloured(t, left, w0))
        std = own * stds[basis.shape[1] + 2 * m : basis.shape[1] + 2 * m + 2]
        amplitude = scale * float(np.hypot(*amplitudes[2 + 2 * m : 4 + 2 * m]))
        modes.append(
            Mode(
                float(w0 / (2 * np.pi)),
                float(std[0] / (2 * np.pi)),
                float(zeta),
                float(std[1]),
                amplitude,
                quantile,
            )
        )
    modes.sort(key=lambda mode: mode.frequency)
    return Fit(tuple(modes), scale * (z - left), scale * float(np.sqrt(variance)))


def strongest(found: Fit, length: float) -> Mode:
    """The mode that holds most of a record of this length [s]."""
    return max(found.modes, key=lambda mode: mode.power(length))


def changes(found: Fit, t: np.ndarray, y: np.ndarray, most: int = 4) -> tuple[Mode, ...]:
    """The strongest mode in both halves of a record, if its frequency changes; else nothing.

    It changes if both values differ by more than four standard deviations: what rings is not
    linear. With another mode near it, halves do not say so.
    """
    if not found.modes:
        return ()
    whole = strongest(found, float(t[-1] - t[0]))
    half = len(t) // 2
    shapes = np.array([[2 * np.pi * mode.frequency, mode.ratio] for mode in found.modes])
    if _near(2 * np.pi * whole.frequency, shapes, t[: half + 1] - t[0]).sum() > 1:
        return ()  # a half may not tell two modes apart
    both = []
    for part in (slice(None, half), slice(half, None)):
        modes = fit(t[part], y[part], most).modes
        near = [m for m in modes if abs(m.frequency / whole.frequency - 1) < 0.1]
        if not near:
            return ()
        both.append(min(near, key=lambda mode: abs(mode.frequency - whole.frequency)))
    first, second = both
    apart = abs(first.frequency - second.frequency)
    return tuple(both) if apart > 4 * np.hypot(first.frequency_std, second.frequency_std) else ()


def lacks(found: Fit, t: np.ndarray, y: np.ndarray) -> dict[str, float] | None:
    """What a fit lacks about its strongest mode: another one near it, or one that changes.

    Returns:
        `share`: the RMS of what is left about it by that of the fit; `by_noise`: by the noise
        there. None: nothing worth a word.
    """
    if not found.modes:
        return None
    t = t - t[0]
    w0 = 2 * np.pi * strongest(found, float(t[-1])).frequency
    rms, by_noise = lacking(t, y - found.values, w0)
    share = rms / float(np.std(found.values))
    much = share > LACKING and by_noise > LEFT
    return {"share": share, "by_noise": by_noise} if much else None


def _near(w0: float, shapes: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Which modes (M,) are near a frequency: some resolutions of the record, or a bandwidth."""
    wide = np.maximum(NEAR * 2 * np.pi / t[-1], 2 * np.abs(shapes[:, 1]) * shapes[:, 0])
    return np.asarray(np.abs(shapes[:, 0] - w0) < wide)


def _with_another(
    t: np.ndarray, z: np.ndarray, shapes: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The modes (M + 1, 2) fitted with one more from `start` on, and what they leave (T,).

    A mode that is near may be two that were fitted as one: the fit begins from two in its place
    too, and the better fit counts. Without any that ends with modes that ring: those of now.
    """
    starts = [np.vstack([shapes, start])]
    if _near(start[0], shapes, t).any():
        m = int(np.argmin(np.abs(shapes[:, 0] - start[0])))
        for side in (np.pi / t[-1], -np.pi / t[-1]):
            both = np.vstack([shapes, shapes[m]])
            both[[m, -1], 0] += [side, -side]
            both[[m, -1], 1] /= 2
            starts.append(both)
    ends = [tried for tried in (solve(t, z, each) for each in starts) if tried is not None]
    rests = [z - columns(t, end)[0] @ amplitudes_of(t, z, end) for end in (ends or [shapes])]
    best = int(np.argmin([rest @ rest for rest in rests]))
    return (ends or [shapes])[best], rests[best]


def _apart(t: np.ndarray, z: np.ndarray, shapes: np.ndarray, rest: np.ndarray) -> bool:
    """Whether modes that are near each other are two, and not one that changes with its amplitude.

    The changing mode is Re exp(p0 + p1 t + ...). With a few numbers more than two modes have, it
    must leave significantly more than they do; with many more, not significantly less.

    Args:
        t: times (T,) from 0 on [s].
        z: values (T,).
        shapes: w0 and zeta of the modes (M, 2).
        rest: what the modes leave (T,).
    """
    basis, amplitudes = columns(t, shapes)[0], amplitudes_of(t, z, shapes)
    power, least = float(rest @ rest), PENALTY * np.log(len(z)) / len(z)
    for m in range(len(shapes)):
        for k in (m + 1 + np.flatnonzero(_near(shapes[m, 0], shapes[m + 1 :], t))).tolist():
            if abs(shapes[m, 0] - shapes[k, 0]) * t[-1] < SAME * 2 * np.pi:
                return False
            own = [2 + 2 * m, 3 + 2 * m, 2 + 2 * k, 3 + 2 * k]
            both = rest + basis[:, own] @ amplitudes[own]
            few, many = (left_by_a_changing_mode(t, both, shapes[[m, k]], n) for n in DEGREES)
            if np.log(few / power) < least or np.log(power / many) > least:
                return False
    return True
