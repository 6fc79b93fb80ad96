"""Robots for the tests: short builders, the benchmarks' arms, and random robots with random states
(hypothesis).

A state from `state` is physically small: each flexible link is bent in shapes like its three lowest
modes, its slopes below `SLOPE`. Random numbers on all unknowns would bend a link in shapes that no
motion takes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

import flexura as fx
from flexura.robot import renamed

SLOPE = 0.1  # rad: largest slope of a random state
fast = settings(max_examples=25, deadline=None, derandomize=True, database=None)
few = settings(fast, max_examples=10)


def beam(
    length: float, mass: Any, stiffness: Any, elements: int = 8, type: str = "R", **keys: Any
) -> dict[str, Any]:
    """A flexible link's table: mass per length [kg/m], bending stiffness [N m^2].

    `modes` and `damping` go to the link, all other keys to its joint.
    """
    link = {k: keys.pop(k) for k in ("modes", "damping") if k in keys}
    numbers = {
        "length_m": length,
        "elements": elements,
        "mass_per_length_kg_m": mass,
        "bending_stiffness_N_m2": stiffness,
    }
    return numbers | link | {"joint": {"type": type} | keys}


def rigid(
    length: float, mass: float, centre: float, inertia: float, type: str = "R", **joint: Any
) -> dict[str, Any]:
    """A rigid link's table; the inertia is about its centre of mass."""
    body = {
        "length_m": length,
        "mass_kg": mass,
        "centre_of_mass_m": centre,
        "inertia_kg_m2": inertia,
    }
    return body | {"joint": {"type": type} | joint}


def robot(
    *links: dict[str, Any],
    gravity: tuple[float, float] = (0.0, 0.0),
    payload: float = 0.0,
    payload_inertia: float = 0.0,
    **keys: Any,
) -> fx.Robot:
    """A robot of these links; their joints may have keys without a unit, as `start`."""
    load = {"mass_kg": float(payload), "inertia_kg_m2": float(payload_inertia)}
    data = {"link": list(links), "gravity_m_s2": gravity, "payload": load} | keys
    return fx.Robot.from_dict(renamed(data)[0])


def system(*links: dict[str, Any], **keys: Any) -> fx.System:
    return fx.assemble(robot(*links, **keys))


def bench_arm(elements: int = 8, **keys: Any) -> fx.System:
    """The benchmarks' bench link: steel 30 x 1 mm, 0.6 m, a hub and a tip mass."""
    return system(beam(0.6, 0.2355, 0.5, elements, hub_inertia_kg_m2=2e-3), payload=0.05, **keys)


def two_link_arm(elements: int = 4, **link: Any) -> fx.Robot:
    """De Luca and Siciliano's arm."""
    return robot(
        beam(0.5, 0.2, 1.0, elements, hub_inertia_kg_m2=0.1, **link),
        beam(0.5, 0.2, 1.0, elements, hub_mass_kg=1.0, hub_inertia_kg_m2=0.1, **link),
        payload=0.1,
        payload_inertia=5e-4,
    )


