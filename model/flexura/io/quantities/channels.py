"""The channels of a Run: their names, units, sign, frame and zero, in one table.

Joints and links are counted from 1. The base frame is at the first joint's origin: x to the right,
y up, angles counter-clockwise. The hub frame of a link has its x axis along the tangent at the
link's hub (Pb: along the sleeve), its y axis 90 degrees counter-clockwise from there.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass

MOST = 12  # entries of a list in a message
STATIONS = 9  # places along a flexible link at which a Run holds the deflection


@dataclass(frozen=True)
class Channel:
    """What a channel means.

    Attributes:
        name: the channel, with `i` for a joint or link, `k` for a station, `NAME` for any name.
        units: its unit; two where it depends on the joint: R, then Pa and Pb.
        quantity: a short name for a figure's axis.
        meaning: sign, frame and zero in words.
    """

    name: str
    units: tuple[str, ...]
    quantity: str
    meaning: str

    def fits(self, name: str) -> bool:
        """Whether a channel's name is one of these.

        Args:
            name: for example "joint/1/position".

        Returns:
            True if it is.
        """
        parts = {"i": r"[1-9]\d*", "k": r"\d+", "NAME": r".+"}
        pattern = "/".join(parts.get(part, re.escape(part)) for part in self.name.split("/"))
        return re.fullmatch(pattern, name) is not None


TURN, LENGTH, RATE, FORCE = ("rad", "m"), ("m",), ("rad/s", "m/s"), ("N m", "N")

# of the channels along a link
_PLACES = (
    f"at the arc length k L / {STATIONS - 1} from the link's origin; Pb: at k / {STATIONS - 1} of "
    f"the free length from the sleeve's exit, k = 0 ... {STATIONS - 1}."
)

CHANNELS = (
    Channel(
        "joint/i/position",
        TURN,
        "joint position",
        "R: angle of link i's hub against the tangent at the end of link i-1 (i = 1: against x), "
        "counter-clockwise; 0: aligned. Pa: distance of the hub from the origin of link i-1, along "
        "that link (i = 1: along x). Pb: free length of link i ahead of its sleeve.",
    ),
    Channel(
        "joint/i/velocity",
        RATE,
        "joint velocity",
        "Time derivative of joint/i/position; the same sign.",
    ),
    Channel(
        "joint/i/drive",
        FORCE,
        "drive",
        "Moment or force of the drive between link i-1 and the hub of link i; positive: it pushes "
        "joint/i/position up. The work of a drive is the integral of drive times velocity.",
    ),
    Channel(
        "joint/i/motor_position",
        TURN,
        "motor position",
        "Elastic joint: position of the rotor, reduced to the joint; equal to joint/i/position "
        "where the transmission is not strained. The drive acts on it, and a controller "
        "measures it.",
    ),
    Channel(
        "joint/i/motor_velocity",
        RATE,
        "motor velocity",
        "Elastic joint: time derivative of joint/i/motor_position; the work of the drive is the "
        "integral of drive times this velocity.",
    ),
    Channel(
        "joint/i/reference",
        TURN,
        "reference",
        "Set-point of joint/i/position that a controller follows; the same sign and zero.",
    ),
    Channel(
        "joint/i/pulses",
        TURN,
        "counted pulses",
        "Experiment: joint position that the counted pulses of a stepper motor stand for.",
    ),
    Channel(
        "joint/i/voltage",
        ("V",),
        "motor voltage",
        "Voltage at the motor of joint i; positive: it pushes joint/i/position up.",
    ),
    Channel(
        "joint/i/current",
        ("A",),
        "motor current",
        "Current of the motor of joint i, with the voltage's sign.",
    ),
    Channel(
        "joint/i/reaction_x",
        ("N",),
        "reaction x",
        "Force that link i-1 (i = 1: the base) exerts on link i at the joint, along the base "
        "frame's x.",
    ),
    Channel(
        "joint/i/reaction_y",
        ("N",),
        "reaction y",
        "Force that link i-1 (i = 1: the base) exerts on link i at the joint, along the base "
        "frame's y.",
    ),
    Channel(
        "joint/i/reaction_moment",
        ("N m",),
        "reaction moment",
        "Moment that link i-1 exerts on link i, counter-clockwise, about the joint: R: its axis, "
        "Pa: the hub, Pb: the sleeve's exit. R: what drive, spring and friction give, less what "
        "the rotor's inertia takes.",
    ),
    Channel(
        "joint/i/reaction_along",
        ("N",),
        "reaction along the slide",
        "Pa, Pb: the part of the reaction along the line on which the joint slides, towards "
        "larger joint/i/position: what drive, spring and friction give.",
    ),
    Channel(
        "joint/i/reaction_across",
        ("N",),
        "reaction across the slide",
        "Pa, Pb: the part of the reaction across that line, to its left: what the guide gives.",
    ),
    Channel("link/i/x", LENGTH, "hub x", "Origin of link i's hub frame in the base frame."),
    Channel("link/i/y", LENGTH, "hub y", "Origin of link i's hub frame in the base frame."),
    Channel(
        "link/i/angle",
        ("rad",),
        "link angle",
        "Angle of link i's hub frame against the base frame's x, counter-clockwise; counted "
        "through full turns.",
    ),
    Channel(
        "link/i/tip_deflection",
        LENGTH,
        "tip deflection",
        "Flexible link: distance of its end from the x axis of its hub frame, positive towards y; "
        "0: straight.",
    ),
    Channel(
        "link/i/tip_slope",
        ("rad",),
        "tip slope",
        "Flexible link: angle of the tangent at its end against the x axis of its hub frame, "
        "counter-clockwise; 0: straight.",
    ),
    Channel(
        "link/i/deflection/k",
        LENGTH,
        "deflection",
        f"Flexible link: as tip_deflection, of the point at the arc length k L / {STATIONS - 1} "
        f"from the link's origin, k = 0 ... {STATIONS - 1}.",
    ),
    Channel(
        "link/i/bending_moment/k",
        ("N m",),
        "bending moment",
        f"Bending moment in a section, positive where the link bends to the left, {_PLACES}",
    ),
    Channel(
        "link/i/shear_force/k",
        ("N",),
        "shear force",
        "Force that the part beyond a section exerts on the part before, across the tangent to "
        f"its left, {_PLACES}",
    ),
    Channel(
        "link/i/axial_force/k",
        ("N",),
        "axial force",
        f"Force along the tangent in a section, positive where it pulls, {_PLACES}",
    ),
    Channel(
        "link/i/stress/k",
        ("Pa",),
        "bending stress",
        "Bending stress of the outer fibre to the left, positive where it is drawn out; the fibre "
        f"to the right has the opposite; {_PLACES}",
    ),
    Channel(
        "link/i/tip_deflection_std",
        LENGTH,
        "standard deviation of the tip deflection",
        "Experiment: standard deviation of a reading of link/i/tip_deflection, 0 or more.",
    ),
    Channel(
        "link/i/flex_voltage",
        ("V",),
        "flex sensor voltage",
        "Experiment: voltage of the flex sensor on link i, as read; not zeroed.",
    ),
    Channel(
        "sensor/NAME",
        (),
        "sensor",
        "Sensor of the robot file: deflection [m] and slope [rad] in the hub frame of its link, "
        "strain [1] positive where the fibre is stretched; bending moment, shear force, axial "
        "force and stress as the channels of links. In an imported log: any quantity.",
    ),
    Channel("tip/x", LENGTH, "tip x", "Tip of the last link in the base frame."),
    Channel("tip/y", LENGTH, "tip y", "Tip of the last link in the base frame."),
    Channel(
        "energy/kinetic",
        ("J",),
        "kinetic energy",
        "Of links, hubs, rotors and payload in the base frame; 0: at rest.",
    ),
    Channel(
        "energy/strain",
        ("J",),
        "strain energy",
        "Of bent links and of springs; 0: unstrained.",
    ),
    Channel(
        "energy/potential",
        ("J",),
        "potential energy",
        "Of gravity; 0: all masses at the height of the base frame's origin.",
    ),
    Channel("energy/work", ("J",), "work of the drives", "Done by the drives since the start."),
    Channel(
        "energy/loss",
        ("J",),
        "dissipated energy",
        "Dissipated by damping and friction since the start; never falls.",
    ),
    Channel(
        "energy/numerical_loss",
        ("J",),
        "numerical loss",
        "Taken out by the numerical damping of the solver since the start.",
    ),
)


def meant(name: str) -> str:
    """What is said of a name that is no channel.

    Args:
        name: for example "joint/1/pos".

    Returns:
        For example "did you mean joint/1/position?"; "" for a channel of `CHANNELS`.
    """
    if any(known.fits(name) for known in CHANNELS):
        return ""
    numbers = [part for part in name.split("/") if part.isdecimal() and int(part) > 0]
    spelt = []
    for known in CHANNELS:
        left, parts = iter(numbers), known.name.split("/")
        spelt.append("/".join(next(left, "1") if p in ("i", "k") else p for p in parts))
    near = difflib.get_close_matches(name, spelt, 1, 0.6)
    return f"did you mean {near[0]}?" if near else "expected a channel, or sensor/NAME"


def listed(names: Iterable[str]) -> str:
    """Names of channels in a sentence, those along a link as one.

    Args:
        names: of a run.

    Returns:
        For example "tip/x, link/1/deflection/0 to 8", with at most 12 entries; "none" of none.
    """
    places: dict[str, list[int]] = {}
    for name in names:
        before, _, last = name.rpartition("/")
        key = before if last.isdecimal() else name
        places.setdefault(key, []).extend([int(last)] if last.isdecimal() else [])
    said = [
        f"{key}/{min(at)} to {max(at)}" if at[1:] else f"{key}/{at[0]}" if at else key
        for key, at in places.items()
    ]
    more = f" and {len(said) - MOST} more" if len(said) > MOST else ""
    return ", ".join(said[:MOST]) + more if said else "none"


def channel(name: str) -> Channel:
    """What a channel means; of a name that is in no table, only its last part is known.

    Args:
        name: for example "joint/1/position".

    Returns:
        Its row of CHANNELS, or one without units and meaning.
    """
    found = next((known for known in CHANNELS if known.fits(name)), None)
    return found or Channel(name, (), name.rpartition("/")[2].replace("_", " "), "")
