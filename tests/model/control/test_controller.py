"""Sampled controllers: a cart's recursion written out, the continuous limit, the linear model."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import flexura as fx
from controlled_robots import TICK, cart, rig, rig_controller
from flexura import control, signals
from flexura.control import controller, lqr
from flexura.simulation import gain_sweep
from robots import beam, rigid, robot, system


def rounded(x: float, quantum: float) -> float:
    return quantum * np.floor(x / quantum + 0.5) if quantum else x


def by_hand(c: fx.PID, mass: float, ticks: int) -> np.ndarray:
    """Positions of a cart (ticks + 1,) under the law as firmware/README.md states it."""
    a, b = (
        1 - np.exp(-2 * np.pi * f * TICK) if f else 1.0 for f in (c.setpoint_Hz, c.derivative_Hz)
    )
    x = v = integral = u = speed = 0.0
    last, r, given, out = 0.0, c.reference(-1e-9)[0], [0.0] * round(c.delay_s / TICK), [0.0]
    for k in range(ticks):
        q = rounded(x, c.count)
        r, r_before = r + a * (c.reference(k * TICK)[0] - r), r
        rate = (r - r_before) / TICK
        speed += b * ((q - last) / TICK - speed)
        last, e = q, r - q
        grown = integral + c.ki * e * TICK
        grown = grown if abs(grown) <= c.limit else integral
        wish = c.kp * e + grown + c.kd * (rate - speed) + c.kv * rate + c.kc * np.sign(rate)
        before, u = (
            u,
            float(np.clip(np.clip(wish, -c.limit, c.limit), u - c.slew * TICK, u + c.slew * TICK)),
        )
        assert abs(u) <= c.limit and abs(u - before) <= c.slew * TICK * (1 + 1e-9)
        if not ((wish > u and e >= 0) or (wish < u and e < 0)):
            integral = grown
        given.append(u)
        force = rounded(given.pop(0), c.duty) / mass
        x, v = x + TICK * (v + TICK * force / 2), v + TICK * force
        out.append(x)
    return np.array(out)


@settings(max_examples=15, deadline=None)
@given(st.data())
def test_a_cart_follows_the_recursion_written_out(data):
    """Filters, sum and its stop, limit, slew, delay and resolutions, to the solver's round-off.

    Resolutions are odd numbers: under a force of 40 N the cart is at multiples of 1e-5 m, where a
    position of half a count is rounded up or down by the last digit.
    """
    pick = lambda *values: data.draw(st.sampled_from(values))
    c = fx.PID(
        signals.cycloid(0.3, 0.2) if pick(True, False) else signals.step(0.3, 0.02),
        kp=pick(100.0, 400.0),
        ki=pick(0.0, 900.0),
        kd=pick(0.0, 25.0),
        kv=pick(0.0, 3.0),
        kc=pick(0.0, 0.5),
        limit=pick(5.0, 40.0, np.inf),
        slew=pick(300.0, np.inf),
        setpoint_Hz=pick(0.0, 3.0),
        derivative_Hz=pick(0.0, 50.0),
        delay_s=pick(0.0, 0.003),
        count=pick(0.0, 0.9717e-4),
        duty=pick(0.0, 0.09831),
    )
    run = fx.simulate(
        cart(), np.arange(401) * TICK, fx.Controller((c,)), rtol=1e-12, method="explicit"
    )
    wanted = by_hand(c, 2.0, 400)
    np.testing.assert_allclose(run["joint/1/position"], wanted, atol=1e-10)


def law_by_hand(pids, drive, positions, w, s):
    """Outputs (K, N) of the law as controller.py states it, from measured positions (K, N),
    deflections and slopes (K,)."""
    T, smooth = 1 / drive.rate_Hz, lambda f, T: 1 - np.exp(-2 * np.pi * f * T) if f else 1.0
    strip = [np.zeros(2), np.zeros(2)]  # value and rate of deflection, of slope
    m = [
        dict(
            sum=0.0,
            u=0.0,
            r=p.reference(-1e-9)[0],
            speed=0.0,
            last=x,
            pulses=x,
            tip=0.0,
            z=0.0,
            d=0.0,
        )
        for p, x in zip(pids, positions[0])
    ]
    out = np.zeros(positions.shape)
    for k in range(len(positions)):
        readings = np.array(
            [[rounded(w[j], drive.deflection_quantum_m), s[j]] for j in (max(k - 1, 0), k)]
        )
        if k == 0:
            strip[0][0], strip[1][0] = readings[1]
        if k % 2 == 0:
            for value, mean in zip(strip, readings.mean(axis=0)):
                change = smooth(drive.deflection_Hz, 2 * T) * (mean - value[0])
                value += [change, change / (2 * T) - value[1]]
        for i, (p, own) in enumerate(zip(pids, m)):
            before, own["r"] = (
                own["r"],
                own["r"] + smooth(p.setpoint_Hz, T) * (p.reference(k * T)[0] - own["r"]),
            )
            rate = (own["r"] - before) / T
            own["speed"] += smooth(p.derivative_Hz, T) * (
                (positions[k, i] - own["last"]) / T - own["speed"]
            )
            own["last"] = positions[k, i]
            counts = isinstance(p.output, fx.Stepper) and not p.output.encoder
            q, speed = (own["pulses"], own["u"]) if counts else (positions[k, i], own["speed"])
            if k % 2 == i % 2:
                own["tip"] = (
                    p.kf * strip[0][0]
                    + p.kg * strip[0][1]
                    + p.ks * strip[1][0]
                    + p.kt * strip[1][1]
                    + own["d"]
                )
            elif p.observer_Hz:
                a = smooth(p.observer_Hz, 2 * T)
                c = p.jo * a / (2 * T * (1 - a))
                own["z"] += a * (own["u"] + (c - p.bo) * speed - own["z"])
                own["d"] = own["z"] - c * speed
            e = own["r"] - q
            grown = own["sum"] + p.ki * e * T
            grown = grown if abs(grown) <= p.limit else own["sum"]
            ahead = p.feedforward(k * T)[0] if p.feedforward else 0.0
            wish = (
                p.kp * e
                + grown
                + p.kd * (rate - speed)
                + own["tip"]
                + p.kv * rate
                + p.kc * np.sign(rate)
                + ahead
            )
            u = np.clip(
                np.clip(wish, -p.limit, p.limit), own["u"] - p.slew * T, own["u"] + p.slew * T
            )
            if not ((wish > u and (e < 0) == (p.ki < 0)) or (wish < u and (e < 0) != (p.ki < 0))):
                own["sum"] = grown
            own["u"], own["pulses"] = u, own["pulses"] + u * T
            out[k, i] = u
    return out


@pytest.mark.parametrize("seed", range(6))
def test_every_term_is_that_of_the_law_written_out(seed):
    """A force, a stepper that counts and one by its encoder, each with all terms, on random
    measurements."""
    r, count = np.random.default_rng(seed), 120
    sys = system(
        rigid(0.1, 0.6, 0.05, 5e-4, "Pa"),
        rigid(0.1, 0.2, 0.05, 5e-4),
        beam(0.3, 0.157, 0.3333, 4, modes=2),
    )
    pids = tuple(
        fx.PID(
            signals.harmonic(*r.uniform(0.1, 2.0, 2)),
            output,
            feedforward=signals.harmonic(*r.uniform(0.1, 2.0, 2)),
            setpoint_Hz=r.choice([0.0, 5.0]),
            derivative_Hz=r.choice([0.0, 50.0]),
            limit=r.choice([3.0, np.inf]),
            slew=r.choice([500.0, np.inf]),
            observer_Hz=8.0 if isinstance(output, fx.Force) else 0.0,
            jo=r.uniform(0.0, 0.01),
            bo=r.uniform(0.0, 0.5),
            **dict(zip(controller.GAINS, r.uniform(-0.5, 0.9, 9))),
        )
        for output in (fx.Force(), fx.Stepper(), fx.Stepper(encoder=True))
    )
    drive = fx.Controller(pids, rate_Hz=500.0, deflection_Hz=20.0, deflection_quantum_m=1e-4)
    positions = np.cumsum(r.normal(0, 1e-3, (count, 3)), axis=0)
    w, s = np.cumsum(r.normal(0, 1e-3, (2, count)), axis=1)
    sampler = drive.sampler(sys)
    sampler.start(sys.start())
    for k in range(count):
        force, motion = sampler.step(k, k / 500, positions[k], w[k], s[k])
        assert force[0] == sampler.log[k, 0, 1] and motion[1, 0] == sampler.log[k, 1, 2]
    np.testing.assert_allclose(
        sampler.log[:, :, 1], law_by_hand(pids, drive, positions, w, s), rtol=1e-9, atol=1e-9
    )


def test_the_law_measures_what_a_run_shows():
    """Tip deflection and slope are those of the exact line: with kf and ks alone, forces are the
    Run's channels."""
    sys = system(beam(0.3, 0.157, 0.3333, 4), payload=0.02)
    bent = fx.static(sys, tip_force=(0.0, 2.0))
    for gain, channel in (("kf", "tip_deflection"), ("ks", "tip_slope")):
        c = fx.PID(signals.constant(0.0), **{gain: 3.0})
        run = fx.simulate(sys, [0.0, TICK], fx.Controller((c,), deflection_Hz=0.0), q0=bent)
        assert run["joint/1/drive"][0] == pytest.approx(
            3.0 * run[f"link/1/{channel}"][0], rel=1e-15
        )
        assert abs(run[f"link/1/{channel}"][0]) > 0.03


