"""A run as a film: the links drawn as bent as they are, the tip's way, and a clock."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import FlexuraError, InputError
from ...optional import Missing, load
from ..files import path_of, replaced, write_bytes
from .over_time import AXES, COLOURS, GRID, INK, STYLE, heading
from .pictures import plain, told
from .poses import with_poses
from .shapes import Curves, curves, extent, has_shapes

if TYPE_CHECKING:
    from ..run import Run

FORMS = (".gif", ".mp4")
SHORTEST_S, LONGEST_S = 3.0, 12.0  # a film's duration where none is asked for
MOST_FRAMES = 5000
SIDE_PX = 640  # the longer side of the picture
EDGES_PX = (66, 46, 14, 34)  # left, bottom, right and top of the axes
NEARLY_WHITE = 247
GHOST, RIGID = "#c3c8cf", "#6b7280"
NO_ENCODER = (
    "no encoder for MP4 here: install ffmpeg, type pip install imageio-ffmpeg, or ask for a .gif"
)


def animation(
    run: Run,
    path: str | Path,
    *,
    frame_rate: float = 25.0,
    duration: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write a run as an animated GIF, or as MP4 where an encoder is installed.

    Args:
        run: with the poses of its links, or with joint positions and a robot.
        path: ends with .gif or .mp4; written as a whole or not at all.
        frame_rate: pictures a second of the film [1/s]; a GIF counts in hundredths of a second.
        duration: of the film [s]; by default the run's own, but 3 to 12 s. The clock in the picture
            shows the run's time, and how much faster the film is.
        progress: called with the fraction that is done.

    Returns:
        The path.

    Raises:
        InputError: a wrong argument, or a run that does not say where its links are.
        FlexuraError: there is no encoder for MP4.
        Missing: matplotlib or pillow is not installed.
    """
    target = path_of(path, "out")
    form = target.suffix.lower()
    if form not in FORMS:
        raise InputError(
            f"expected a file that ends with {' or '.join(FORMS)}", key="out", value=str(path)
        )
    placed, _ = with_poses(run)
    if len(run) == 0 or not has_shapes(placed):
        text = "expected a run with samples, a robot, and its links' poses or joint positions"
        raise InputError(text, key="run")
    film = duration if duration is not None else _duration(run)
    for key, value, most in (("frame_rate", frame_rate, 100.0), ("duration", film, 3600.0)):
        if not 0 < value <= most:
            raise InputError(f"expected a number above 0, at most {most:g}", key=key, value=value)
    if form == ".gif":  # whole hundredths of a second, or the film runs at another speed
        frame_rate = 100.0 / max(round(100.0 / frame_rate), 2)
    count = max(round(film * frame_rate), 2)
    if count > MOST_FRAMES:
        raise InputError(
            f"expected at most {MOST_FRAMES} pictures, not {count}", key="duration", value=film
        )
    encoder = mp4_encoder() if form == ".mp4" else ""
    at = np.linspace(run.t[0], run.t[-1], count)
    index = np.clip(np.searchsorted(run.t, at - 1e-9), 0, len(run) - 1)
    pictures = _pictures(placed, index, film, progress or (lambda fraction: None))
    if form == ".gif":
        write_bytes(target, _gif(pictures, frame_rate))
    else:
        _mp4(pictures, frame_rate, encoder, target)
    return target


def mp4_encoder() -> str:
    """The path of an ffmpeg. Raises FlexuraError, with what to install."""
    if found := shutil.which("ffmpeg"):
        return found
    try:
        return str(load("imageio_ffmpeg", "lab").get_ffmpeg_exe())
    except (Missing, RuntimeError):
        raise FlexuraError(NO_ENCODER) from None


def _duration(run: Run) -> float:
    return float(np.clip(run.t[-1] - run.t[0], SHORTEST_S, LONGEST_S))


def _pictures(
    run: Run, index: np.ndarray, film: float, progress: Callable[[float], None]
) -> Iterator[np.ndarray]:
    """The pictures, (height, width, 3) of bytes each, at the samples `index` of the run."""
    matplotlib = load("matplotlib")
    low, high = extent([run])
    mark = 0.022 * float((high - low).max())
    every = curves(run, np.arange(len(run)), mark)
    with matplotlib.rc_context(STYLE):
        with told("the film"):
            scene = Scene(run, every, low, high, film)
        for k, sample in enumerate(index):
            yield scene.drawn(int(sample))
            progress((k + 1) / len(index))


