"""Looking at a review: in the native viewer's window, or as a picture drawn without a screen.

The viewer only listens on this machine's loopback address. Pictures are drawn with a home folder of
their own, so that neither the user's settings of the viewer nor its usage statistics come into
play.
"""

from __future__ import annotations

import contextlib
import io
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from flexura.errors import FlexuraError, InputError
from flexura.io import write_bytes
from flexura.optional import Optional, load

from .seal import check_review

rerun_cli = Optional("rerun_cli")

LATE = 4  # pictures that are not painted in time: more end the drawing
MENU_PX = 36  # the height of the viewer's menu, which stays as an empty strip when it is hidden
LOOPBACK = "127.0.0.1"
NO_VULKAN = (
    "the review's viewer needs a Vulkan driver to draw without a screen; on Debian and Ubuntu: "
    "apt-get install -y --no-install-recommends mesa-vulkan-drivers libvulkan1"
)


def draw(
    rrd: str | Path,
    png: str | Path,
    *,
    time_s: float | None = None,
    size: tuple[int, int] = (1600, 900),
) -> Path:
    """Draw a review; see `flexlab.review.picture`."""
    if min(size) < 100 or max(size) > 8000:
        raise InputError("a width and a height between 100 and 8000 pixels", key="size", value=size)
    at = default_time(rrd)
    with viewer((size[0], size[1] + MENU_PX)) as client:
        show(client, rrd)
        # the picture is of the review, not of the viewer's menu
        client.run_command("ui.toggle_top_panel")
        client.set_time(
            "time", duration=float(at if time_s is None else time_s), play_state="paused"
        )
        write_bytes(png, _without_menu(settled_picture(client), size))
    return Path(png)


def default_time(rrd: str | Path) -> float:
    """The time [s] that a review proposes for its picture. Raises InputError for a file that is no
    review."""
    RrdReader = load("rerun.chunk").RrdReader

    path = Path(rrd)
    check_review(path)
    try:
        for chunk in RrdReader(path).stream().filter(content="/__properties/review"):
            batch = chunk.to_record_batch()
            if "picture_time_s" in batch.schema.names:
                return float(np.ravel(batch.column("picture_time_s")[0].as_py())[0])
    except (RuntimeError, ValueError, OSError) as error:
        raise InputError(
            f"not a Rerun recording ({str(error).splitlines()[0]})", file=str(rrd)
        ) from None
    raise InputError("a Rerun recording, but not a review of flexura", file=str(rrd))


def executable() -> Path:
    """The viewer itself: the `rerun` on the path is a script, which would leave the viewer running
    when ended."""
    path = Path(rerun_cli.__file__).with_name("rerun.exe" if os.name == "nt" else "rerun")
    if not path.is_file():
        raise FlexuraError(f"the viewer is missing: expected {path}; install rerun-sdk again")
    return path


