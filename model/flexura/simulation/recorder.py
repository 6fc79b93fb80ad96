"""A finished simulation as a Run: its channels, their units, and the energy balance."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..io import STATIONS, Run, Tables, judged
from ..robot import Robot
from ..signals import Drive, Loads
from ..system import RunStates, System, sensor_channels
from .internal_forces import force_channels, force_units
from .problem import Problem, Solution


def channel_units(robot: Robot) -> dict[str, str]:
    """The channels that a simulation of this robot has.

    Args:
        robot: the robot.

    Returns:
        Units by channel, in the order of the channels.
    """
    units: dict[str, str] = {}
    for i, link in enumerate(robot.links, 1):
        turns = link.joint.type == "R"
        kinds = ("rad", "rad/s", "N m") if turns else ("m", "m/s", "N")
        units |= {
            f"joint/{i}/{what}": unit
            for what, unit in zip(("position", "velocity", "drive"), kinds, strict=True)
        }
        if link.joint.transmission is not None:
            units |= {f"joint/{i}/motor_position": "rad", f"joint/{i}/motor_velocity": "rad/s"}
    for i, link in enumerate(robot.links, 1):
        units |= {f"link/{i}/x": "m", f"link/{i}/y": "m", f"link/{i}/angle": "rad"}
        if link.flexible:
            units |= {f"link/{i}/tip_deflection": "m", f"link/{i}/tip_slope": "rad"}
            units |= {f"link/{i}/deflection/{k}": "m" for k in range(STATIONS)}
    energies = ("kinetic", "strain", "potential", "work", "loss", "numerical_loss")
    return units | {"tip/x": "m", "tip/y": "m"} | {f"energy/{name}": "J" for name in energies}


def sensor_units(robot: Robot) -> dict[str, str]:
    """The channels of a robot's sensors.

    Args:
        robot: the robot.

    Returns:
        Units by channel.
    """
    return {f"sensor/{s.name}": s.unit for link in robot.links for s in link.sensor}


def recorded_channels(robot: Robot) -> list[str]:
    """The channels that the core reads from a state, in the order of `System.observe`."""
    accounts = ("energy/work", "energy/loss", "energy/numerical_loss")
    return [
        name
        for name in channel_units(robot)
        if not name.startswith("joint/") and name not in accounts
    ]


# columns of the accounts, as Account of model/core/control/plant.hpp counts them
WORK, LOSS, NUMERICAL, STRAIN = range(4)
LIMITS = ("limit", "end_of_link", "sleeve")  # names of events that stop a joint
FAST_M_S = 1000.0  # of a tip, by one joint: three times the speed of sound
STILL = 1e-9  # m or rad: a robot whose unknowns change by less does not move


def record(
    system: System,
    solution: Solution,
    loads: Loads | None = None,
    internal_forces: bool = False,
) -> Run:
    """The Run of a solution under loads on links: its channels, the balance of its energies, and
    the solver's metadata; if asked for, with the forces within the robot."""
    loads = loads or Loads()
    n, t, states, accounts = system.n, solution.t, solution.states, solution.accounts
    q, v = np.ascontiguousarray(states[:, :n]), np.ascontiguousarray(states[:, n:])
    seen = system.observe(q, v) if solution.seen is None else solution.seen
    found: list[np.ndarray] = []
    hubs, hub_rates = system.hub_positions(q), system.hub_positions(v)
    for i, row in enumerate(system.joint_rows):
        found += [hubs[:, i], hub_rates[:, i], solution.forces[:, i]]
        found += [q[:, row], v[:, row]] if i in system.windup_rows else []
    found += [*seen.T, *accounts[:, :STRAIN].T]
    units = channel_units(system.robot)
    channels = {
        name: np.ascontiguousarray(values) for name, values in zip(units, found, strict=True)
    }
    begin, sensors = 0, []
    for carrying, end in solution.systems or ((system, len(t)),):
        rows = slice(begin, end)
        now = (t[rows], q[rows], v[rows], solution.forces[rows])
        for block in RunStates(carrying, *now, loads).blocks():
            sensors.append(sensor_channels(block))
            if internal_forces:
                sensors[-1] |= force_channels(block)
        begin = end
    channels |= {name: np.concatenate([part[name] for part in sensors]) for name in sensors[0]}
    units |= sensor_units(system.robot)
    units |= force_units(system.robot) if internal_forces else {}
    about = describe(system, energy_error(seen[:, -3:], accounts, solution.jumps)) | solution.meta
    if loads:
        about["loads"] = loads.spec()
    if len(t):
        about["numerical_loss_J"] = float(accounts[-1, NUMERICAL])
    return judged(Run(t, channels, units, about, states))


