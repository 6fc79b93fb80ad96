"""Frequency responses: from a drive to any channel of small motions, with their Bode plot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...io import array, choice, write_bytes
from ...optional import Optional
from ..system import RobotLike, System, assemble, jacobian
from .mode_motion import observed_units
from .statespace import StateSpace, linearize

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 600
DECADES = 1.0  # below the lowest and above the highest of the ten lowest frequencies
pyplot = Optional("matplotlib.pyplot")


@dataclass(frozen=True)
class FrequencyResponse:
    """A channel's small motions under a harmonic drive: `values` (F,), complex, at `frequencies_Hz`
    (F,) (121)."""

    frequencies_Hz: np.ndarray
    values: np.ndarray
    drive: str
    channel: str
    unit: str

    @property
    def magnitude(self) -> np.ndarray:
        """Amplitude of the channel for each unit of the drive (F,)."""
        return np.abs(self.values)

    @property
    def phase_rad(self) -> np.ndarray:
        """Phase (F,), without jumps by whole turns."""
        return np.unwrap(np.angle(self.values))

    def bode(self, out: str | Path | None = None) -> Figure:
        """Draw magnitude and phase over the frequency.

        Args:
            out: a file to write, .pdf, .svg or .png.

        Returns:
            The figure of matplotlib.

        Raises:
            InputError: `out` has another ending.
            Missing: matplotlib is not installed.
        """
        form = _picture_form(out)
        figure, (above, below) = pyplot.subplots(2, 1, sharex=True, layout="constrained")
        above.loglog(self.frequencies_Hz, self.magnitude)
        above.set_ylabel(f"{self.channel} [{self.unit}]")
        above.set_title(f"{self.drive} to {self.channel}")
        below.semilogx(self.frequencies_Hz, np.degrees(self.phase_rad))
        below.set(xlabel="frequency [Hz]", ylabel="phase [deg]")
        for axes in (above, below):
            axes.grid(alpha=0.3)
        return _written(figure, out, form)

    def nyquist(self, out: str | Path | None = None) -> Figure:
        """Draw the values in the complex plane, with the unit circle and the point -1 of a loop.

        Args:
            out: a file to write, .pdf, .svg or .png.

        Returns:
            The figure of matplotlib.

        Raises:
            InputError: `out` has another ending.
            Missing: matplotlib is not installed.
        """
        form = _picture_form(out)
        figure, axes = pyplot.subplots(layout="constrained")
        round_one = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
        axes.plot(round_one.real, round_one.imag, color="0.7", linewidth=0.8)
        axes.plot([-1.0], [0.0], "+", color="black")
        axes.plot(self.values.real, self.values.imag)
        axes.plot(self.values.real, -self.values.imag, linestyle="--", linewidth=0.8)
        axes.set(xlabel="real part", ylabel="imaginary part", xlim=(-3, 3), ylim=(-3, 3))
        axes.set(title=f"{self.drive} to {self.channel} [{self.unit}]", aspect="equal")
        axes.grid(alpha=0.3)
        return _written(figure, out, form)


def _picture_form(out: str | Path | None) -> str:
    """The format of a picture's file, "" if there is none. Raises InputError."""
    form = "" if out is None else Path(out).suffix.lower().removeprefix(".")
    if out is not None and form not in ("pdf", "svg", "png"):
        raise InputError(
            "expected a file that ends with .pdf, .svg or .png", key="out", value=str(out)
        )
    return form


def _written(figure: Figure, out: str | Path | None, form: str) -> Figure:
    if out is not None:
        import io

        picture = io.BytesIO()
        figure.savefig(picture, format=form)
        pyplot.close(figure)
        write_bytes(out, picture.getvalue())
    return figure


def frequency_response(
    robot: RobotLike,
    drive: str,
    channel: str,
    frequencies_Hz: ArrayLike | None = None,
    q: ArrayLike | None = None,
) -> FrequencyResponse:
    """The response of a channel to a harmonic drive, for small motions about an equilibrium (121).

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        drive: "joint/1/drive", ...
        channel: "joint/i/position", "joint/i/velocity", or any channel of links and tip that a Run
            has.
        frequencies_Hz: (F,), by default from a tenth of the lowest natural frequency to ten times
            the tenth.
        q: the equilibrium (n,), by default the static one at the start.

    Returns:
        Frequencies, magnitude and phase.

    Raises:
        InputError: an argument is not what is expected.
    """
    system = assemble(robot)
    lin = linearize(system, q)
    choice(drive, "drive", lin.inputs)
    row, unit, rate = _output(system, lin, channel)
    if frequencies_Hz is None:
        hertz = np.abs(lin.poles) / (2 * np.pi)
        found = np.sort(hertz[hertz > 1e-3])[: 2 * 10]
        low, high = (found[0], found[-1]) if len(found) else (1.0, 1.0)
        f = np.geomspace(low / 10**DECADES, high * 10**DECADES, POINTS)
    else:
        f = array(
            frequencies_Hz, "frequencies_Hz", "expected frequencies above 0 in hertz", (None,)
        )
        if not np.all(f > 0):
            raise InputError(
                "expected frequencies above 0 in hertz", key="frequencies_Hz", value=frequencies_Hz
            )
    s = 2j * np.pi * f
    push = lin.E[:, lin.inputs.index(drive)].astype(complex)
    matrices = s[:, None, None] ** 2 * lin.M + s[:, None, None] * lin.G + lin.K
    moved = np.linalg.solve(matrices, np.broadcast_to(push[:, None], (len(f), len(push), 1)))
    values = moved[:, :, 0] @ row * (s if rate else 1.0)
    return FrequencyResponse(f, values, drive, channel, f"{unit}/{lin.units[drive]}")


def _output(system: System, lin: StateSpace, channel: str) -> tuple[np.ndarray, str, bool]:
    """The row (m,) that gives a channel of the free unknowns, its unit, if it is a rate."""
    if not isinstance(channel, str):
        raise InputError("expected the name of a channel", key="channel", value=channel)
    free = system.free_rows
    names = observed_units(system)
    for i, row in enumerate(system.joint_rows, 1):
        unit = "rad" if system.robot.links[i - 1].joint.type == "R" else "m"
        if channel == f"joint/{i}/position":
            return (free == row).astype(float), unit, False
        if channel == f"joint/{i}/velocity":
            return (free == row).astype(float), f"{unit}/s", True
    places = [name for name in names if not name.startswith("energy")]
    if channel not in places:
        joints = [
            f"joint/{i + 1}/{x}"
            for i in range(len(system.joint_rows))
            for x in ("position", "velocity")
        ]
        raise InputError(
            f"expected one of {', '.join([*joints, *places])}", key="channel", value=channel
        )
    column = list(names).index(channel)
    still = np.zeros((1, system.n))
    look = lambda z: system.observe(z[None], still)[0, column : column + 1]
    return jacobian(look, lin.q, np.full(system.n, 1e-6))[0, free], names[channel], False
