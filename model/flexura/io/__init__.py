"""Files: runs in Parquet, TOML tables, whole or not at all; what a run's channels mean, and its
pictures."""

from . import summary
from .arguments import (
    array,
    check_progress,
    choice,
    finite_arguments,
    flag,
    function_of,
    number,
    takes,
    whole,
)
from .channels import CHANNELS, STATIONS, Channel, channel
from .format import FORMAT, check_format
from .labels import EMULATED, called, emulated, kind
from .memory import check_memory
from .run import FILE, Run
from .shipped import find, shipped_files
from .toml_files import read_toml, write_bytes, write_text, write_toml
from .trust import DOUBTED, REFUSED, balance_events, judged
from .validation import MOST_LETTERS, explain, is_name

__all__ = [
    "CHANNELS",
    "DOUBTED",
    "EMULATED",
    "FILE",
    "FORMAT",
    "MOST_LETTERS",
    "REFUSED",
    "STATIONS",
    "Channel",
    "Run",
    "array",
    "balance_events",
    "called",
    "channel",
    "check_format",
    "check_memory",
    "check_progress",
    "choice",
    "emulated",
    "explain",
    "find",
    "finite_arguments",
    "flag",
    "function_of",
    "is_name",
    "judged",
    "kind",
    "number",
    "read_toml",
    "shipped_files",
    "summary",
    "takes",
    "whole",
    "write_bytes",
    "write_text",
    "write_toml",
]
