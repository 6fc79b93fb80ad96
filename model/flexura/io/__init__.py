"""Files: runs in Parquet, TOML tables, whole or not at all; what a run's channels mean, and its
pictures."""

from . import summary
from .arguments import (
    array,
    check_memory,
    check_progress,
    choice,
    finite_arguments,
    flag,
    function_of,
    number,
    takes,
    whole,
)
from .changes import changed, index_of
from .files import (
    DRAFT,
    FINISHED,
    leftovers,
    make_folder,
    move,
    replace_results,
    replaced,
    settle,
    sync,
    unwritable,
    write_bytes,
    write_text,
)
from .format import FORMAT, check_format
from .quantities import CHANNELS, STATIONS, Channel, channel
from .quantities.labels import EMULATED, called, emulated, kind
from .run import FILE, Run
from .seal import (
    Damaged,
    read_sealed,
    read_sealed_json,
    read_table,
    room_for_arrow,
    say_unsealed,
    sealed,
    sealed_json,
    sealed_parquet,
)
from .shipped import find, shipped_files
from .toml_files import Tables, read_toml, write_toml
from .trust import DOUBTED, REFUSED, balance_events, judged
from .validation import MOST_LETTERS, explain, is_name

__all__ = [
    "CHANNELS",
    "DOUBTED",
    "DRAFT",
    "EMULATED",
    "FILE",
    "FINISHED",
    "FORMAT",
    "MOST_LETTERS",
    "REFUSED",
    "STATIONS",
    "Channel",
    "Damaged",
    "Run",
    "Tables",
    "array",
    "balance_events",
    "called",
    "changed",
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
    "index_of",
    "is_name",
    "judged",
    "kind",
    "leftovers",
    "make_folder",
    "move",
    "number",
    "read_sealed",
    "read_sealed_json",
    "read_table",
    "read_toml",
    "replace_results",
    "replaced",
    "room_for_arrow",
    "say_unsealed",
    "sealed",
    "sealed_json",
    "sealed_parquet",
    "settle",
    "shipped_files",
    "summary",
    "sync",
    "takes",
    "unwritable",
    "whole",
    "write_bytes",
    "write_text",
    "write_toml",
]
