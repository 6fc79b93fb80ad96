"""What a fit says beside its numbers: what cannot be told apart, what is at a bound, what
contradicts the file."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ..estimate import Estimate
from .inputs import force_unit, noise, rate_at_start
from .model import AT_START, PLAIN, read, settings_of

if TYPE_CHECKING:
    from .search import Search

ALIKE = 0.95  # correlation of two estimates that hardly differ in their effect
SAME = 1e-5  # smallest singular value of the scaled derivatives, by the largest: no difference
OFF = 0.2  # of the file's value: further away is told
LEFT = 3.0  # residual by noise: the model lacks something
BEGUN = 0.02  # of a channel's peak, between its first reading and the simulation's
EXPLAINED = 0.2  # of the residual's square, by one more quantity of a channel


def told(found: Estimate) -> set[str]:
    """The names of parameters that the runs tell."""
    J = found.derivatives.reshape(len(found.parameters), -1)
    out, unknown = set(), {*_mixed(found), *without_effect(found)}
    for k, u in enumerate(found.parameters):
        variance = found.covariance[k, k]
        if np.isfinite(variance) and variance >= 0 and u.name not in unknown:
            out.add(u.name)
    return out if J.any() else set()


def without_effect(found: Estimate) -> list[str]:
    """The names of parameters on which nothing that was compared depends."""
    J = found.derivatives.reshape(len(found.parameters), -1)
    size = np.linalg.norm(J, axis=1) * [_reach(u) for u in found.parameters]
    return [u.name for u, x in zip(found.parameters, size, strict=True) if x < 1e-6]


def _reach(u: object) -> float:
    """How far a scaled value may change."""
    low, high = sorted(map(u.to_scaled, u.bounds))  # type: ignore[attr-defined]
    return float(high - low)


def _mixed(found: Estimate) -> list[str]:
    """The names of parameters of which only combinations have an effect."""
    J = found.derivatives.reshape(len(found.parameters), -1)
    size = np.linalg.norm(J, axis=1)
    there = np.flatnonzero(size > 0)
    if len(there) < 2:
        return []
    U, s, _ = np.linalg.svd(J[there] / size[there, None], full_matrices=False)
    names: list[str] = []
    for k in np.flatnonzero(s < SAME * s[0]):
        names += [found.parameters[there[i]].name for i in np.flatnonzero(np.abs(U[:, k]) > 0.1)]
    return list(dict.fromkeys(names))


def sentences(search: Search, found: Estimate, quantities: Sequence[object]) -> list[str]:
    """The sentences.

    Args:
        search: the runs.
        found: the estimate.
        quantities: the rows of the result, as `Quantity`.

    Returns:
        One a finding.
    """
    out = []
    nothing = without_effect(found)
    out += [
        f"{name}: nothing that was compared depends on it; the robot file keeps its own value"
        for name in nothing
    ]
    mixed = [name for name in _mixed(found) if name not in nothing]
    if mixed:
        out.append(f"cannot be told apart by these runs: {', '.join(mixed)}; fix one of them")
    out += _alike(found, {*nothing, *mixed})
    out += [
        f"{u.name}: at the {word} bound of the search; its value is not known"
        for u, word in found.at_bounds()
        if u.name not in nothing
    ]
    out += _off(quantities)
    out += _of_inputs(search, found)
    out += _starts(search, found)
    out += _left(search, found)
    out += _channels(search, found)
    return out


def _alike(found: Estimate, without: set[str]) -> list[str]:
    deviation = np.sqrt(np.diag(found.covariance))
    out = []
    for i, j in combinations(range(len(found.parameters)), 2):
        a, b = found.parameters[i].name, found.parameters[j].name
        if {a, b} & without or not deviation[i] * deviation[j] > 0:
            continue
        related = found.covariance[i, j] / (deviation[i] * deviation[j])
        if abs(related) > ALIKE:
            out.append(
                f"{a} and {b} are hard to tell apart: their estimates have the correlation "
                f"{related:.3f}"
            )
    return out


def _off(quantities: Sequence[object]) -> list[str]:
    """Estimates far from the file's values, which lie outside their intervals."""
    out = []
    for q in quantities:
        name, file, value = q.name, q.file, q.value  # type: ignore[attr-defined]
        low, high = q.low, q.high  # type: ignore[attr-defined]
        if not np.isfinite([file, low, high]).all() or file == 0 or "/" in name:
            continue
        if abs(value / file - 1) > OFF and not low <= file <= high:
            out.append(
                f"{name}: {value / file:.3g} times the file's value, which the interval excludes"
            )
    return out


