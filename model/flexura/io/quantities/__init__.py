"""What numbers of a run mean: its channels, their units, its clock."""

from .channels import CHANNELS, STATIONS, Channel, channel, listed, meant
from .clock import EPOCH_S, LATEST_S, doubted, fault, from_first, slow
from .turns import note_turns
from .units import Unit, check_unit, converted, is_unit, suffix, unit

__all__ = [
    "CHANNELS",
    "EPOCH_S",
    "LATEST_S",
    "STATIONS",
    "Channel",
    "Unit",
    "channel",
    "check_unit",
    "converted",
    "doubted",
    "fault",
    "from_first",
    "is_unit",
    "listed",
    "meant",
    "note_turns",
    "slow",
    "suffix",
    "unit",
]
