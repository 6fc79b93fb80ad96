"""The joints as the board's settings describe them: units, counts and names of settings.

A recording has the board's settings; that is all that its conversion needs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

DRIVES = {"drive_1": 1.0, "drive_2": 1.0, "encoder_2": 1.0}  # of boards that had no other


@dataclass(frozen=True)
class BoardAxis:
    """One joint of the board.

    Attributes:
        number: of the joint.
        kind: "motor" or "stepper".
        unit: of the position, "m" or "rad".
        counts: of the encoder for 1 m or 1 rad; a stepper without encoder counts its microsteps.
        setpoints: units of a set-point (256ths apart) for 1 m or 1 rad.
        encoder: whether the joint has an encoder.
        names: settings by what they are: "low", "high", "speed", "following", "kp".
    """

    number: int
    kind: str
    unit: str
    counts: float
    setpoints: float
    encoder: bool
    names: Mapping[str, str]

    @property
    def command(self) -> str:
        """The channel of what the board gives the drive."""
        return f"joint/{self.number}/{'voltage' if self.kind == 'motor' else 'pulses'}"

    @property
    def command_unit(self) -> str:
        """Its unit."""
        return "V" if self.kind == "motor" else "rad"

    @property
    def what(self) -> str:
        """The joint in words."""
        return "carriage" if self.unit == "m" else f"joint {self.number}"


def board_axes(settings: Mapping[str, float]) -> tuple[BoardAxis, ...]:
    """The joints of a board with these settings.

    Args:
        settings: by name; those of older boards lack drive_1, drive_2 and encoder_2.
    """
    settings = DRIVES | dict(settings)
    if settings["drive_1"] < 1.5:
        first = _axis(1, "motor", "m", settings["motor_counts_per_m"])
    else:
        first = _axis(1, "motor", "rad", settings["motor_1_counts_per_rad"])
    if settings["drive_2"] < 0.5:
        return (first,)
    if settings["drive_2"] > 1.5:
        return first, _axis(2, "motor", "rad", settings["motor_2_counts_per_rad"])
    steps = settings["stepper_steps_per_rad"]
    encoder = settings["encoder_2"] > 0.5
    counts = settings["stepper_counts_per_rad"] if encoder else steps
    return first, _axis(2, "stepper", "rad", counts, steps, encoder)


def _axis(
    number: int,
    kind: str,
    unit: str,
    counts: float,
    setpoints: float | None = None,
    encoder: bool = True,
) -> BoardAxis:
    names = {
        "low": f"position_min_{number}_{unit}",
        "high": f"position_max_{number}_{unit}",
        "speed": f"speed_max_{number}_{unit}_s",
        "following": f"following_max_{number}_{unit}",
        "kp": f"kp_{number}_1_s" if kind == "stepper" else f"kp_{number}_V_{unit}",
    }
    return BoardAxis(number, kind, unit, counts, setpoints or counts, encoder, names)
