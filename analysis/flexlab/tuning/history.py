"""History of a search, stored as a whole after each generation, and as a Run."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.errors import InputError
from flexura.io import Damaged, leftovers, read_sealed, say_unsealed, sealed, write_bytes

FILE = "state.npz"
ADVICE = "restore a copy, or remove it to begin the search again"
NO_ARRAYS = (  # what NumPy raises for a file that has none
    OSError,
    ValueError,
    EOFError,
    AttributeError,
    KeyError,
    NotImplementedError,
    RuntimeError,
    SyntaxError,
    zipfile.BadZipFile,
    zlib.error,
)
_ARRAYS = ("points", "goals", "figures", "reached")


class History:
    """All points of the unit cube that were tried, with their goals and metrics.

    `ends`: number of evaluations after each generation. `wall_s`: duration of each [s]. `stored`:
    generations that were stored already.
    """

    def __init__(self, digest: str, path: Path | None = None) -> None:
        self.digest, self.path = digest, path
        self.ends: list[int] = []
        self.wall_s: list[float] = []
        self._parts: dict[str, list[np.ndarray]] = {name: [] for name in _ARRAYS}
        self.stored = 0  # generations that were there already

    @staticmethod
    def open(folder: Path, digest: str) -> History:
        """The history stored in a folder, empty if there is none.

        Args:
            folder: of the search.
            digest: of the search and its task.

        Raises:
            InputError: the folder holds another search.
        """
        history = History(digest, folder / FILE)
        assert history.path is not None
        for leftover in leftovers(history.path):  # of a process that was killed while it wrote
            leftover.unlink(missing_ok=True)
        if not history.path.exists():
            return history
        try:
            content, there = read_sealed(history.path, ADVICE, "a damaged state of a search")
            with np.load(io.BytesIO(content)) as data:
                found = {name: data[name] for name in data.files}
            missing = {"digest", "ends", "wall_s", *_ARRAYS} - set(found)
            if missing:
                raise ValueError(f"without {', '.join(sorted(missing))}")
        except Damaged:
            raise
        except NO_ARRAYS as error:
            raise InputError(
                f"expected the state of a search ({error})", key="--out", file=str(history.path)
            ) from None
        if str(found.get("digest")) != digest:
            expected = (
                "expected an empty folder, or one of this search, of which --generations "
                "and --patience alone may change"
            )
            raise InputError(expected, key="--out", value=str(folder))
        if not there:
            say_unsealed(history.path)
        history.ends, history.wall_s = found["ends"].tolist(), found["wall_s"].tolist()
        history.stored, begin = len(history.ends), 0
        for end in history.ends:
            for name in _ARRAYS:
                history._parts[name].append(found[name][begin:end])
            begin = end
        return history

    def __len__(self) -> int:
        return len(self.ends)

    def append(
        self,
        points: np.ndarray,
        objectives: np.ndarray,
        metrics: np.ndarray,
        reached: np.ndarray,
        wall_s: float,
    ) -> None:
        """Append a generation of B points and store the history.

        Args:
            points: in the unit cube (B, d).
            objectives: (B, 1 or 2).
            metrics: of R robots (B, R, k).
            reached: fractions of the time reached (B, R).
            wall_s: duration [s].
        """
        for name, array in zip(_ARRAYS, (points, objectives, metrics, reached), strict=True):
            self._parts[name].append(np.array(array))
        self.ends.append(len(points) + (self.ends[-1] if self.ends else 0))
        self.wall_s.append(wall_s)
        if self.path is not None:
            sink = io.BytesIO()
            arrays: dict[str, Any] = {name: self.all(name) for name in _ARRAYS}
            np.savez(sink, digest=self.digest, ends=self.ends, wall_s=self.wall_s, **arrays)
            write_bytes(self.path, sealed(sink.getvalue()), new=len(self.ends) == 1)

    def objectives_for_algorithm(self, generation: int, points: np.ndarray) -> np.ndarray:
        """The goals of a stored generation.

        Args:
            generation: its number, from 0.
            points: what the algorithm asks for.

        Raises:
            InputError: the algorithm asks for other points than were stored.
        """
        stored = self._parts["points"][generation]
        if stored.shape != points.shape or not np.array_equal(stored, points):
            expected = (
                "expected a search stored by the same version of pymoo: this one takes another way"
            )
            raise InputError(
                expected, key="--out", value=f"generation {generation + 1}", file=str(self.path)
            )
        return self._parts["goals"][generation]

    def all(self, name: str) -> np.ndarray:
        """An array of all E evaluations.

        Args:
            name: "points" (E, d), "goals" (E, 1 or 2), "figures" (E, R, k) or "reached" (E, R).
        """
        return np.concatenate(self._parts[name])

    @property
    def evaluations(self) -> int:
        """The number of evaluations."""
        return self.ends[-1] if self.ends else 0

    @property
    def best(self) -> int:
        """Index of the best evaluation.

        For two goals it is the one nearest to both ends of the front, each goal over its range.
        """
        objectives = self.all("goals")
        if objectives.shape[1] == 1:
            return int(objectives[:, 0].argmin())
        pareto_front = self.pareto_front()
        low, high = objectives[pareto_front].min(axis=0), objectives[pareto_front].max(axis=0)
        return int(
            pareto_front[
                np.linalg.norm(
                    (objectives[pareto_front] - low) / np.maximum(high - low, 1e-300), axis=1
                ).argmin()
            ]
        )

    def pareto_front(self) -> np.ndarray:
        """Indices of the evaluations that no other beats in all goals, by the first goal."""
        objectives = self.all("goals")
        order, members, least = np.lexsort(objectives.T[::-1]), [], np.inf
        for k in order:
            if objectives[k, -1] < least:
                members.append(k)
                least = objectives[k, -1]
        return np.array(members)

    def convergence_measure(self, generation: int) -> float:
        """The best J after so many generations.

        For two goals: minus the area between the front and the median of the first generation.
        """
        objectives = self.all("goals")
        tried = objectives[: self.ends[generation - 1]]
        if objectives.shape[1] == 1:
            return float(tried[:, 0].min())
        corner = np.median(self._parts["goals"][0], axis=0)
        inside = tried[(tried < corner).all(axis=1)]
        order, area, top = inside[np.argsort(inside[:, 0])], 0.0, corner[1]
        for x, y in order:
            if y < top:
                area += (corner[0] - x) * (top - y)
                top = y
        return -area

    def run(
        self,
        names: list[str],
        values: np.ndarray,
        objectives: tuple[str, ...],
        meta: dict[str, Any],
    ) -> fx.Run:
        """The history as a Run over the number of the generation.

        Args:
            names: of the free settings.
            values: their values (E, d).
            objectives: names of the goals.
            meta: further metadata.

        Returns:
            Channels: best and median of the goals, evaluations, and the best settings so far.
        """
        every, count = self.all("goals"), len(self)
        starts = [0, *self.ends[:-1]]
        channels, best = {}, np.array([int(every[:end, 0].argmin()) for end in self.ends])
        for k, goal in enumerate(objectives):
            channels[f"goal/{goal}/best"] = np.array([every[:end, k].min() for end in self.ends])
            channels[f"goal/{goal}/median"] = np.array(
                [np.median(every[a:b, k]) for a, b in zip(starts, self.ends, strict=True)]
            )
        channels["evaluations"] = np.array(self.ends, dtype=float)
        channels |= {f"setting/{name}": values[best, k] for k, name in enumerate(names)}
        about = {"source": "tuning", "complete": True, "events": [], "t": "generation"} | meta
        return fx.Run(np.arange(1.0, count + 1), channels, dict.fromkeys(channels, "1"), about)
