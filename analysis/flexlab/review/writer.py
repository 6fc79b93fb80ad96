"""Writing a review: signals, shapes, events and the about page of one or two runs as columns of one
Rerun recording."""

from __future__ import annotations

import dataclasses
import hashlib
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexura.optional import Optional

if TYPE_CHECKING:
    import rerun as rr
else:
    rr = Optional("rerun")

from flexura.io import Run, write_bytes
from flexura.io.drawing import MAX_SAMPLES, curves, extent, frames, grid, thinned

from ..runs.deviation import TIP_DISTANCE, common, compared, deviation
from .layout import Scene, blueprint
from .seal import sealed_review
from .sources import (
    DEVIATION,
    NAMES,
    Source,
    against_experiment,
    curve_colour,
    entity,
    has_payload,
    lightened,
    order,
    sources,
)
from .summary_page import summary
from .ticks import Signal

CHUNK = 10_000  # rows a chunk: large enough to be quick, small enough to be loaded in parts
GHOST = (150, 150, 150)
DARK = (60, 60, 60)
LINES = (226, 228, 232)
LEVELS = {"INFO", "WARN", "ERROR", "DEBUG", "TRACE", "CRITICAL"}


def write(path: str | Path, groups: dict[str, Sequence[Run]]) -> Path:
    """Write the review of one group of runs, or a gallery of several by name; see
    `flexlab.review`."""
    # otherwise wrong lengths and shapes only warn, and the data is dropped
    rr.set_strict_mode(True)
    target = Path(path)
    parts = [_part(name if len(groups) > 1 else "", runs) for name, runs in groups.items()]
    scenes = [scene for _, scene in parts]
    # The viewer keeps a layout by application id: reviews with the same layout share one, others
    # must not.
    key = hashlib.sha1(repr(scenes).encode()).hexdigest()[:8]
    with rr.RecordingStream(f"flexura-review-{key}") as rec:
        # in memory: a thread of Rerun's that cannot write leaves the others waiting for ever
        held = rec.memory_recording()
        rec.send_blueprint(blueprint(scenes), make_active=False, make_default=True)
        rec.set_log_time_enabled(False)
        rec.send_recording_name("; ".join(dict.fromkeys(_title(shown) for shown, _ in parts)))
        rec.send_property(
            "review", rr.AnyValues(picture_time_s=picture_time([s.run for s in parts[0][0]]))
        )
        for shown, scene in parts:
            _write(rec, shown, scene)
        rec.flush()
        content = held.drain_as_bytes()
    write_bytes(target, sealed_review(content))
    return target


def _part(name: str, runs: Sequence[Run]) -> tuple[list[Source], Scene]:
    """The runs of one robot and what is recorded of them, under a root of their own where `name` is
    given."""
    shown = sources(runs)
    prefix = f"/{re.sub(r'[^a-z0-9]+', '_', name.lower()).strip('_')}" if name else ""
    shown = [dataclasses.replace(s, root=f"{prefix}/{s.root}".removeprefix("/")) for s in shown]
    return shown, _scene(shown, prefix, name)


def _title(shown: list[Source]) -> str:
    robot = shown[0].run.meta.get("robot", {}).get("name") or "robot"
    return f"{robot}: {' and '.join(s.label for s in shown)}"