def _of_inputs(search: Search, found: Estimate) -> list[str]:
    """Estimates whose intervals are mostly what measured motions do to them."""
    named = zip(found.parameters, found.mostly_of_inputs, strict=True)
    idle = without_effect(found)
    names = [u.name for u, mostly in named if mostly and u.name not in idle]
    if not names:
        return []
    first = search.experiments[0]
    motions = [each.channel for each in first.inputs if each.channel in first.run]
    return [
        f"{', '.join(names)}: most of the interval comes from the noise of the measured motion "
        f"{', '.join(motions)}, which is an input, or from what it does between its samples; a "
        "drive, or the reference of a controller that is known, has none"
    ]


def _starts(search: Search, found: Estimate) -> list[str]:
    """Runs that do not begin at rest, as a fit does."""
    values, out = {**search.fixed, **found.values}, []
    for each in search.experiments:
        for given in each.inputs:
            rate = rate_at_start(each.run, given)
            if rate:
                unit = "rad/s" if force_unit(search.robot, given.joint) == "N m" else "m/s"
                out.append(
                    f"joint {given.joint} moves at once, at {rate:.3g} {unit}; a fit begins at "
                    "rest. If the run began in motion, the estimates are wrong"
                )
        first = int(np.argmax(each.counted.any(axis=0)))
        for name, y, z in zip(
            each.channels, each.measured, each.readings(search.robot, values), strict=True
        ):
            off = abs(z[0] - y[0])
            if first == 0 and off > max(AT_START * noise(y), BEGUN * float(np.nanmax(np.abs(y)))):
                out.append(
                    f"{name}: begins at {y[0]:.3g}, and in the simulation at {z[0]:.3g}: the run "
                    "does not begin at rest, or the channel's zero is off"
                )
    return list(dict.fromkeys(out))


def _left(search: Search, found: Estimate) -> list[str]:
    out = []
    for name, left in search.residuals({**search.fixed, **found.values}).items():
        if left["noise"] > 0 and left["rms"] > LEFT * left["noise"] and left["by_peak"] > 0.01:
            out.append(
                f"{name}: what is left is {left['by_peak']:.2g} of its peak, "
                f"{left['rms'] / left['noise']:.2g} times its noise: the model lacks something"
            )
    return out


def _channels(search: Search, found: Estimate) -> list[str]:
    """Channels whose scale, zero or clock contradict the model: one of these more would explain
    much of what is left (a score test)."""
    values = {**search.fixed, **found.values}
    J = found.derivatives.reshape(len(found.parameters), -1)
    size = np.linalg.norm(J, axis=1)
    base = np.linalg.qr((J[size > 0] / size[size > 0, None]).T)[0]
    r, out = found.residuals.ravel(), []
    z = [each.simulate(search.robot, values) for each in search.experiments]
    for k, name in enumerate(search.experiments[0].channels):
        best: tuple[float, str] = (EXPLAINED, "")
        for what, step, unit in (("gain", 1e-3, ""), ("offset", 1.0, ""), ("delay_s", 1e-4, " s")):
            if f"{name}.{what}" in values:
                continue
            settings = settings_of(name, values)
            by = step * (search.sizes[k] if what == "offset" else 1.0)
            by *= settings["gain"] if what == "gain" else 1.0
            column = np.zeros(found.residuals.shape)
            column[k] = np.concatenate(
                [
                    _change(each.run.t, run, name, settings, what, by) * each.counted[k]
                    for each, run in zip(search.experiments, z, strict=True)
                ]
            )
            c = column.ravel() / search.sigma[k]
            free = c - base @ (base.T @ c)
            power = float(free @ free)
            if power < 1e-6 * float(c @ c) or power == 0.0:
                continue
            share = float(free @ r) ** 2 / power / max(float(r @ r), 1e-300)
            value = settings[what] - by * float(free @ r) / power
            if share > best[0]:
                said = {"gain": "scale", "offset": "zero", "delay_s": "clock"}[what]
                best = (
                    share,
                    f"{name}: {what} = {value:.3g}{unit} would explain {100 * share:.0f} % of what "
                    f"is left: its {said} contradicts the file",
                )
        if best[1]:
            out.append(best[1])
    return out


def _change(
    t: np.ndarray, run: object, name: str, settings: dict[str, float], what: str, by: float
) -> np.ndarray:
    """The change of a channel's readings (T,) by one of its settings."""
    y = run[name]  # type: ignore[index]
    full = np.full(len(t), y[-1] if len(y) else 0.0)
    full[: len(y)] = y
    assert what in PLAIN
    return read(t, full, settings | {what: settings[what] + by}) - read(t, full, settings)
