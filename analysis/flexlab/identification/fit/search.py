"""The search for parameters: residuals of all runs, their derivatives, and weights by channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

import flexura as fx

from ..estimate import Estimate, covariance
from .inputs import noise
from .model import Experiment
from .unknowns import Unknown, of_channel

STEPS = 30  # of one fit
WEIGHTED = 4  # fits with weights of the one before
SETTLED = 0.01  # change of the weights that ends this
DRAWS = 8  # of the noise of measured motions
IDLE = 1e-8  # of the largest derivative: nothing but round-off
UNEXPLAINED = 3.0  # standard deviations: a change that noise does not make
FAILED = 1e3  # a residual of a simulation that ended early
LEAST_NOISE = 1e-6  # of a channel's size


@dataclass
class Search:
    """The unknowns of a robot, and the runs that they are fitted to."""

    robot: fx.Robot
    unknowns: tuple[Unknown, ...]
    fixed: Mapping[str, float]
    experiments: tuple[Experiment, ...]
    sigma: np.ndarray = field(default_factory=lambda: np.zeros(0))
    evaluations: int = 0

    def __post_init__(self) -> None:
        self.sizes = np.array([self._size(k) for k in range(len(self.experiments[0].channels))])
        self.sigma = self.sizes.copy()

    def _size(self, k: int) -> float:
        """The RMS of a channel about its mean."""
        y = np.concatenate([each.measured[k][each.counted[k]] for each in self.experiments])
        return float(np.std(y)) or float(np.abs(y).max(initial=0.0)) or 1.0

    @property
    def start(self) -> dict[str, float]:
        """Values to begin with."""
        return {u.name: u.parameter.start for u in self.unknowns}

    def stiffer(self, values: Mapping[str, float], factor: float) -> dict[str, float]:
        """All stiffnesses times a factor, within their bounds."""
        out = dict(values)
        for u in self.unknowns:
            if u.stiffness:
                low, high = u.parameter.bounds
                out[u.name] = float(np.clip(factor * u.parameter.start, low, high))
        return out

    def first_frequency(self) -> float:
        """The robot's first natural frequency with its joints locked [Hz]; 0: nothing bends."""
        own = {key: x for key, x in self.start.items() if not of_channel(key)[0]}
        try:
            found = fx.frequencies(self.robot.replace(own), count=1)
        except fx.InputError:
            return 0.0
        return float(found[0]) if len(found) else 0.0

    def residuals_at(
        self,
        values: Mapping[str, float],
        ends: Sequence[float] | None = None,
        experiments: Sequence[Experiment] | None = None,
    ) -> np.ndarray:
        """Deviations of all runs in units of sigma, one run after another (channels, T).

        Args:
            values: of the unknowns.
            ends: of each run [s]; None: the whole.
            experiments: in place of the runs' own.
        """
        self.evaluations += 1
        parts = []
        for k, each in enumerate(experiments or self.experiments):
            try:
                end = None if ends is None else ends[k]
                z = each.readings(self.robot, {**self.fixed, **values}, end)
            except fx.NumericalError:
                z = np.full(each.measured.shape, np.nan)
            r = np.where(np.isfinite(z), z - each.measured, FAILED * self.sizes[:, None])
            counted = each.counted if ends is None else each.counted & (each.run.t <= ends[k])
            parts.append(np.where(counted, r, 0.0))
        return np.concatenate(parts, axis=1) / self.sigma[:, None]

    def misfit(self, values: Mapping[str, float], ends: Sequence[float] | None) -> float:
        """Sum of squares, with the best gain and offset of channels whose gain or offset is
        sought."""
        return float((self.residuals_at(values, ends) ** 2).sum())

    def jacobian(
        self, scaled: np.ndarray, ends: Sequence[float] | None = None, *, central: bool = False
    ) -> np.ndarray:
        """Derivatives of the residuals by the scaled values (k, channels, T), by differences.

        Args:
            scaled: the values (k,).
            ends: of each run [s]; None: the whole.
            central: differences of both sides, where bounds leave room.
        """
        base = self.residuals_at(self.physical(scaled), ends)
        out = np.zeros((len(scaled), *base.shape))
        # those of channels take the simulation that is at hand
        for k in sorted(range(len(scaled)), key=lambda k: not self.unknowns[k].channel):
            parameter = self.unknowns[k].parameter
            low, high = sorted(map(parameter.to_scaled, parameter.bounds))
            sides = [min(scaled[k] + parameter.step, high), max(scaled[k] - parameter.step, low)]
            if not central:
                sides = [max(sides, key=lambda x: abs(x - scaled[k])), scaled[k]]
            r = []
            for x in sides:
                moved = scaled.copy()
                moved[k] = x
                r.append(base if x == scaled[k] else self.residuals_at(self.physical(moved), ends))
            out[k] = (r[0] - r[1]) / (sides[0] - sides[1])
        return out

    def physical(self, scaled: np.ndarray) -> dict[str, float]:
        """Values in their units from scaled ones (k,)."""
        return {u.name: u.physical(float(x)) for u, x in zip(self.unknowns, scaled, strict=True)}

    def fit(self, values: Mapping[str, float], ends: Sequence[float] | None = None) -> Estimate:
        """Least squares from `values` on, by the weights of now; the covariance is not of use."""
        from scipy.optimize import least_squares

        scaled = lambda of: np.array([u.parameter.to_scaled(of(u)) for u in self.unknowns])
        bounds = np.array(
            [sorted(map(u.parameter.to_scaled, u.parameter.bounds)) for u in self.unknowns]
        ).T
        solution = least_squares(
            lambda x: self.residuals_at(self.physical(x), ends).ravel(),
            np.clip(scaled(lambda u: values[u.name]), *bounds),
            lambda x: self.jacobian(x, ends).reshape(len(x), -1).T,
            tuple(bounds),
            x_scale=np.array([u.parameter.step for u in self.unknowns]),
            ftol=1e-3 if ends is not None else 1e-7,
            xtol=1e-9,
            gtol=1e-12,
            max_nfev=STEPS,
        )
        r = self.residuals_at(self.physical(solution.x), ends)
        J = solution.jac.T.reshape(len(self.unknowns), *r.shape)
        parameters = tuple(u.parameter for u in self.unknowns)
        none = np.full((len(parameters), len(parameters)), np.nan)
        return Estimate(parameters, self.physical(solution.x), none, r, J, self.evaluations)

    def weighted_fit(self, values: Mapping[str, float]) -> Estimate:
        """The fit to the whole runs, each channel by the RMS of what is left of it."""
        found = self.fit(values)
        for _ in range(WEIGHTED):
            count = np.sum([each.counted.sum(axis=1) for each in self.experiments], axis=0)
            share = len(self.unknowns) / count.sum()  # of the samples that the unknowns use up
            rms = np.sqrt((found.residuals**2).sum(axis=1) / count / max(1 - share, 0.5))
            before = self.sigma
            self.sigma = np.maximum(before * rms, LEAST_NOISE * self.sizes)
            settled = np.abs(self.sigma / before - 1).max() < SETTLED
            found = self.fit(found.values)
            if settled:
                break
        x = np.array([u.parameter.to_scaled(found.values[u.name]) for u in self.unknowns])
        J = self.jacobian(x, central=True)
        of_inputs = self._of_inputs(found.values, J)
        C = covariance(J, found.residuals, self._lag(found.residuals)) + of_inputs
        return replace(
            found,
            derivatives=J,
            covariance=C,
            of_inputs=of_inputs,
            evaluations=self.evaluations,
        )

    def smoother(self) -> Search:
        """The same with motions that are smoothed more."""
        return replace(
            self,
            experiments=tuple(replace(e, smoother=True, _cache={}) for e in self.experiments),
        )

    def _of_inputs(self, values: Mapping[str, float], J: np.ndarray) -> np.ndarray:
        """What measured motions do to the scaled values: a mean square (k, k) of changes.

        For their noise, motions are smoothed again from other readings of the same noise. For what
        they do between samples, every second one is left out: that change counts where the noise
        does not explain it.
        """
        flat = J.reshape(len(J), -1)
        size = np.linalg.norm(flat, axis=1)
        out, there = np.zeros((len(J), len(J))), size > IDLE * size.max()
        if not there.any():
            return out
        base = self.residuals_at(values)
        scaled = (flat[there] / size[there, None]).T

        def moved(others: Sequence[Experiment | None]) -> np.ndarray:
            change = np.zeros(len(J))
            if any(others):
                drawn = [other or own for own, other in zip(self.experiments, others, strict=True)]
                r = (self.residuals_at(values, experiments=drawn) - base).ravel()
                change[there] = -np.linalg.lstsq(scaled, r, rcond=None)[0] / size[there]
            return change

        for seed in range(DRAWS):
            change = moved([each.misread(seed) for each in self.experiments])
            out += np.outer(change, change) / DRAWS
        change = moved([each.coarser() for each in self.experiments])
        change[change**2 < UNEXPLAINED**2 * np.diag(out)] = 0.0
        # a motion between samples is wrong by the first power of their distance, or a higher one
        return out + np.outer(change, change) / 4

    def _lag(self, r: np.ndarray) -> int:
        """Samples over which residuals hang together: 0 for white ones."""
        T = r.shape[1]
        most, level = T // 8, max(0.1, 4 / np.sqrt(T))
        last = 0
        for row in r:
            power = float(row @ row)
            if power == 0.0:
                continue
            size = 1 << (2 * T - 1).bit_length()
            spectrum = np.abs(np.fft.rfft(row, size)) ** 2
            related = np.fft.irfft(spectrum, size)[1 : most + 1] / power
            far = np.flatnonzero(np.abs(related) > level)
            last = max(last, int(far[-1]) + 1 if len(far) else 0)
        return 2 * last

    def residuals(self, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
        """By channel: `rms` of what is left, `noise` of the measured values, `by_peak` the RMS by
        their peak."""
        z = [each.readings(self.robot, values) for each in self.experiments]
        out = {}
        for k, name in enumerate(self.experiments[0].channels):
            y, left, level = [], [], []
            for each, reading in zip(self.experiments, z, strict=True):
                counted = each.counted[k]
                y.append(each.measured[k][counted])
                left.append((reading[k] - each.measured[k])[counted])
                level.append(noise(each.measured[k]))
            rms = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
            peak = float(np.abs(np.concatenate(y)).max()) or 1.0
            out[name] = {"rms": rms, "noise": float(np.mean(level)), "by_peak": rms / peak}
        return out