def _scene(shown: list[Source], prefix: str, name: str) -> Scene:
    has_shape = [s.run for s in shown if s.has_shape]
    low, high = extent(has_shape) if has_shape else (np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    first = shown[0].run
    # Without one time in common, or with a gap all the way, there is no deviation to show.
    apart = {
        path: (name, other, values)
        for path, (name, other) in pairs(shown, prefix).items()
        if np.isfinite(values := deviation(first, other.run, name)[1]).any()
    }
    return Scene(
        sources=tuple((s.root, s.label, NAMES[s.colour], s.has_shape) for s in shown),
        signals={
            f"/{s.root}/{entity(name)}": Signal(
                s.run.units[name], _label(name, s.label, s.run.units[name]), *_range(s.run[name])
            )
            for s in shown
            for name in s.signals
            if np.isfinite(s.run[name]).any()
        },
        deviations={
            path: Signal(
                first.units.get(name, "m"),
                _distinct_label(name, [shown[0], other], first.units.get(name, "m")),
                *_range(values),
            )
            for path, (name, other, values) in apart.items()
        },
        events=any(s.run.meta.get("events") for s in shown),
        phases=tuple(s.root for s in shown if s.run.meta.get("phases")),
        low=(float(low[0]), float(low[1])),
        high=(float(high[0]), float(high[1])),
        prefix=prefix,
        name=name,
        measured=against_experiment(shown),
    )


def pairs(shown: list[Source], prefix: str) -> dict[str, tuple[str, Source]]:
    """The channels of deviations from the first run, and the other run, by their paths; of more
    than two runs with the other one's name in it."""
    many = len(shown) > 2
    return {
        f"{prefix}/deviation/{f'{other.root}/' if many else ''}{name}": (name, other)
        for other in shown[1:]
        for name in compared(shown[0].run, other.run)
    }


def _write(rec: rr.RecordingStream, shown: list[Source], scene: Scene) -> None:
    first = shown[0]
    samples = sum(len(s.run) for s in shown for _ in s.signals) + len(first.run) * len(
        scene.deviations
    )
    budget = (
        MAX_SAMPLES
        if samples <= MAX_SAMPLES
        else MAX_SAMPLES // max(len(scene.signals) + len(scene.deviations), 1)
    )
    for s in shown:
        rec.send_property(s.root.replace("/", "_"), rr.AnyValues(**_properties(s)))
        signals(rec, s, scene, budget)
        events(rec, s, scene)
        if s.has_shape:
            shape(rec, s, scene, s is not first)
    if any(s.has_shape for s in shown):
        ground(rec, scene)
    found = pairs(shown, scene.prefix)
    for other in shown[1:]:
        own = {path: name for path, (name, s) in found.items() if s is other}
        kept = [name for path, name in own.items() if path in scene.deviations]
        places = order(kept, first.run.units)
        for path, name in own.items():
            if path not in scene.deviations:
                continue
            t, values = deviation(first.run, other.run, name)
            step = np.flatnonzero(common(first.run, other.run))
            base = DEVIATION if len(shown) == 2 else other.colour
            colour = curve_colour(base, places[name])
            curve(rec, path, t, values, step, scene.deviations[path], colour, 1.8, budget)
    page = summary(shown, thinned_to=budget if samples > MAX_SAMPLES else None)
    rec.log(
        f"{scene.prefix}/about",
        rr.TextDocument(page, media_type=rr.MediaType.MARKDOWN),
        static=True,
    )


def signals(rec: rr.RecordingStream, s: Source, scene: Scene, budget: int) -> None:
    """One entity a channel, in a colour of the source's family; curves that share a plot differ."""
    places = order(s.signals, s.run.units)
    # The viewer draws curves in the order of their paths: those below are broader, to be seen where
    # both runs agree.
    roots = sorted(root for root, *_ in scene.sources)
    below = len(roots) > 1 and s.root == roots[0]
    width = 1.8 if len(roots) == 1 else (5.5 if scene.measured else 4.2) if below else 1.5
    for name in s.signals:
        path = f"/{s.root}/{entity(name)}"
        if path in scene.signals:
            colour = curve_colour(s.colour, places[name] + (3 if below and scene.measured else 0))
            curve(
                rec,
                path,
                s.run.t,
                s.run[name],
                np.arange(len(s.run)),
                scene.signals[path],
                colour,
                width,
                budget,
            )


def curve(
    rec: rr.RecordingStream,
    path: str,
    t: np.ndarray,
    y: np.ndarray,
    step: np.ndarray,
    signal: Signal,
    colour: Any,
    width: float,
    budget: int,
) -> None:
    """One signal: its style and unit once, its samples in chunks."""
    # The viewer draws the smallest and largest value of each pixel; by default it averages them.
    style = rr.SeriesLines(
        colors=[colour],
        widths=[width],
        names=[signal.label],
        aggregation_policy=rr.components.AggregationPolicy.MinMax,
    )
    rec.log(path, style, rr.AnyValues(unit=signal.unit), static=True)
    keep = thinned(y, budget)
    for a in range(0, len(keep), CHUNK):
        part = keep[a : a + CHUNK]
        rec.send_columns(
            path,
            times(t[part], step[part]),
            rr.Scalars.columns(scalars=np.asarray(y, dtype=np.float64)[part]),
        )


def shape(rec: rr.RecordingStream, s: Source, scene: Scene, over: bool) -> None:
    """The arm at frame rate, y up: ghost, links, joints and tip as columns; rail and tip path once.

    `over`: the second run, which is drawn slimmer and above the first, so that both are seen where
    they lie on each other.
    """
    size = scene.mark
    c = curves(s.run, frames(s.run.t), size)
    arm = f"/{s.root}/arm"
    index = times(s.run.t[c.index], c.index)
    rec.log(arm, rr.Transform3D(scale=[1.0, -1.0, 1.0]), static=True)  # a 2D view's y points down
    line: Any = rr.Radius.ui_points
    dot = (0.75 if has_payload(s.run) else 0.45) * size
    strips(rec, f"{arm}/undeformed", index, c.undeformed, GHOST, line(0.9), 10)
    strips(
        rec,
        f"{arm}/rigid",
        index,
        c.rigid,
        lightened(s.colour, 0.5),
        (0.25 if over else 0.45) * size,
        20 + over,
    )
    strips(
        rec, f"{arm}/deformed", index, c.deformed, s.colour, line(1.6 if over else 2.8), 30 + over
    )
    strips(rec, f"{arm}/sliders", index, c.sliders, DARK, line(1.3), 40)
    points(rec, f"{arm}/pins", index, c.pins, DARK, 0.55 * size, 41)
    points(rec, f"{arm}/pin_centres", index, c.pins, (255, 255, 255), 0.3 * size, 42)
    points(
        rec, f"{arm}/tip", index, c.tip[:, None], s.colour, dot * (0.6 if over else 1.0), 43 + over
    )
    if len(c.trace) > 1:
        path = rr.LineStrips2D(
            [c.trace.astype(np.float32)],
            colors=[lightened(s.colour, 0.75)],
            radii=[line(0.5 if over else 1.2)],
            draw_order=5.0 + over,
        )
        rec.log(f"{arm}/tip_path", path, static=True)
    if c.rail is not None:
        rail = rr.LineStrips2D(
            [c.rail.astype(np.float32)], colors=[GHOST], radii=[line(1.2)], draw_order=8.0
        )
        rec.log(f"{arm}/rail", rail, static=True)


def strips(
    rec: rr.RecordingStream,
    path: str,
    index: list[Any],
    lines: np.ndarray,
    colour: Any,
    radius: Any,
    order: float,
) -> None:
    """Polylines (F, n, points, 2); a line with a NaN is left out of its frame instead of staying
    from the frame before."""
    if lines.shape[1]:
        there = np.isfinite(lines).all(axis=(2, 3))
        rec.log(
            path,
            rr.LineStrips2D.from_fields(colors=[colour], radii=[radius], draw_order=order),
            static=True,
        )
        columns = rr.LineStrips2D.columns(strips=lines[there].astype(np.float32))
        rec.send_columns(path, index, columns.partition(there.sum(axis=1)))


def points(
    rec: rr.RecordingStream,
    path: str,
    index: list[Any],
    places: np.ndarray,
    colour: Any,
    radius: Any,
    order: float,
) -> None:
    """Points (F, n, 2), without those that are NaN."""
    if places.shape[1]:
        there = np.isfinite(places).all(axis=2)
        rec.log(
            path,
            rr.Points2D.from_fields(colors=[colour], radii=[radius], draw_order=order),
            static=True,
        )
        columns = rr.Points2D.columns(positions=places[there].astype(np.float32))
        rec.send_columns(path, index, columns.partition(there.sum(axis=1)))


def ground(rec: rr.RecordingStream, scene: Scene) -> None:
    """A square grid behind the arms and a bar with its length, so that the picture has a scale."""
    low, high = np.array(scene.low), np.array(scene.high)
    step, lines = grid(low, high)
    line: Any = rr.Radius.ui_points
    rec.log(f"{scene.prefix}/ground", rr.Transform3D(scale=[1.0, -1.0, 1.0]), static=True)
    squares = rr.LineStrips2D(
        lines.astype(np.float32), colors=[LINES], radii=[line(0.5)], draw_order=1.0
    )
    rec.log(f"{scene.prefix}/ground/grid", squares, static=True)
    start = low + [0.05, 0.12] * (high - low)
    bar = np.array([start, start + np.array([step, 0.0])], dtype=np.float32)
    style = rr.LineStrips2D(
        [bar],
        colors=[DARK],
        radii=[line(1.5)],
        labels=[f"{step:g} m"],
        show_labels=True,
        draw_order=50.0,
    )
    rec.log(f"{scene.prefix}/ground/scale", style, static=True)


def events(rec: rr.RecordingStream, s: Source, scene: Scene) -> None:
    """The run's events, each with the name of its source, and its phases."""
    listed = sorted(s.run.meta.get("events") or [], key=lambda e: e["t"])
    if listed:
        t = np.array([e["t"] for e in listed], dtype=float)
        text = [f"{e['t']:.3f} s  {s.label}: {e['text']}" for e in listed]
        levels = [
            level if (level := str(e.get("level", "INFO")).upper()) in LEVELS else "INFO"
            for e in listed
        ]
        step = np.clip(np.searchsorted(s.run.t, t), 0, len(s.run) - 1)
        where = f"{scene.prefix}/events/{s.root.rpartition('/')[2]}"
        rec.send_columns(where, times(t, step), rr.TextLog.columns(text=text, level=levels))
    phases = sorted(s.run.meta.get("phases") or [], key=lambda p: p["t"])
    if phases:
        t, names = np.array([p["t"] for p in phases], dtype=float), [str(p["name"]) for p in phases]
        kinds = list(dict.fromkeys(names))
        rec.log(f"/{s.root}/phase", rr.StateConfiguration(values=kinds, labels=kinds), static=True)
        step = np.clip(np.searchsorted(s.run.t, t), 0, len(s.run) - 1)
        rec.send_columns(f"/{s.root}/phase", times(t, step), rr.StateChange.columns(state=names))


def times(t: np.ndarray, step: np.ndarray) -> list[Any]:
    """Both timelines; seconds rounded to nanoseconds first, since TimeColumn truncates."""
    ns = np.rint(np.asarray(t, dtype=np.float64) * 1e9).astype("timedelta64[ns]")
    return [
        rr.TimeColumn("time", duration=ns),
        rr.TimeColumn("step", sequence=np.asarray(step, dtype=np.int64)),
    ]


def picture_time(runs: list[Run]) -> float:
    """The time [s] at which the first run's tip deflection is largest within all runs' time; the
    middle when nothing bends."""
    begin, end = max(run.t[0] for run in runs), min(run.t[-1] for run in runs)
    best, at = 0.0, float(runs[0].t[len(runs[0]) // 2])
    inside = (runs[0].t >= begin) & (runs[0].t <= end)
    for name in runs[0]:
        if re.fullmatch(r"link/\d+/tip_deflection", name) and inside.any():
            size = np.where(inside, np.nan_to_num(np.abs(runs[0][name])), 0.0)
            if size.max() > best:
                best, at = float(size.max()), float(runs[0].t[size.argmax()])
    return at


def _label(name: str, source: str, unit: str) -> str:
    """A curve's name in the legend: whose, from which run, in which unit."""
    return f"{_part_name(name)}, {source} [{unit}]"


def _distinct_label(name: str, shown: list[Source], unit: str) -> str:
    a, b = shown[0].label, shown[1].label
    return (
        f"distance between the tips [{unit}]"
        if name == TIP_DISTANCE
        else f"{_part_name(name)}, {b} − {a} [{unit}]"
    )


def _part_name(name: str) -> str:
    """`joint/1/position` -> "joint 1" (the plot says what is shown), `energy/strain` ->
    "strain"."""
    if found := re.fullmatch(r"(joint|link)/(\d+)/\w+", name):
        return f"{found[1]} {found[2]}"
    return name.removeprefix("energy/").replace("/", " ").replace("_", " ")


def _range(values: np.ndarray) -> tuple[float, float]:
    values = values[np.isfinite(values)]
    return float(values.min()), float(values.max())


def _properties(s: Source) -> dict[str, Any]:
    meta = s.run.meta
    kept = {
        key: value
        for key, value in meta.items()
        if isinstance(value, bool | int | float | str) and key not in ("source", "robot")
    }
    return {
        "label": s.label,
        "robot": str(meta.get("robot", {}).get("name", "")),
        "complete": s.run.complete,
        "samples": len(s.run),
    } | kept
