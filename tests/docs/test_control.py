"""Equations of docs/theory/09-control.md, written down with plain NumPy,
against the sampled controller of the core."""

import numpy as np
import pytest

import flexura as fx
import robots
from flexura import control
from flexura.control.step_metrics import joint_metrics, strip_metrics
from flexura.signals import cycloid, harmonic, matched_cycloid, zv, zvd

RATE = 100.0
T = 1 / RATE
RNG = np.random.default_rng(7)
GAINS = {
    "kp": 3.0,
    "ki": 7.0,
    "kd": 0.4,
    "kf": 20.0,
    "kg": 0.7,
    "ks": 2.0,
    "kt": 0.1,
    "kv": 0.5,
    "kc": 0.2,
}


def clip(x, c):
    return min(max(x, -c), c)


def arm():
    return robots.system(
        robots.rigid(0.1, 0.4, 0.05, 1e-3, "Pa"),
        robots.beam(0.5, 0.2, 0.8, 2, hub_inertia_kg_m2=1e-3),
        payload=0.05,
    )


def smoothing(f, period):
    return 1 - np.exp(-2 * np.pi * f * period)


def law(ticks, measured, w, s, joint, limit, slew, reference, feedforward):
    """The outputs of one joint's law, tick by tick: the formulas of the page one after another."""
    a_r, a_q, a_w = smoothing(5.0, T), smoothing(20.0, T), smoothing(15.0, 2 * T)
    g = GAINS
    r_before, rate, z, u, tip = reference(-1e-12)[0], 0.0, 0.0, 0.0, 0.0
    q_before, before, filtered, slopes = (
        measured[0],
        (w[0], s[0]),
        np.array([w[0], s[0]]),
        np.zeros(2),
    )
    out = []
    for k in range(ticks):
        r = r_before + a_r * (reference(k * T)[0] - r_before)
        r_rate = (r - r_before) / T
        rate += a_q * ((measured[k] - q_before) / T - rate)
        if k % 2 == 0:
            new = filtered + a_w * ((np.array(before) + [w[k], s[k]]) / 2 - filtered)
            slopes, filtered = (new - filtered) / (2 * T), new
        before = (w[k], s[k])
        if k % 2 == joint % 2:
            tip = (
                g["kf"] * filtered[0]
                + g["kg"] * slopes[0]
                + g["ks"] * filtered[1]
                + g["kt"] * slopes[1]
            )
        e = r - measured[k]
        more = z + g["ki"] * e * T
        counted = more if abs(more) <= limit else z
        wish = (
            g["kp"] * e
            + counted
            + g["kd"] * (r_rate - rate)
            + tip
            + g["kv"] * r_rate
            + g["kc"] * np.sign(r_rate)
        )
        wish += feedforward(k * T)[0]
        u = min(max(clip(wish, limit), u - slew * T), u + slew * T)
        if (wish - u) * g["ki"] * e <= 0:
            z = counted
        r_before, q_before = r, measured[k]
        out.append(u)
    return np.array(out)


@pytest.mark.parametrize(
    ("limit", "slew"), [(np.inf, np.inf), (1.2, np.inf), (1.2, 15.0), (0.3, 400.0)]
)
def test_the_law_of_a_joint(limit, slew):
    """Measurement, PID, limits and anti-windup on random measurements.

    Equations: 67, 68, 69, 70, 71, 72
    """
    ticks, reference, feedforward = 120, harmonic(0.5, 0.7), harmonic(0.1, 2.0)
    pids = tuple(
        fx.PID(
            reference,
            limit=limit,
            slew=slew,
            setpoint_Hz=5.0,
            derivative_Hz=20.0,
            feedforward=feedforward,
            **GAINS,
        )
        for _ in range(2)
    )
    controller = fx.Controller(pids, rate_Hz=RATE, deflection_Hz=15.0)
    system = arm()
    made = controller.sampler(system)
    t = T * np.arange(ticks)
    places = 0.3 * np.sin(2 * np.pi * np.outer([1.0, 0.4], t)) + 0.01 * RNG.normal(size=(2, ticks))
    w, s = 0.02 * np.sin(9 * t), 0.05 * np.cos(7 * t)
    made.start(system.start())
    found = np.array([made.step(k, t[k], places[:, k].copy(), w[k], s[k])[0] for k in range(ticks)])
    for joint in (0, 1):
        expected = law(ticks, places[joint], w, s, joint, limit, slew, reference, feedforward)
        assert found[:, joint] == pytest.approx(expected, rel=1e-9, abs=1e-11)
    if limit < 1:
        assert np.mean(np.abs(found) > 0.999 * limit) > 0.3  # the output is held back