def test_a_run_begins_where_the_robot_stands():
    """A stepper that holds a joint which does not start at 0."""
    sys = system(beam(0.3, 0.157, 0.3333, 4, "Pb", start=0.2), payload=0.02)
    run = fx.simulate(
        sys, [0.0, 0.01], fx.Controller((fx.PID(signals.constant(0.2), fx.Stepper(), kp=5.0),))
    )
    np.testing.assert_array_equal(run["joint/1/position"], [0.2, 0.2])


def test_rows_of_gains_are_runs_whatever_their_order_and_threads():
    sys = rig()
    drive = rig_controller()
    rows = np.repeat(drive.gains()[None], 6, axis=0)
    rows[:, 0, controller.KP] = np.linspace(100, 600, 6)
    many = gain_sweep.prepare_gain_sweep(sys, drive, 1.0, 0.005, 1e-5)
    figures, reached = many.run(rows)
    assert (reached == 1.0).all()
    again, _ = many.run(rows[::-1], threads=3)
    np.testing.assert_array_equal(again[::-1], figures)


@pytest.mark.parametrize("name", ["single-r", "rig-rr", "type-7-pbr"])
def test_a_row_of_gains_is_the_run_that_simulate_makes(name):
    """With the method that suits each: of strips whose modes are faster than the ticks, too."""
    sys = fx.assemble(fx.load(name))
    q = sys.start()
    inertia = np.diag(sys.mass(q))[sys.joint_rows]
    laws = [
        fx.PID(signals.step(float(q[row]) + 0.02), kp=160.0 * m, kd=12.0 * m, limit=4.0 * m)
        for row, m in zip(sys.joint_rows, inertia, strict=True)
    ]
    drive = fx.Controller(tuple(laws), rate_Hz=1000.0)
    many = gain_sweep.prepare_gain_sweep(sys, drive, 0.3, 0.005, 1e-4, start="straight")
    figures, reached = many.run(drive.gains()[None])
    t = np.arange(0, 301, 5) * 1e-3
    run = fx.simulate(sys, t, drive, rtol=1e-4, start="straight")
    references = [np.full(len(t), law.reference(0.1)[0]) for law in laws]
    found = control.step_response(run, references, [law.limit for law in laws])
    told = np.concatenate([found.joints.ravel(), found.strip])
    effort = control.EFFORT + len(control.JOINT) * np.arange(len(laws))
    rest = np.setdiff1d(np.arange(len(told)), effort)
    assert reached[0] == 1.0 and run.meta["method"] == "exponential"
    assert figures[0, rest] == pytest.approx(told[rest], rel=1e-9, nan_ok=True)


