"""Random chains of every kind: the recursion solves the assembled equations, and the mass matrix is
positive definite."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest

import flexura as fx
from generators.identities import faults
from robots import beam, rigid, robot

PER_SEED = 20


def random_robot(rng: np.random.Generator) -> fx.Robot:
    """1 to 5 links: lengths 1e-2 to 10 m, EI 1e-3 to 1e6 N m2, R, Pa, Pb in equal shares, 30 % bare
    hubs, a payload of 0 to 1e3 masses of the last link; one sleeve in five begins near an end of
    its link; meshes of 1 to 32 elements, or modes; one link in five is rigid."""
    tables: list[dict[str, Any]] = []
    for _ in range(rng.integers(1, 6)):
        kind, L = str(rng.choice(["R", "Pa", "Pb"])), float(10 ** rng.uniform(-2, 1))
        rho = float(10 ** rng.uniform(-2, 1))
        joint: dict[str, Any] = {"start": float(rng.uniform(-np.pi, np.pi))}
        if kind != "R":
            joint["angle_rad"] = float(rng.uniform(-np.pi, np.pi))
        if kind == "Pb":
            share = rng.uniform(0.03, 0.97) if rng.random() > 0.2 else rng.choice([0.025, 0.999])
            joint["start"] = float(share) * L
        if kind == "Pa" and tables:
            before = tables[-1]
            low = (
                before["length_m"] - before["joint"]["start"]
                if before["joint"]["type"] == "Pb"
                else 0.0
            )
            joint["start"] = float(low + (before["length_m"] - low) * rng.uniform(0.02, 0.98))
        if rng.random() > 0.3:
            size = float(10 ** rng.uniform(-3, 1)) * rho * L
            joint |= {
                "hub_mass_kg": size,
                "hub_inertia_kg_m2": size * L**2 * float(rng.uniform(0, 0.1)),
            }
            joint |= {
                "rotor_inertia": float(rng.choice([0.0, 0.01]))
                * size
                * (L**2 if kind == "R" else 1.0)
            }
        joint |= {"viscous_friction": float(rng.choice([0.0, 0.1]))}
        if rng.random() < 0.2:
            tables.append(
                rigid(L, rho * L, float(rng.uniform(0, 1)) * L, rho * L**3 / 12, kind, **joint)
            )
            continue
        elements, keys = int(rng.choice([1, 2, 3, 4, 8, 16, 32])), {}
        if rng.random() < 0.3:
            keys["modes"] = int(rng.integers(1, min(2 * elements, 6) + 1))
        EI, taper = float(10 ** rng.uniform(-3, 6)), float(rng.uniform(0.3, 1.0))
        tapered = rng.random() < 0.3
        law = lambda v, f=taper, end=L, on=tapered: (
            [{"at_m": 0.0, "value": v}, {"at_m": end, "value": v * f}] if on else v
        )
        keys["damping"] = {
            "beta_s": float(rng.choice([0.0, 1e-3])),
            "alpha_1_s": float(rng.choice([0.0, 0.1])),
        }
        tables.append(beam(L, law(rho), law(EI), elements, kind, **keys, **joint))
    last = tables[-1]["length_m"]
    payload = 0.0 if rng.random() < 0.25 else float(10 ** rng.uniform(-3, 3)) * rho * last
    gravity = (float(rng.uniform(-10, 10)), float(rng.uniform(-10, 10)))
    return robot(
        *tables,
        gravity=gravity,
        payload=payload,
        payload_inertia=payload * last**2 * float(rng.choice([0.0, 0.01])),
    )


def furnished(bot: fx.Robot, rng: np.random.Generator) -> fx.Robot:
    """The same chain with springs, transmissions, hub radii, lumped masses and centres off the
    line, each on every second joint or link."""
    tables, rarely = bot.to_dict(), lambda: rng.random() < 0.5
    for table, after in zip(tables["link"], [*tables["link"][1:], tables["link"][0]], strict=True):
        joint, L, turns = table["joint"], table["length_m"], table["joint"]["type"] == "R"
        mass = float(10 ** rng.uniform(-2, 1))
        if rarely():
            keys = ("stiffness_N_m_rad", "rest_rad") if turns else ("stiffness_N_m", "rest_m")
            joint["spring"] = dict(zip(keys, (mass * 100, float(rng.uniform(-1, 1))), strict=True))
        if turns and rarely():
            joint["hub_radius_m"] = float(rng.uniform(0, 1)) * L
        if turns and rarely():
            joint["rotor_inertia_kg_m2"] = mass * L**2 * float(10 ** rng.uniform(-3, 1))
            joint["transmission"] = {
                "stiffness_N_m_rad": float(10 ** rng.uniform(0, 6)),
                "damping_N_m_s_rad": float(rng.choice([0.0, 0.1])),
            }
        if rarely() and not ("elements" in table and joint["type"] == "Pb"):
            table["mass"] = [
                {
                    "at_m": float(rng.choice([0.0, rng.uniform(0, 1), 1.0])) * L,
                    "mass_kg": mass,
                    "inertia_kg_m2": mass * L**2 * float(rng.choice([0.0, 0.01])),
                }
                for _ in range(rng.integers(1, 4))
            ]
            if "modes" in table or after["joint"]["type"] == "Pa":  # needs a mesh
                for lump in table["mass"]:
                    lump["inertia_kg_m2"] *= lump["at_m"] in (0.0, L)
        if "elements" not in table and rarely():
            table["centre_of_mass_m"] = (L * rng.uniform(-1, 1, 2)).tolist()
    if bot.payload.mass_kg and rarely():
        tables["payload"]["centre_of_mass_m"] = (L * rng.uniform(-1, 1, 2)).tolist()
    return fx.Robot.from_dict(tables)


def judge(seed: int) -> list[str]:
    """What is wrong with the chains of one seed: nothing, one hopes."""
    rng, wrong = np.random.default_rng(seed), []
    for k in range(PER_SEED):
        bot = random_robot(rng)
        if k % 2:
            bot = furnished(bot, np.random.default_rng([seed, k]))
        found = faults(fx.assemble(bot), rng)
        wrong += [f"seed {seed}, chain {k} ({bot.structure}): {text}" for text in found]
    return wrong


@pytest.mark.parametrize("seed", range(15))
def test_300_random_chains(seed):
    """Residual of the assembly at the core's accelerations, row by row, and Cholesky's factor of
    the unit-diagonal M."""
    assert judge(seed) == []


@pytest.mark.long
@pytest.mark.timeout(36000)
def test_10_000_random_chains():
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        assert [text for found in pool.map(judge, range(1000, 1500)) for text in found] == []
