"""The Run of a recording: from the bytes that were received and from what the host noted, and from
nothing else.

The same function ends every experiment and recovers one whose host was killed.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx

from ..board.protocol import messages
from ..board.protocol.declaration import CONTROL_HZ, FAULTS, MESSAGES, Fault, Mode, State
from ..board.protocol.frames import Deframer
from ..board.protocol.player import Knots
from ..rig.description import Calibration
from ..runs.poses import with_poses
from . import recording
from .delay_estimation import delay
from .unit_conversion import UNITS, Sensor, channels, start_tick

TICK = slice(messages.HEAD_BYTES, messages.HEAD_BYTES + 4)  # the first field of a report
UNTOLD = "the host ended without a word; rebuilt from what had been received"
_FOLLOWED = {  # what a channel follows
    Mode.position: {
        "joint/1/position": "joint/1/reference",
        "joint/2/position": "joint/2/reference",
    },
    Mode.open_loop: {"joint/1/velocity": "joint/1/voltage", "joint/2/position": "joint/2/pulses"},
}


def rebuild(folder: str | Path) -> fx.Run:
    """Read a recording and make its Run. Raises InputError where there is no recording or nothing
    was received in it."""
    kept = recording.read(folder)
    session = kept.session
    knots = knots_from(session["knots"])
    settings, rest = session["settings"], session.get("rest")
    deframer = Deframer()
    reports, numbers = _reports(deframer.feed(kept.received))
    if not len(reports):
        raise fx.InputError(
            "no report of the board was received in this recording", file=str(folder)
        )
    calibration = Calibration.model_validate(session["calibration"])
    sensor = Sensor(calibration, **rest) if rest else Sensor(calibration, calibration.zero)
    begun = start_tick(reports, knots, settings)
    start, unsure_s = begun if begun is not None else (float(reports["tick"][0]), 0.0)
    during = _during(reports, start)
    reports = reports[during]
    ticks, values = channels(reports, knots.mode, settings, sensor, numbers[during])
    t = (ticks - start) / CONTROL_HZ
    missing = len(t) - len(reports)
    ended = [event for event in kept.events if event.get("ended")]
    events = _told(kept.events, start, float(t[-1])) + _seen(reports, start)
    if begun is None:
        events.append({"t": 0.0, "text": "nothing was moved", "level": "WARN"})
    if missing:
        events.append(
            {
                "t": float(t[-1]),
                "text": f"{missing} of {len(t)} reports did not arrive: NaN",
                "level": "WARN",
            }
        )
    if not ended:
        events.append({"t": float(t[-1]), "text": UNTOLD, "level": "ERROR"})
    meta = {key: value for key, value in session.items() if key != "settings"} | {
        "complete": bool(ended and ended[-1]["complete"]),
        "events": sorted(events, key=lambda event: event["t"]),
        "settings": settings,
        "start_uncertainty_s": unsure_s,
        "line": {
            "reports": len(reports),
            "missing": missing,
            "bad_frames": deframer.bad,
            "bytes": len(kept.received),
        },
        "tip_deflection_std": "noise, resolution, zero"
        + (", calibration" if calibration.covariance else "; calibration unknown"),
    }
    run = _with_tip(fx.Run(t, values, dict(UNITS), meta))
    meta["delays"] = _delays(run, knots.mode)
    return run


def knots_from(spec: dict[str, Any]) -> Knots:
    return Knots(
        Mode(spec["mode"]),
        spec["period_log2"],
        {name: np.array(v) for name, v in spec["columns"].items()},
    )


def knots_spec(knots: Knots) -> dict[str, Any]:
    columns = {name: np.asarray(values).tolist() for name, values in knots.columns.items()}
    return {"mode": int(knots.mode), "period_log2": knots.period_log2, "columns": columns}


def _reports(payloads: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """The reports, and their numbers, of the session in which the board ran; of the last one, if it
    ran in none.

    The board introduces itself at the beginning of each session and after each reset, and counts
    its reports anew; where that was lost, a tick that is no later than the last tells of a reset.
    """
    code, size = MESSAGES["telemetry"].code, messages.HEAD_BYTES + messages.TELEMETRY.itemsize
    sessions: list[list[bytes]] = [[]]
    last = -1
    for payload in payloads:
        if payload[0] == code and len(payload) == size:
            tick = int.from_bytes(payload[TICK], "little")
            if tick <= last:
                sessions.append([])
            last = tick
            sessions[-1].append(payload)
        elif payload[0] == MESSAGES["identity"].code:
            sessions.append([])
            last = -1
    found = [
        (messages.reports([messages.body(p) for p in kept]), kept) for kept in sessions if kept
    ]
    if not found:
        return messages.reports([]), np.zeros(0, dtype=np.int64)
    reports, kept = next(
        (pair for pair in reversed(found) if (pair[0]["state"] == State.running).any()), found[-1]
    )
    return reports, np.array([p[1] | p[2] << 8 for p in kept], dtype=np.int64)


def _during(reports: np.ndarray, start: float) -> slice:
    """From the start on; to the end where the board had a fault, else as long as it ran."""
    first = int(np.searchsorted(reports["tick"].astype(np.int64), start))
    running = np.flatnonzero(reports["state"] == State.running)
    faulted = (reports["state"][first:] == State.fault).any()
    return slice(first, len(reports) if faulted or not len(running) else int(running[-1]) + 1)


def _told(events: list[dict[str, Any]], start: float, end: float) -> list[dict[str, Any]]:
    """The host's events in the run's time; those without a tick at its ends."""
    return [
        {
            "t": end if e.get("tick") is None else max((e["tick"] - start) / CONTROL_HZ, 0.0),
            "text": e["text"],
            "level": e["level"],
        }
        for e in events
    ]


def _seen(reports: np.ndarray, start: float) -> list[dict[str, Any]]:
    """A fault, as the board's own reports tell it."""
    faulted = reports[reports["state"] == State.fault]
    if not len(faulted):
        return []
    fault = Fault(faulted["fault"][0])
    at = max((int(faulted["fault_tick"][0]) - start) / CONTROL_HZ, 0.0)
    return [
        {"t": at, "text": f"board: fault {fault.name}: {' '.join(FAULTS[fault])}", "level": "ERROR"}
    ]


def _with_tip(run: fx.Run) -> fx.Run:
    """The tip in the base frame from the joints' encoders and the flex sensor."""
    placed, _ = with_poses(run)
    names = ("tip/x", "tip/y")
    return dataclasses.replace(
        run,
        channels=run.channels | {name: placed[name] for name in names},
        units=run.units | dict.fromkeys(names, "m"),
    )


def _delays(run: fx.Run, mode: Mode) -> dict[str, Any]:
    """By how much each channel lags behind what it follows."""
    out = {}
    for channel, command in _FOLLOWED[mode].items():
        if found := delay(run.t, run[command], run[channel]):
            out[channel] = {
                "behind": command,
                **{key: float(value) for key, value in vars(found).items()},
            }
    return out
