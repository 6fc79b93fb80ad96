"""The balance of energy along motions of random robots, for long, and at rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

import flexura as fx
from identities import drives, small_state
from robots import (
    beam,
    bench_arm,
    few,
    rigid,
    robot,
    robots,
    seeds,
    system,
)

# Energy along a motion


@few
@given(robots(max_links=4, stiffening=True), seeds)
def test_energy_changes_by_the_work_of_the_drives_less_the_losses(bot, seed):
    """To 1e-8 of the largest energy (B12) at rtol 1e-11, since work and losses do not choose the
    steps."""
    sys = fx.assemble(bot)
    run = fx.simulate(
        sys,
        [0.0, 0.05, 0.1],
        drives(sys, seed),
        **small_state(sys, seed),
        rtol=1e-11,
        method="explicit",
    )
    assert run.meta["energy_error"] < 1e-8


@few
@given(robots(max_links=3, modes=False, stiffening=True), seeds)
def test_energy_is_balanced_by_the_implicit_method_too(bot, seed):
    sys = fx.assemble(bot)
    run = fx.simulate(
        sys,
        [0.0, 0.025, 0.05],
        drives(sys, seed),
        **small_state(sys, seed),
        rtol=1e-11,
        method="implicit",
    )
    assert run.meta["energy_error"] < 1e-8


@pytest.mark.parametrize("second", [{}, {"locked": True}], ids=["free", "locked"])
def test_round_off_does_not_feed_energy_into_a_fine_link_that_carries_bodies(second):
    """A flexible link with two rigid ones on it, the first free or fixed: at rtol 1e-11 the balance
    is kept to 1e-9."""
    body = {"hub_inertia_kg_m2": 1e-3, "start": -1.0}
    arm = system(
        beam(0.2, 0.1, 0.5, 6, **body),
        rigid(0.2, 0.1, 0.0, 1e-3, **body, **second),
        rigid(0.2, 0.1, 0.0, 1e-3, **body),
    )
    run = fx.simulate(arm, [0.0, 0.05], **small_state(arm, 0), rtol=1e-11, method="explicit")
    assert run.meta["energy_error"] < 1e-9


# For long, and at rest


def test_a_bench_arm_keeps_its_energy_for_long():
    """Five seconds of free vibration, undamped: no drift beyond a hundred times the tolerance."""
    arm = bench_arm()
    q = fx.static(arm, tip_force=(0.0, 0.2))
    for method, rtol in (("explicit", 1e-10), ("implicit", 1e-8)):
        assert (
            fx.simulate(arm, np.linspace(0, 5, 6), q0=q, rtol=rtol, method=method).meta[
                "energy_error"
            ]
            < 100 * rtol
        )


def test_a_robot_that_hangs_still_stays_still():
    """Static equilibrium under gravity of hanging links is a fixed point of the motion."""
    hang = robot(
        beam(0.5, 0.2, 1.0, 3, start=-np.pi / 2),
        rigid(0.3, 0.4, 0.1, 1e-3),
        beam(0.3, 0.2, 1.0, 2),
        payload=0.1,
        gravity=(0.0, -9.81),
    )
    sys = fx.assemble(hang)
    run = fx.simulate(sys, [0.0, 1.0], q0=fx.static(sys), rtol=1e-8)
    assert np.abs(run.states[-1] - run.states[0]).max() < 1e-9
