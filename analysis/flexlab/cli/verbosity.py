"""How much the command says: the logger "flexura" on stderr, and whether notes and progress bars
are wanted."""

from __future__ import annotations

import logging
import sys

_quiet = False


def quiet() -> bool:
    """Whether only results and errors are wanted."""
    return _quiet


def set_verbosity(*, quiet: bool = False, verbose: bool = False) -> None:
    """Say less or more.

    Args:
        quiet: no progress bars, notes and warnings.
        verbose: also what the logger says for debugging.
    """
    global _quiet
    _quiet = quiet
    log = logging.getLogger("flexura")
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("flexura: %(message)s"))
    log.handlers = [handler]
    log.propagate = False
    log.setLevel(logging.ERROR if quiet else logging.DEBUG if verbose else logging.WARNING)
