"""Files: runs in Parquet, TOML tables, whole or not at all."""

from .run import FILE, STATIONS, Run
from .toml_files import read_toml, write_bytes, write_text, write_toml
from .validation import explain, is_name

__all__ = [
    "FILE",
    "STATIONS",
    "Run",
    "explain",
    "is_name",
    "read_toml",
    "write_bytes",
    "write_text",
    "write_toml",
]
