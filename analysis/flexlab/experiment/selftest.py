"""The self-test before an experiment: may this board, as it is wired, be armed?

Nothing moves in it. `Link.connect` compares the declaration's hash when the session opens. The
self-test checks pins, configuration, faults, the proof of the emergency stop, supply, switches,
encoders and the strip's sensor at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..board.base import BoardError
from ..board.commissioning import Program, program, where
from ..board.protocol.declaration import FAULTS, PINS_HASH, Fault, Flag, Result, State
from ..board.protocol.session import Identity, Link, Refused
from ..recordings.unit_conversion import DEFLECTION_SENSORS, Sensor, flex_reading
from ..rig import Check
from ..rig.board_axes import board_axes
from .flash import as_float32

REST_S = 0.4  # how long the rig is watched at rest
BENT_M = 0.03  # a tip deflection at rest that is no drift of the sensor any more


@dataclass(frozen=True)
class Rest:
    """The sensor's reading with the strip at rest.

    `zero`: mean. `noise`: standard deviation of one report. `reports`: their number.
    """

    zero: float
    noise: float
    reports: int

    def spec(self) -> dict[str, Any]:
        """As a table for session.json."""
        return vars(self)


def prepare(
    link: Link,
    identity: Identity,
    stored: dict[str, float],
    wanted: dict[str, float],
    write: bool,
    commission: Callable[[Link], Program],
) -> list[Check]:
    """Bring the board to Idle with the settings of the experiment.

    Args:
        link: the session with the board.
        identity: what the board says of itself.
        stored: the rig file's settings. A board that has others is refused, unless `write` is set.
        wanted: the experiment's settings. Those that differ are in use until the next reset and not
            stored.
        write: whether the rig file's settings may be written and stored.
        commission: has the emergency stop pressed, if it is not proven with the board's firmware.

    Returns:
        The checks, up to the first that failed.

    Raises:
        BoardError: the board does not keep what was written.
    """
    link.command("stop")
    link.run(0.01)
    fault = Fault(link.newest["fault"])
    found = link.read_configuration()
    differing = [name for name, value in stored.items() if found[name] != as_float32(value)]
    runs = program(link)
    out = [
        Check(
            "pins",
            runs.pins_are_declared,
            f"{runs.pins:08x}",
            f"{PINS_HASH:08x}, those of protocol.toml",
            "load the firmware of this declaration: flexura flash",
        ),
        Check(
            "declaration",
            True,
            f"{identity.declaration:08x}, firmware {identity.firmware}",
            "this program's",
        ),
        Check(
            "configuration",
            not differing or write,
            _some(differing) if differing else "the rig file's",
            "the rig file's",
            "flexura flash --configure",
        ),
    ]
    if not all(finding.passed for finding in out):
        return out
    if differing:
        link.write_configuration(
            {name: stored[name] for name in differing} if fault is Fault.none else stored
        )
    if fault is not Fault.none:
        try:
            link.command("clear", fault=fault)
            out.append(Check("fault", True, f"{fault.name} of before, cleared", "none that lasts"))
        except Refused as refused:
            if refused.result is Result.fault_persists:  # perhaps because of another one
                fault = Fault(refused.detail)
            out.append(
                Check(
                    "fault",
                    False,
                    f"{fault.name}: {FAULTS[fault][0]}",
                    "none that lasts",
                    FAULTS[fault][1],
                )
            )
            return out
    out.append(_stop_proof(commission(link)))
    if not out[-1].passed:
        return out
    special = {
        name: value
        for name, value in wanted.items()
        if as_float32(value) != as_float32(stored[name])
    }
    link.write_configuration(special, save=False)
    back = link.read_configuration()
    wrong = [name for name, value in wanted.items() if back[name] != as_float32(value)]
    if wrong:
        raise BoardError(
            f"{link.board.label}: read back other values than written: {', '.join(wrong)}"
        )
    if special:
        out.append(
            Check("settings of this experiment", True, _some(list(special)), "in use, not stored")
        )
    return out


def _stop_proof(runs: Program) -> Check:
    trial = {"untried": "never pressed", "pressed": "open", "released": "not stored"}
    return Check(
        "emergency stop proven",
        runs.may_move,
        f"with firmware {runs.firmware:08x}" if runs.may_move else trial[runs.stop.name],
        "pressed and released once with this firmware",
        f"emergency_stop is at {where('emergency_stop')}: check its wire, press it and release it",
    )


def run_selftest(
    link: Link, settings: dict[str, float], sensor: Sensor
) -> tuple[list[Check], Rest]:
    """Watch the rig at rest.

    Args:
        link: the session with the board.
        settings: of the experiment, by name.
        sensor: of the strip, calibrated.

    Returns:
        The checks, and the sensor's reading at rest.

    Raises:
        BoardError: reports are missing.
    """
    link.telemetry()
    link.run(REST_S)
    seen = link.telemetry()
    if len(seen) < 10:
        raise BoardError(
            f"{link.board.label}: {len(seen)} reports in {REST_S:g} s; expected some "
            f"{round(500 * REST_S)}"
        )
    last, x = seen[-1], flex_reading(seen["flex"])
    rest = Rest(float(x.mean()), float(x.std(ddof=1)), len(x))
    supply = seen["supply"] / 1000
    flags = np.bitwise_or.reduce(seen["flags"])
    out = [
        Check("state", State(last["state"]) is State.idle, State(last["state"]).name, "idle"),
        Check(
            "supply",
            bool(
                settings["supply_min_V"] < supply.min() and supply.max() < settings["supply_max_V"]
            ),
            f"{supply.min():.2f} to {supply.max():.2f} V",
            f"{settings['supply_min_V']:g} to {settings['supply_max_V']:g} V",
            "switch the motor supply on; check its fuse",
        ),
    ]
    for flag in (Flag.emergency_stop, Flag.limit_low, Flag.limit_high):
        fault = FAULTS[Fault[flag.name]]
        open_ = bool(flags >> flag & 1)
        out.append(
            Check(
                flag.name.replace("_", " "),
                not open_,
                "open" if open_ else "closed",
                "closed",
                fault[1],
            )
        )
    for axis in board_axes(settings):
        if not axis.encoder:
            continue
        number = axis.number
        counts = seen[f"position_{number}"]
        spread = int(counts.max() - counts.min())
        found = "still" if spread <= 1 else f"moved by {spread} counts"
        out.append(
            Check(
                f"encoder {number}",
                spread <= 1,
                found,
                "still",
                "nothing may move before the start; check its wires",
            )
        )
    missed = int(seen["missed"][-1] - seen["missed"][0])
    out.append(Check("missed edges", missed == 0, str(missed), "0", "check the encoders' wires"))
    if sensor.kind:
        low, high = settings["flex_min"], settings["flex_max"]
        out.append(
            Check(
                sensor.kind.replace("_", " ") + (" sensor" if sensor.kind == "flex" else ""),
                bool(low < x.min() and x.max() < high),
                f"{rest.zero:.4f} +- {rest.noise:.4f}",
                f"{low:g} to {high:g}",
                "check the sensor and its wires",
            )
        )
    if sensor.kind in DEFLECTION_SENSORS:
        tip = float(sensor.tip(np.asarray(rest.zero)))
        out.append(
            Check(
                "strip at rest",
                abs(tip) < BENT_M,
                f"{1e3 * tip:.1f} mm by the calibration",
                f"within {1e3 * BENT_M:g} mm",
                "free the strip, or calibrate: flexura bench calibrate",
            )
        )
    return out, rest


def _some(names: list[str]) -> str:
    more = f" and {len(names) - 4} more" if len(names) > 4 else ""
    return f"{len(names)} differ: {', '.join(names[:4])}{more}"
