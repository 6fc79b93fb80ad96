"""Random well-formed robot files: from 1 mm to 100 m, from silicone to steel, R, Pa and Pb in equal
shares, meshes to 32 elements, modes, bare hubs, payloads to 1000 masses of a link."""

from __future__ import annotations

from typing import Any

import numpy as np

# Young's modulus [Pa] and density [kg/m3]: steel, aluminium, carbon fibre, wood, rubber, silicone
MATERIALS = (
    (2e11, 7850.0),
    (7e10, 2700.0),
    (1.4e11, 1600.0),
    (1e10, 600.0),
    (5e6, 1100.0),
    (5e3, 1050.0),
)
ELEMENTS = (1, 2, 3, 4, 4, 4, 8, 16, 32)


def robot(rng: np.random.Generator, odd: bool = False) -> dict[str, Any]:
    """The tables of a robot file.

    Args:
        rng: that draws them.
        odd: one number is as many as nine orders of magnitude off.
    """
    low, high = (-3.0, 2.0) if rng.random() < 0.1 else (-2.0, 1.0)
    links: list[dict[str, Any]] = []
    for _ in range(int(rng.choice([1, 1, 1, 2, 2, 3, 4, 5]))):
        links.append(_link(rng, links[-1] if links else None, float(10 ** rng.uniform(low, high))))
    tables: dict[str, Any] = {"name": "generated", "link": links}
    if rng.random() < 0.7:
        tables["gravity_m_s2"] = [float(rng.uniform(-10, 10)), float(rng.uniform(-10, 10))]
    if rng.random() < 0.02:
        tables["stiffening"] = False
    last = links[-1]["length_m"]
    if rng.random() < 0.7:
        mass = float(10 ** rng.uniform(-3, 3)) * _mass(links[-1])
        tables["payload"] = {
            "mass_kg": mass,
            "inertia_kg_m2": mass * last**2 * float(rng.choice([0.0, 0.01])),
        }
    return _made_odd(rng, tables) if odd else tables


def _link(rng: np.random.Generator, before: dict[str, Any] | None, length: float) -> dict[str, Any]:
    kind = str(rng.choice(["R", "Pa", "Pb"]))
    link: dict[str, Any] = {"length_m": length}
    if rng.random() < 0.2:
        mass = float(10 ** rng.uniform(-2, 1)) * length
        link |= {
            "mass_kg": mass,
            "centre_of_mass_m": float(rng.uniform(0, 1)) * length,
            "inertia_kg_m2": mass * length**2 / 12,
        }
    else:
        link |= _flexible(rng, length)
    mass = _mass(link)
    joint: dict[str, Any] = {"type": kind}
    unit, slow = ("rad", "N_m_s_rad") if kind == "R" else ("m", "N_s_m")
    if kind == "R":
        joint["start_rad"] = float(rng.uniform(-np.pi, np.pi))
    else:
        joint["angle_rad"] = float(rng.uniform(-np.pi, np.pi))
        joint["start_m"] = _place(rng, kind, length, before)
    if rng.random() < 0.7:
        size = float(10 ** rng.uniform(-3, 1)) * mass
        joint["hub_mass_kg"] = size
        joint["hub_inertia_kg_m2"] = size * length**2 * float(rng.uniform(0, 0.1))
        if rng.random() < 0.5:
            rotor = "rotor_inertia_kg_m2" if kind == "R" else "rotor_mass_kg"
            joint[rotor] = 0.1 * size * (length**2 if kind == "R" else 1.0)
    scale = mass * (length**2 if kind == "R" else 1.0)
    if rng.random() < 0.3:
        joint[f"viscous_friction_{slow}"] = scale * float(10 ** rng.uniform(-2, 2))
    if rng.random() < 0.1:
        force = "N_m" if kind == "R" else "N"
        joint[f"coulomb_friction_{force}"] = scale * float(10 ** rng.uniform(-2, 1))
    if rng.random() < 0.1:
        joint["locked"] = True
    if kind == "R" and rng.random() < 0.1:
        joint[f"limits_{unit}"] = [joint["start_rad"] - 1.0, joint["start_rad"] + 1.0]
    return link | {"joint": joint}


def _place(
    rng: np.random.Generator, kind: str, length: float, before: dict[str, Any] | None
) -> float:
    """Where a joint that slides starts [m]."""
    if kind == "Pb":
        near = rng.random() < 0.2
        return length * float(rng.choice([0.025, 0.999]) if near else rng.uniform(0.03, 0.97))
    if before is None:
        return float(rng.uniform(-1, 1))
    end = before["length_m"]
    low = end - before["joint"]["start_m"] if before["joint"]["type"] == "Pb" else 0.0
    return float(low + (end - low) * rng.uniform(0.02, 0.98))


def _flexible(rng: np.random.Generator, length: float) -> dict[str, Any]:
    elements = int(rng.choice(ELEMENTS))
    link: dict[str, Any] = {"elements": elements}
    if rng.random() < 0.3:
        link["modes"] = int(rng.integers(1, min(2 * elements, 6) + 1))
    if rng.random() < 0.5:
        modulus, density = MATERIALS[rng.integers(len(MATERIALS))]
        height = length / float(10 ** rng.uniform(1, 2.5))
        link |= {
            "section": {"width_m": height * float(rng.uniform(1, 10)), "height_m": height},
            "young_modulus_Pa": modulus,
            "density_kg_m3": density,
        }
        if link["section"]["width_m"] > 10:
            link["section"]["width_m"] = height
    else:
        taper = [1.0, float(rng.uniform(0.3, 1.0))] if rng.random() < 0.3 else None
        numbers = {
            "mass_per_length_kg_m": float(10 ** rng.uniform(-2, 1)),
            "bending_stiffness_N_m2": float(10 ** rng.uniform(-3, 6)),
        }
        for key, value in numbers.items():
            ends = zip((0.0, length), taper or (), strict=False)
            link[key] = (
                [{"at_m": at, "value": value * part} for at, part in ends] if taper else value
            )
    damping = {}
    if rng.random() < 0.6:
        damping["beta_s"] = float(10 ** rng.uniform(-5, -2))
    if rng.random() < 0.3:
        damping["alpha_1_s"] = float(10 ** rng.uniform(-2, 0))
    return link | ({"damping": damping} if damping else {})


def _mass(link: dict[str, Any]) -> float:
    """A link's mass [kg], by its values at the first place."""
    if "mass_kg" in link:
        return float(link["mass_kg"])
    if "section" in link:
        area = link["section"]["width_m"] * link["section"]["height_m"]
        return float(link["density_kg_m3"] * area * link["length_m"])
    value = link["mass_per_length_kg_m"]
    return float((value if isinstance(value, float) else value[0]["value"]) * link["length_m"])


def _made_odd(rng: np.random.Generator, tables: dict[str, Any]) -> dict[str, Any]:
    """One number of the file is off by up to nine orders of magnitude."""
    places: list[tuple[dict[str, Any], str]] = []

    def collect(table: dict[str, Any]) -> None:
        for key, value in table.items():
            if isinstance(value, dict):
                collect(value)
            elif isinstance(value, float):
                places.append((table, key))

    for table in [*tables["link"], *([tables["payload"]] if "payload" in tables else [])]:
        collect(table)
    table, key = places[rng.integers(len(places))]
    table[key] *= float(10 ** rng.uniform(-9, 9))
    return tables
