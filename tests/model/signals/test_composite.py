"""Pulses, chirps and noise; sums and delays: by their formulas, in files, and in a run."""

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flexura as fx
import robots
from flexura import signals
from flexura.signals import chirp, cycloid, delayed, from_spec, harmonic, noise, pulse, step

T = np.linspace(-0.5, 3.5, 1601)


def values(signal, t=T):
    return np.array([signal(float(at)) for at in t])


def test_a_pulse_is_there_for_its_duration():
    y = values(pulse(2.5, 0.75, 0.5))[:, 0]
    assert np.array_equal(y, np.where((T >= 0.5) & (T < 1.25), 2.5, 0.0))


def test_a_chirp_is_its_formula_with_both_derivatives():
    a, f0, f1, d, at = 0.3, 2.0, 21.0, 2.0, 0.25
    s = T - at
    inside = (s >= 0) & (s < d)
    phase = 2 * np.pi * (f0 * s + (f1 - f0) * s**2 / (2 * d))
    w, growth = 2 * np.pi * (f0 + (f1 - f0) * s / d), 2 * np.pi * (f1 - f0) / d
    y = [
        np.sin(phase),
        w * np.cos(phase),
        growth * np.cos(phase) - w**2 * np.sin(phase),
    ]
    exact = a * np.where(inside, y, 0.0).T
    found = values(chirp(a, f0, f1, d, at))
    off = np.abs(found - exact).max(axis=0) / np.abs(exact).max(axis=0)
    assert np.all(off < [1e-10, 1e-8, 1e-7])


def test_noise_has_its_size_and_band_and_begins_and_ends_at_rest():
    rms, cutoff, d = 0.2, 25.0, 200.0
    y = noise(rms, cutoff, d, seed=3)
    t = np.arange(0.0, d, 1 / (16 * cutoff))
    sampled, _ = signals.signal.evaluate_many(y.segments, t)
    assert sampled.std() == pytest.approx(rms, rel=0.12)  # between its knots a spline is smaller
    power = np.abs(np.fft.rfft(sampled)) ** 2
    beyond = np.fft.rfftfreq(len(t), t[1]) > 1.3 * cutoff
    assert power[beyond].sum() < 0.05 * power.sum()
    assert y(0.0)[:2] == pytest.approx((0.0, 0.0), abs=1e-12)
    assert y(d - 1e-12)[:2] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert np.array_equal(y.segments, noise(rms, cutoff, d, seed=3).segments)
    assert not np.array_equal(y.segments, noise(rms, cutoff, d, seed=4).segments)


PARTS = [
    step(0.4, 0.3),
    cycloid(1.0, 0.8, 0.2, 0.1),
    signals.table([0.0, 0.7, 1.1, 2.0], [0.0, 1.0, -0.5, 0.3]),
    pulse(-2.0, 0.5, 1.0),
    chirp(0.2, 1.0, 3.0, 1.0, 0.4),
    noise(0.1, 5.0, 2.0),
]


@pytest.mark.parametrize(
    "signal", [*PARTS, harmonic(0.3, 4.0, 0.2, 0.1), signals.sum([*PARTS, harmonic(0.3, 4.0)])]
)
def test_many_values_have_the_digits_of_each(signal):
    breaks = signal.breaks if isinstance(signal, signals.Signal) else []
    t = np.concatenate([np.random.default_rng(1).uniform(-0.5, 2.5, 500), breaks])
    y, rates = signals.evaluate_many(signal.segments, t)
    each = np.array([signals.evaluate(signal.segments, at)[:2] for at in t])
    assert np.array_equal(y, each[:, 0])
    np.testing.assert_allclose(rates, each[:, 1], rtol=1e-12, atol=1e-12 * abs(rates).max())


@pytest.mark.parametrize("more", [[], [harmonic(0.3, 4.0, 0.2, 0.1)], [harmonic(0.3, 1.25)]])
def test_a_sum_is_the_sum_of_values_and_derivatives(more):
    parts = PARTS + more
    found = signals.sum(parts)
    assert bool(len(found.segments)) == (not more or more[0].spec["frequency_Hz"] == 1.25)
    wanted = sum(values(part) for part in parts)
    assert values(found) == pytest.approx(wanted, rel=1e-9, abs=1e-8)


def test_a_delay_moves_all_of_a_signal():
    for part in [*PARTS, harmonic(0.3, 4.0, 0.2, 0.1)]:
        assert values(delayed(part, 0.45)) == pytest.approx(values(part, T - 0.45), abs=1e-8)


def test_they_are_read_back_from_their_tables():
    every = [*PARTS[3:], delayed(PARTS[1], 0.5), signals.sum(PARTS), signals.sum([harmonic(1, 2)])]
    for signal in [*every, signals.sum([harmonic(1, 2), harmonic(1, 3)])]:
        again = from_spec(json.loads(json.dumps(signal.spec)))
        assert np.array_equal(values(again), values(signal))


def test_harmonics_of_two_frequencies_drive_a_robot():
    """A rigid disc without a spring: twice the integral of the torque."""
    arm = fx.Robot.from_dict({"link": [robots.rigid(0.5, 1.0, 0.25, 0.02)]})
    inertia = fx.assemble(arm).mass(np.zeros(1))[0, 0]
    both = signals.sum([harmonic(0.2, 1.0), harmonic(0.1, 3.7, 0.4)])
    t = np.linspace(0, 2, 41)
    run = fx.simulate(arm, t, [both], rtol=1e-8)
    torque = lambda s: 0.2 * np.cos(2 * np.pi * s) + 0.1 * np.cos(2 * np.pi * 3.7 * s + 0.4)
    exact = solve_ivp(
        lambda s, z: [z[1], torque(s) / inertia], (0, 2), [0, 0], t_eval=t, rtol=1e-10, atol=1e-12
    )
    assert run["joint/1/position"] == pytest.approx(exact.y[0], abs=1e-6)
    back = fx.inverse(arm, t, [both], qd0=None)
    assert back["joint/1/position"] == pytest.approx([both(s)[0] for s in t], abs=1e-7)


CHIRP = {"kind": "chirp", "amplitude": 1, "start_Hz": 1, "end_Hz": 2, "duration_s": 1}


@pytest.mark.parametrize(
    ("spec", "key"),
    [
        ({"kind": "pulse", "value": 1.0, "duration_s": 0.0}, "s.duration_s"),
        (
            CHIRP | {"start_Hz": -1},
            "s.start_Hz",
        ),
        (
            CHIRP | {"end_Hz": 1e6},
            "s.duration_s",
        ),
        ({"kind": "noise", "rms": 1, "cutoff_Hz": 0, "duration_s": 1}, "s.cutoff_Hz"),
        ({"kind": "noise", "rms": 1, "cutoff_Hz": 1, "duration_s": 1, "seed": -1}, "s.seed"),
        ({"kind": "sum", "signals": []}, "s.signals"),
        ({"kind": "sum", "signals": 3.0}, "s.signals"),
        ({"kind": "sum", "signals": [{"kind": "stepp"}]}, "s.signals[1].kind"),
        ({"kind": "delayed", "signal": {"kind": "step", "value": 1.0}}, "s.by_s"),
    ],
)
def test_what_is_wrong_is_named(spec, key):
    with pytest.raises(fx.InputError) as error:
        from_spec(spec, key="s")
    assert error.value.key == key
