"""Many robots of one topology as rows of numbers, as the compiled core reads them; and how values
vary along them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..robot import LEAST_FREE, Link, Robot, Section
from ..system.constants import payload, rows

# Columns of `numbers`, as system/constants.py gives them.
LENGTH, MASS, CENTRE, INERTIA, START, LOW, HIGH = 0, 1, 2, 3, 7, 13, 14
ELEMENTS, LUMPS = 2, 5  # columns of `counts`
OF_JOINT = {
    "angle_rad": 6,
    "hub_mass_kg": 8,
    "hub_inertia_kg_m2": 9,
}
OF_EITHER = {"rotor_inertia": 10, "viscous_friction": 11, "coulomb_friction": 12}
OF_DAMPING = {"alpha_1_s": 4, "beta_s": 5}
OF_RIGID = {
    "mass_kg": MASS,
    "centre_of_mass_m": CENTRE,
    "inertia_kg_m2": INERTIA,
    "length_m": LENGTH,
}
OF_MATERIAL = (
    "length_m",
    "young_modulus_Pa",
    "density_kg_m3",
    "mass_per_length_kg_m",
    "bending_stiffness_N_m2",
)
PA, PB = 1, 2  # kinds of joints in `counts`


@dataclass(frozen=True)
class Rows:
    """B robots: counts (N, 8) of them all, numbers (B, N, 21), material (B, K, 10), lumped masses
    (B, J, 3), gravity (B, 2) and payload (B, 4)."""

    counts: np.ndarray
    numbers: np.ndarray
    material: np.ndarray
    lumps: np.ndarray
    gravity: np.ndarray
    payload: np.ndarray

    def __len__(self) -> int:
        return len(self.numbers)

    def of(self, some: Sequence[int] | slice) -> Rows:
        """The rows of some robots."""
        return Rows(
            self.counts,
            *(
                np.ascontiguousarray(a[some])
                for a in (self.numbers, self.material, self.lumps, self.gravity, self.payload)
            ),
        )

    def contents(self, k: int) -> bytes:
        """All numbers of robot k, to the last bit."""
        varied = (self.numbers, self.material, self.lumps, self.gravity, self.payload)
        arrays = (self.counts, *(each[k] for each in varied))
        return b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)

    @property
    def topology(self) -> bytes:
        """What is the same in robots that the core takes together: the counts, and at which shares
        of their links the lumped masses of the first are, by which its meshes are made."""
        on = np.repeat(np.arange(len(self.counts)), self.counts[:, LUMPS])
        shares = self.lumps[0, :, 0] / np.maximum(self.numbers[0, on, LENGTH], 1e-300)
        return self.counts.tobytes() + np.round(shares, 12).tobytes()

    @property
    def limits(self) -> np.ndarray:
        """Limits of the joints (B, N, 2) [m or rad], the ends of the links that slide included, as
        in `System.limits`."""
        out = np.array(self.numbers[:, :, [LOW, HIGH]])
        length = self.numbers[:, :, LENGTH]
        for i, count in enumerate(self.counts):
            if count[0] == PB:
                low, high = (LEAST_FREE * length[:, i] if count[2] else 0.0), length[:, i]
            elif count[0] == PA and i > 0:
                low, high = 0.0, length[:, i - 1]
            else:
                continue
            out[:, i, 0], out[:, i, 1] = (
                np.maximum(out[:, i, 0], low),
                np.minimum(out[:, i, 1], high),
            )
        return out


def one(robot: Robot) -> Rows:
    """The rows of one robot."""
    counts, numbers, material, lumps = rows(robot)
    return Rows(
        counts,
        numbers[None],
        material[None],
        lumps[None],
        np.array([robot.gravity_m_s2], dtype=float),
        payload(robot)[None],
    )


def joined(parts: Sequence[Rows]) -> Rows:
    """Robots of the same counts in one."""
    first = parts[0]
    return Rows(
        first.counts,
        *(
            np.concatenate([getattr(p, name) for p in parts])
            for name in ("numbers", "material", "lumps", "gravity", "payload")
        ),
    )


def varied(robot: Robot, columns: Mapping[str, np.ndarray], B: int) -> Rows | None:
    """The rows of `robot.replace({key: value})` along columns (B,), to the last bit, without making
    the robots.

    None: a key is not one that maps to numbers by itself. The values are taken as good (`good`).
    """
    base = one(robot)
    again = lambda a: np.repeat(a, B, axis=0)
    out = Rows(
        base.counts,
        again(base.numbers),
        again(base.material),
        again(base.lumps),
        again(base.gravity),
        again(base.payload),
    )
    if any(link.damping.by_ratio for link in robot.links):  # it follows from all of a link
        return None
    links: dict[int, dict[str, np.ndarray]] = {}
    for key, values in columns.items():
        parts = key.split(".")
        if parts[0] == "payload" and parts[1:] in (["mass_kg"], ["inertia_kg_m2"]):
            out.payload[:, int(parts[1] == "inertia_kg_m2")] = values
        elif parts[0] == "gravity_m_s2" and parts[1:] in (["1"], ["2"]):
            out.gravity[:, int(parts[1]) - 1] = values
        elif (
            parts[0] == "link"
            and len(parts) > 2
            and parts[1].isdigit()
            and 1 <= int(parts[1]) <= len(robot.links)
        ):
            links.setdefault(int(parts[1]) - 1, {})[".".join(parts[2:])] = values
        else:
            return None
    if not all(_vary_link(robot.links[i], i, out, changes) for i, changes in links.items()):
        return None
    return out


def _vary_link(link: Link, i: int, out: Rows, changes: Mapping[str, np.ndarray]) -> bool:
    """Puts varied values of link i into its rows; False: a key is not known here."""
    rest = dict(changes)
    own = {link.joint.key(name): column for name, column in OF_EITHER.items()}
    for table, known in (("joint", OF_JOINT | OF_EITHER | own), ("damping", OF_DAMPING)):
        for name, column in known.items():
            if f"{table}.{name}" in rest:
                out.numbers[:, i, column] = rest.pop(f"{table}.{name}")
    if not rest:
        return True
    if (link.mass or link.sensor) and "length_m" in rest:  # these must stay on the link
        return False
    if not link.flexible:
        return _vary_rigid(link, i, out, rest)
    simple = not any(
        isinstance(v, list)
        for v in (link.section, link.mass_per_length_kg_m, link.bending_stiffness_N_m2)
    )
    given = [name for name in OF_MATERIAL if getattr(link, name) is not None]
    section = link.section if isinstance(link.section, Section) else None
    if section is not None and section.kind == "rectangle":  # others have bounds in one another
        given += [f"section.{name}" for name in section.form.keys]
    if not simple or not set(rest) <= set(given):
        return False
    row = int(out.counts[:i, 4].sum())
    value: Callable[[str], Any] = lambda name: rest[name] if name in rest else getattr(link, name)
    if "length_m" in rest:
        out.numbers[:, i, LENGTH] = out.material[:, row, 1] = rest["length_m"]
    if section is None:
        mass, stiffness = value("mass_per_length_kg_m"), value("bending_stiffness_N_m2")
    else:  # in the order of Link.mass_per_length and Link.bending_stiffness
        form = section.form
        size = [rest.get(f"section.{key}", getattr(section, key)) for key in form.keys]
        mass = value("density_kg_m3") * form.area(*size)
        stiffness = value("young_modulus_Pa") * form.second_moment(*size)
    out.material[:, row, 2], out.material[:, row, 5] = mass, stiffness
    return True


def _vary_rigid(link: Link, i: int, out: Rows, changes: Mapping[str, np.ndarray]) -> bool:
    if link.mass_kg is None or not set(changes) <= set(OF_RIGID):
        return False
    if isinstance(link.centre_of_mass_m, tuple):
        return False
    for name, values in changes.items():
        out.numbers[:, i, OF_RIGID[name]] = values
    if (
        link.centre_of_mass_m is None
        and "centre_of_mass_m" not in changes
        and "length_m" in changes
    ):
        out.numbers[:, i, CENTRE] = changes["length_m"] / 2
    return True


def good(robot: Robot, columns: Mapping[str, np.ndarray]) -> bool:
    """Whether all values make robots, as the least and the largest of each key tell: the rules of a
    robot file bound every key by itself, but for a section's height, which is below the link's
    length."""
    try:
        for key, values in columns.items():
            if not np.isfinite(values).all():
                return False
            for end in (float(values.min()), float(values.max())):
                robot.replace({key: end})
        for i in range(1, len(robot.links) + 1):
            length, height = (
                columns.get(f"link.{i}.length_m"),
                columns.get(f"link.{i}.section.height_m"),
            )
            if length is not None and height is not None and not (height < length).all():
                return False
    except InputError:
        return False
    return True
