"""Springs, transmissions, hub radii, lumped masses and bodies off the line: the solver against its
twin, and the twin against closed forms."""

import numpy as np
import pytest

import flexura as fx
from flexura import signals, twin
from robots import beam, rigid, robot

NEAR = 1e-3


def geared(table, rotor, stiffness, damping=0.0, **joint):
    between = {"stiffness_N_m_rad": stiffness, "damping_N_m_s_rad": damping}
    own = {"rotor_inertia_kg_m2": rotor, "transmission": between}
    return table | {"joint": table["joint"] | own | joint}


def lumps(table, *masses):
    keys = ("at_m", "mass_kg", "inertia_kg_m2")
    return table | {"mass": [dict(zip(keys, mass, strict=True)) for mass in masses]}


def off_tip(bot, mass, inertia, centre):
    keys = ("mass_kg", "inertia_kg_m2", "centre_of_mass_m")
    values = (mass, inertia, list(centre))
    return bot.replace({f"payload.{k}": v for k, v in zip(keys, values, strict=True)})


def furnished(gravity=(0.0, -9.81)):
    """A bracket and a flexible arm with all of it."""
    bracket = rigid(0.2, 0.3, 0.0, 1e-3, hub_inertia_kg_m2=2e-3, hub_radius_m=0.05)
    bracket |= {"centre_of_mass_m": [0.1, 0.04]}
    bracket = lumps(bracket, (0.15, 0.1, 1e-4))
    bracket["joint"]["spring"] = {"stiffness_N_m_rad": 30.0, "rest_rad": 0.2}
    arm = beam(0.6, 0.3, 2.0, 8, start=0.4, hub_radius_m=0.04, hub_mass_kg=0.2)
    arm["joint"]["hub_inertia_kg_m2"] = 1e-3
    arm = geared(lumps(arm, (0.25, 0.1, 1e-4), (0.6, 0.05, 0.0)), 0.01, 20.0, 0.01)
    return off_tip(robot(bracket, arm, gravity=gravity), 0.15, 1e-4, (0.05, -0.03))


def compared(bot, drive, t, beam="ancf", start=None, near=NEAR, **keys):
    """Both programs' runs; every channel is near, relative to the largest of its kind."""
    ours = fx.simulate(bot, t, drive, rtol=1e-8, start=start)
    theirs = twin.simulate(bot, t, drive, beam=beam, start=start, step_s=5e-4, **keys)
    assert theirs.complete and set(theirs.keys()) <= set(ours.keys())
    for name in theirs:
        if name.endswith(("drive", "velocity")):  # their time error is larger
            continue
        kind = name.split("/")[0] + ours.units[name]
        alike = [ours[c] for c in ours if c.split("/")[0] + ours.units[c] == kind]
        size = max(np.abs(x).max() for x in alike)
        assert np.abs(ours[name] - theirs[name]).max() <= near * size, name
    return ours, theirs


@pytest.mark.parametrize("kind", ["ancf", "ge"])
def test_an_arm_with_all_of_it(kind):
    drive = fx.Drive.force(
        signals.bang_bang(1.0, 0.4, rise_s=0.05), signals.bang_bang(0.3, 0.4, rise_s=0.05)
    )
    t = np.linspace(0, 0.5, 51)
    ours, _ = compared(furnished(), drive, t, kind, elements=16 if kind == "ge" else None)
    wound = ours["joint/2/position"] - ours["joint/2/motor_position"]
    assert np.ptp(wound) > 0.02 and np.ptp(ours["link/2/tip_deflection"]) > 0.02


def test_the_twin_keeps_the_energy():
    bot = furnished().replace({"link.2.joint.transmission.damping_N_m_s_rad": 0.0})
    t = np.linspace(0, 0.5, 51)
    run = twin.simulate(bot, t, qd0=[1.0, -0.5], start="straight", step_s=2.5e-4)
    total = sum(run[f"energy/{name}"] for name in ("kinetic", "strain", "potential"))
    assert np.abs(total - total[0]).max() < 2e-3 * np.ptp(run["energy/potential"])


def test_a_motor_that_follows_a_motion():
    motion, t = signals.cycloid(0.8, 0.4), np.linspace(0, 0.6, 61)
    arm = beam(0.5, 0.3, 2.0, 6, hub_inertia_kg_m2=2e-3)
    bot = robot(geared(arm, 0.05, 40.0, 0.05), payload=0.1)
    drive = fx.Drive.prescribed(motion)
    ours, theirs = compared(bot, drive, t)
    assert theirs["joint/1/motor_position"] == pytest.approx([motion(x)[0] for x in t], abs=1e-9)
    size = np.abs(ours["joint/1/drive"]).max()
    smooth = (np.abs(t - 0.02) > 0.025) & (np.abs(t - 0.42) > 0.025)  # its jerk jumps at 0, 0.4 s
    assert np.abs((ours["joint/1/drive"] - theirs["joint/1/drive"])[smooth]).max() < NEAR * size
    closed = fx.Drive.pd([signals.constant(0.5)], [20.0], [2.0])
    compared(bot, closed, t)


def test_a_carriage_on_a_spring_carries_an_arm():
    spring = {"stiffness_N_m": 80.0, "rest_m": 0.05}
    cart = rigid(0.0, 0.5, 0.0, 1e-3, "Pa", spring=spring)
    arm = lumps(beam(0.5, 0.2, 1.0, 8, hub_inertia_kg_m2=1e-3), (0.33, 0.05, 0.0))
    arm["damping"] = {"beta_s": 1e-3}
    bot = robot(cart, arm)
    compared(
        bot, fx.Drive.force(0.0, signals.bang_bang(0.1, 0.3, rise_s=0.05)), np.linspace(0, 0.6, 61)
    )


def test_the_frequencies_of_case_m02():
    """The twin rings at the frequencies of the solver: rotor held, free vibration after a pull."""
    bot = robot(geared(beam(0.7, 4.0, 0.6, 8, locked=True), 1.0, 100.0))
    t = np.linspace(0, 4, 401)
    run = fx.simulate(bot.replace({"gravity_m_s2": [0.0, -0.05]}), t, start="straight", rtol=1e-8)
    other = twin.simulate(
        bot.replace({"gravity_m_s2": [0.0, -0.05]}), t, start="straight", step_s=1e-3
    )
    for name in ("tip/y", "joint/1/position", "link/1/tip_deflection"):
        assert np.abs(run[name] - other[name]).max() < NEAR * np.abs(run["tip/y"]).max(), name