def test_the_sum_does_not_wind_up():
    """A cart that does not move, pushed for 1 s against its limit: once the reference turns, so
    does the output."""
    c = fx.PID(
        signals.piecewise([0.0, 1.0], [1.0, -1.0]), kp=10.0, ki=50.0, limit=20.0, slew=1000.0
    )
    run = fx.simulate(cart(1e9), np.arange(0, 1.2, TICK), fx.Controller((c,)))
    u = run["joint/1/drive"]
    assert u[999] == pytest.approx(20.0, abs=1e-6) and np.abs(u).max() <= 20.0
    turned = int(
        np.argmax(u < 0)
    )  # kp e falls from 10 to -10, the sum from at most 20 by 0.05 a tick
    assert 1000 < turned <= 1000 + 10 + 1 + (20 - 10) / 0.05
    free = fx.simulate(
        cart(1e9), np.arange(0, 1.2, TICK), fx.Controller((replace(c, limit=1e9, slew=1e9),))
    )["joint/1/drive"]
    assert free[999] > 55 and np.all(free[1000:] > 0)  # what it would have wound up to


def test_faster_sampling_tends_to_the_continuous_law_with_order_one():
    sys = rig()
    motions = [signals.cycloid(0.05, 0.3), signals.cycloid(0.4, 0.3)]
    t = np.linspace(0, 0.5, 26)
    exact = fx.simulate(sys, t, fx.Drive.pd(motions, kp=[300, 3], kd=[30, 0.2]), rtol=1e-10)
    errors = []
    for rate in (500.0, 1000.0, 2000.0, 4000.0):
        pids = [
            fx.PID(m, kp=p, kd=d, derivative_Hz=0.0)
            for m, p, d in zip(motions, (300, 3), (30, 0.2))
        ]
        run = fx.simulate(
            sys, t, fx.Controller(tuple(pids), rate_Hz=rate), rtol=1e-10, method="explicit"
        )
        errors.append(np.abs(run["joint/2/position"] - exact["joint/2/position"]).max())
    assert all(0.9 < np.log2(a / b) < 1.15 for a, b in itertools.pairwise(errors)), errors


