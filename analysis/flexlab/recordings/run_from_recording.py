"""The Run of a recording, from the received bytes and the host's notes only.

The same function ends every experiment and recovers one whose host was killed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.io.drawing import with_poses

from ..board.protocol import messages
from ..board.protocol.declaration import CONTROL_HZ, FAULTS, MESSAGES, Fault, Mode, State
from ..board.protocol.frames import Deframer
from ..board.protocol.player import Knots
from ..rig.board_axes import BoardAxis, board_axes
from . import recording
from .delay_estimation import estimate_delay
from .strip_sensor import sensor_of_session
from .unit_conversion import DEFLECTION_SENSORS, channels_of_reports, start_tick, units_of

TICK = slice(messages.HEAD_BYTES, messages.HEAD_BYTES + 4)  # the first field of a report
UNEXPLAINED = "the host ended without a word; rebuilt from what had been received"


def run_from_recording(folder: str | Path) -> fx.Run:
    """Read a recording and make its Run.

    Args:
        folder: the recording.

    Raises:
        InputError: there is no recording, or no report in it.
    """
    stored = recording.read(folder)
    session = stored.session
    knots = knots_from(session["knots"])
    settings = session["settings"]
    deframer = Deframer()
    reports, numbers = _reports(deframer.feed(stored.received))
    if not len(reports):
        raise fx.InputError(
            "no report of the board was received in this recording", file=str(folder)
        )
    sensor, axes = sensor_of_session(session), board_axes(settings)
    start_found = start_tick(reports, knots, settings)
    start, uncertainty_s = (
        start_found if start_found is not None else (float(reports["tick"][0]), 0.0)
    )
    within = _within(reports, start)
    reports = reports[within]
    ticks, values = channels_of_reports(reports, knots.mode, settings, sensor, numbers[within])
    t = (ticks - start) / CONTROL_HZ
    missing = len(t) - len(reports)
    end_events = [event for event in stored.events if event.get("ended")]
    events = _events_from_host(stored.events, start, float(t[-1])) + _events_from_board(
        reports, start
    )
    if start_found is None:
        events.append({"t": 0.0, "text": "nothing was moved", "level": "WARN"})
    if missing:
        events.append(
            {
                "t": float(t[-1]),
                "text": f"{missing} of {len(t)} reports did not arrive: NaN",
                "level": "WARN",
            }
        )
    if stored.lost_events:
        text = f"{stored.lost_events} lines of the host's events are damaged, and left out"
        events.append({"t": float(t[-1]), "text": text, "level": "WARN"})
    if not end_events:
        events.append({"t": float(t[-1]), "text": UNEXPLAINED, "level": "ERROR"})
    meta = {key: value for key, value in session.items() if key != "settings"} | {
        "complete": bool(end_events and end_events[-1]["complete"]),
        "events": sorted(events, key=lambda event: event["t"]),
        "settings": settings,
        "start_uncertainty_s": uncertainty_s,
        "line": {
            "reports": len(reports),
            "missing": missing,
            "bad_frames": deframer.bad,
            "bytes": len(stored.received),
        },
    }
    if sensor.kind in DEFLECTION_SENSORS:
        known = ", calibration" if sensor.calibration.covariance else "; calibration unknown"
        meta["tip_deflection_std"] = f"noise, resolution, zero{known}"
    run = fx.Run(t, values, units_of(axes, sensor.strip, sensor.kind), meta)
    run = _with_tip(run)
    meta["delays"] = _delays(run, knots.mode, axes)
    return run


def knots_from(spec: dict[str, Any]) -> Knots:
    """Knots from their table in session.json."""
    return Knots(
        Mode(spec["mode"]),
        spec["period_log2"],
        {name: np.array(v) for name, v in spec["columns"].items()},
    )


def knots_spec(knots: Knots) -> dict[str, Any]:
    """Knots as a table for session.json."""
    columns = {name: np.asarray(values).tolist() for name, values in knots.columns.items()}
    return {"mode": int(knots.mode), "period_log2": knots.period_log2, "columns": columns}


def _reports(payloads: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """The reports, and their numbers, of the session in which the board ran, else of the last one.

    The board introduces itself at the start of each session and after each reset, and counts its
    reports anew. If that message is lost, a tick that does not increase tells of a reset.
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
        (messages.reports([messages.body(p) for p in stored]), stored)
        for stored in sessions
        if stored
    ]
    if not found:
        return messages.reports([]), np.zeros(0, dtype=np.int64)
    reports, stored = next(
        (pair for pair in reversed(found) if (pair[0]["state"] == State.running).any()), found[-1]
    )
    return reports, np.array([p[1] | p[2] << 8 for p in stored], dtype=np.int64)


def _within(reports: np.ndarray, start: float) -> slice:
    """Reports from the start on: to the end if the board had a fault, else while it ran."""
    first = int(np.searchsorted(reports["tick"].astype(np.int64), start))
    running = np.flatnonzero(reports["state"] == State.running)
    faulted = (reports["state"][first:] == State.fault).any()
    return slice(first, len(reports) if faulted or not len(running) else int(running[-1]) + 1)


def _events_from_host(
    events: list[dict[str, Any]], start: float, end: float
) -> list[dict[str, Any]]:
    """The host's events in the run's time; those without a tick at its end."""
    return [
        {
            "t": end if e.get("tick") is None else max((e["tick"] - start) / CONTROL_HZ, 0.0),
            "text": e["text"],
            "level": e["level"],
        }
        for e in events
    ]


def _events_from_board(reports: np.ndarray, start: float) -> list[dict[str, Any]]:
    """A fault, from the board's own reports."""
    faulted = reports[reports["state"] == State.fault]
    if not len(faulted):
        return []
    fault = Fault(faulted["fault"][0])
    at = max((int(faulted["fault_tick"][0]) - start) / CONTROL_HZ, 0.0)
    return [
        {"t": at, "text": f"board: fault {fault.name}: {' '.join(FAULTS[fault])}", "level": "ERROR"}
    ]


def _with_tip(run: fx.Run) -> fx.Run:
    """Add the tip in the base frame, from the joints' encoders and the strip's sensor.

    A flexible link without a sensor counts as straight.
    """
    placed, _ = with_poses(run)
    names = ("tip/x", "tip/y")
    return dataclasses.replace(
        run,
        channels=run.channels | {name: placed[name] for name in names},
        units=run.units | dict.fromkeys(names, "m"),
    )


def _followed(mode: Mode, axes: Sequence[BoardAxis]) -> Iterator[tuple[str, str]]:
    """Channels, and what each follows: a set-point, a motor's voltage, a stepper's pulses."""
    for axis in axes:
        name = f"joint/{axis.number}"
        if mode is Mode.position:
            yield f"{name}/position", f"{name}/reference"
        elif axis.kind == "motor":
            yield f"{name}/velocity", axis.command
        else:
            yield f"{name}/position", axis.command


def _delays(run: fx.Run, mode: Mode, axes: Sequence[BoardAxis]) -> dict[str, Any]:
    """The delay of each channel behind what it follows."""
    out = {}
    for channel, command in _followed(mode, axes):
        if found := estimate_delay(run.t, run[command], run[channel]):
            out[channel] = {
                "behind": command,
                **{key: float(value) for key, value in vars(found).items()},
            }
    return out
