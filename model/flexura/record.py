"""A finished simulation as a Run: its channels, their units, and the energy balance."""

from __future__ import annotations

from typing import Any

import numpy as np

from .observe import observe
from .run import Run
from .system import System


def record(system: System, t: np.ndarray, states: np.ndarray, work: np.ndarray, forces: np.ndarray, meta: dict[str, Any]) -> Run:
    """The Run of states (T, 2n) in the solver's coordinates, work and loss (T, 2) [J], and drive forces (T, N)."""
    robot, n, links, rows = system.robot, system.n, len(system.robot.links), len(states)
    poses, tips, ends, energies = np.zeros((rows, links, 3)), np.zeros((rows, links, 2)), np.zeros((rows, 2)), np.zeros((rows, 3))
    observe(system.chain, system._work(), np.ascontiguousarray(states), poses, tips, ends, energies)
    channels: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}

    def put(name: str, values: np.ndarray, unit: str) -> None:
        channels[name], units[name] = np.ascontiguousarray(values), unit

    for i, (link, row) in enumerate(zip(robot.links, system.joint_rows, strict=True), 1):
        turns = link.joint.type == "R"
        put(f"joint/{i}/position", states[:, row], "rad" if turns else "m")
        put(f"joint/{i}/velocity", states[:, n + row], "rad/s" if turns else "m/s")
        put(f"joint/{i}/drive", forces[:, i - 1], "N m" if turns else "N")
    for i, link in enumerate(robot.links, 1):
        for k, (name, unit) in enumerate((("x", "m"), ("y", "m"), ("angle", "rad"))):
            put(f"link/{i}/{name}", poses[:, i - 1, k], unit)
        if link.flexible:
            put(f"link/{i}/tip_deflection", tips[:, i - 1, 0], "m")
            put(f"link/{i}/tip_slope", tips[:, i - 1, 1], "rad")
            own = slice(system.chain.first[i - 1] + 1, system.chain.first[i])
            for k, values in enumerate(system.deflections(i - 1, states[:, own], states[:, system.joint_rows[i - 1]])):
                put(f"link/{i}/deflection/{k}", values, "m")
    put("tip/x", ends[:, 0], "m")
    put("tip/y", ends[:, 1], "m")
    for k, name in enumerate(("kinetic", "strain", "potential")):
        put(f"energy/{name}", energies[:, k], "J")
    put("energy/work", work[:, 0], "J")
    put("energy/loss", work[:, 1], "J")
    about = describe(system, energy_error(energies, work)) | meta
    return Run(t, channels, units, about, np.hstack([states[:, :n] @ system.transform.T, states[:, n:] @ system.transform.T]))


def describe(system: System, error: float) -> dict[str, Any]:
    """What the metadata of every simulation says: of what, by what, and how well the energy balances."""
    robot = system.robot
    return {
        "source": "simulation",
        "program": "flexura",
        "name": robot.name,
        "structure": robot.structure,
        "unknowns": system.n,
        "energy_error": error,
        "robot": robot.to_dict(),
    }


def energy_error(energies: np.ndarray, work: np.ndarray, jumps: Any = 0.0) -> float:
    """Largest |E - E(0) - work + loss - jumps| of energies (T, 3), work and loss (T, 2), and E's jumps so far (T,), relative to
    the largest of these energies, or work or loss."""
    total = energies.sum(axis=1)
    balance = total - total[0] - (work[:, 0] - work[0, 0]) + (work[:, 1] - work[0, 1]) - jumps
    scale = max(np.abs(energies).max(), np.abs(energies - energies[0]).max(), np.abs(work).max(), 1e-300)
    return float(np.abs(balance).max() / scale)


def limit_event(system: System, joint: int, t: float, position: np.ndarray) -> dict[str, Any]:
    """What stopped joint (from 0) at t, with the joints at `position` (N,)."""
    robot, (low, high) = system.robot, system.limits[joint]
    kind, own, travel = robot.links[joint].joint.type, robot.links[joint].joint.limits, robot.travel(joint)
    bound = low if abs(position[joint] - low) < abs(position[joint] - high) else high
    if abs(position[joint] - bound) > 1e-6 * max(1.0, abs(bound)):
        text = f"joint {joint + 1} (Pa) ran into the sleeve of link {joint}: stopped"
    elif bound in travel and (own is None or bound not in own):
        link = joint if kind == "Pa" else joint + 1
        text = f"joint {joint + 1} ({kind}) reached the end of link {link}, at {bound:g} m: stopped"
    else:
        text = f"joint {joint + 1} left its limits, {low:g} to {high:g} {'rad' if kind == 'R' else 'm'}: stopped"
    return {"t": t, "level": "ERROR", "text": text}
