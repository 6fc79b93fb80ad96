"""The layout of a review: which views there are, and where; built from what was recorded, so that
no view is empty."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flexura.optional import Optional

from .ticks import LOW_PX, PLOT_PX, Signals, value_range

if TYPE_CHECKING:
    import rerun.blueprint as rrb
else:
    rrb = Optional("rerun.blueprint")

CURVES = 6  # in one plot; further joints or links go to further tabs
WIDE = 1.2  # from this ratio on, two pictures below each other are larger than two side by side
WHITE = (255, 255, 255)


@dataclass(frozen=True)
class Scene:
    """What is recorded of one robot: `sources` (root, label, colour's name, has shapes), curves by
    path, the arms' bounds [m], y up. In a gallery of several robots `name` is this one's and all
    its paths begin with `prefix`."""

    sources: tuple[tuple[str, str, str, bool], ...]
    signals: Signals
    deviations: Signals
    events: bool
    phases: tuple[str, ...]
    low: tuple[float, float]
    high: tuple[float, float]
    prefix: str = ""
    name: str = ""
    # an experiment beside its simulation: the dissertation's figures, each above its own deviation
    measured: bool = False

    @property
    def width(self) -> float:
        """Width of the picture [m]."""
        return self.high[0] - self.low[0]

    @property
    def height(self) -> float:
        """Height of the picture [m]."""
        return self.high[1] - self.low[1]

    @property
    def mark(self) -> float:
        """Half the length of a joint's mark [m]: the same share of every picture."""
        return 0.022 * max(self.width, self.height)


def blueprint(scenes: Sequence[Scene]) -> rrb.Blueprint:
    """One robot: its page. Several: all of them at a glance, and a tab for the page of each."""
    if len(scenes) == 1:
        root = _page(scenes[0])
    else:
        glance = rrb.Grid(*(_arms(scene)[0] for scene in scenes), name="all")
        root = rrb.Tabs(glance, *(_page(scene) for scene in scenes), active_tab=0)
    return rrb.Blueprint(
        root,
        rrb.TimePanel(timeline="time", state="collapsed", play_state="paused"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _page(scene: Scene) -> Any:
    """Arms and the about page above, plots over time below."""
    notes: list[Any] = [
        rrb.TextDocumentView(
            origin="/", contents=[f"{scene.prefix}/about"], name="about this review"
        )
    ]
    shares = [2.6]
    if scene.phases:
        notes.append(
            rrb.StateTimelineView(
                origin="/", contents=[f"/{root}/phase" for root in scene.phases], name="phases"
            )
        )
        shares.append(0.6 + 0.4 * len(scene.phases))
    if scene.events:
        notes.append(
            rrb.TextLogView(
                origin="/",
                contents=[f"{scene.prefix}/events/**"],
                name="events",
                columns=_log_columns(),
            )
        )
        shares.append(1.2)
    side = rrb.Vertical(*notes, row_shares=shares)
    if scene.measured and (figures := _figures(scene)):
        drawn = _arms(scene, apart=False)
        page = _tabs(notes)
        above = rrb.Horizontal(_tabs(drawn), page, column_shares=[3, 4]) if drawn else page
        return rrb.Vertical(
            above, rrb.Horizontal(*figures), row_shares=[5, 7], name=scene.name or None
        )
    upper = rrb.Horizontal(*(drawn := _arms(scene)), side, column_shares=_shares(scene, len(drawn)))
    columns = _plots(scene)
    if not columns:
        return upper
    above, height = (upper, 3) if drawn else (side, 2)
    return rrb.Vertical(
        above, rrb.Horizontal(*columns), row_shares=[height, 5 - height], name=scene.name or None
    )


def _arms(scene: Scene, apart: bool = True) -> list[Any]:
    """The overlaid view, and each run alone: below each other when the picture is wide, else side
    by side; not `apart`: views that may be tabs."""
    # Bounds are given in the view's own coordinates, in which y points down.
    bounds = rrb.VisualBounds2D(
        x_range=[scene.low[0], scene.high[0]], y_range=[-scene.high[1], -scene.low[1]]
    )

    def arm(name: str, contents: list[str]) -> Any:
        return rrb.Spatial2DView(
            origin="/",
            contents=[f"{scene.prefix}/ground/**", *contents],
            name=name,
            visual_bounds=bounds,
            background=WHITE,
        )

    has_shape = [
        (root, label, f"{colour} {label}") for root, label, colour, there in scene.sources if there
    ]
    alone = [arm(label, [f"/{root}/arm/**"]) for root, label, _ in has_shape]
    if len(has_shape) < 2:
        return alone
    words = ", ".join(said for _, _, said in has_shape)
    title = f"{scene.name}: {words}" if scene.name else f"overlaid: {words}"
    # One ghost is enough where the arms lie on each other.
    ghosts = [f"- /{root}/arm/undeformed" for root, *_ in has_shape[1:]]
    both = arm(title, [*(f"/{root}/arm/**" for root, *_ in has_shape), *ghosts])
    if not apart:
        return [both, *alone]
    if len(has_shape) > 2:
        return [both, rrb.Tabs(*alone)]
    return [
        both,
        rrb.Vertical(*alone) if scene.width > WIDE * scene.height else rrb.Horizontal(*alone),
    ]


def _figures(scene: Scene) -> list[Any]:
    """The dissertation's Figs 4.19 to 4.21: each joint variable and each tip displacement, below it
    its deviation.

    The channels of one kind that share a unit share a figure; what else there is stands in tabs
    behind.
    """
    columns = []
    for kind, part, unit, words in (
        ("joint", "position", "m", "joint variable"),
        ("joint", "position", "rad", "joint variable"),
        ("link", "tip_deflection", "m", "tip flexural displacement, link"),
    ):
        pattern = rf"/{kind}/(\d+)/{part}"
        shown = {
            p: s for p, s in scene.signals.items() if s.unit == unit and re.search(pattern + "$", p)
        }
        if not shown:
            continue
        numbers = _numbers(shown, pattern)
        name = f"{words} {', '.join(map(str, numbers))}"
        below = {
            p: s
            for p, s in scene.deviations.items()
            if s.unit == unit and re.search(pattern + "$", p)
        }
        ends = [f"/{kind}/{i}/" for i in numbers]
        behind = {
            p: s
            for p, s in scene.signals.items()
            if p not in shown and any(end in p for end in ends)
        }
        views = [_plot(name, shown), *_by_part(behind)]
        if kind == "link":
            views += _one("tip position", scene.signals, r"/.+/tip/[xy]")
            views += _one(
                "deviation of the tip", scene.deviations, r".*/deviation/(tip/[xy]|tip_distance)"
            )
        upper = _tabs(views)
        columns.append(
            rrb.Vertical(upper, _plot(f"deviation of {name}", below, LOW_PX), row_shares=[5, 3])
            if below
            else upper
        )
    return columns


def _by_part(signals: Signals) -> list[Any]:
    """A plot for each quantity, by the last part of its path."""
    parts = dict.fromkeys(path.rsplit("/", 1)[1] for path in signals)
    return [
        _plot(part.replace("_", " "), {p: s for p, s in signals.items() if p.endswith(f"/{part}")})
        for part in parts
    ]


def _shares(scene: Scene, arms: int) -> list[float]:
    if arms == 2:
        return [5, 3, 3] if scene.width > WIDE * scene.height else [4, 5, 3]
    return [5.0, 3.0] if arms else [1.0]


def _plots(scene: Scene) -> list[Any]:
    """Up to four columns of plots: joints that slide, joints that turn, links, deviations; what
    belongs together in tabs."""
    signals, columns = scene.signals, []
    group = max(CURVES // len(scene.sources), 1)
    for unit in ("m", "rad"):
        numbers = _numbers(
            (path for path, s in signals.items() if s.unit == unit), r"/joint/(\d+)/position"
        )
        views = [
            v
            for k, part in enumerate(("position", "velocity", "drive"))
            for v in _grouped(signals, "joint", part, numbers, group, k == 0)
        ]
        if views:
            columns.append(views)
    links = _numbers(signals, r"/link/(\d+)/tip_(?:deflection|slope)")
    tip = _one("tip position", signals, r"/.+/tip/[xy]")
    bend = [
        v
        for k, part in enumerate(("tip_deflection", "tip_slope"))
        for v in _grouped(signals, "link", part, links, group, k == 0)
    ]
    if bend or tip:
        columns.append(bend + tip)
    energy = _one("energy", _moving(signals), r"/.+/energy/(kinetic|strain|potential)")
    energy += _one("work and loss", _moving(signals), r"/.+/energy/(work|loss)")
    if energy and columns and len(columns) + bool(scene.deviations) >= 4:
        columns[-1].extend(energy)
    elif energy:
        columns.append(energy)
    shown = re.compile(
        r"/.+/(joint/\d+/(position|velocity|drive)|link/\d+/tip_(deflection|slope)|energy/\w+|tip/[xy])"
    )
    rest = {path: s for path, s in signals.items() if not shown.fullmatch(path)}
    further = [
        _plot(f"other [{unit}]", {p: s for p, s in rest.items() if s.unit == unit})
        for unit in dict.fromkeys(s.unit for s in rest.values())
    ]
    if further and columns:
        columns[-1].extend(further)
    elif further:
        columns.append(further)
    if apart := _deviations(scene):
        columns.append(apart)
    return [_tabs(views) for views in columns]


def _deviations(scene: Scene) -> list[Any]:
    """Deviations of tip deflections, of the tip, and of joint positions, one unit a plot."""
    apart = scene.deviations
    links = _numbers(apart, r"/link/(\d+)/tip_deflection")
    views = _grouped(apart, "link", "tip_deflection", links, CURVES // 2, True, "deviation of ")
    views += _one(
        "of the tip" if views else "deviation of the tip",
        apart,
        r".*/deviation/(\w+/)?(tip/[xy]|tip_distance)",
    )
    for unit in ("m", "rad"):
        same = {path: s for path, s in apart.items() if s.unit == unit}
        views += _grouped(
            same,
            "joint",
            "position",
            _numbers(same, r"/joint/(\d+)/position"),
            CURVES // 2,
            True,
            "" if views else "deviation of ",
        )
    return views


def _grouped(
    signals: Signals,
    kind: str,
    part: str,
    numbers: list[int],
    group: int,
    full: bool,
    before: str = "",
) -> list[Any]:
    """Plots of one quantity, `group` joints or links at a time; `full`: the name says which even
    where they are all."""
    views = []
    for k in range(0, len(numbers), group):
        some = numbers[k : k + group]
        found = {
            path: s
            for path, s in signals.items()
            for i in some
            if path.endswith(f"/{kind}/{i}/{part}")
        }
        which = (
            f", {kind}{'s' if len(some) > 1 else ''} {', '.join(map(str, some))}"
            if full or len(numbers) > group
            else ""
        )
        if found:
            views.append(_plot(before + part.replace("_", " ") + which, found))
    return views


def _one(name: str, signals: Signals, pattern: str) -> list[Any]:
    found = {path: s for path, s in signals.items() if re.fullmatch(pattern, path)}
    return [_plot(name, found)] if found else []


def _plot(name: str, signals: Signals, height: int = PLOT_PX) -> Any:
    return rrb.TimeSeriesView(
        origin="/",
        contents=list(signals),
        name=name,
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        axis_y=rrb.ScalarAxis(range=value_range(signals, height)),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
    )


def _moving(signals: Signals) -> Signals:
    """Without those that are 0 all the time, such as the potential energy of a robot in the
    horizontal plane."""
    return {path: s for path, s in signals.items() if s.low or s.high}


def _tabs(views: list[Any]) -> Any:
    return views[0] if len(views) == 1 else rrb.Tabs(*views, active_tab=0)


def _numbers(paths: Iterable[str], pattern: str) -> list[int]:
    return sorted({int(found[1]) for path in paths if (found := re.search(pattern + "$", path))})


def _log_columns() -> Any:
    """Level and text: the text itself has the time, which the viewer would cut short, and names the
    source."""
    kinds = rrb.encodings.TextLogColumnKind
    shown = [
        rrb.encodings.TextLogColumn(kind=kind, visible=True)
        for kind in (kinds.LogLevel, kinds.Body)
    ]
    return rrb.TextLogColumns(
        timeline_columns=[rrb.encodings.TimelineColumn(timeline="time", visible=False)],
        text_log_columns=shown,
    )
