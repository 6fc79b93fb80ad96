"""From robots to their Systems: many of one topology at once, the same numbers as one at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from .beam import LinkIntegrals, integrals, uniform
from .chain import REVOLUTE, SLEEVE, SLIDER, Chain, one_of, workspace
from .errors import InputError
from .extended import mass_matrix
from .lanes import padded, room
from .modes import modal
from .newton_euler import masses
from .robot import Link, Robot
from .system import System
from .uniform import meshed, reduced


@dataclass(frozen=True)
class Systems:
    """The Systems of B robots of one topology, their constants side by side: every array has a leading axis (B,).

    `systems[b]` is one of them, and raises the InputError of a robot that is `refused`.
    """

    robots: Sequence[Robot]
    chains: Chain
    links: tuple[LinkIntegrals, ...]
    transform: np.ndarray
    to_solver: np.ndarray
    labels: tuple[str, ...]
    refused: dict[int, InputError]

    def __len__(self) -> int:
        return len(self.robots)

    def __iter__(self) -> Iterator[System]:
        return (self[b] for b in range(len(self)))

    def __getitem__(self, b: int) -> System:
        if b in self.refused:
            raise self.refused[b]
        links = tuple(LinkIntegrals(*(field[b] for field in link)) for link in self.links)
        return System(self.robots[b], one_of(self.chains, b), links, self.transform[b], self.to_solver[b], self.labels)


def assemble(robot: Robot) -> System:
    """The System of a robot. Raises InputError for a singular mass matrix, and for joints that start beyond a link's end."""
    return assemble_all([robot])[0]


def size(robot: Robot) -> int:
    """How many unknowns a robot's System has."""
    counts = [(k.modes, 2 * k.elements, 2 * (i < len(robot.links))) for i, k in enumerate(robot.links, 1)]
    return len(robot.links) + sum(whole if modes is None else min(modes + static, whole) for modes, whole, static in counts)


def assemble_all(robots: Sequence[Robot]) -> Systems:
    """The Systems of robots of one topology. What one robot gets does not depend on the others, to the last bit."""
    first, B = robots[0], len(robots)
    rows, infos, spectra, transforms, back = [0], [], [], [], []
    for i in range(len(first.links)):
        last = i == len(first.links) - 1
        own = [robot.links[i] for robot in robots]
        load = np.array([(robot.payload.mass_kg, robot.payload.inertia_kg_m2) for robot in robots]) * last
        info, lam, to_modes = _link(own, load[:, 0], load[:, 1], loaded=not last)
        m = lam.shape[1]
        rows.append(rows[-1] + 1 + m)
        transforms.append(np.tile(np.eye(m), (B, 1, 1)) if to_modes is None else info.basis)
        back.append(transforms[-1] if to_modes is None else to_modes)
        spectra.append(lam)
        infos.append(info)
    chains = _chains(robots, rows, infos, spectra)
    start = np.zeros((B, rows[-1]))
    start[:, rows[:-1]] = [robot.start for robot in robots]
    free = np.setdiff1d(np.arange(rows[-1]), np.array(rows[:-1])[chains.locked[0].astype(bool)])
    refused = {
        b: InputError(
            "nothing to accelerate: expected a mass or inertia (link, hub, rotor or payload) that this joint moves",
            key=f"link[{joint}].joint",
        )
        for b, joint in _massless(_masses(chains, start)[:, free[:, None], free], free, rows).items()
    }
    return Systems(robots, chains, tuple(infos), _blocks(transforms), _blocks(back), _labels(first, rows), refused)


def _link(
    links: Sequence[Link], tip_mass: np.ndarray, tip_inertia: np.ndarray, loaded: bool
) -> tuple[LinkIntegrals, np.ndarray, np.ndarray | None]:
    """Links with payloads (B,) in their own modes, omega^2 (B, m), and from nodal unknowns to modes (B, m, m) if all are kept."""
    one = links[0]
    kinds = [uniform(link) for link in links]
    if len(set(kinds)) > 1:
        parts = [_link([link], tip_mass[k : k + 1], tip_inertia[k : k + 1], loaded) for k, link in enumerate(links)]
        infos, values, to_modes = zip(*parts, strict=True)
        info = LinkIntegrals(*(np.concatenate(fields) for fields in zip(*infos, strict=True)))
        return info, np.concatenate(values), None if to_modes[0] is None else np.concatenate(to_modes)
    plain = kinds[0] and one.flexible and one.joint.type != "Pb"
    if plain and one.modes is not None and one.modes + 2 * loaded < 2 * one.elements:
        return *reduced(links, tip_mass, tip_inertia, loaded), None
    nodal = (meshed if plain else integrals)(links, tip_mass, tip_inertia)
    info, lam = modal(nodal, one.modes, loaded)
    return info, lam, None if one.modes is not None or lam.shape[1] == 0 else np.swapaxes(info.basis, 1, 2) @ nodal.M


