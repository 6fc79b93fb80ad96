"""Sums of damped sinusoids fitted to a free vibration by nonlinear least squares.

    y(t) = a0 + a1 t + sum_m Re{ c_m exp(s_m t) },  s = -zeta w0 + i w0 sqrt(1 - zeta^2)

w0 = 2 pi f is the undamped frequency, zeta the damping ratio. Modes are found one after the other
at the highest peak of the remainder's spectrum (RELAX: Li and Stoica 1996, IEEE Trans. Signal
Processing 44, 281-295), and all are fitted together. A mode is kept if it makes the fit better
than noise does. Intervals come from the Jacobian and the remainder's variance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FOUR = 4  # numbers a mode: frequency, damping ratio, two amplitudes
PENALTY = 6.0  # of a mode, times ln(samples): noise makes a false one in far less than 1 of 1000
SMALLEST = 1e-4  # of the vibration's energy: what is less is no mode
RATIOS = (0.002, 0.01, 0.03, 0.1, 0.3)  # of damping, to begin with
MOST_RATIO = 0.7
STEPS = 60


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
    left = z - _line(t, z)
    energy = left_energy = float(left @ left)
    while len(shapes) < most:
        start = _peak(t, left)
        if start is None or _close(start, shapes, t):
            break
        tried = _solve(t, z, np.vstack([shapes, start]))
        if tried is None:
            break
        rest = z - _basis(t, tried)[0] @ _amplitudes(t, z, tried)
        now = float(rest @ rest)
        if now <= 0.0 or len(z) - FOUR * len(tried) - 2 < 1:
            shapes, left, left_energy = tried, rest, now
            break
        gain = len(z) * np.log(left_energy / now) if now < left_energy else 0.0
        if gain < PENALTY * FOUR * np.log(len(z)) or left_energy - now < SMALLEST * energy:
            break
        shapes, left, left_energy = tried, rest, now
    if not len(shapes):
        return Fit((), scale * (z - left), float(np.std(left)) * scale)
    basis, slopes = _basis(t, shapes)
    amplitudes = _amplitudes(t, z, shapes)
    jacobian = np.hstack([basis, _derivatives(slopes, amplitudes, len(shapes))])
    degrees = max(len(z) - jacobian.shape[1], 1)
    variance = left_energy / degrees
    size = np.linalg.norm(jacobian, axis=0)
    covariance = np.linalg.pinv((jacobian / size).T @ (jacobian / size))
    stds = np.sqrt(variance * np.diag(covariance)) / size
    quantile = float(student.ppf(0.975, degrees))
    modes = []
    for m, (w0, zeta) in enumerate(shapes):
        own = np.sqrt(_coloured(t, left, w0))
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
    linear.
    """
    if not found.modes:
        return ()
    whole = strongest(found, float(t[-1] - t[0]))
    half = len(t) // 2
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


