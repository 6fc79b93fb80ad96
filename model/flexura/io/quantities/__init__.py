"""What numbers of a run mean: its channels, their units, its clock."""

from .channels import CHANNELS, STATIONS, Channel, channel
from .clock import EPOCH_S, LATEST_S, fault, from_first
from .units import Unit, converted, suffix, unit

__all__ = [
    "CHANNELS",
    "EPOCH_S",
    "LATEST_S",
    "STATIONS",
    "Channel",
    "Unit",
    "channel",
    "converted",
    "fault",
    "from_first",
    "suffix",
    "unit",
]
