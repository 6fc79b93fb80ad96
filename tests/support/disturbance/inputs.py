"""What the disturbed commands read: finished runs, a log, measurements, a recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexlab.recordings import recording

ROBOTS = Path(__file__).resolve().parents[3] / "model" / "robots"
LAW = ["rig", "rig-inverse-law"]
VARY = ["simulate", *LAW, "--vary", "payload.mass_kg=0:0.1:3"]
CALLED: dict[str, list[Any]] = {
    "a": ["simulate", *LAW, "--out", "a"],
    "b": ["simulate", *LAW, "--out", "b", "--rtol", "1e-4"],
    "p": [*VARY, "--out", "p"],
    "e": ["bench", "excite", "--emulated", "--out", "e"],
    "r": ["bench", "step", "--duration-s", "0.9", "--emulated", "--out", "r"],
}


def ringing(place: Path) -> None:
    """A free vibration of 4.7 Hz."""
    t = np.arange(500) / 100
    y = 0.01 * np.exp(-0.3 * t) * np.cos(2 * np.pi * 4.7 * t)
    fx.Run(t, {"link/1/tip_deflection": y}, {"link/1/tip_deflection": "m"}, {}).save(place)


def log(place: Path) -> None:
    """A CSV file of another program."""
    rows = [f"{k / 100},{0.1 * k}" for k in range(200)]
    place.write_text("\n".join(["time [s],joint/1/position [deg]", *rows, ""]))


def measured(place: Path) -> None:
    """A step run of a stiffer strip, written as the published ones are."""
    from scipy.io import savemat

    stiff = fx.load("quanser-2dsfl").replace({"link.1.young_modulus_Pa": 2.2e11})
    t = np.arange(2000) / 500
    motion = fx.signals.cycloid(0.3, 0.4)
    hub = np.array([motion(x)[0] for x in t])
    run = fx.simulate(stiff, t, fx.Drive.prescribed(motion))
    angle = 2 * run["link/1/tip_deflection"] / 0.202 - 2 / 3 * run["link/1/tip_slope"]
    (place / "lqg").mkdir(parents=True)
    columns = {"time": t[:, None], "theta11": hub[:, None], "theta12": angle[:, None]}
    savemat(place / "lqg" / "lqg_step_17deg_run01.mat", columns)


def old_robot(place: Path) -> None:
    """A robot file with a key of an older version."""
    text = (ROBOTS / "single-r.toml").read_text()
    place.write_text(text.replace("[link.joint]", "[link.joint]\nviscous_friction = 0.001", 1))


def cut_off(place: Path) -> None:
    """A recording `r` whose host did not come to make the run."""
    for each in place.iterdir():
        if each.name not in (recording.SESSION, recording.EVENTS, recording.RECEIVED):
            each.unlink()


MADE: dict[str, Callable[[Path], None]] = {
    "v": ringing,
    "log.csv": log,
    "measured": measured,
    "out.toml": old_robot,
    "second.toml": old_robot,
}
