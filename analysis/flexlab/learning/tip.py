"""Where the tip was in a trial, by encoders, sensor and the identified model."""

from __future__ import annotations

import numpy as np

import flexura as fx

from ..identification.identify_rig import Identified
from ..identification.strip import StripModel

CORRECTED_HZ = 8.0  # of what the sensor says beyond the model
DRIFT_DEGREE = 3
REMEMBERED = 4  # trials over which that is averaged


class Observer:
    """The tip from encoders and sensor, through the identified model.

    The model follows the measured joints, which gives the tip and what the sensor should say. What
    the sensor says beyond that, slow drift taken away, corrects the tip. It is averaged over the
    last trials: the motion repeats itself, noise does not.
    """

    def __init__(self, found: Identified) -> None:
        """Args: found: the identification of this rig."""
        self.found = found
        self._beyond: list[np.ndarray] = []

    def followed(self, run: fx.Run) -> fx.Run:
        """A trial as the model follows its measured drives, joints behind their backlash.

        Args:
            run: the trial.
        """
        found = self.found
        data = StripModel(run, found.nominal.rig, found.nominal.robot, found.friction)
        return data.simulate(found.strip.values)

    def tip(self, run: fx.Run) -> np.ndarray:
        """x and y of the tip at the run's times (T, 2) [m].

        Args:
            run: the newest trial, complete.
        """
        from scipy.signal import butter, sosfiltfilt

        found = self.found
        nominal, values = found.nominal, found.strip.values
        data = StripModel(run, nominal.rig, nominal.robot, found.friction)
        model = data.simulate(values)
        said = data.voltage(model, values)
        off = data.sensor_V - said
        there = np.isfinite(off)
        off = np.interp(run.t, run.t[there], off[there])
        drift = np.polynomial.Legendre.fit(run.t, off, DRIFT_DEGREE)
        rate = 1 / float(np.median(np.diff(run.t)))
        low = butter(2, CORRECTED_HZ, output="sos", fs=rate)
        for_V = np.polyfit(said, model[f"link/{data.link}/tip_deflection"], 1)[0]
        if len(self._beyond) == 1 or len(self._beyond) > REMEMBERED:
            self._beyond.pop(0)  # the first trial's motion is another
        self._beyond.append(for_V * sosfiltfilt(low, off - drift(run.t)))
        mean = np.mean([_of_length(b, len(run.t)) for b in self._beyond], axis=0)
        # of what is left, noise of the sensor is no motion
        noise = (for_V * data.sensor_noise_V) ** 2 * 2 * CORRECTED_HZ / rate / len(self._beyond)
        mean *= max(0.0, 1.0 - noise / max(float(np.mean(mean**2)), 1e-30))
        angle = model[f"link/{data.link}/angle"]
        across = np.column_stack([-np.sin(angle), np.cos(angle)])
        tips = np.column_stack([model["tip/x"], model["tip/y"]])
        return np.asarray(tips + mean[:, None] * across)


def _of_length(values: np.ndarray, count: int) -> np.ndarray:
    """The values, cut or held to a length: trials end some reports earlier or later."""
    return np.concatenate([values, np.full(max(count - len(values), 0), values[-1])])[:count]
