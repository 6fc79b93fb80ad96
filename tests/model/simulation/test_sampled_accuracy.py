"""A controller's ticks make the forces jump: exponential steps hold the tolerance all the same.

The error counts as in the accuracy table: relative to the largest deflection, or a thousandth of
the tip's way. The reference are explicit steps, which resolve all that swings.
"""

import numpy as np
import pytest

import flexura as fx

BARE_HUB = fx.Robot.from_dict(
    {
        "link": [
            {
                "length_m": 0.4,
                "elements": 4,
                "mass_per_length_kg_m": 0.2,
                "bending_stiffness_N_m2": 2.0,
                "damping": {"beta_s": 1e-3},
                "joint": {"type": "R"},
            }
        ],
        "payload": {"mass_kg": 0.2},
    }
)
ROBOTS = {
    "bare hub": (BARE_HUB, [1.0]),
    "rig-rr": (fx.load("rig-rr"), [0.2, 0.1]),
    "rig": (fx.load("rig"), [3.0, 0.02]),
    "type-1-rr": (fx.load("type-1-rr"), [0.02, 0.01]),
}
TIMES = np.linspace(0.0, 0.3, 31)


def run(robot, size, rate_Hz, **how):
    law = lambda t: np.cos(9.0 * t) * np.array(size)
    return fx.simulate(robot, TIMES, fx.Sampled(law, rate_Hz), **how)


@pytest.mark.parametrize("rate_Hz", [50.0, 250.0, 1000.0])
@pytest.mark.parametrize("name", ROBOTS)
def test_exponential_steps_hold_the_tolerance_under_a_sampled_law(name, rate_Hz):
    robot, size = ROBOTS[name]
    exact = run(robot, size, rate_Hz, method="explicit", rtol=1e-10)
    x, y = exact["tip/x"], exact["tip/y"]
    bent = max(np.abs(exact[k]).max() for k in exact if k.endswith("tip_deflection"))
    scale = max(bent, 1e-3 * np.hypot(np.diff(x), np.diff(y)).sum())
    for rtol in (1e-4, 1e-6, 1e-7):
        found = run(robot, size, rate_Hz, method="exponential", rtol=rtol)
        error = np.hypot(found["tip/x"] - x, found["tip/y"] - y).max()
        assert error <= 20.0 * rtol * scale, (rtol, error / (rtol * scale))


def test_a_sampled_law_takes_no_more_evaluations_than_the_same_steps_as_signals():
    """What the ticks' own starts save over forgetting the past, at equal error."""
    robot, size = ROBOTS["rig-rr"]
    force = lambda t: np.cos(9.0 * t) * np.array(size)
    ticks = np.arange(0.0, 0.3, 0.01)
    jumps = np.diff([force(t) for t in ticks], axis=0, prepend=0.0)
    signals = [
        fx.signals.sum([fx.signals.step(j, at_s=t) for j, t in zip(column, ticks, strict=True)])
        for column in jumps.T
    ]
    held = run(robot, size, 100.0, method="exponential", rtol=1e-6)
    stepped = fx.simulate(robot, TIMES, signals, method="exponential", rtol=1e-6)
    assert held["tip/y"] == pytest.approx(stepped["tip/y"], abs=1e-5 * np.ptp(stepped["tip/y"]))
    assert held.meta["evaluations"] < stepped.meta["evaluations"]