@pytest.mark.parametrize(
    "method, rtol, most",
    [
        ("explicit", 1e-9, 1e-10),
        ("explicit-5", 1e-8, 1e-7),
        ("explicit-3", 1e-5, 1e-3),
        ("implicit", 1e-7, 1e-6),
    ],
)
def test_every_method_balances_energy_and_agrees(method, rtol, most):
    sys = rig()
    drive = rig_controller(ki=100, kv=9)
    t = np.linspace(0, 0.6, 101)  # not on ticks
    run = fx.simulate(sys, t, drive, rtol=rtol, method=method)
    exact = fx.simulate(sys, t, drive, rtol=1e-11, method="explicit")
    assert run.meta["energy_error"] < most and run.meta["method"] == method
    for name in (
        "joint/1/position",
        "joint/2/position",
        "link/2/tip_deflection",
        "joint/1/voltage",
        "joint/1/drive",
    ):
        assert np.abs(run[name] - exact[name]).max() < 100 * rtol * np.abs(exact[name]).max(), name


def test_a_motor_is_its_voltage_less_its_back_emf():
    run = fx.simulate(
        rig(),
        np.arange(0, 0.3, TICK),
        fx.Controller(
            (
                fx.PID(signals.step(0.05), fx.Motor(13.0, 120.0), kp=200, limit=12),
                fx.PID(signals.constant(0.0), kp=3),
            )
        ),
    )
    np.testing.assert_allclose(
        run["joint/1/drive"],
        13.0 * run["joint/1/voltage"] - 120.0 * run["joint/1/velocity"],
        rtol=1e-9,
        atol=1e-9,
    )
    assert run.units["joint/1/voltage"] == "V" and run["joint/1/voltage"].max() == pytest.approx(
        200 * 0.05, rel=1e-9
    )


@pytest.mark.parametrize("stiffness", [None, 200.0])
def test_a_steppers_joint_follows_its_pulses(stiffness):
    step = fx.PID(
        signals.step(0.4), fx.Stepper(stiffness, 0.05), kp=20, limit=2.0, slew=60, delay_s=TICK
    )
    held = fx.PID(signals.constant(0.0), kp=900, kd=50)
    run = fx.simulate(rig(), np.arange(0, 1, TICK), fx.Controller((held, step)), rtol=1e-6)
    pulses, q = run["joint/2/pulses"], run["joint/2/position"]
    rate = np.diff(pulses) / TICK
    assert rate.max() == pytest.approx(2.0, rel=1e-6) and np.abs(
        np.diff(rate)
    ).max() <= 60 * TICK * (1 + 1e-6)
    assert pulses[-1] == pytest.approx(0.4, abs=1e-4)
    if stiffness is None:
        np.testing.assert_allclose(q, pulses, atol=1e-12)
    else:
        assert 0 < np.abs(q - pulses).max() < 0.02