@contextlib.contextmanager
def viewer(size: tuple[int, int] = (1600, 900), timeout: float = 60.0) -> Iterator[Any]:
    """A viewer without a screen, `size` in pixels, as a client to steer it by; ended with the
    block.

    Raises FlexuraError when there is no Vulkan driver, or when the viewer doesn't answer: within
    `timeout` seconds at first, within the client's own deadline later.
    """
    ViewerClient = load("rerun.experimental").ViewerClient

    program, port = str(executable()), free_port()
    with (
        tempfile.TemporaryDirectory(prefix="flexura-viewer-", ignore_cleanup_errors=True) as home,
        tempfile.TemporaryFile() as output,
    ):
        own = {
            "HOME": home,
            "XDG_CONFIG_HOME": f"{home}/.config",
            "XDG_DATA_HOME": f"{home}/.local/share",
            "XDG_RUNTIME_DIR": home,
        }
        env = os.environ | own | {"RUST_LOG": "error", "NO_COLOR": "1"}
        subprocess.run(
            [program, "analytics", "disable"],
            env=env,
            check=False,
            capture_output=True,
            timeout=timeout,
        )
        options = [
            "--headless",
            "--bind",
            LOOPBACK,
            "--port",
            str(port),
            "--window-size",
            f"{size[0]}x{size[1]}",
            "--hide-welcome-screen",
        ]
        process = subprocess.Popen(
            [program, *options],
            env=env,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        try:
            yield _connected(ViewerClient, process, port, output, timeout)
        except OSError as error:  # its client's, such as a deadline on a busy machine
            raise FlexuraError(f"the viewer does not answer: {error}") from None
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _connected(
    client_type: Any, process: subprocess.Popen[bytes], port: int, output: Any, timeout: float
) -> Any:
    end = time.monotonic() + timeout
    while True:
        try:
            client = client_type.connect(f"rerun+http://{LOOPBACK}:{port}/proxy")
            client.get_state()
            return client
        except Exception:  # whatever a server says that isn't up yet
            if process.poll() is not None or time.monotonic() > end:
                output.seek(0)
                said = output.read().decode(errors="replace")
                if "render context" in said or "graphics adapter" in said or "wgpu" in said.lower():
                    raise FlexuraError(NO_VULKAN) from None
                raise FlexuraError(
                    f"the viewer did not start: {said.strip()[-500:] or 'no answer'}"
                ) from None
            time.sleep(0.05)


def show(client: Any, rrd: str | Path, timeout: float = 60.0) -> Any:
    """Open a review in a viewer and wait until it is loaded; returns the viewer's state."""
    end = time.monotonic() + timeout
    client.open(str(Path(rrd).resolve()))
    while (state := client.get_state()).loading or not state.views:
        if time.monotonic() > end:
            raise FlexuraError(f"the viewer did not load {rrd} within {timeout:g} s")
        time.sleep(0.05)
    return state


def settled_picture(client: Any, view_id: Any = None, tries: int = 60) -> bytes:
    """The PNG of a view, or of the whole window, once two in a row agree: axes and data arrive over
    several frames."""
    last, late = b"", 0
    for _ in range(tries):
        try:
            png = client.take_screenshot(view_id)
        except OSError:  # its deadline of 15 s, on a busy machine
            late += 1
            if late == LATE:
                raise
            continue
        if png == last:
            return png
        last = png
        time.sleep(0.15)
    raise FlexuraError("the viewer keeps changing its picture")


def _without_menu(png: bytes, size: tuple[int, int]) -> bytes:
    """The picture cut to `size`: without the strip of the menu where it is empty, else scaled."""
    Image = load("PIL.Image")

    image = Image.open(io.BytesIO(png)).convert("RGB")
    strip = image.crop((image.width // 4, 4, image.width // 2, MENU_PX - 4)).getcolors(1)
    if image.size == (size[0], size[1] + MENU_PX) and strip is not None:
        image = image.crop((0, MENU_PX, *image.size))
    else:
        image = image.resize(size, Image.Resampling.LANCZOS)
    out = io.BytesIO()
    image.save(out, "PNG", optimize=True)
    return out.getvalue()


def open_window(rrd: str | Path) -> subprocess.Popen[bytes]:
    """Open the viewer's window; see `flexlab.review.open_viewer`."""
    path = Path(rrd)
    check_review(path)
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise FlexuraError(
            f"no display to open the viewer on; copy {path} to a machine that has one, or draw a "
            f"picture of it"
        )
    program = executable()
    process = subprocess.Popen(
        [
            str(program),
            "--bind",
            LOOPBACK,
            "--port",
            "auto",
            "--hide-welcome-screen",
            str(path.resolve()),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # an interrupt of the command must not close the window
    )
    try:
        code = process.wait(1.5)
    except subprocess.TimeoutExpired:
        return process
    if code:
        raise FlexuraError(
            f"the viewer ended at once with status {code}: is the display "
            f"{os.environ.get('DISPLAY', '')} usable?"
        )
    return process


def free_port() -> int:
    """A TCP port of this machine that no program uses now."""
    with socket.socket() as s:
        s.bind((LOOPBACK, 0))
        return int(s.getsockname()[1])
