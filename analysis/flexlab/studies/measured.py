"""A measured robot against its simulation: step runs of Quanser's 2DSFL, stage 1.

The measured hub motion is prescribed; the strain gauge at the clamp is compared. The maker converts
its strain to an angle as if a force alone bent the strip at its tip:

    L kappa(0) / 3 = 2 w / L - 2 phi / 3

with the tip's deflection w and slope phi; this holds exactly for a strip without mass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.io.logs import Log, read_log

from ..comparison.replay.smoothing import smoothing_spline

GAUGE = "sensor/strain_gauge"
COLUMNS = ("time", "theta11", "theta12")
RINGS_FROM_S = 1.5  # the steps have ended
BAND_HZ = (1.0, 4.0)  # of the ring: the controllers are slower, the second mode is faster
PADDED = 1 << 16  # samples of a spectrum
FEWEST = 256  # samples of a ring


@dataclass(frozen=True)
class Measured:
    """One measured run and its simulation.

    `ring_Hz`: of the measured ring; `simulated_Hz`: of the simulated one under the same hub motion;
    `held_Hz`: the robot's first frequency with its joint locked; `rms_of_peak`: RMS deviation of
    the gauge by its largest measured value.
    """

    name: str
    experiment: fx.Run
    simulation: fx.Run
    ring_Hz: float
    simulated_Hz: float
    held_Hz: float
    rms_of_peak: float

    @property
    def held_deviation(self) -> float:
        """The robot's first frequency against the measured ring, relative."""
        return self.held_Hz / self.ring_Hz - 1

    @property
    def simulated_deviation(self) -> float:
        """The simulated ring against the measured one, relative."""
        return self.simulated_Hz / self.ring_Hz - 1


def measured(
    robot: fx.Robot,
    data: Path,
    *,
    rtol: float = 1e-6,
    progress: Callable[[float], None] = lambda fraction: None,
) -> list[Measured]:
    """Simulate all step runs below a folder.

    Args:
        robot: one flexible link on a joint R.
        data: folder with MAT files `*step*.mat`, in it or one folder below.
        rtol: of the simulations.
        progress: called with the finished fraction.

    Returns:
        One entry a run, by name.

    Raises:
        InputError: another robot, no run, a damaged one, or a simulation that did not end.
    """
    if len(robot.links) != 1 or not robot.links[0].flexible or robot.links[0].joint.type != "R":
        raise fx.InputError(
            "expected one flexible link on a joint R", key="ROBOT", value=robot.name
        )
    paths = sorted([*data.glob("*step*.mat"), *data.glob("*/*step*.mat")])
    if not paths:
        raise fx.InputError(
            "no *step*.mat in it or one folder below; docs/guide/measured.md says where they are",
            key="--data",
            value=str(data),
        )
    experiments = [(path, step_run(path, robot)) for path in paths]
    system, done = fx.assemble(robot), []
    held = float(fx.frequencies(system)[0])
    for k, (path, experiment) in enumerate(experiments, 1):
        simulation = replayed(system, experiment, rtol)
        if not simulation.complete:
            texts = "; ".join(event["text"] for event in simulation.meta["events"])
            raise fx.InputError(f"the simulation did not end: {texts}", file=str(path))
        y, s = experiment[GAUGE], simulation[GAUGE]
        done.append(
            Measured(
                path.stem,
                experiment,
                simulation,
                ring(experiment.t, y),
                ring(experiment.t, s),
                held,
                float(np.sqrt(np.mean((s - y) ** 2)) / np.abs(y).max()),
            )
        )
        progress(k / len(experiments))
    return done


def step_run(path: Path, robot: fx.Robot) -> fx.Run:
    """One step run as an experiment.

    Args:
        path: of the MAT file.
        robot: names the channel of the encoder, which is on the motor's side.

    Returns:
        The Run: the encoder's angle and the gauge's angle [rad].

    Raises:
        InputError: not such a file.
    """
    t, hub, gauge = _columns(read_log(path))
    name = encoder(robot)
    meta = {
        "source": "experiment",
        "program": "flexura study measured",
        "robot": robot.to_dict(),
        "complete": True,
        "events": [],
        "imported": {"file": path.name, "format": "MAT"},
    }
    if len(t) < 2:
        raise fx.InputError("expected two rows or more", file=str(path))
    try:
        return fx.Run(t - t[0], {name: hub, GAUGE: gauge}, {name: "rad", GAUGE: "rad"}, meta)
    except fx.InputError as error:
        raise error.in_file(str(path)) from None


def _columns(log: Log) -> list[np.ndarray]:
    found = {column.head: column for column in log.columns}
    out = []
    for name in COLUMNS:
        if name not in found:
            raise fx.InputError(
                f"expected {', '.join(COLUMNS)}; it has {', '.join(found)}",
                key=f"column {name!r}",
                file=log.file,
            )
        values = np.asarray(found[name].values, dtype=float)
        if not np.isfinite(values).all() or len(values) != len(found[COLUMNS[0]].values):
            raise fx.InputError(
                "expected finite numbers, one a row", key=f"column {name!r}", file=log.file
            )
        out.append(values)
    return out


def encoder(robot: fx.Robot) -> str:
    """The channel of the encoder on the motor's side."""
    elastic = robot.links[0].joint.transmission is not None
    return "joint/1/motor_position" if elastic else "joint/1/position"


def replayed(system: fx.System, experiment: fx.Run, rtol: float = 1e-6) -> fx.Run:
    """The simulation of a step run: its encoder's motion is prescribed, smoothed.

    Args:
        system: the robot.
        experiment: the measured run.
        rtol: of the simulation.

    Returns:
        The Run, with the gauge's channel.
    """
    motion = smoothing_spline(experiment.t, experiment[encoder(system.robot)])
    run = fx.simulate(system, experiment.t, fx.Drive.prescribed(motion), rtol=rtol).uninterrupted()
    length = system.robot.links[0].length_m
    angle = 2 * run["link/1/tip_deflection"] / length - 2 / 3 * run["link/1/tip_slope"]
    return fx.Run(run.t, run.channels | {GAUGE: angle}, run.units | {GAUGE: "rad"}, run.meta)


def ring(t: np.ndarray, y: np.ndarray) -> float:
    """The frequency of the ring later than 1.5 s: the peak of the spectrum under a Hann window.

    Args:
        t: equally spaced times (T,) [s].
        y: values (T,).

    Returns:
        The frequency [Hz].

    Raises:
        InputError: too few samples.
    """
    late = t >= RINGS_FROM_S
    z = y[late]
    if len(z) < FEWEST:
        raise fx.InputError(f"{len(z)} samples later than {RINGS_FROM_S} s: expected {FEWEST}")
    size = np.abs(np.fft.rfft((z - z.mean()) * np.hanning(len(z)), PADDED))
    f = np.fft.rfftfreq(PADDED, float(np.mean(np.diff(t))))
    inside = (f >= BAND_HZ[0]) & (f <= BAND_HZ[1])
    return float(f[inside][size[inside].argmax()])


def numbers(found: Sequence[Measured]) -> list[dict[str, Any]]:
    """The figures of all runs for JSON."""
    return [
        {
            "run": m.name,
            "ring_Hz": m.ring_Hz,
            "simulated_Hz": m.simulated_Hz,
            "held_Hz": m.held_Hz,
            "held_deviation": m.held_deviation,
            "simulated_deviation": m.simulated_deviation,
            "rms_of_peak": m.rms_of_peak,
        }
        for m in found
    ]
