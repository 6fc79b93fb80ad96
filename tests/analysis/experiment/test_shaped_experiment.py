"""Input shaping from an identified frequency, on the emulated rig: the whole way from one free
vibration to a strip at rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

import flexura as fx
from boards import elf
from experiments import BENCH, SETTINGS, experiment
from flexlab.experiment import plan as plans
from flexlab.experiment.run_experiment import open_board
from flexlab.identification.vibration.shapers import Shaper, shaped
from flexura import signals
from flexura.signals import constant, trapezoidal

MOVE_S, END_RAD, SEED = 0.25, 0.5, 3


def emulated(plan, folder) -> fx.Run:
    """On the rig's plant, which is not the native model and has other numbers than the robot
    file."""
    run = experiment(plan, folder, opened=open_board(BENCH, None, SEED, elf())).run
    assert run.meta["emulated"] and run.meta["complete"]
    return run


def free_vibration(run: fx.Run, from_s: float) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of what the sensor says from an instant on: a damped sine
    and a constant."""
    there = (run.t >= from_s) & np.isfinite(run["link/2/tip_deflection"])
    t, w = run.t[there] - from_s, run["link/2/tip_deflection"][there]
    spectrum = np.abs(np.fft.rfft((w - w.mean()) * np.hanning(len(w)), 1 << 16))
    at = np.fft.rfftfreq(1 << 16, np.median(np.diff(t)))
    guess = at[(at > 1) & (at < 20)][spectrum[(at > 1) & (at < 20)].argmax()]

    def left(x):
        wave = np.exp(-x[1] * t)
        basis = np.column_stack(
            [
                wave * np.cos(2 * np.pi * x[0] * t),
                wave * np.sin(2 * np.pi * x[0] * t),
                np.ones_like(t),
            ]
        )
        return w - basis @ np.linalg.lstsq(basis, w, rcond=None)[0]

    found = least_squares(left, [guess, 0.2], x_scale=[0.01, 0.1]).x
    return float(found[0]), float(found[1] / (2 * np.pi * found[0]))


def left(run: fx.Run, frequency_Hz: float) -> float:
    """Amplitude [m] of the vibration in the second after the motion, at that frequency: the
    sensor's noise averages out."""
    begin = run.meta["phases"][0]["t"] + 0.9
    there = (run.t >= begin) & (run.t < begin + 1.0) & np.isfinite(run["link/2/tip_deflection"])
    t = run.t[there]
    basis = np.column_stack(
        [
            np.cos(2 * np.pi * frequency_Hz * t),
            np.sin(2 * np.pi * frequency_Hz * t),
            np.ones_like(t),
            t,
        ]
    )
    return float(
        np.hypot(*np.linalg.lstsq(basis, run["link/2/tip_deflection"][there], rcond=None)[0][:2])
    )


def turn(motion) -> plans.Plan:
    drive = fx.Drive.pd([constant(0.0), motion], [1, 1], [0, 0])
    return plans.inverse(BENCH, SETTINGS, fx.Manoeuvre("turn and stop", 2.2, 0.01, drive))


def test_a_motion_that_does_not_rest_is_shaped_with_its_lead_out():
    """The rig's harmonic motions end at speed: shaped, they come to the same rest, a period
    later."""
    frequency = 4.76
    plain = plans.inverse(BENCH, SETTINGS)
    shaper = Shaper("zvd", frequency, 0.0)
    made = plans.inverse(BENCH, SETTINGS, None, lambda whole: shaped(whole, shaper))
    assert made.duration_s == pytest.approx(plain.duration_s + 1 / frequency)
    for one, other in zip(plain.knots.columns.values(), made.knots.columns.values(), strict=True):
        assert abs(one[-1] - other[-1]) <= 1 and abs(one[0] - other[0]) <= 1
    assert made.phases == plain.phases and plain.asked["out_s"] > 0


@pytest.mark.slow
def test_shaping_from_the_identified_frequency_brings_the_strip_to_rest(tmp_path):
    """ZV and ZVD at the identified frequency: a twentieth of the unshaped vibration. 10 % off: ZVD
    still a tenth, ZV not."""
    ringing = emulated(plans.free_vibration(BENCH, SETTINGS, 0.2, 5.0), tmp_path / "free")
    frequency, ratio = free_vibration(ringing, ringing.meta["asked"]["rings_from_s"] + 0.1)
    assert 4.0 < frequency < 6.5 and 0 < ratio < 0.05
    plain = trapezoidal(END_RAD, MOVE_S, 0.1, at_s=0.1)
    amplitude = left(emulated(turn(plain), tmp_path / "plain"), frequency)
    assert amplitude > 5e-3
    parts = {}
    for name, shaper, factor in (
        ("zv", signals.zv, 1.0),
        ("zvd", signals.zvd, 1.0),
        ("zv +10 %", signals.zv, 1.1),
        ("zvd +10 %", signals.zvd, 1.1),
        ("zvd -10 %", signals.zvd, 0.9),
    ):
        run = emulated(
            turn(shaper(plain, factor * frequency, ratio)), tmp_path / name.replace(" ", "")
        )
        assert run["joint/2/position"][-1] == pytest.approx(END_RAD, abs=0.005)
        parts[name] = amplitude / left(run, frequency)
    print(
        f"identified {frequency:.3f} Hz, damping {ratio:.4f}; unshaped {1e3 * amplitude:.2f} mm; "
        f"fewer times: {parts}"
    )
    assert parts["zv"] > 20 and parts["zvd"] > 20
    assert parts["zvd +10 %"] > 10 and parts["zvd -10 %"] > 10 > parts["zv +10 %"]
