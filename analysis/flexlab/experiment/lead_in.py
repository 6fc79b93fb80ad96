"""Smooth start and end of a motion that begins or ends at speed.

    p(s) = quintic with position, velocity and acceleration given at both ends, s from its beginning

A stepper that must turn at 3.3 rad/s at once loses steps. With a lead-in of one second it does not,
and the manoeuvre itself is unchanged.
"""

from __future__ import annotations

import math

import numpy as np

from flexura.signals import COLUMNS, Signal

LEAD_IN_S = 1.0
AT_REST = 1e-9  # m, rad and their rates: no lead is needed


def with_lead_in(motion: Signal, duration_s: float, lead_s: float, out_s: float) -> Signal:
    """A motion with a lead-in from rest at 0 and a lead-out to rest where it ends.

    Args:
        motion: the motion, from 0 to its duration.
        duration_s: its duration [s].
        lead_s: duration of the lead-in [s]; 0 if the motion begins at rest.
        out_s: duration of the lead-out [s]; 0 if it ends at rest.
    """
    rows = []
    begin, end = motion(0.0), motion(duration_s)
    if lead_s:
        rows.append(quintic(0.0, lead_s, (0.0, 0.0, 0.0), begin))
    rows += _shifted(motion.segments, lead_s, duration_s)
    if out_s:
        rows.append(quintic(lead_s + duration_s, out_s, end, (end[0], 0.0, 0.0)))
        rows.append(_hold(lead_s + duration_s + out_s, end[0]))
    segments = np.array(rows)
    segments.setflags(write=False)
    return Signal(
        segments, {"kind": "led", "motion": motion.spec, "lead_s": lead_s, "out_s": out_s}
    )


def quintic(
    t0: float, T: float, a: tuple[float, float, float], b: tuple[float, float, float]
) -> np.ndarray:
    """A signal's row from a state at t0 to one at t0 + T.

    Args:
        t0: start [s].
        T: duration [s].
        a: position, velocity and acceleration at t0.
        b: the same at t0 + T.
    """
    left = np.array([b[0] - a[0] - a[1] * T - a[2] * T**2 / 2, b[1] - a[1] - a[2] * T, b[2] - a[2]])
    high = np.linalg.solve(
        [[T**3, T**4, T**5], [3 * T**2, 4 * T**3, 5 * T**4], [6 * T, 12 * T**2, 20 * T**3]], left
    )
    return np.array([t0, a[0], a[1], a[2] / 2, *high, 0.0, 0.0, 0.0])


def _hold(t0: float, value: float) -> np.ndarray:
    row = np.zeros(COLUMNS)
    row[0], row[1] = t0, value
    return row


def _shifted(segments: np.ndarray, by: float, duration_s: float) -> list[np.ndarray]:
    """The rows that act from 0 to the duration, later by `by`; the first begins there."""
    first = max(int(np.searchsorted(segments[:, 0], 0.0, side="right")) - 1, 0)
    rows = [row.copy() for row in segments[first:] if row[0] < duration_s]
    if rows and rows[0][0] > 0:  # held until then
        rows.insert(0, _hold(0.0, float(rows[0][1] + rows[0][7] * math.sin(rows[0][9]))))
    elif rows and rows[0][0] < 0:
        rows[0] = _from_zero(rows[0])
    for row in rows:
        row[0] += by
    return rows


def _from_zero(row: np.ndarray) -> np.ndarray:
    """The same function, expanded at 0 instead of at the row's own earlier beginning."""
    s, c = -row[0], row[1:7]
    out = row.copy()
    out[0] = 0.0
    if np.any(c[1:]):
        out[1:7] = [
            sum(math.comb(j, k) * c[j] * s ** (j - k) for j in range(k, 6)) for k in range(6)
        ]
    if row[7]:
        out[9] = row[9] + row[8] * s
    return out