def test_the_disturbance_observer():
    """The sampled law beside the formulas on random measurements, and what the observer finds of a
    constant load on the nominal joint.

    Equations: 147, 148, 149, 150
    """
    jo, bo, frequency, ticks = 0.3, 0.8, 2.0, 200
    pid = fx.PID(fx.signals.constant(0.0), kp=3.0, jo=jo, bo=bo, observer_Hz=frequency, limit=1.5)
    system = robots.system(robots.rigid(0.1, 0.4, 0.05, 1e-3, "Pa"))
    made = fx.Controller((pid,), rate_Hz=RATE).sampler(system)
    a, a_q = smoothing(frequency, 2 * T), smoothing(50.0, T)
    c = jo * a / (2 * T * (1 - a))
    q = 0.3 * np.sin(5 * T * np.arange(ticks)) + 0.01 * RNG.normal(size=ticks)
    made.start(system.start())
    rate = z = d = taken = u = 0.0
    for k in range(ticks):
        rate += a_q * ((q[k] - q[max(k - 1, 0)]) / T - rate)
        if k % 2 == 0:
            taken = d
        else:
            z += a * (u + (c - bo) * rate - z)
            d = z - c * rate
        u = clip(3.0 * -q[k] + taken, 1.5)
        found, _ = made.step(k, k * T, q[k : k + 1].copy(), 0.0, 0.0)
        assert found[0] == pytest.approx(u, rel=1e-9, abs=1e-11)

    load = 0.4  # on a joint that is the nominal one
    cart = robots.system(robots.rigid(0.1, 0.5, 0.05, 1e-3, "Pa", viscous_friction_N_s_m=0.8))
    ends = []
    for given in (0.0, 5.0):
        pid = fx.PID(
            fx.signals.constant(0.0),
            kp=20.0,
            kd=5.0,
            jo=0.5,
            bo=0.8,
            observer_Hz=given,
        )
        push = fx.Load(1, force_N=(-load, 0.0))
        drive = fx.Controller((pid,), rate_Hz=1000.0)
        run = fx.simulate(cart, np.linspace(0, 3, 301), drive, loads=(push,))
        ends.append(run["joint/1/position"][-1])
        assert run["joint/1/drive"][-1] == pytest.approx(load, rel=1e-4)
    assert ends[0] == pytest.approx(-load / 20.0, rel=1e-3) and abs(ends[1]) < 1e-6


def test_one_sensor_in_place_of_two():
    """Deflection gains that do the same for a cantilever loaded at its tip.

    Equations: 73
    """
    one = fx.PID(fx.signals.constant(0.0), **GAINS).one_sensor(0.4)
    assert one.kf == pytest.approx(GAINS["kf"] + 3 / (2 * 0.4) * GAINS["ks"])
    assert (
        one.kg == pytest.approx(GAINS["kg"] + 3 / (2 * 0.4) * GAINS["kt"]) and one.ks == one.kt == 0
    )


def lqr_design():
    system = arm()
    pids = (fx.PID(fx.signals.step(0.1), fx.Motor(13.0, 40.0)), fx.PID(fx.signals.step(0.5)))
    controller = fx.Controller(pids, rate_Hz=RATE)
    made, design = control.lqr(
        system,
        controller,
        (12.0, 0.5),
        position=(0.01, 0.05),
        deflection=0.002,
        disturbance=(0.5, 0.01),
        noise=(1e-4, 1e-4, 1e-5),
    )
    return system, made, design


