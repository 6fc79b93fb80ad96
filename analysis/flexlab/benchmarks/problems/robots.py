"""Robot tables of the benchmark."""

from __future__ import annotations

from typing import Any

from .problem import Tables


def turning(**keys: Any) -> Tables:
    """Table of a joint R."""
    return {"type": "R", **keys}


def strip(
    length: float,
    section: tuple[float, float],
    elements: int,
    joint: Tables,
    metal: str = "steel",
    **keys: Any,
) -> Tables:
    """Table of a flexible link with a rectangular section.

    Args:
        length: its length [m].
        section: width and height [m].
        elements: finite elements.
        joint: table of its joint.
        metal: "steel", "aluminium" or "6061".
        keys: further keys of the link.
    """
    modulus, density = {
        "steel": (2.0e11, 7850.0),
        "aluminium": (7.0e10, 2700.0),
        "6061": (7.1e10, 2710.0),
    }[metal]
    size = {"width_m": section[0], "height_m": section[1]}
    material = {"young_modulus_Pa": modulus, "density_kg_m3": density}
    return {
        "length_m": length,
        "elements": elements,
        "section": size,
        **material,
        "joint": joint,
        **keys,
    }


def beam(
    length: float, stiffness: float, mass: float, elements: int, joint: Tables, **keys: Any
) -> Tables:
    """Table of a flexible link by its EI [N m^2] and mass per length [kg/m]."""
    line = {"mass_per_length_kg_m": mass, "bending_stiffness_N_m2": stiffness}
    return {"length_m": length, "elements": elements, **line, "joint": joint, **keys}


def carriage(mass: float) -> Tables:
    """Table of a rigid link without length on a rail, the first of its robot."""
    return {
        "length_m": 0.0,
        "elements": 0,
        "mass_kg": mass,
        "inertia_kg_m2": 0.0,
        "joint": {"type": "Pa"},
    }


def damped(beta: float) -> Tables:
    """A link's damping key; beta [s]."""
    return {"damping": {"beta_s": beta}}


def robot(
    links: list[Tables], payload: float = 0.0, inertia: float = 0.0, gravity: bool = False
) -> Tables:
    """Tables of a robot.

    Args:
        links: tables of its links.
        payload: mass at the tip [kg].
        inertia: the payload's moment of inertia [kg m^2].
        gravity: whether the plane is vertical.
    """
    made: Tables = {"name": "benchmark", "link": links}
    if payload or inertia:
        made["payload"] = {"mass_kg": payload, "inertia_kg_m2": inertia}
    return made | ({"gravity_m_s2": [0.0, -9.81]} if gravity else {})


def meshed(tables: Tables, elements: int) -> Tables:
    """The robot with all unknowns of `elements` elements a flexible link, without modes."""
    whole = lambda link: {k: v for k, v in link.items() if k != "modes"} | {"elements": elements}
    return tables | {"link": [whole(link) if link["elements"] else link for link in tables["link"]]}


def published_arm(elements: int, beta: float = 0.0, modes: int = 0) -> Tables:
    """The two-link arm of De Luca and Siciliano (IEEE Trans. SMC 21(4), 1991)."""
    keys = (damped(beta) if beta else {}) | ({"modes": modes} if modes else {})
    first = beam(0.5, 1.0, 0.2, elements, turning(hub_inertia_kg_m2=0.1), **keys)
    second = beam(0.5, 1.0, 0.2, elements, turning(hub_mass_kg=1.0, hub_inertia_kg_m2=0.1), **keys)
    return robot([first, second], 0.1, 5e-4)


def tokhi_arm(elements: int = 8, joint: Tables | None = None) -> Tables:
    """Tokhi's aluminium arm: 0.9 m, 19.008 x 3.2004 mm."""
    hub = {"hub_inertia_kg_m2": 5.86e-4} | (joint or {})
    return robot(
        [strip(0.9, (0.019008, 0.0032004), elements, turning(**hub), "6061", **damped(1e-4))]
    )


def rig(hub: float) -> Tables:
    """The rig (PaR) with a hub of inertia `hub` [kg m^2] instead of its rotor."""
    return robot(
        [
            carriage(0.6),
            strip(0.3, (0.02, 0.001), 4, turning(hub_inertia_kg_m2=hub), **damped(2e-4)),
        ],
        0.02,
    )


