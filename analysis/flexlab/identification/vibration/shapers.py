"""Input shapers for a measured mode, as files that `flexura simulate` and `flexura bench inverse`
take."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import flexura as fx
from flexura.errors import InputError
from flexura.io import read_toml
from flexura.signals import Drive, Signal, ei, zv, zvd

KINDS = {"zv": zv, "zvd": zvd, "ei": ei}
AT_REST = 1e-9  # m/s or rad/s: a motion that is slower at its end comes to rest there
_KEYS = ("kind", "frequency_Hz", "damping_ratio", "tolerance")


@dataclass(frozen=True)
class Shaper:
    """One of KINDS for a mode of undamped frequency [Hz] and damping ratio; `tolerance` of EI."""

    kind: str
    frequency_Hz: float
    damping_ratio: float
    tolerance: float = 0.05

    def shape(self, signal: Signal) -> Signal:
        """The shaped signal."""
        own = {"tolerance": self.tolerance} if self.kind == "ei" else {}
        return KINDS[self.kind](signal, self.frequency_Hz, self.damping_ratio, **own)

    def tables(self) -> dict[str, Any]:
        """What a file holds."""
        own = {
            "kind": self.kind,
            "frequency_Hz": self.frequency_Hz,
            "damping_ratio": self.damping_ratio,
        }
        return {"shaper": own | ({"tolerance": self.tolerance} if self.kind == "ei" else {})}

    @property
    def lengthens_s(self) -> float:
        """What a motion gets longer by: half a damped period for ZV, else a whole one [s]."""
        damped = self.frequency_Hz * (1 - self.damping_ratio**2) ** 0.5
        return (0.5 if self.kind == "zv" else 1.0) / damped


def read_shaper(path: str | Path) -> Shaper:
    """Read a shaper's file.

    Raises:
        InputError: by file, key and value, for what is wrong in it.
    """
    tables = read_toml(path)
    file = str(path)
    table = tables.get("shaper")
    if not isinstance(table, dict) or set(tables) != {"shaper"}:
        raise InputError("missing: expected one table [shaper]", key="shaper", file=file)
    for key, value in table.items():
        if key not in _KEYS:
            expected = f"an unknown key; known here: {', '.join(_KEYS)}"
            raise InputError(expected, key=f"shaper.{key}", value=value, file=file)
    kind = table.get("kind")
    if kind not in KINDS:
        raise InputError(
            f"expected one of {', '.join(KINDS)}", key="shaper.kind", value=kind, file=file
        )
    found = {}
    for key, default in (("frequency_Hz", None), ("damping_ratio", 0.0), ("tolerance", 0.05)):
        value = table.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError("expected a number", key=f"shaper.{key}", value=value, file=file)
        found[key] = float(value)
    if "tolerance" in table and kind != "ei":
        raise InputError(
            "expected no tolerance: only ei has one",
            key="shaper.tolerance",
            value=table["tolerance"],
            file=file,
        )
    made = Shaper(str(kind), **found)
    try:
        made.shape(fx.signals.step(1.0))
    except InputError as error:
        raise InputError(
            error.expected, key=f"shaper.{error.key}", value=error.value, file=file
        ) from None
    return made


def shaped(asked: fx.Manoeuvre, shaper: Shaper) -> fx.Manoeuvre:
    """A manoeuvre whose motions are shaped, longer by what the shaper takes.

    Raises:
        InputError: no joint has a motion, or one goes on at the manoeuvre's end.
    """
    joints = asked.drive.joints
    if all(joint.motion is None for joint in joints):
        raise InputError("missing: no joint has a motion that could be shaped", key="motion")
    for number, joint in enumerate(joints, 1):
        speed = 0.0 if joint.motion is None else joint.motion(asked.duration_s)[1]
        if abs(speed) > AT_REST:
            raise InputError(
                f"expected a motion that comes to rest: at the manoeuvre's end, "
                f"{asked.duration_s:g} s, this one goes on",
                key=f"joint[{number}].motion",
                value=speed,
            )
    new = [j if j.motion is None else replace(j, motion=shaper.shape(j.motion)) for j in joints]
    duration = asked.duration_s + shaper.lengthens_s
    return replace(asked, duration_s=duration, drive=Drive(tuple(new)))