def test_the_linear_model_over_a_tick():
    """The matrix exponential, by a Taylor series of a small part that is squared.

    Equations: 74
    """
    system, _, design = lqr_design()
    linear = fx.linearize(system)
    motor = np.zeros_like(linear.G)
    motor[0, 0] = 40.0
    M, D, S = linear.M, linear.G + motor, linear.K
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, S), -np.linalg.solve(M, D)]])
    B = np.vstack([np.zeros((n, 2)), np.linalg.solve(M, linear.E * [13.0, 1.0])])
    X = np.block([[A, B], [np.zeros((2, 2 * n + 2))]]) * T / 2**16
    exponential, term = np.eye(len(X)), np.eye(len(X))
    for k in range(1, 12):
        term = term @ X / k
        exponential = exponential + term
    for _ in range(16):
        exponential = exponential @ exponential
    assert design.F == pytest.approx(
        exponential[: 2 * n, : 2 * n], abs=1e-6 * np.abs(design.F).max()
    )
    assert design.G == pytest.approx(
        exponential[: 2 * n, 2 * n :], abs=1e-6 * np.abs(design.G).max()
    )


def test_the_regulator():
    """Riccati's equation, Bryson's weights, and the gain.

    Equations: 75
    """
    system, _, d = lqr_design()
    linear = fx.linearize(system)
    rows = [
        linear.outputs.index(name)
        for name in ("joint/1/position", "joint/2/position", "link/2/tip_deflection")
    ]
    W = linear.C[rows] / np.array([0.01, 0.05, 0.002])[:, None]
    Q, R = W.T @ W, np.diag(1 / np.array([12.0, 0.5]) ** 2)
    K = np.linalg.solve(R + d.G.T @ d.P @ d.G, d.G.T @ d.P @ d.F)
    assert d.K == pytest.approx(K, rel=1e-9, abs=1e-9 * np.abs(K).max())
    P = Q + d.F.T @ d.P @ (d.F - d.G @ K)
    assert d.P == pytest.approx(P, abs=1e-7 * np.abs(P).max())
    assert np.abs(np.linalg.eigvals(d.F - d.G @ K)).max() < 1


def test_the_estimator():
    """The covariance and the gain of Kalman's filter.

    Equations: 76
    """
    _, _, d = lqr_design()
    W, V = d.G @ np.diag([0.5**2, 0.01**2]) @ d.G.T, np.diag([1e-8, 1e-8, 1e-10])
    L = d.S @ d.C.T @ np.linalg.inv(d.C @ d.S @ d.C.T + V)
    assert d.L == pytest.approx(L, rel=1e-7, abs=1e-9 * np.abs(L).max())
    S = d.F @ (np.eye(len(d.F)) - L @ d.C) @ d.S @ d.F.T + W
    assert d.S == pytest.approx(S, abs=1e-7 * np.abs(S).max())
    assert np.abs(np.linalg.eigvals(d.F @ (np.eye(len(d.F)) - L @ d.C))).max() < 1


def test_the_law_with_the_estimator():
    """The core's linear law on measurements, and its prediction for the next tick.

    Equations: 77
    """
    system, controller, d = lqr_design()
    made = controller.sampler(system)
    made.start(system.start())
    before, w = np.zeros(len(d.F)), 0.0
    places = np.cumsum(1e-3 * RNG.normal(size=(20, 2)), axis=0)
    for k in range(20):
        w = 1e-3 * np.sin(k)
        y = np.append(places[k], w)
        now = before + d.L @ (y - d.C @ before)
        reference = np.zeros(len(d.F))
        reference[[0, 1 + np.flatnonzero(d.C[1, 1:])[0]]] = [0.1, 0.5]
        u = -d.K @ (now - reference)
        if k == 0:
            u = u - d.K @ (reference * 0)  # references that have not moved have no rate
        found = made.step(k, k * T, places[k].copy(), w, 0.0)[0]
        if k > 0:
            assert found / [13.0, 1.0] == pytest.approx(u, rel=1e-7, abs=1e-8)
        before = d.F @ now + d.G @ (found / [13.0, 1.0])
        assert made.prediction == pytest.approx(before, rel=1e-7, abs=1e-9)


