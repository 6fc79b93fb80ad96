"""Files: runs in Parquet, TOML tables, whole or not at all."""

from .format import FORMAT, check_format
from .run import FILE, STATIONS, Run
from .shipped import find, shipped_files
from .toml_files import read_toml, write_bytes, write_text, write_toml
from .validation import explain, is_name

__all__ = [
    "FILE",
    "FORMAT",
    "STATIONS",
    "Run",
    "check_format",
    "explain",
    "find",
    "is_name",
    "read_toml",
    "shipped_files",
    "write_bytes",
    "write_text",
    "write_toml",
]
