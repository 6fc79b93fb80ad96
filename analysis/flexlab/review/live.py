"""A live view of an experiment: a Rerun server on this machine that a viewer may join late, or
never, or leave.

Rerun's calls take milliseconds: they are made in a thread of their own, from a queue, so that the
board's line does not wait.
"""

from __future__ import annotations

import queue
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from flexura.optional import Optional

if TYPE_CHECKING:
    import rerun as rr
else:
    rr = Optional("rerun")
from flexura.optional import Optional

if TYPE_CHECKING:
    import rerun.blueprint as rrb
else:
    rrb = Optional("rerun.blueprint")

import flexura as fx
from flexura.errors import InputError
from flexura.io.drawing import with_poses

from ..board.protocol.declaration import CONTROL_HZ, State
from ..experiment.plan import Plan
from ..recordings.unit_conversion import DEFLECTION_SENSORS, Sensor, channels_of_reports, units_of
from ..rig.board_axes import board_axes
from .writer import times

HOST = "127.0.0.1"
MEMORY = "500MB"  # what the server keeps for viewers that join late
POINTS = 9  # of a flexible link's line, as in a run's deflection channels
COLOURS = ((32, 164, 84), (150, 150, 150), (160, 84, 204))  # measured, asked, commanded


@contextmanager
def serve(
    plan: Plan, sensor: Sensor, robot: fx.Robot, title: str, port: int
) -> Iterator[Callable[[np.ndarray, float], None]]:
    """Serve the view while the context lasts; it gives what takes new reports. Raises InputError
    for a port in use."""
    _free(port)
    waiting: queue.Queue[np.ndarray | None] = queue.Queue()
    with rr.RecordingStream("flexura-live") as rec:
        rec.set_sinks(
            rr.GrpcServerSink(HOST, port, server_memory_limit=MEMORY),
            default_blueprint=_blueprint(title, robot, plots(plan, sensor)),
        )
        rec.set_log_time_enabled(False)
        rec.send_recording_name(title)
        _style(rec, title, plots(plan, sensor))
        writer = threading.Thread(
            target=_write, args=(rec, waiting, plan, sensor, robot), name="live view", daemon=True
        )
        writer.start()
        try:
            yield lambda reports, part: waiting.put(reports) if len(reports) else None
        finally:
            waiting.put(None)
            writer.join(timeout=5.0)
            rec.flush()
            rec.disconnect()


def _free(port: int) -> None:
    """Rerun itself says nothing when it cannot have the port."""
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((HOST, port))
        except (OSError, OverflowError) as error:
            expected = (
                f"cannot be had ({getattr(error, 'strerror', None) or error}): expected a "
                f"free TCP port"
            )
            raise InputError(expected, key="--live-port", value=port) from None


def plots(plan: Plan, sensor: Sensor) -> dict[str, list[str]]:
    """The plots of a live view: titles, and the channels in each."""
    axes = board_axes(plan.settings)
    out = {}
    for axis in axes:
        n = f"joint/{axis.number}"
        names = [f"{n}/position", f"{n}/reference"]
        out[f"joint {axis.number} [{axis.unit}]"] = names + [axis.command] * (
            axis.kind == "stepper"
        )
    if sensor.kind in DEFLECTION_SENSORS:
        out["tip deflection [m]"] = [f"link/{sensor.strip}/tip_deflection"]
    elif sensor.kind:
        out["acceleration [m/s^2]"] = ["sensor/accelerometer"]
    motors = [axis.command for axis in axes if axis.kind == "motor"]
    return out | {"motor voltage [V]": motors}


def _blueprint(title: str, robot: fx.Robot, shown: dict[str, list[str]]) -> rrb.Blueprint:
    reach = sum(link.length_m for link in robot.links)
    low, high = robot.links[0].joint.limits or (0.0, 0.0)
    half = 0.6 * reach
    bounds = rrb.VisualBounds2D(
        x_range=[low - 0.1 * reach, high + 1.1 * reach], y_range=[-half, half]
    )
    plots = [
        rrb.TimeSeriesView(origin="/", contents=[f"/experiment/{c}" for c in names], name=name)
        for name, names in shown.items()
    ]
    arm = rrb.Spatial2DView(
        origin="/", contents=["/experiment/arm"], name=title, visual_bounds=bounds
    )
    about = rrb.TextDocumentView(origin="/about", name="about")
    return rrb.Blueprint(
        rrb.Vertical(rrb.Horizontal(arm, about, column_shares=[3, 1]), rrb.Grid(*plots)),
        rrb.TimePanel(timeline="time", state="collapsed", play_state="following"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _style(rec: rr.RecordingStream, title: str, shown: dict[str, list[str]]) -> None:
    text = (
        f"# {title}\n\nLive. The recording itself is in the run's folder.\n\nGreen: measured. "
        f"Grey: set-point. Violet: pulses."
    )
    rec.log("about", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
    thick: Any = rr.Radius.ui_points(3.0)
    style = rr.LineStrips2D.from_fields(colors=[COLOURS[0]], radii=[thick])
    rec.log("experiment/arm", style, static=True)
    # a 2D view's y points down
    rec.log("experiment/arm", rr.Transform3D(scale=[1.0, -1.0, 1.0]), static=True)
    for names in shown.values():
        for name, colour in zip(names, COLOURS, strict=False):
            kind = name.rpartition("/")[2].replace("_", " ")
            rec.log(
                f"experiment/{name}",
                rr.SeriesLines(colors=[colour], widths=[1.8], names=[kind]),
                static=True,
            )


def _write(
    rec: rr.RecordingStream, waiting: queue.Queue[Any], plan: Plan, sensor: Sensor, robot: fx.Robot
) -> None:
    start: int | None = None
    while (reports := waiting.get()) is not None:
        if start is None:
            running = reports["tick"][reports["state"] == State.running]
            start = int(running[0]) if len(running) else None
        if start is None:
            continue
        ticks, values = channels_of_reports(reports, plan.knots.mode, plan.settings, sensor)
        index = times((ticks - start) / CONTROL_HZ, ticks - start)
        for names in plots(plan, sensor).values():
            for name in names:
                if np.isfinite(values[name]).any():
                    rec.send_columns(
                        f"experiment/{name}", index, rr.Scalars.columns(scalars=values[name])
                    )
        line = _arm({name: v[-1:] for name, v in values.items()}, robot, sensor, plan)
        if np.isfinite(line).all():
            strip = rr.LineStrips2D.columns(strips=[line.astype(np.float32)])
            rec.send_columns(
                "experiment/arm",
                times((ticks[-1:] - start) / CONTROL_HZ, ticks[-1:] - start),
                strip,
            )


def _arm(values: dict[str, np.ndarray], robot: fx.Robot, sensor: Sensor, plan: Plan) -> np.ndarray:
    """The arm's line at one instant, (points, 2) in the base frame."""
    units = units_of(board_axes(plan.settings), sensor.strip, sensor.kind)
    run, _ = with_poses(fx.Run(np.zeros(1), values, units, {"robot": robot.to_dict()}))
    parts = []
    for i, link in enumerate(robot.links, 1):
        x, y, angle = (float(run[f"link/{i}/{part}"][0]) for part in ("x", "y", "angle"))
        along = np.linspace(0.0, link.length_m, POINTS if link.flexible else 2)
        names = [f"link/{i}/deflection/{k}" for k in range(len(along))]
        w = np.array([run[name][0] if name in run else 0.0 for name in names])
        c, s = np.cos(angle), np.sin(angle)
        parts.append(np.stack([x + along * c - w * s, y + along * s + w * c], axis=1))
    return np.concatenate(parts)
