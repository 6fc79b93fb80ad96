"""A finished simulation as a Run: its channels, their units, and the energy balance."""

from __future__ import annotations

from typing import Any

import numpy as np

from .observe import observe
from .robot import Robot
from .run import STATIONS, Run
from .system import System


def channel_units(robot: Robot) -> dict[str, str]:
    """The channels that a simulation of this robot has, in their order, with their units."""
    units: dict[str, str] = {}
    for i, link in enumerate(robot.links, 1):
        turns = link.joint.type == "R"
        kinds = ("rad", "rad/s", "N m") if turns else ("m", "m/s", "N")
        units |= {f"joint/{i}/{what}": unit for what, unit in zip(("position", "velocity", "drive"), kinds, strict=True)}
    for i, link in enumerate(robot.links, 1):
        units |= {f"link/{i}/x": "m", f"link/{i}/y": "m", f"link/{i}/angle": "rad"}
        if link.flexible:
            units |= {f"link/{i}/tip_deflection": "m", f"link/{i}/tip_slope": "rad"}
            units |= {f"link/{i}/deflection/{k}": "m" for k in range(STATIONS)}
    energies = ("kinetic", "strain", "potential", "work", "loss")
    return units | {"tip/x": "m", "tip/y": "m"} | {f"energy/{name}": "J" for name in energies}


def record(system: System, t: np.ndarray, states: np.ndarray, work: np.ndarray, forces: np.ndarray, meta: dict[str, Any]) -> Run:
    """The Run of states (T, 2n) in the solver's coordinates, work and loss (T, 2) [J], and drive forces (T, N)."""
    robot, n, links, rows = system.robot, system.n, len(system.robot.links), len(states)
    poses, tips, ends, energies = np.zeros((rows, links, 3)), np.zeros((rows, links, 2)), np.zeros((rows, 2)), np.zeros((rows, 3))
    observe(system.chain, system._work(), np.ascontiguousarray(states), poses, tips, ends, energies)
    found: list[np.ndarray] = []
    for i, row in enumerate(system.joint_rows):
        found += [states[:, row], states[:, n + row], forces[:, i]]
    for i, link in enumerate(robot.links):
        found += list(poses[:, i].T)
        if link.flexible:
            own = slice(system.chain.first[i] + 1, system.chain.first[i + 1])
            found += [*tips[:, i].T, *system.deflections(i, states[:, own], states[:, system.joint_rows[i]])]
    found += [*ends.T, *energies.T, *work.T]
    units = channel_units(robot)
    channels = {name: np.ascontiguousarray(values) for name, values in zip(units, found, strict=True)}
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
