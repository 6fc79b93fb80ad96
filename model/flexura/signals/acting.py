"""What acts on a robot beside its drives, loads and changes of the payload, and how its numbers are
varied."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..io import Tables, changed, index_of
from .load import EXPECTED as EXPECTED_LOADS
from .load import Load, LoadsLike, load_from_table, splined
from .payload_change import PayloadChange, PayloadsLike, as_payloads, payload_from_table

_KEY = re.compile(r"(load|payload)\.\d+\.")
WHERE = "a table [[load]] or [[payload]]"


def acts(key: str) -> bool:
    """Whether a key is one of a load or of a change of the payload, not of the robot.

    Args:
        key: as load.1.force_N.2 or payload.1.at_s.

    Returns:
        True if it is.
    """
    return _KEY.match(key) is not None


@dataclass(frozen=True)
class Acting:
    """Loads on links, and changes of the payload."""

    loads: tuple[Load, ...] = ()
    payloads: tuple[PayloadChange, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.loads or self.payloads)

    @staticmethod
    def of(loads: LoadsLike, payloads: PayloadsLike, start: float, end: float) -> Acting:
        """What acts in runs of robots whose links' lengths are not known yet.

        Args:
            loads: as in `simulate`.
            payloads: as in `simulate`.
            start: begin of the runs [s].
            end: their end [s].

        Returns:
            It, with functions of time as splines of fifth order.

        Raises:
            InputError: an argument is not what is expected.
        """
        entries: Any = [loads] if isinstance(loads, Load | dict) else loads
        entries = () if entries is None else getattr(entries, "each", entries)
        if isinstance(entries, str | bytes) or not isinstance(entries, Sequence):
            raise InputError(EXPECTED_LOADS, key="loads", value=loads)
        found = []
        for i, entry in enumerate(entries, 1):
            load = load_from_table(entry, i) if isinstance(entry, dict) else entry
            if not isinstance(load, Load):
                raise InputError(EXPECTED_LOADS, key="loads", value=entry)
            found.append(splined(load, i, start, end))
        return Acting(tuple(found), as_payloads(payloads, start, end))

    def varied(self, values: Mapping[str, float]) -> Acting:
        """The same with some numbers changed.

        Args:
            values: by key, loads and changes counted from 1: {"load.1.force_N.2": 0.5,
                "load.1.moment_N_m.amplitude": 0.1, "payload.1.mass_kg": 0.1}.

        Returns:
            What acts then.

        Raises:
            InputError: a key leads nowhere, or a wrong value.
        """
        if not values:
            return self
        loads, payloads = list(self.loads), list(self.payloads)
        for key, value in values.items():
            kind, number, *rest = key.split(".")
            own: Any = loads if kind == "load" else payloads
            if not own:
                text = f"expected a key of what acts, but there is no [[{kind}]]"
                raise InputError(text, key=key, value=value)
            k = index_of(own, number, key, value)
            put = _load_with if kind == "load" else _payload_with
            own[k] = put(own[k], k + 1, rest, key, value)
        return Acting(tuple(loads), tuple(payloads))

    @property
    def digest(self) -> str:
        """What tells these numbers from any others, of splines too."""
        found = hashlib.sha256(repr([change.spec() for change in self.payloads]).encode())
        for load in self.loads:
            found.update(repr((load.link, load.at_m, load.frame)).encode())
            for signal in load.signals:
                rows = np.zeros(0) if signal is None else signal.segments
                found.update(repr(rows.shape).encode() + np.ascontiguousarray(rows).tobytes())
        return found.hexdigest()[:16]

    def spec(self) -> dict[str, list[Tables]]:
        """Their tables by "loads" and "payloads", as in the metadata of a run."""
        own = {"loads": [load.spec() for load in self.loads]}
        own["payloads"] = [change.spec() for change in self.payloads]
        return {name: tables for name, tables in own.items() if tables}


def _load_with(load: Load, i: int, rest: Sequence[str], key: str, value: float) -> Load:
    """A load with one number changed: of its own, or of one of its signals' tables."""
    *force, moment = load.signals
    table: Tables = {"link": load.link, "at_m": load.at_m, "frame": load.frame}
    table |= {"force_N": list(force), "moment_N_m": moment}
    deep = 2 if rest[0] == "force_N" else 1  # from where on the key is the signal's
    if rest[0] in ("force_N", "moment_N_m") and len(rest) > deep:
        if rest[0] == "force_N":
            index_of(force, rest[1], key, value)
        signal = load.signals[int(rest[1]) - 1 if deep == 2 else 2]
        if signal is None or signal.spec.get("kind") in (None, "function"):
            text = "expected the key of a number of a signal that the load has"
            raise InputError(text, key=key, value=value)
        table = changed(table, {".".join(rest[:deep]): signal.spec})
    elif rest[:1] == ["force_N"] and len(rest) != 2:
        text = "expected force_N.1 or force_N.2, a component of the force"
        raise InputError(text, key=key, value=value)
    elif rest[0] in ("link", "frame"):
        text = "expected another key: all robots of a batch have their loads on the same links"
        raise InputError(text, key=key, value=value)
    table = changed(table, {".".join(rest): value}, WHERE)
    kept = {name: each for name, each in table.items() if each is not None}
    return load_from_table(kept, i)


def _payload_with(
    change: PayloadChange, i: int, rest: Sequence[str], key: str, value: float
) -> PayloadChange:
    """A change of the payload with one number changed."""
    table = change.spec()
    if rest[0] == "centre_of_mass_m" and change.centre_of_mass_m is None:
        text = "expected a [[payload]] that has centre_of_mass_m, of which one number is varied"
        raise InputError(text, key=key, value=value)
    return payload_from_table(changed(table, {".".join(rest): value}, WHERE), i)