def _chains(robots: Sequence[Robot], rows: list[int], infos: list[LinkIntegrals], spectra: list[np.ndarray]) -> Chain:
    """The Chain of all robots: every field with a leading axis (B,)."""
    links = [robot.links for robot in robots]
    B, N = len(robots), len(links[0])
    column = lambda f, kind=float: np.array([[f(link) for link in of] for of in links], dtype=kind)
    joint = lambda name, kind=float: column(lambda k: getattr(k.joint, name), kind)
    of = lambda name: np.stack([getattr(info, name) for info in infos], axis=1)
    each = lambda values: np.tile(np.array(values), (B, 1))
    ends = np.arange(N) == N - 1
    kinds = [{"R": REVOLUTE, "Pa": SLIDER, "Pb": SLEEVE}[link.joint.type] for link in links[0]]
    hubs = joint("hub_mass_kg") * (np.array(kinds) == SLEEVE)
    alpha, beta = column(lambda k: k.damping.alpha_1_s), column(lambda k: k.damping.beta_s)
    lam = _padded(spectra)
    sleeved = np.array([link.joint.type == "Pb" and link.flexible for link in links[0]])
    laws = [[_laws(link) if sleeved[i] else _NO_LAWS for i, link in enumerate(row)] for row in links] if sleeved.any() else None
    pieces = max(len(law[0]) for row in laws for law in row) if laws else 1
    fields: dict[str, Any] = {
        "first": each(rows).astype(np.int64), "kind": each(kinds).astype(np.int64), "locked": joint("locked", np.int64),
        "angle": joint("angle_rad"), "rotor": joint("rotor_inertia"), "viscous": joint("viscous_friction"),
        "coulomb": joint("coulomb_friction"), "length": of("length"), "mass": of("mass") + hubs, "hub": hubs, "s1": of("s1"),
        "inertia": of("inertia"), "lam": lam, "alpha": alpha, "beta": beta,
        "damp": np.where(lam > 0, alpha[:, :, None] + beta[:, :, None] * lam, 0.0),
        "points": each([info.point_x.shape[1] for info in infos]).astype(np.int64),
        "payload": np.array([[robot.payload.mass_kg] for robot in robots]) * ends,
        "tip_inertia": np.array([[robot.payload.inertia_kg_m2] for robot in robots]) * ends,
        "elements": each([link.elements for link in links[0]]).astype(np.int64), "node": np.zeros((B, N), dtype=np.int64),
        "reference": of("reference"), "stiffening": np.array([robot.stiffening for robot in robots]),
        "gravity": np.array([robot.gravity_m_s2 for robot in robots], dtype=float),
    }  # fmt: skip
    fields |= {name: _padded([getattr(info, name) for info in infos]) for name in _PER_LINK}
    for name in ("slope_dx", "slope_EI", "slope_d1", "slope_d2"):  # two slope points before each mass point
        fields[name] = _padded([_halves(getattr(info, name), info.point_x.shape[1]) for info in infos])
    fields["ride"] = np.moveaxis(fields["ride"], 3, 4)
    fields |= {name: _in_fours(fields[name], axes) for name, axes in _IN_FOURS.items()}
    for name in ("point_phi", "slope_d1", "slope_d2"):
        fields[name + "_T"] = _in_fours(np.moveaxis(fields[name], -1, 2), ())
    for k, (name, columns, empty) in enumerate((("law_x", (), np.inf), ("law_mass", (3,), 0.0), ("law_EI", (5,), 0.0))):
        fields[name] = np.full((B, N, pieces, *columns), empty)
        if laws is None:
            fields[name][:, :, 0] = 0.0
            continue
        for b, row in enumerate(laws):
            for i, law in enumerate(row):
                fields[name][b, i, : len(law[k])] = law[k]
    return Chain(**fields)


_PER_LINK = (
    "S0", "S1", "NL", "SL", "G1", "G2", "H", "point_x", "point_mass", "point_phi", "ride", "sleeve_xi", "sleeve_w", "sleeve_phi",
    "sleeve_d1", "sleeve_d2",
)  # fmt: skip
_IN_FOURS = {  # axes that end on a multiple of four in the compiled code
    "S0": (2,), "S1": (2,), "NL": (2,), "SL": (2,), "lam": (2,), "damp": (2,), "G1": (2, 3), "G2": (2, 3), "H": (2, 3),
    "point_x": (2,), "point_mass": (2,), "point_phi": (2, 3), "slope_dx": (3,), "slope_EI": (3,), "slope_d1": (3, 4),
    "slope_d2": (3, 4), "ride": (3, 4), "sleeve_phi": (3,), "sleeve_d1": (3,), "sleeve_d2": (3,),
}  # fmt: skip