def type_4(elements: int, modes: int = 0) -> Tables:
    """Type IV (PaR): a carriage on a rail, a rotor, a steel strip, a payload; undamped."""
    keys: Tables = {"modes": modes} if modes else {}
    return robot(
        [
            carriage(1.0),
            strip(0.3, (0.02, 0.001), elements, turning(hub_inertia_kg_m2=1e-3), **keys),
        ],
        0.05,
    )


def two_strips(elements: int, modes: tuple[int, int] | None = None) -> Tables:
    """Type I (RR): two aluminium strips, undamped."""
    first = strip(0.9, (0.03, 0.006), elements, turning(hub_inertia_kg_m2=0.05), "aluminium")
    second = strip(
        0.8, (0.03, 0.004), elements, turning(hub_mass_kg=0.5, hub_inertia_kg_m2=0.005), "aluminium"
    )
    links = [first, second]
    return robot(
        links
        if modes is None
        else [link | {"modes": m} for link, m in zip(links, modes, strict=True)],
        0.2,
    )


def upright_arm(elements: int) -> Tables:
    """Three aluminium links in the vertical plane."""
    hub = lambda mass, inertia: turning(hub_mass_kg=mass, hub_inertia_kg_m2=inertia)
    links = [
        strip(0.5, (0.04, 0.006), elements, hub(0.0, 0.02), "aluminium", **damped(2e-4)),
        strip(0.4, (0.04, 0.005), elements, hub(0.6, 0.004), "aluminium", **damped(2e-4)),
        strip(0.3, (0.03, 0.004), elements, hub(0.4, 0.002), "aluminium", **damped(2e-4)),
    ]
    return robot(links, 0.3, gravity=True)


def chain(links: int, elements: int) -> Tables:
    """Equal damped links with joints R."""
    hub = turning(hub_mass_kg=0.1, hub_inertia_kg_m2=1e-3)
    return robot([beam(0.3, 2.0, 0.2, elements, hub, **damped(1e-3)) for _ in range(links)], 0.1)


def boom() -> Tables:
    """Two long tubes with a payload of 200 kg, as on a spacecraft."""
    first = beam(6.4, 3.8e6, 22.0, 4, turning(hub_inertia_kg_m2=400.0), **damped(2e-3))
    return robot(
        [
            first,
            beam(
                7.0,
                2.9e6,
                17.0,
                4,
                turning(hub_mass_kg=60.0, hub_inertia_kg_m2=50.0),
                **damped(2e-3),
            ),
        ],
        200.0,
    )


def slider(elements: int = 8) -> Tables:
    """Type II (RPa): a flexible strip across a slider on a turning flexible arm."""
    ride = {
        "type": "Pa",
        "angle_rad": 1.5707963267948966,
        "start_m": 0.25,
        "limits_m": [0.1, 0.4],
        "hub_mass_kg": 0.1,
    }
    arm = strip(0.5, (0.03, 0.003), elements, turning(hub_inertia_kg_m2=2e-3), **damped(2e-4))
    return robot([arm, strip(0.3, (0.02, 0.001), 4, ride, **damped(2e-4))], 0.02)


def sleeve(elements: int = 4) -> Tables:
    """Type III (RPb): a flexible strip that slides through a sleeve on a turning rigid arm."""
    through = {"type": "Pb", "start": 0.25, "limits": [0.15, 0.35], "hub_mass_kg": 0.3}
    arm: Tables = {"length_m": 0.2, "elements": 0, "mass_per_length_kg_m": 1.0, "joint": turning()}
    return robot([arm, strip(0.4, (0.02, 0.001), elements, through, **damped(2e-4))], 0.02)


def wrist(elements: int = 4) -> Tables:
    """Type VII (PbR): a flexible arm through a sleeve in the base, with a strip on a joint R."""
    through = {"type": "Pb", "start": 0.3, "limits": [0.2, 0.45]}
    turn = turning(hub_mass_kg=0.15, hub_inertia_kg_m2=1e-4)
    arm = strip(0.5, (0.03, 0.003), elements, through, **damped(2e-4))
    return robot([arm, strip(0.25, (0.02, 0.001), elements, turn, **damped(2e-4))], 0.02)
