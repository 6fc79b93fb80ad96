"""The command `flexura vibration`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx
from flexura.control import step_figures
from flexura.io import find, read_toml, write_toml

from ..identification.vibration.damped_sinusoids import (
    Fit,
    Mode,
    changes,
    fit,
    lacks,
    strongest,
)
from ..identification.vibration.record import Record, record
from ..identification.vibration.shapers import KINDS, Shaper, shaped
from ..runs.formatting import finite, number, percent
from ..runs.table import Table
from .options import Force, Json
from .output import message, print_results
from .results import results
from .runs import RobotNumber, one_run

MODES = 4
HELP_CHANNEL = "which channel rings; default: the tip deflection, or the sensor, that swings most"


@dataclass(frozen=True)
class Found:
    """What is known of one free vibration, and the steps of the run's joints."""

    record: Record
    fit: Fit
    halves: tuple[Mode, ...]
    lacks: dict[str, float] | None
    steps: dict[str, dict[str, float | None]]

    @property
    def strongest(self) -> Mode:
        """The mode that holds most of the vibration: what the shapers are for."""
        return strongest(self.fit, self.record.length)

    @property
    def shapers(self) -> list[Shaper]:
        """ZV, ZVD and EI for the strongest mode."""
        mode = self.strongest
        return [Shaper(kind, mode.frequency, max(mode.ratio, 0.0)) for kind in KINDS]


def vibration(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="folder of a run, or its run.parquet")],
    channel: Annotated[str | None, typer.Option(metavar="CHANNEL", help=HELP_CHANNEL)] = None,
    from_s: Annotated[
        float | None,
        typer.Option(help="begin there [s]; default: after the last command, where it is free"),
    ] = None,
    to_s: Annotated[float | None, typer.Option(help="end there [s]; default: the end")] = None,
    modes: Annotated[int, typer.Option(min=1, max=12, help="at most so many")] = MODES,
    manoeuvre: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="also write this manoeuvre, shaped, with --out"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="new folder for the shapers, one file each"),
    ] = None,
    robot: RobotNumber = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Find frequency and damping ratio of each mode of a free vibration.

    The frequency is the undamped one. Each has a 95 % interval.

    With --out it writes the shapers ZV, ZVD and EI of the strongest mode. `flexura simulate` and
    `flexura bench inverse` take them with --shaper.

    \b
    Example: flexura vibration logs/free-vibration --out logs/shapers
    """
    if manoeuvre is not None and out is None:
        raise fx.InputError("expected together with --out", key="--manoeuvre", value=str(manoeuvre))
    read = one_run(run, robot)
    part = record(read, channel, from_s, to_s)
    fitted = fit(part.t, part.y, modes)
    halves = changes(fitted, part.t, part.y, modes)
    found = Found(part, fitted, halves, lacks(fitted, part.t, part.y), _steps(read))
    if not fitted.modes:
        raise fx.InputError(
            f"no vibration stands out of the noise {part.why}: expected a free vibration",
            key=f"channel {part.channel}",
            file=str(run),
        )
    written: dict[str, dict[str, Any]] = {}
    if out is not None:
        written = {f"{shaper.kind}.toml": shaper.tables() for shaper in found.shapers}
        if manoeuvre is not None:
            joints = _joints(manoeuvre)
            asked = fx.load_manoeuvre(manoeuvre, joints)
            for shaper in found.shapers:
                name = f"{manoeuvre.stem}-{shaper.kind}.toml"
                written[name] = shaped(asked, shaper).spec()
        with results(out, force=force) as draft:
            for name, tables in written.items():
                write_toml(draft.folder / name, tables)
            draft.keep()
    told = lambda: _data(found) | {"files": list(written)}
    print_results(json, lambda: _tables(found, read), told)
    if out is not None:
        message(json, f"stored {out}: {', '.join(written)}")
        message(json, f"use it: flexura simulate ROBOT MANOEUVRE --shaper {out / 'zvd.toml'}")


def _joints(manoeuvre: Path) -> int:
    """How many joints a manoeuvre has."""

    tables = read_toml(find(manoeuvre, "manoeuvres")).get("joint", [])
    return max(len(tables), 1) if isinstance(tables, list) else 1


def _steps(run: fx.Run) -> dict[str, dict[str, float | None]]:
    """The step figures of each joint that has a set-point and goes somewhere."""
    out = {}
    for name in run:
        if name.startswith("joint/") and name.endswith("/position"):
            if name.replace("/position", "/reference") not in run:
                continue
            try:
                out[name] = step_figures(run, name)
            except fx.InputError:  # it stays where it is
                continue
    return out


def _tables(found: Found, run: fx.Run) -> list[Table]:
    part = found.record
    title = (run.meta.get("robot") or {}).get("name") or "run"
    heads = ("mode", "frequency [Hz]", "95 % interval [Hz]", "damping ratio", "95 % interval")
    modes = Table(f"{title}: free vibration of {part.channel}", (*heads, "amplitude"), ("mode",))
    for k, mode in enumerate(found.fit.modes, 1):
        f, z = mode.interval("frequency"), mode.interval("ratio")
        modes.add(
            str(k),
            number(f[0], 6),
            f"{f[1]:.6g} to {f[2]:.6g}",
            number(z[0], 3),
            f"{z[1]:.3g} to {z[2]:.3g}",
            f"{mode.amplitude:.3g} {part.unit}",
        )
    cycles = found.strongest.frequency * (part.t[-1] - part.t[0])
    modes.notes.append(
        f"{part.why}: {len(part.t)} samples, {cycles:.3g} cycles of the strongest mode; "
        f"noise {found.fit.noise:.2g} {part.unit}"
    )
    if found.halves:
        first, second = (number(mode.frequency, 5) for mode in found.halves)
        modes.notes.append(
            f"the strongest mode is not linear: {first} Hz in the first half, {second} Hz in the "
            "second; the interval is of the whole"
        )
    if found.lacks is not None:
        modes.notes.append(
            f"what is left about the strongest mode is {percent(found.lacks['share'])} of the "
            f"vibration, {found.lacks['by_noise']:.2g} times the noise: another mode is near it, "
            "or it changes; its damping ratio may be far outside the interval, and the shapers "
            "take it"
        )
    modes.notes.append("the frequency is the undamped one; amplitudes are at the start")
    longer = (f"{s.kind.upper()} {s.lengthens_s:.3g} s" for s in found.shapers)
    modes.notes.append(f"shapers of the strongest mode lengthen a motion by: {', '.join(longer)}")
    out = [modes]
    if found.steps:
        heads = ("joint", "rise [s]", "settling [s]", "overshoot", "remaining error")
        steps = Table("steps", heads, ("joint",))
        for name, figures in found.steps.items():
            own = [float("nan") if x is None else x for x in figures.values()]
            steps.add(name, number(own[0]), number(own[1]), percent(own[2]), percent(own[3]))
        out.append(steps)
    return out


def _data(found: Found) -> dict[str, Any]:
    """For JSON."""
    part = found.record
    return {
        "channel": part.channel,
        "from_s": float(part.t[0]),
        "to_s": float(part.t[-1]),
        "modes": [
            {
                "frequency_Hz": [finite(x) for x in mode.interval("frequency")],
                "damping_ratio": [finite(x) for x in mode.interval("ratio")],
                "amplitude": mode.amplitude,
            }
            for mode in found.fit.modes
        ],
        "halves_Hz": [mode.frequency for mode in found.halves],
        "lacks": found.lacks,
        "noise": found.fit.noise,
        "unit": part.unit,
        "shapers": [shaper.tables()["shaper"] for shaper in found.shapers],
        "steps": found.steps,
    }