def off_motion(problem: Problem) -> list[Tables]:
    """An event for each joint whose motion begins elsewhere than the joint that is to follow it."""
    if not isinstance(problem.drive, Drive) or problem.start == "continued":
        return []
    out: list[Tables] = []
    t, links = float(problem.t[0]), problem.system.robot.links
    places = problem.q[problem.system.joint_rows]
    for i, (own, link, q) in enumerate(zip(problem.drive.joints, links, places, strict=True), 1):
        if own.motion is None or own.prescribed:
            continue
        begin, unit = own.motion(t)[0], "rad" if link.joint.type == "R" else "m"
        if abs(begin - q) > STILL:
            text = f"joint {i} starts at {q:.4g} {unit}, the motion that it follows at {begin:.4g}"
            out.append({"t": t, "level": "INFO", "name": "off_motion", "text": text})
    return out


def still(run: Run, loads: object) -> list[Tables]:
    """The event of a whole run in which nothing moves and nothing acts; none of another."""
    if loads or not run.complete:
        return []
    drives = [values for name, values in run.channels.items() if name.endswith("/drive")]
    if run.states is None or len(run.t) < 2 or any(values.any() for values in drives):
        return []
    if np.abs(run.states - run.states[0]).max() > STILL:
        return []
    text = "nothing moves: no drive acts, and the robot starts at rest in equilibrium"
    return [{"t": float(run.t[0]), "level": "INFO", "name": "still", "text": text}]


def fast(run: Run, robot: Robot) -> list[Tables]:
    """The event of a run in which a joint moves a tip faster than any robot: a controller that is
    unstable, or a unit that is wrong; none of another."""
    reach = sum(link.length_m for link in robot.links)
    for i, link in enumerate(robot.links, 1):
        turns = link.joint.type == "R"
        rates = np.abs(run[f"joint/{i}/velocity"])
        beyond = np.flatnonzero(rates * (reach if turns else 1.0) > FAST_M_S)
        if beyond.size:
            k = int(beyond[0])
            unit = "rad/s" if turns else "m/s"
            text = (
                f"joint {i} moves at {rates[k]:.3g} {unit}, which takes a tip beyond "
                f"{FAST_M_S:g} m/s: is a controller unstable, or a unit wrong?"
            )
            return [{"t": float(run.t[k]), "level": "WARN", "name": "fast", "text": text}]
    return []


def describe(system: System, error: float) -> Tables:
    """What the metadata of every simulation says: of what, by what, and how well the energy
    balances."""
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


def energy_error(energies: np.ndarray, accounts: np.ndarray, jumps: Any = 0.0) -> float:
    """How far the energies (T, 3) and accounts (T, 4) of a run are from balancing, relative to the
    largest of them (102).

    The larger of |E - E(0) - work + loss + numerical loss - jumps| and |strain - strain(0) - its
    own integral|; `jumps` (T,): what E has jumped by so far.
    """
    if not len(energies):
        return 0.0
    since = accounts - accounts[0]
    change = energies - energies[0]
    balance = change.sum(axis=1) - since[:, WORK] + since[:, LOSS] + since[:, NUMERICAL] - jumps
    strain = change[:, 1] - since[:, STRAIN] if not np.any(jumps) else np.zeros(1)
    scale = max(
        np.abs(energies).max(), np.abs(change).max(), np.abs(accounts[:, :STRAIN]).max(), 1e-300
    )
    return float(max(np.abs(balance).max(), np.abs(strain).max()) / scale)


def limit_event(system: System, joint: int, t: float, position: np.ndarray) -> Tables:
    """The event of the stop at a limit: joint (from 0) at t, with all at `position` (N,)."""
    robot, (low, high) = system.robot, system.limits[joint]
    kind, own, travel = (
        robot.links[joint].joint.type,
        robot.links[joint].joint.limits,
        robot.travel(joint),
    )
    bound = low if abs(position[joint] - low) < abs(position[joint] - high) else high
    inside = joint > 0 and robot.links[joint - 1].joint.type == "Pb" and kind == "Pa"
    if inside and abs(position[joint] - bound) > 1e-6 * max(1.0, abs(bound)):
        name, text = (
            "sleeve",
            f"joint {joint + 1} (Pa) ran into the sleeve of link {joint}: stopped",
        )
    elif bound in travel and (own is None or bound not in own):
        link = joint if kind == "Pa" else joint + 1
        name = "end_of_link"
        text = f"joint {joint + 1} ({kind}) reached the end of link {link}, at {bound:g} m: stopped"
    else:
        name = "limit"
        text = (
            f"joint {joint + 1} left its limits, {low:g} to {high:g} "
            f"{'rad' if kind == 'R' else 'm'}: stopped"
        )
    return {"t": t, "level": "ERROR", "name": name, "text": text}