def _halves(a: np.ndarray, gaps: int) -> np.ndarray:
    """Values at the slope points (B, 2 gaps, ...), two in each gap, as (B, 2, gaps, ...): the nearer ones, the farther ones."""
    return np.moveaxis(a[:, : 2 * gaps].reshape(len(a), gaps, 2, *a.shape[2:]), 2, 1)


def _in_fours(a: np.ndarray, axes: tuple[int, ...]) -> np.ndarray:
    """An array with zeros after the ends of some axes, up to the next multiple of four."""
    out = room(a=tuple(padded(size) if axis in axes else size for axis, size in enumerate(a.shape)))["a"]
    out[tuple(map(slice, a.shape))] = a
    return out


_NO_LAWS = (np.zeros(1), np.zeros((1, 3)), np.zeros((1, 5)))


def _laws(link: Link) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """rho A and E I between a link's breaks as polynomials: where they begin (B,), coefficients (B, 3) and (B, 5), exact for
    sections that taper linearly."""
    breaks = np.array(link.breaks())
    pieces = list(pairwise(breaks))
    mass, EI = np.zeros((len(pieces), 3)), np.zeros((len(pieces), 5))
    for k, (a, b) in enumerate(pieces):
        for row, law in ((mass[k], link.mass_per_length), (EI[k], link.bending_stiffness)):
            s = np.linspace(0, b - a, len(row))
            row[:] = np.polynomial.polynomial.polyfit(s / (b - a), law(a + s), len(row) - 1) / (b - a) ** np.arange(len(row))
    return breaks[:-1], mass, EI


def _padded(arrays: list[np.ndarray]) -> np.ndarray:
    """Arrays (B, ...) of the links as one (B, N, ...), padded with zeros to the largest."""
    largest = [max(sizes) for sizes in zip(*(a.shape[1:] for a in arrays), strict=True)]
    out = np.zeros((len(arrays[0]), len(arrays), *largest))
    for i, a in enumerate(arrays):
        out[:, i][(slice(None), *(slice(size) for size in a.shape[1:]))] = a
    return out


def _blocks(parts: list[np.ndarray]) -> np.ndarray:
    """Matrices (B, n, n) with 1 for each joint and the links' own (B, m, m) after it on their diagonals."""
    n = sum(1 + part.shape[1] for part in parts)
    out, row = np.zeros((len(parts[0]), n, n)), 0
    for part in parts:
        end = row + 1 + part.shape[1]
        out[:, row, row] = 1.0
        out[:, row + 1 : end, row + 1 : end] = part
        row = end
    return out


def _labels(robot: Robot, rows: list[int]) -> tuple[str, ...]:
    labels = []
    for i, link in enumerate(robot.links, 1):
        m = rows[i] - rows[i - 1] - 1
        labels.append(f"joint {i} position [{'rad' if link.joint.type == 'R' else 'm'}]")
        if link.modes is not None:
            labels += [f"link {i} mode {k + 1} [kg^(1/2) m]" for k in range(m)]
        else:
            slope = "slope x d/L [rad]" if link.joint.type == "Pb" and robot.sliding == "continuous" else "slope [rad]"
            labels += [f"link {i} node {k // 2 + 1} {slope if k % 2 else 'deflection [m]'}" for k in range(m)]
    return tuple(labels)


def _masses(chains: Chain, y: np.ndarray) -> np.ndarray:
    """Mass matrices (B, n, n) at y (B, n), in the solver's coordinates."""
    B, n = y.shape
    work = workspace(one_of(chains, 0))
    if n > 60:  # column by column takes n times a pass, whose cost grows faster than n
        return np.array([mass_matrix(one_of(chains, b), work, y[b]) for b in range(B)])
    M = np.zeros((B, n, n))
    masses(chains, work, y, np.zeros((4, max(n, 2))), M)
    return (M + np.swapaxes(M, 1, 2)) / 2


def _massless(M: np.ndarray, free: np.ndarray, rows: list[int]) -> dict[int, int]:
    """The robots (from 0) whose mass matrix, of the free rows, is singular, each with a joint (from 1) that moves nothing."""
    if len(free) == 0:
        return {}
    diagonal = np.einsum("bii->bi", M)
    scale = 1 / np.sqrt(np.maximum(diagonal, 1e-300))
    scaled = M * scale[:, None, :] * scale[:, :, None]
    if (diagonal > 0).all():
        try:
            np.linalg.cholesky(scaled - 1e-13 * np.eye(len(free)))
            return {}
        except np.linalg.LinAlgError:
            pass  # one of them; which, their eigenvalues say
    smallest = np.linalg.eigvalsh(scaled)[:, 0]
    out = {}
    for b in np.flatnonzero((diagonal <= 0).any(axis=1) | (smallest < 1e-13)):
        nothing = {int(row) for row, value in zip(free, diagonal[b], strict=True) if value <= 1e-300}
        out[int(b)] = next((i for i, row in enumerate(rows[:-1], 1) if row in nothing), len(rows) - 1)
    return out