def oscillator_at(signal, f, zeta, end):
    """Amplitude of a mode about its set-point after the motion, by small exact steps."""
    w, n = 2 * np.pi * f, 4000
    h, x = end / n, np.zeros(2)
    A = np.array([[0, 1], [-w * w, -2 * zeta * w]])
    step = np.eye(2) + h * A @ (
        np.eye(2) + h / 2 * A @ (np.eye(2) + h / 3 * A @ (np.eye(2) + h / 4 * A))
    )
    push = np.linalg.solve(A, (step - np.eye(2)) @ [0, 1])
    for k in range(n):
        x = step @ x + push * w * w * signal((k + 0.5) * h)[0]
    return np.hypot(x[0] - signal(end)[0], x[1] / w)


def test_input_shapers():
    """Two and three copies of a motion, and a mode that they leave at rest.

    Equations: 78
    """
    f, zeta, motion = 2.0, 0.1, fx.signals.step(0.3, 0.1)
    Td, k = 1 / (f * np.sqrt(1 - zeta**2)), np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2))
    two, three, smooth = zv(motion, f, zeta), zvd(motion, f, zeta), cycloid(0.3, 0.4)
    shaped = zv(smooth, f, zeta)
    y = lambda signal, t: signal(t)[0]
    for t in (0.0, 0.2, 0.1 + 0.6 * Td, 0.1 + 1.2 * Td, 2.0):
        late = [y(motion, t - x) for x in (0.0, Td / 2, Td)]
        assert y(two, t) == pytest.approx((late[0] + k * late[1]) / (1 + k))
        assert y(three, t) == pytest.approx(
            (late[0] + 2 * k * late[1] + k * k * late[2]) / (1 + k) ** 2
        )
        assert y(shaped, t) == pytest.approx((y(smooth, t) + k * y(smooth, t - Td / 2)) / (1 + k))
    assert oscillator_at(smooth, f, zeta, 2.0) > 20 * oscillator_at(shaped, f, zeta, 2.0)


def test_a_cycloid_matched_to_a_mode():
    """Its duration, and the mode afterwards.

    Equations: 79
    """
    signal = matched_cycloid(0.3, 2.0, 2)
    assert signal(2 / 2.0)[0] == pytest.approx(0.3) and signal(2 / 2.0 - 1e-3)[0] < 0.3
    assert oscillator_at(signal, 2.0, 0.0, 1.2) < 1e-5


def test_the_figures_of_a_motion():
    """Of a damped step and of a strip, by sums over their samples.

    Equations: 80
    """
    t = np.linspace(0, 4, 2001)
    q = 0.1 + 0.5 * (1 - np.exp(-2 * t) * np.cos(5 * t))
    r = np.full_like(t, 0.6)
    y = (q - 0.1) / 0.5
    figures = joint_metrics(t, r, q)
    outside = np.flatnonzero(np.abs(y - 1) > 0.02)[-1]
    trapezoid = lambda f: np.sum((f[1:] + f[:-1]) / 2 * np.diff(t))
    assert figures[2] == pytest.approx(max(0, (y - 1).max()))
    assert t[outside] <= figures[1] <= t[outside + 1]
    assert figures[4] == pytest.approx(trapezoid(t * np.abs(r - q)) / 0.5)
    w = 0.02 * np.exp(-t) * np.sin(9 * t) + 0.001
    rest = w[t >= 3.6].mean()
    assert strip_metrics(t, w, 1.0)[2] == pytest.approx(trapezoid(t * np.abs(w - rest)))
