"""How much memory there is, asked before it is taken."""

from __future__ import annotations

import os

from ..errors import InputError


def available() -> int:
    """The memory [bytes] that this process can still take: the system's, and its own limit."""
    found = [2**62]
    try:
        with open("/proc/meminfo", encoding="ascii") as stream:
            found += [
                int(line.split()[1]) * 1024 for line in stream if line[:13] == "MemAvailable:"
            ]
    except OSError:
        if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
            found.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    try:
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            with open("/proc/self/statm", encoding="ascii") as stream:
                taken = int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
            found.append(max(limit - taken, 0))
    except (ImportError, OSError):  # no limit is known
        pass
    return min(found)


def check_memory(needed: float, what: str, key: str, value: object) -> None:
    """Refuse what does not fit.

    Args:
        needed: bytes.
        what: they are for, and what to do, as the message says it.
        key: the argument that is too large.
        value: of it.

    Raises:
        InputError: there is less memory than needed.
    """
    there = available()
    if needed > there:
        raise InputError(
            f"expected what fits into memory: {what}; it would take {needed / 1e9:.3g} GB, and "
            f"{there / 1e9:.3g} GB are there",
            key=key,
            value=value,
        )