def test_the_sum_takes_the_last_error_away():
    """A cart pushed by 2 N: without ki it stands off by 2 / kp."""
    for ki, off in ((0.0, 2 / 100), (200.0, 0.0)):
        c = fx.PID(signals.step(0.1), kp=100, ki=ki, kd=20)
        run = fx.simulate(cart(gravity=(-1.0, 0.0)), np.linspace(0, 8, 81), fx.Controller((c,)))
        assert 0.1 - run["joint/1/position"][-1] == pytest.approx(off, abs=1e-6)


def test_small_motions_are_those_of_the_sampled_linear_model():
    """Closed-loop states, tick by tick, against linearize, the exponential of its A over a tick,
    and the law as a matrix."""
    sys = rig()
    linear = fx.linearize(sys)
    n, m = linear.B.shape
    both = expm(np.block([[linear.A, linear.B], [np.zeros((m, n + m))]]) * TICK)
    F, G = both[:n, :n], both[:n, n:]
    kp, kd, r = np.diag([200.0, 2.0]), np.diag([20.0, 0.1]), np.array([1e-5, 1e-4])
    C = np.array([linear.C[linear.outputs.index(f"joint/{i}/position")] for i in (1, 2)])
    x, last, u_before, rows = np.zeros(n), np.zeros(2), None, []
    for k in range(300):
        rows.append(C @ x)
        rate = (C @ x - last) / TICK
        u_before = kp @ (r - C @ x) - kd @ rate + (kd @ r / TICK if k == 0 else 0)
        last = C @ x
        x = F @ x + G @ u_before
    pids = tuple(
        fx.PID(signals.step(r[i]), kp=kp[i, i], kd=kd[i, i], derivative_Hz=0.0) for i in range(2)
    )
    run = fx.simulate(
        sys, np.arange(300) * TICK, fx.Controller(pids), rtol=1e-10, method="explicit"
    )
    got = np.column_stack([run["joint/1/position"], run["joint/2/position"]])
    assert np.abs(got - rows).max(axis=0) == pytest.approx(
        [0, 0], abs=1e-8
    )  # 1e-4 of the motion, its square


@pytest.mark.parametrize(
    "change, key",
    [
        (dict(kp=np.nan), "kp"),
        (dict(limit=0.0), "limit"),
        (dict(slew=-1.0), "slew"),
        (dict(setpoint_Hz=-1.0), "setpoint_Hz"),
        (dict(observer_Hz=-1.0), "observer_Hz"),
        (dict(observer_Hz=5.0, output=fx.Stepper()), "observer_Hz"),
        (dict(jo=-1.0), "jo"),
    ],
)
def test_a_law_that_makes_no_sense_is_refused(change, key):
    with pytest.raises(fx.InputError) as caught:
        fx.PID(signals.constant(0.0), **change)
    assert caught.value.key == key


def test_the_twin_refuses_a_sampled_controller():
    from flexura import twin

    c = fx.PID(signals.constant(0.0))
    with pytest.raises(fx.InputError, match="drive"):
        twin.simulate(rig().robot, [0.0, 0.1], fx.Controller((c, c)))


def test_delays_between_ticks_nodal_robots_and_wrong_counts_are_refused():
    c = fx.PID(signals.constant(0.0))
    with pytest.raises(fx.InputError, match="whole number of ticks"):
        fx.Controller((replace(c, delay_s=0.0015),))
    with pytest.raises(fx.InputError, match="joint drives, one a joint"):
        fx.simulate(rig(), [0.0, 0.1], fx.Controller((c,)))
    nodal = fx.assemble(
        robot(
            rigid(0.2, 0.2, 0.1, 1e-3),
            beam(0.4, 0.157, 0.3333, 4, "Pb", start=0.25),
            sliding="nodal",
        )
    )
    with pytest.raises(fx.InputError, match="continuous"):
        fx.simulate(nodal, [0.0, 0.1], fx.Controller((c, c)))
    with pytest.raises(fx.InputError, match="stepper"):
        lqr(rig(), fx.Controller((c, replace(c, output=fx.Stepper()))), 1.0)
