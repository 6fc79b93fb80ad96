"""Files and folders that are kept: whole, on the disk itself, and never over others unasked."""

from .places import (
    DRAFT,
    FINISHED,
    check_suffix,
    draft_of,
    linked,
    make_folder,
    path_of,
    sync,
    taken,
    unwritable,
)
from .replacement import replace_results, settle
from .whole import leftovers, put, refuse_taken, replaced, write_bytes, write_text

__all__ = [
    "DRAFT",
    "FINISHED",
    "check_suffix",
    "draft_of",
    "leftovers",
    "linked",
    "make_folder",
    "path_of",
    "put",
    "refuse_taken",
    "replace_results",
    "replaced",
    "settle",
    "sync",
    "taken",
    "unwritable",
    "write_bytes",
    "write_text",
]