def by_hub(run: fx.Run, link: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """The robot's tip in the hub frame of a link."""
    x, y, a = (
        run["tip/x"] - run[f"link/{link}/x"],
        run["tip/y"] - run[f"link/{link}/y"],
        run[f"link/{link}/angle"],
    )
    return np.cos(a) * x + np.sin(a) * y, np.cos(a) * y - np.sin(a) * x


def largest_difference(a: fx.Run, b: fx.Run, names: Any = None) -> float:
    """Largest difference of two runs' channels, each relative to the largest value of all channels
    of its kind."""
    worst = 0.0
    for name in names or [n for n in a if not n.startswith("energy") and not n.endswith("drive")]:
        alike = [
            c for c in a if c.split("/")[0] == name.split("/")[0] and a.units[c] == a.units[name]
        ]
        size = max(max(np.abs(a[c]).max() for c in alike), 1e-12)
        worst = max(worst, float(np.abs(a[name] - b[name]).max() / size))
    return worst


# Random robots


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.integers(0, 1000).map(lambda k: low + (high - low) * k / 1000)


def maybe(strategy: st.SearchStrategy[float]) -> st.SearchStrategy[float]:
    return st.one_of(st.just(0.0), strategy)


@st.composite
def links(draw: Any, joint: dict[str, Any], flexible: bool, modes: bool) -> dict[str, Any]:
    length = draw(numbers(0.2, 0.8))
    if not flexible:
        return rigid(
            length,
            draw(numbers(0.1, 1.0)),
            draw(numbers(0.0, 0.5)) * length,
            draw(numbers(1e-3, 1e-2)),
            **joint,
        )
    elements = draw(st.integers(1, 4))
    mass, stiffness = draw(numbers(0.1, 0.5)), draw(numbers(0.5, 5.0))
    if draw(
        st.booleans()
    ):  # tapered; a kink that passes a sleeve costs the energy balance what its quadrature costs
        at = [0.0, length] if joint["type"] == "Pb" else [0.0, 0.4 * length, length]
        mass, stiffness = (
            [{"at_m": x, "value": v * f} for x, f in zip(at, (1.4, 1.0, 0.7))]
            for v in (mass, stiffness)
        )
    link = beam(length, mass, stiffness, elements, **joint)
    if modes and draw(st.booleans()):
        link["modes"] = draw(st.integers(1, 2 * elements))
    link["damping"] = {
        "alpha_1_s": draw(maybe(numbers(0.1, 1.0))),
        "beta_s": draw(maybe(numbers(1e-5, 1e-4))),
    }
    return link


@st.composite
def robots(
    draw: Any,
    max_links: int = 5,
    friction: bool = True,
    coulomb: bool = False,
    gravity: bool = True,
    modes: bool = True,
    locked: bool = False,
    stiffening: bool | None = None,
    first: str | None = None,
    sliding: bool = True,
) -> fx.Robot:
    """1 to `max_links` links, rigid and flexible, joints R, Pa and Pb anywhere; without `sliding`
    no Pb, and Pa on the base or a rigid link only."""
    chain: list[dict[str, Any]] = []
    for i in range(draw(st.integers(1, max_links))):
        ridden = sliding or not (i and chain[-1].get("elements"))
        kind = draw(
            st.sampled_from(["R", "R", *(["Pa"] if ridden else []), *(["Pb"] if sliding else [])])
        )
        if i == 0 and first:
            kind = first
        joint: dict[str, Any] = {
            "type": kind,
            "hub_mass_kg": draw(maybe(numbers(0.05, 0.5))),
            "hub_inertia_kg_m2": draw(numbers(1e-3, 1e-2)),
            "rotor_inertia": draw(maybe(numbers(1e-3, 1e-2))),
            "start": draw(numbers(-1.0, 1.0)),
        }
        if kind != "R":
            joint["angle_rad"] = draw(numbers(-2.0, 2.0))
        if friction:
            joint["viscous_friction"] = draw(maybe(numbers(1e-3, 0.1)))
        if coulomb:
            joint["coulomb_friction"] = draw(maybe(numbers(1e-3, 0.1)))
        if locked:
            joint["locked"] = draw(st.sampled_from([False, False, True]))
        link = draw(links(joint, draw(st.booleans()), modes))
        if kind == "Pb":  # the free length
            link["joint"]["start"] = link["length_m"] * draw(numbers(0.4, 0.8))
        elif kind == "Pa" and i:  # on the last link, ahead of its sleeve
            low, length = 0.0, chain[-1]["length_m"]
            if chain[-1]["joint"]["type"] == "Pb":
                low = length - chain[-1]["joint"]["start"]
            link["joint"]["start"] = low + (length - low) * draw(numbers(0.3, 0.8))
        chain.append(link)
    return robot(
        *chain,
        gravity=(draw(numbers(-3.0, 3.0)), draw(numbers(-9.81, 3.0)))
        if gravity and draw(st.booleans())
        else (0.0, 0.0),
        payload=draw(maybe(numbers(0.05, 0.3))),
        payload_inertia=draw(maybe(numbers(1e-4, 1e-2))),
        stiffening=draw(st.booleans()) if stiffening is None else stiffening,
    )


seeds = st.integers(0, 2**32 - 1)


def state(
    sys: fx.System, seed: int, slope: float = SLOPE, rate: float = 2.0
) -> tuple[np.ndarray, np.ndarray]:
    """q and qd (n,): R joints anywhere, sliding ones within 5 % of the link around their start,
    joint rates below `rate` rad/s or `rate` / 4 m/s, slopes below `slope` and their rates below
    `rate`."""
    random = np.random.default_rng(seed)
    links = sys.robot.links
    turns = np.array([link.joint.type == "R" for link in links])
    reach = 0.05 * np.array(
        [links[max(i - (link.joint.type == "Pa"), 0)].length_m for i, link in enumerate(links)]
    )
    q = _motion(sys, random, np.where(turns, 1.5, reach), slope)
    qd = _motion(sys, random, np.where(turns, rate, rate / 4), rate)
    q[sys.joint_rows] += np.where(turns, 0.0, sys.robot.start)
    return q, qd


def forces(sys: fx.System, seed: int) -> np.ndarray:
    """Random forces and torques (N,), up to 1."""
    return np.random.default_rng(seed + 1).uniform(-1, 1, len(sys.robot.links))


def bending(sys: fx.System, link: int, sizes: Any) -> np.ndarray:
    """Elastic unknowns (m,) of a link (from 0) whose tangent turns by sum_k sizes_k sin((k - 1/2)
    pi s / L), k = 1, 2, ..., the angles of a clamped link's modes nearly, as closely as its own
    shapes come to them."""
    x = np.linspace(0, 1, 8 * (sys.robot.links[link].elements or 1) + 1)
    shapes = sys.angles(link + 1, x * sys.robot.links[link].length_m)[:, sys.link_rows(link)]
    angle = sum(size * np.sin((k + 0.5) * np.pi * x) for k, size in enumerate(sizes))
    scale = np.abs(shapes).max(axis=0)
    return np.linalg.lstsq(shapes / scale, angle, rcond=None)[0] / scale


def turning(sys: fx.System) -> np.ndarray:
    """How far a unit of each unknown turns a tangent [rad], (n,); 1 for joints."""
    out = np.ones(sys.n)
    for i, link in enumerate(sys.robot.links):
        own = sys.link_rows(i)
        if len(own):
            out[own] = np.abs(
                sys.angles(i + 1, np.linspace(0, link.length_m, 64 * link.elements + 1))[:, own]
            ).max(axis=0)
    return out


def _motion(
    sys: fx.System, random: np.random.Generator, joints: np.ndarray, slope: float
) -> np.ndarray:
    y = np.zeros(sys.n)
    for i, row in enumerate(sys.joint_rows):
        y[row] = joints[i] * random.uniform(-1, 1)
        if len(own := sys.link_rows(i)):
            kept = min(3, len(own))
            y[own] = bending(sys, i, slope / kept * random.uniform(-1, 1, kept))
    return y