def _line(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The straight line through y."""
    basis = np.column_stack([np.ones_like(t), t / t[-1]])
    return basis @ np.linalg.lstsq(basis, y, rcond=None)[0]


def _poles(shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """s (M,), and its derivatives by w0 and zeta."""
    w0, zeta = shapes[:, 0], shapes[:, 1]
    root = np.sqrt(np.maximum(1 - zeta**2, 1e-12))
    by_frequency = -zeta + 1j * root
    return w0 * by_frequency, by_frequency, -w0 - 1j * w0 * zeta / root


def _basis(t: np.ndarray, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns (T, 2 + 2M): 1, t, then Re and -Im of exp(s t); and t exp(s t) ds/d(w0, zeta)."""
    poles, by_frequency, by_ratio = _poles(shapes)
    waves = np.exp(np.outer(t, poles))
    columns = [np.ones_like(t), t / t[-1]]
    for wave in waves.T:
        columns += [wave.real, -wave.imag]
    slopes = np.stack([t[:, None] * waves * by_frequency, t[:, None] * waves * by_ratio], axis=2)
    return np.column_stack(columns), slopes


def _amplitudes(t: np.ndarray, y: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(_basis(t, shapes)[0], y, rcond=None)[0]


def _derivatives(slopes: np.ndarray, amplitudes: np.ndarray, count: int) -> np.ndarray:
    """Derivatives of y by w0 and zeta of each mode, (T, 2M)."""
    complex_amplitudes = amplitudes[2::2][:count] + 1j * amplitudes[3::2][:count]
    return np.real(slopes * complex_amplitudes[None, :, None]).reshape(len(slopes), 2 * count)


def _solve(t: np.ndarray, y: np.ndarray, shapes: np.ndarray) -> np.ndarray | None:
    """All modes together by Levenberg and Marquardt; amplitudes are solved for in each step."""
    shapes = shapes.copy()
    basis, slopes = _basis(t, shapes)
    amplitudes = np.linalg.lstsq(basis, y, rcond=None)[0]
    rest = y - basis @ amplitudes
    cost, damping = float(rest @ rest), 1e-4
    fastest = 1.1 * np.pi * (len(t) - 1) / t[-1]
    for _ in range(STEPS):
        jacobian = np.hstack([basis, _derivatives(slopes, amplitudes, len(shapes))])
        size = np.linalg.norm(jacobian, axis=0)
        size[size == 0] = 1.0
        normal = (jacobian / size).T @ (jacobian / size)
        gradient = (jacobian / size).T @ rest
        better = False
        for _ in range(12):
            step = np.linalg.solve(normal + damping * np.eye(len(normal)), gradient) / size
            tried = shapes + step[basis.shape[1] :].reshape(-1, 2)
            inside = (tried[:, 0] > 0) & (tried[:, 0] < fastest)
            if inside.all():
                # growing waves stay finite: exp(1) at the end
                tried[:, 1] = np.clip(tried[:, 1], -1 / (tried[:, 0] * t[-1]), 0.95)
                new_basis, new_slopes = _basis(t, tried)
                new = np.linalg.lstsq(new_basis, y, rcond=None)[0]
                rest_new = y - new_basis @ new
                if float(rest_new @ rest_new) <= cost:
                    better = True
                    break
            damping *= 10
        if not better:
            break
        change = np.abs(tried - shapes) / np.column_stack([shapes[:, 0], np.ones(len(shapes))])
        fell = cost - float(rest_new @ rest_new)
        shapes, basis, slopes, amplitudes, rest = tried, new_basis, new_slopes, new, rest_new
        cost, damping = float(rest @ rest), max(damping / 10, 1e-12)
        if change.max() < 1e-9 or fell <= 1e-14 * cost:
            break
    ringing = (np.abs(shapes[:, 1]) < MOST_RATIO) & (shapes[:, 0] * t[-1] > 2 * np.pi)
    return shapes if ringing.all() else None


def _peak(t: np.ndarray, left: np.ndarray) -> np.ndarray | None:
    """w0 and zeta of the highest peak of the remainder's spectrum, and the best of some ratios."""
    step = float(t[-1]) / (len(t) - 1)
    even = np.interp(np.arange(len(t)) * step, t, left)
    spectrum = np.abs(np.fft.rfft(even, 4 * len(even)))
    at = np.fft.rfftfreq(4 * len(even), step)
    spectrum[at * t[-1] < 1.0] = 0.0
    k = int(spectrum.argmax())
    if spectrum[k] == 0.0:
        return None
    found = [np.array([2 * np.pi * at[k], ratio]) for ratio in RATIOS]
    costs = []
    for each in found:
        basis = _basis(t, each[None])[0][:, 2:]
        rest = left - basis @ np.linalg.lstsq(basis, left, rcond=None)[0]
        costs.append(float(rest @ rest))
    return found[int(np.argmin(costs))]


def _close(start: np.ndarray, shapes: np.ndarray, t: np.ndarray) -> bool:
    """Whether a mode is there already: closer than the record's resolution, or half a bandwidth."""
    wide = np.maximum(2 * np.pi / t[-1], 2 * np.abs(shapes[:, 1]) * shapes[:, 0])
    return bool((np.abs(shapes[:, 0] - start[0]) < wide).any())


def _coloured(t: np.ndarray, left: np.ndarray, w0: float) -> float:
    """The remainder's power at a mode's frequency over its mean power; 1 unless it is well above.

    Noise that is not white makes intervals wider, where it is stronger at the mode.
    """
    step = float(t[-1]) / (len(t) - 1)
    even = np.interp(np.arange(len(t)) * step, t, left)
    power = np.abs(np.fft.rfft(even)[1:]) ** 2
    k = round(w0 / (2 * np.pi) * step * len(t)) - 1
    wide = max(8, len(power) // 50)
    part = power[max(k - wide, 0) : k + wide + 1]
    share = float(part.mean() / power.mean()) if len(part) and power.mean() > 0 else 1.0
    significant = 1 + 4 / np.sqrt(max(len(part), 1))
    return share if share > significant else 1.0
