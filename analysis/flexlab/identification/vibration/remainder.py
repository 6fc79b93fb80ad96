"""What a fit leaves of a vibration: its spectrum's peaks and its noise."""

from __future__ import annotations

import numpy as np

from .least_squares import columns

RATIOS = (0.002, 0.01, 0.03, 0.1, 0.3)  # of damping, to begin with
NEAR = 3.0  # resolutions of a record, 1 / length: modes that are nearer may be one


def peak(t: np.ndarray, left: np.ndarray, refused: list[float]) -> np.ndarray | None:
    """w0 and zeta of the highest peak of the remainder's spectrum, and the best of some ratios.

    No peak is sought at the frequencies `refused` [rad/s].
    """
    step = float(t[-1]) / (len(t) - 1)
    even = np.interp(np.arange(len(t)) * step, t, left)
    spectrum = np.abs(np.fft.rfft(even, 4 * len(even)))
    at = np.fft.rfftfreq(4 * len(even), step)
    spectrum[at * t[-1] < 1.0] = 0.0
    for w0 in refused:
        spectrum[np.abs(at - w0 / (2 * np.pi)) * t[-1] < NEAR] = 0.0
    k = int(spectrum.argmax())
    if spectrum[k] == 0.0:
        return None
    found = [np.array([2 * np.pi * at[k], ratio]) for ratio in RATIOS]
    costs = []
    for each in found:
        basis = columns(t, each[None])[0][:, 2:]
        rest = left - basis @ np.linalg.lstsq(basis, left, rcond=None)[0]
        costs.append(float(rest @ rest))
    return found[int(np.argmin(costs))]


def coloured(t: np.ndarray, left: np.ndarray, w0: float) -> float:
    """The remainder's power at a mode's frequency over its mean power; 1 unless it is well above.

    Noise that is not white makes intervals wider, where it is stronger at the mode.
    """
    power, part = _about(t, left, w0)
    share = float(part.mean() / power.mean()) if len(part) and power.mean() > 0 else 1.0
    significant = 1 + 4 / np.sqrt(max(len(part), 1))
    return share if share > significant else 1.0


def level(t: np.ndarray, left: np.ndarray, w0: float) -> float:
    """The noise's power about a frequency over the remainder's mean power: lines do not count."""
    power, part = _about(t, left, w0)
    mean = float(power.mean())
    return float(np.median(part)) / np.log(2) / mean if len(part) and mean > 0 else 1.0


def lacking(t: np.ndarray, left: np.ndarray, w0: float) -> tuple[float, float]:
    """What a fit lacks at a mode's frequency.

    Args:
        t: times (T,) from 0 on [s].
        left: what the fit leaves (T,).
        w0: the mode's frequency [rad/s].

    Returns:
        The RMS of what is left within NEAR resolutions of the mode, and by how many times it is
        more than the noise about it.
    """
    power, _ = _about(t, left, w0)
    k = np.arange(1, len(power) + 1) - w0 / (2 * np.pi) * t[-1]
    own = power[np.abs(k) < NEAR]
    mean = float(own.mean()) if len(own) else 0.0
    noise = level(t, left, w0) * float(power.mean())
    rms = np.sqrt(2 * mean * len(own)) / len(t)
    return float(rms), float(np.sqrt(mean / noise)) if noise > 0 else 0.0


def _about(t: np.ndarray, left: np.ndarray, w0: float) -> tuple[np.ndarray, np.ndarray]:
    """The remainder's power by frequency, and the part about one."""
    step = float(t[-1]) / (len(t) - 1)
    power = np.abs(np.fft.rfft(np.interp(np.arange(len(t)) * step, t, left))[1:]) ** 2
    k = round(w0 / (2 * np.pi) * step * len(t)) - 1
    wide = max(8, len(power) // 50)
    return power, power[max(k - wide, 0) : k + wide + 1]
