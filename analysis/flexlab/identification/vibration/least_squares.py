"""Damped sinusoids and their parameters' least squares: what `fit` puts together.

A mode is a row of `shapes`: its undamped frequency w0 [rad/s] and its damping ratio.
"""

from __future__ import annotations

import numpy as np

MOST_RATIO = 0.7
STEPS = 60


def line(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The straight line through y."""
    basis = np.column_stack([np.ones_like(t), t / t[-1]])
    return basis @ np.linalg.lstsq(basis, y, rcond=None)[0]


def columns(t: np.ndarray, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns (T, 2 + 2M): 1, t, then Re and -Im of exp(s t); and t exp(s t) ds/d(w0, zeta)."""
    poles, by_frequency, by_ratio = _poles(shapes)
    waves = np.exp(np.outer(t, poles))
    columns = [np.ones_like(t), t / t[-1]]
    for wave in waves.T:
        columns += [wave.real, -wave.imag]
    slopes = np.stack([t[:, None] * waves * by_frequency, t[:, None] * waves * by_ratio], axis=2)
    return np.column_stack(columns), slopes


def amplitudes_of(t: np.ndarray, y: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """The factors of `columns` (2 + 2M,) that fit y best."""
    return np.linalg.lstsq(columns(t, shapes)[0], y, rcond=None)[0]


def solve(t: np.ndarray, y: np.ndarray, shapes: np.ndarray) -> np.ndarray | None:
    """All modes together by Levenberg and Marquardt; amplitudes are solved for in each step."""
    shapes = shapes.copy()
    basis, slopes = columns(t, shapes)
    amplitudes = np.linalg.lstsq(basis, y, rcond=None)[0]
    rest = y - basis @ amplitudes
    cost, damping = float(rest @ rest), 1e-4
    fastest = 1.1 * np.pi * (len(t) - 1) / t[-1]
    for _ in range(STEPS):
        jacobian = np.hstack([basis, derivatives(slopes, amplitudes, len(shapes))])
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
                new_basis, new_slopes = columns(t, tried)
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


def left_by_a_changing_mode(t: np.ndarray, y: np.ndarray, shapes: np.ndarray, degree: int) -> float:
    """The energy that one mode leaves whose frequency and damping change with time.

    Args:
        t: times (T,) from 0 on [s].
        y: values (T,) of two modes.
        shapes: of these (2, 2).
        degree: of the polynomials in t that logarithm and phase of its amplitude are.
    """
    from scipy.optimize import least_squares

    between = shapes.mean(axis=0)[None]
    merged = solve(t, y, between)
    first = between if merged is None else merged
    powers = (t / t[-1])[:, None] ** np.arange(degree + 1)
    begin = np.zeros(degree + 1, complex)
    begin[0] = np.log(complex(*amplitudes_of(t, y, first)[2:4]))
    begin[1] = _poles(first)[0][0] * t[-1]

    def wave(p: np.ndarray) -> np.ndarray:
        exponent = powers @ (p[: degree + 1] + 1j * p[degree + 1 :])
        return np.asarray(np.exp(np.minimum(exponent.real, 30.0) + 1j * exponent.imag))

    def slopes(p: np.ndarray) -> np.ndarray:
        by_exponent = wave(p)[:, None] * powers
        return np.hstack([by_exponent.real, -by_exponent.imag])

    found = least_squares(
        lambda p: wave(p).real - y,
        np.concatenate([begin.real, begin.imag]),
        slopes,
        x_scale="jac",
        max_nfev=STEPS,
    )
    return 2 * float(found.cost)


def _poles(shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """s (M,), and its derivatives by w0 and zeta."""
    w0, zeta = shapes[:, 0], shapes[:, 1]
    root = np.sqrt(np.maximum(1 - zeta**2, 1e-12))
    by_frequency = -zeta + 1j * root
    return w0 * by_frequency, by_frequency, -w0 - 1j * w0 * zeta / root


def derivatives(slopes: np.ndarray, amplitudes: np.ndarray, count: int) -> np.ndarray:
    """Derivatives of y by w0 and zeta of each mode, (T, 2M)."""
    complex_amplitudes = amplitudes[2::2][:count] + 1j * amplitudes[3::2][:count]
    return np.real(slopes * complex_amplitudes[None, :, None]).reshape(len(slopes), 2 * count)