class Scene:
    """The picture of one instant, drawn again and again with the same artists.

    Args:
        run: with poses.
        every: its shapes at all samples.
        low, high: corners of what is shown [m].
        film: duration of the film [s].
    """

    def __init__(
        self, run: Run, every: Curves, low: np.ndarray, high: np.ndarray, film: float
    ) -> None:
        size = high - low
        inches = np.maximum(size / size.max(), 0.45) * SIDE_PX / 100
        self.run, self.every = run, every
        self.figure = load("matplotlib.figure").Figure(figsize=inches, dpi=100)
        self.canvas = load("matplotlib.backends.backend_agg").FigureCanvasAgg(self.figure)
        left, bottom, right, top = EDGES_PX
        wide, tall = inches * 100
        place = (left / wide, bottom / tall, 1 - (left + right) / wide, 1 - (bottom + top) / tall)
        axes = self.figure.add_axes(place)
        shown = inches * place[2:]
        half, middle = shown * (size / shown).max() / 2, (low + high) / 2
        axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
        axes.set_aspect("equal")
        axes.set_xlabel("x [m]", labelpad=1)
        axes.set_ylabel("y [m]", labelpad=1)
        axes.grid(color=GRID)
        text, line_y = heading([run]), 1 - top / 2 / tall
        text = text if len(text) <= 60 else f"{text[:57]}..."
        self.figure.text(0.015, line_y, plain(text), fontsize=9, va="center")
        self.clock = self.figure.text(
            0.985, line_y, "", fontsize=9, va="center", ha="right", animated=True
        )
        span = float(run.t[-1] - run.t[0])
        pace = span / film if film else 1.0
        self.pace = "" if abs(pace - 1) < 0.02 or not span else f"   {pace:.2g} x speed"
        line = lambda **style: axes.plot([], [], animated=True, **style)[0]
        if every.rail is not None:
            axes.plot(*every.rail.T, color=AXES, linewidth=1.5, zorder=1)
        self.trail = line(color="#E69F00", linewidth=1.0, zorder=2)
        self.ghosts = [
            line(color=GHOST, linewidth=1.0, linestyle="--", zorder=3)
            for _ in range(every.undeformed.shape[1])
        ]
        self.rigid = [
            line(color=RIGID, linewidth=5.0, solid_capstyle="round", zorder=4)
            for _ in range(every.rigid.shape[1])
        ]
        self.bent = [
            line(color=COLOURS[0], linewidth=2.4, solid_capstyle="round", zorder=5)
            for _ in range(every.deformed.shape[1])
        ]
        self.sliders = [
            line(color=INK, linewidth=1.4, zorder=6) for _ in range(every.sliders.shape[1])
        ]
        self.pins = line(
            color=INK, linestyle="", marker="o", markersize=7, markerfacecolor="white", zorder=7
        )
        payload = (run.meta.get("robot") or {}).get("payload", {}).get("mass_kg", 0.0)
        self.tip = line(
            color=COLOURS[1], linestyle="", marker="o", markersize=8 if payload else 5, zorder=8
        )
        self.moving = [self.trail, *self.ghosts, *self.rigid, *self.bent, *self.sliders]
        self.moving += [self.pins, self.tip, self.clock]
        self.canvas.draw()
        self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    def drawn(self, sample: int) -> np.ndarray:
        """The picture at a sample of the run, (height, width, 3) of bytes."""
        every = self.every
        for artists, shapes in (
            (self.ghosts, every.undeformed),
            (self.rigid, every.rigid),
            (self.bent, every.deformed),
            (self.sliders, every.sliders),
        ):
            for k, artist in enumerate(artists):
                artist.set_data(*shapes[sample, k].T)
        self.pins.set_data(*every.pins[sample].T)
        self.tip.set_data(*every.tip[sample][:, None])
        self.trail.set_data(*every.tip[: sample + 1].T)
        self.clock.set_text(f"t = {self.run.t[sample]:.3f} s{self.pace}")
        self.canvas.restore_region(self.still)
        for artist in self.moving:
            self.figure.draw_artist(artist)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


def _gif(pictures: Iterator[np.ndarray], frame_rate: float) -> bytes:
    image = load("PIL.Image")

    def palettes() -> Iterator[Any]:
        first = None
        for picture in pictures:
            colours = image.fromarray(picture)
            found = colours.quantize(64, dither=image.Dither.NONE, palette=first)
            if first is None:  # what is nearly white is white, or the background flickers
                palette = np.array(found.getpalette()).reshape(-1, 3)
                palette[palette.min(axis=1) > NEARLY_WHITE] = 255
                found.putpalette(palette.ravel().tolist())
                first = found
            yield found

    frames = palettes()
    out = io.BytesIO()
    next(frames).save(
        out,
        "GIF",
        save_all=True,
        append_images=frames,
        duration=round(1000 / frame_rate),
        loop=0,
    )
    return out.getvalue()


def _mp4(pictures: Iterator[np.ndarray], frame_rate: float, encoder: str, target: Path) -> None:
    """Pictures through ffmpeg into a file of another name, which then takes its place."""
    first = next(pictures)
    high, wide = first.shape[0] // 2 * 2, first.shape[1] // 2 * 2  # what players can show
    command = [encoder, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{wide}x{high}", "-r", f"{frame_rate:g}", "-i", "-", "-an"]
    command += ["-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    with replaced(target) as draft, tempfile.TemporaryFile() as said:
        process = subprocess.Popen([*command, str(draft)], stdin=subprocess.PIPE, stderr=said)
        assert process.stdin is not None
        try:
            for picture in chain([first], pictures):
                process.stdin.write(picture[:high, :wide].tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass
        except BaseException:
            process.kill()
            process.wait()
            raise
        if process.wait():
            said.seek(0)
            last = said.read().decode(errors="replace").strip().splitlines() or ["no answer"]
            raise FlexuraError(f"the encoder {encoder} failed: {last[-1]}")
