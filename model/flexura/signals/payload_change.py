"""Payloads that are taken up or let go during a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..errors import InputError
from ..io import Tables, array, number
from ..robot import BOUNDS

KEYS = ("at_s", "mass_kg", "inertia_kg_m2", "centre_of_mass_m")
EXPECTED = (
    "expected payloads: a list of fx.PayloadChange, or of tables with the keys at_s, mass_kg, "
    "inertia_kg_m2 and centre_of_mass_m"
)


@dataclass(frozen=True)
class PayloadChange:
    """The payload from an instant on (137).

    at_s: the instant [s]. mass_kg: its mass from then on [kg]; 0 without inertia: nothing.
    inertia_kg_m2: about its own centre. centre_of_mass_m: from the tip, along and across its
    tangent [m]; None: where the payload before had it. What is taken up was at rest; what is let go
    flies on. Raises InputError for other arguments.
    """

    at_s: float
    mass_kg: float
    inertia_kg_m2: float = 0.0
    centre_of_mass_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "at_s", number(self.at_s, "at_s"))
        for name, unit in (("mass_kg", "kilograms"), ("inertia_kg_m2", "kg m^2")):
            expected = f"expected a number in {unit}, {BOUNDS[name]}"
            found = number(getattr(self, name), name, expected)
            if not BOUNDS[name].hold(found):
                raise InputError(expected, key=name, value=found)
            object.__setattr__(self, name, found)
        if self.centre_of_mass_m is not None:
            expected = "expected two numbers in metres, along and across the tip's tangent"
            centre = array(self.centre_of_mass_m, "centre_of_mass_m", expected, (2,))
            if not all(map(BOUNDS["centre_of_mass_m"].hold, centre)):
                expected = f"{expected}, {BOUNDS['centre_of_mass_m']}"
                raise InputError(expected, key="centre_of_mass_m", value=centre.tolist())
            object.__setattr__(self, "centre_of_mass_m", tuple(map(float, centre)))

    def spec(self) -> Tables:
        """Its table of a manoeuvre file."""
        out: Tables = {
            "at_s": self.at_s,
            "mass_kg": self.mass_kg,
            "inertia_kg_m2": self.inertia_kg_m2,
        }
        centre = self.centre_of_mass_m
        return out if centre is None else out | {"centre_of_mass_m": list(centre)}


PayloadsLike: TypeAlias = PayloadChange | Tables | Sequence[PayloadChange | Tables] | None


def as_payloads(value: PayloadsLike, start: float, end: float) -> tuple[PayloadChange, ...]:
    """The changes of the payload in a run.

    Args:
        value: None, a PayloadChange, or a list of them or of tables.
        start: begin of the run [s].
        end: end of the run [s].

    Returns:
        The changes, in order of time.

    Raises:
        InputError: anything else, an instant outside the run, or instants that do not ascend.
    """
    if value is None:
        return ()
    entries: Any = [value] if isinstance(value, PayloadChange | dict) else value
    if isinstance(entries, str | bytes) or not isinstance(entries, Sequence):
        raise InputError(EXPECTED, key="payloads", value=value)
    out: list[PayloadChange] = []
    for i, entry in enumerate(entries, 1):
        change = payload_from_table(entry, i) if isinstance(entry, dict) else entry
        if not isinstance(change, PayloadChange):
            raise InputError(EXPECTED, key="payloads", value=entry)
        key = f"payload[{i}].at_s"
        if not start < change.at_s < end:
            text = f"expected an instant within the run, after {start:g} s and before {end:g} s"
            raise InputError(text, key=key, value=change.at_s)
        if out and not out[-1].at_s < change.at_s:
            text = f"expected instants that ascend, here one after {out[-1].at_s:g} s"
            raise InputError(text, key=key, value=change.at_s)
        out.append(change)
    return tuple(out)


def payload_from_table(entry: Any, i: int) -> PayloadChange:
    """A change from its table [[payload]] of a manoeuvre file.

    Args:
        entry: the table.
        i: its number, from 1.

    Returns:
        The change.

    Raises:
        InputError: an unknown, a missing or a wrong value; it names the key.
    """
    key = f"payload[{i}]"
    if not isinstance(entry, dict):
        raise InputError("expected a table", key=key, value=entry)
    for name, value in entry.items():
        if name not in KEYS:
            text = f"an unknown key; known here: {', '.join(KEYS)}"
            raise InputError(text, key=f"{key}.{name}", value=value)
    for name, what in (("at_s", "the instant in seconds"), ("mass_kg", "the mass in kilograms")):
        if name not in entry:
            raise InputError(f"missing: expected {what}", key=f"{key}.{name}")
    try:
        return PayloadChange(**entry)
    except InputError as error:
        raise InputError(error.expected, key=f"{key}.{error.key}", value=error.value) from None
