"""Free vibration: frequency, damping and their intervals; the shapers; step figures."""

import json
import tomllib

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.signal import lfilter

import flexura as fx
from commands import run as command
from flexlab import rig as rigs
from flexlab.identification.vibration.damped_sinusoids import changes, fit, lacks
from flexlab.identification.vibration.record import record
from flexlab.identification.vibration.shapers import Shaper, read_shaper
from flexura import signals
from flexura.control import step_figures
from flexura.io import Run
from foreign_logs import klipper

F, CYCLES, A_CYCLE = 4.7, 20, 25


def wave(t, frequency, ratio, amplitude=1.0, phase=0.0):
    w = 2 * np.pi * frequency
    damped = w * np.sqrt(1 - ratio**2)
    return amplitude * np.exp(-ratio * w * t) * np.cos(damped * t + phase)


def ringing(ratio, seed):
    """20 cycles with noise of 40 dB below the signal."""
    rng = np.random.default_rng(seed)
    t = np.arange(CYCLES * A_CYCLE) / (F * A_CYCLE)
    y = wave(t, F, ratio, phase=rng.uniform(0, 2 * np.pi))
    return t, y + rng.normal(0, 0.01 * np.sqrt(np.mean(y**2)), len(t))


def held(ratio, seeds):
    """How many intervals hold the truth: of the frequency, of the damping ratio."""
    hits = np.zeros(2, int)
    for seed in seeds:
        (mode,) = fit(*ringing(ratio, seed)).modes
        assert mode.frequency == pytest.approx(F, rel=1e-3)
        assert mode.ratio == pytest.approx(ratio, rel=0.05)
        for k, (what, truth) in enumerate((("frequency", F), ("ratio", ratio))):
            _, low, high = mode.interval(what)
            hits[k] += low <= truth <= high
    return hits


@pytest.mark.parametrize("ratio", [0.005, 0.05])
def test_frequency_and_damping_are_found(ratio):
    assert (held(ratio, range(5000, 5020)) >= 16).all()


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.005, 0.015, 0.05])
def test_an_interval_of_95_percent_holds_the_truth_in_930_to_970_of_1000(ratio):
    hits = held(ratio, range(1000))
    print(f"damping ratio {ratio}: of 1000 intervals hold the truth {hits}")
    assert ((hits >= 930) & (hits <= 970)).all(), hits


MODES = [(4.0, 0.01, 1.0), (4.6, 0.012, 0.5), (31.0, 0.02, 0.1)]


def test_several_modes_are_told_apart():
    rng = np.random.default_rng(3)
    t = np.sort(rng.uniform(0, 5, 2000))  # uneven too
    y = 0.3 + 0.02 * t + rng.normal(0, 0.01, len(t))
    y += sum(wave(t, *mode, phase=k) for k, mode in enumerate(MODES))
    found = fit(t, y).modes
    assert len(found) == 3
    for mode, (frequency, ratio, amplitude) in zip(found, MODES, strict=True):
        assert mode.frequency == pytest.approx(frequency, abs=4 * mode.frequency_std)
        assert mode.ratio == pytest.approx(ratio, abs=4 * mode.ratio_std)
        assert mode.amplitude == pytest.approx(amplitude, rel=0.1)


def two_near(apart, seed):
    """Two modes so many resolutions of the record apart, of 10 s, with noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 10, 0.005)
    y = wave(t, 3.3, 0.01, 1.0, rng.uniform(0, 6)) + rng.normal(0, 0.01, len(t))
    return t, y + wave(t, 3.3 + apart / 10, 0.008, 0.7, rng.uniform(0, 6))


@pytest.mark.parametrize("apart", [0.7, 1.0, 1.3, 2.0])
def test_two_near_modes_are_two_or_it_is_said(apart):
    """Of 20 records 14, 7, 5 and 0 were told as one mode, with up to three times its damping."""
    one = 0
    for seed in range(8):
        t, y = two_near(apart, seed)
        found = fit(t, y)
        if len(found.modes) == 1:
            one += 1
            assert lacks(found, t, y)["by_noise"] > 3
            continue
        assert lacks(found, t, y) is None and changes(found, t, y) == ()
        for mode, ratio in zip(found.modes, (0.01, 0.008), strict=True):
            assert mode.ratio == pytest.approx(ratio, abs=5 * mode.ratio_std)
            assert mode.ratio_std < 0.1 * ratio
    assert one <= (2 if apart < 1 else 0)


def single(kind, seed):
    """One mode whose record is not ideal."""
    rng = np.random.default_rng(seed)
    t, white = np.arange(0, 10, 0.005), rng.normal(size=2000)
    f, ratio = rng.uniform(2, 8), rng.uniform(0.003, 0.012)
    y = wave(t, f, ratio)
    if kind == "quantised":
        return t, 0.05 * np.round(y / 0.05)
    if kind == "drift":
        return t, y + 0.3 * np.exp(-t / 3) + 0.005 * white
    if kind == "red noise":
        red = lfilter([1.0], [1.0, -0.97], white)
        return t, y + 0.1 * red / red.std()
    w, cubic = 2 * np.pi * f, 0.0 if kind == "friction" else 0.05
    friction = 0.003 if kind == "friction" else 0.0
    rate = lambda _, x: [
        x[1],
        -w * w * (x[0] + cubic * x[0] ** 3 + friction * np.tanh(1e3 * x[1] / w))
        - 2 * ratio * w * x[1],
    ]
    own = solve_ivp(rate, (0, 10), [1.0, 0.0], t_eval=t, rtol=1e-7, atol=1e-8, max_step=0.02)
    return t, own.y[0] + 0.005 * white


@pytest.mark.parametrize("kind", ["quantised", "drift", "red noise", "cubic spring", "friction"])
def test_one_mode_stays_one(kind):
    """Red noise gave three false modes more, a mode that changes a second one near it."""
    for seed in range(4):
        modes = fit(*single(kind, seed)).modes
        apart = np.diff([mode.frequency for mode in modes])  # a cubic spring has harmonics
        assert len(modes) == 1 or (kind == "cubic spring" and apart.min() > 1.0), modes


def test_the_command_says_what_one_mode_does_not_explain(tmp_path):
    t, y = two_near(0.3, 0)
    name = "link/1/tip_deflection"
    run = stored(tmp_path / "run", t, {name: 1e-3 * y}, {name: "m"})
    found = json.loads(command(["vibration", run, "--json"])[1])
    assert len(found["modes"]) == 1 and found["lacks"]["by_noise"] > 3
    assert "another mode is near it" in " ".join(command(["vibration", run])[1].split())


@pytest.mark.parametrize("seed", range(10))
def test_noise_has_no_modes(seed):
    rng = np.random.default_rng(seed)
    assert fit(np.arange(1000) / 100, rng.normal(size=1000)).modes == ()


def stored(folder, t, channels, units, **meta):
    Run(t, channels, units, {"source": "experiment", **meta}).save(folder)
    return folder


def test_the_command_tells_json_and_writes_shapers(tmp_path):
    t, y = ringing(0.01, 1)
    name = "link/1/tip_deflection"
    run = stored(tmp_path / "run", t, {name: 1e-3 * y}, {name: "m"})
    out = tmp_path / "shapers"
    status, said, err = command(["vibration", run, "--json", "--out", out])
    assert (status, err) == (0, "")
    found = json.loads(said)
    (mode,) = found["modes"]
    for key, truth in (("frequency_Hz", F), ("damping_ratio", 0.01)):
        value, low, high = mode[key]
        assert low < value < high and value == pytest.approx(truth, rel=0.05)
    assert sorted(path.name for path in out.iterdir()) == ["ei.toml", "zv.toml", "zvd.toml"]
    for kind in ("zv", "zvd", "ei"):
        shaper = read_shaper(out / f"{kind}.toml")
        assert (shaper.kind, shaper.frequency_Hz) == (kind, mode["frequency_Hz"][0])
        assert shaper.damping_ratio == mode["damping_ratio"][0]
    assert command(["vibration", run, "--out", out])[0] == 2  # results are there
    assert max(map(len, command(["vibration", run])[1].splitlines())) <= 80


def test_simulate_and_bench_take_a_shaper(tmp_path):
    """A turn of the strip: the shaped one leaves it at rest."""
    robot = fx.load("single-r")
    f = float(fx.frequencies(robot)[0])
    motion = '{ kind = "cycloid", end = 0.4, duration_s = 0.3 }'
    manoeuvre = tmp_path / "turn.toml"
    manoeuvre.write_text(
        f'name = "turn"\nduration_s = 1.5\n[[joint]]\nmotion = {motion}\nprescribed = true\n'
    )
    left = {}
    for kind in (None, "zv", "zvd", "ei"):
        words = ["simulate", "single-r", manoeuvre, "--out", tmp_path / str(kind), "--json"]
        if kind:
            tables = Shaper(kind, f, 0.0).tables()
            file = tmp_path / f"{kind}.toml"
            text = "".join(f"{key} = {json.dumps(x)}\n" for key, x in tables["shaper"].items())
            file.write_text(f"[shaper]\n{text}")
            words += ["--shaper", file]
        status, _, err = command(words)
        assert status == 0, err
        run = Run.read(tmp_path / str(kind))
        after = run.t > 0.3 + 1.1 / f
        left[kind] = np.ptp(run["link/1/tip_deflection"][after])
    assert left["zv"] < 0.1 * left[None] and left["zvd"] < 0.1 * left[None]
    assert left["ei"] < 0.12 * left[None]
    manoeuvre.write_text(
        'name = "swing"\nduration_s = 1.5\n[[joint]]\nprescribed = true\n'
        'motion = { kind = "harmonic", amplitude = 0.1, frequency_Hz = 0.5 }\n'
    )
    words = ["simulate", "single-r", manoeuvre, "--shaper", tmp_path / "zv.toml"]
    status, _, err = command(words)
    assert status == 2 and "joint[1].motion" in err and "comes to rest" in err
    status, _, err = command(["bench", "inverse", "--shaper", manoeuvre])
    assert status == 2 and "[shaper]" in err and "turn.toml" in err


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ('kind = "zw"\nfrequency_Hz = 3.0\n', "shaper.kind"),
        ('kind = "zv"\n', "shaper.frequency_Hz"),
        ('kind = "zv"\nfrequency_Hz = -3.0\n', "shaper.frequency_Hz"),
        ('kind = "zv"\nfrequency_Hz = 3.0\ndamping_ratio = 1.5\n', "shaper.damping_ratio"),
        ('kind = "zv"\nfrequency_Hz = 3.0\nzeta = 0.5\n', "shaper.zeta"),
        ('kind = "zv"\nfrequency_Hz = 3.0\ntolerance = 0.1\n', "shaper.tolerance"),
    ],
)
def test_a_wrong_shaper_is_refused_by_its_key(text, key, tmp_path):
    (tmp_path / "x.toml").write_text(f"[shaper]\n{text}")
    with pytest.raises(fx.InputError, match=key):
        read_shaper(tmp_path / "x.toml")


def test_ei_leaves_its_tolerance_and_bears_20_percent():
    """A step through a shaper: what rings afterwards, as a share of the unshaped step's."""
    for ratio, error, most in ((0.0, 1.0, 0.0501), (0.02, 1.0, 0.05), (0.0, 1.19, 0.0501)):
        shaped = signals.ei(signals.step(1.0), 2.0, ratio)
        times, values = shaped.segments[:, 0], shaped.segments[:, 1]
        jumps, at = np.diff(values), times[1:]
        w = 2 * np.pi * 2.0 * error
        pole = w * (ratio + 1j * np.sqrt(1 - ratio**2))
        share = abs(np.sum(jumps * np.exp(pole * (at - at[-1]))))
        assert share <= most and jumps.sum() == pytest.approx(1.0)
    assert share > 0.01


def test_an_accelerometer_log_rings_from_the_blow_on(tmp_path):
    rng = np.random.default_rng(2)
    t = 5120.1 + np.arange(6400) / 3200
    free = np.maximum(t - t[640], 0)
    y = np.where(t >= t[640], wave(free, 52.0, 0.03, 9000.0), 0.0)
    parts = [rng.normal(0, 30, len(t)), y + rng.normal(0, 30, len(t)), rng.normal(0, 30, len(t))]
    path = klipper(tmp_path / "raw_data_y.csv", t, parts)
    assert command(["import", path, "--out", tmp_path / "run"])[0] == 0
    status, said, err = command(["vibration", tmp_path / "run", "--json"])
    found = json.loads(said)
    assert (status, err) == (0, "") and found["channel"] == "sensor/accel_y"
    assert found["from_s"] == pytest.approx(0.2, abs=0.002)
    (mode,) = found["modes"]
    assert mode["frequency_Hz"][0] == pytest.approx(52.0, rel=1e-3)
    assert mode["damping_ratio"][0] == pytest.approx(0.03, rel=0.05)


def test_what_does_not_ring_ends_in_a_sentence(tmp_path):
    t = np.arange(500) / 100
    rng = np.random.default_rng(0)
    run = stored(tmp_path / "a", t, {"sensor/a": rng.normal(size=500)}, {"sensor/a": "m/s^2"})
    still = stored(tmp_path / "b", t, {"sensor/a": np.ones(500)}, {"sensor/a": "m"})
    for words, said in (
        ([run], "no vibration stands out of the noise"),
        ([run, "--channel", "sensor/b"], "expected a channel of the run: sensor/a"),
        (
            [run, "--from-s", "4.9"],
            "10 samples from 4.9 s on, of a run from 0 to 4.99 s: expected 32",
        ),
        ([run, "--from-s", "6"], "0 samples from 6 s on, of a run from 0 to 4.99 s"),
        ([run, "--to-s", "0.1"], "11 samples from the start until 0.1 s, of a run from 0 to 4.99"),
        ([still], "a channel that moves"),
    ):
        status, out, err = command(["vibration", *words])
        assert (status, out, err.count("\n")) == (2, "", 1) and said in err


def test_after_a_command_it_is_free():
    t = np.arange(2000) / 200
    moved = np.clip(t / 2, 0, 1)
    y = np.where(t < 2, 0.5 * np.sin(9 * t), wave(t - 2, 3.0, 0.01, 0.1))
    channels = {"joint/1/reference": moved, "link/1/tip_deflection": y}
    part = record(Run(t, channels, {"joint/1/reference": "rad", "link/1/tip_deflection": "m"}))
    assert 2.0 < part.t[0] < 2.4 and "after the last command" in part.why


def test_step_figures_of_any_run():
    """A second-order system: overshoot exp(-pi zeta / sqrt(1 - zeta^2)), and its 2 % settling."""
    zeta, w = 0.4, 5.0
    t = np.arange(-100, 1000) / 200
    s = np.maximum(t, 0)
    wd = w * np.sqrt(1 - zeta**2)
    y = 1 - np.exp(-zeta * w * s) * (np.cos(wd * s) + zeta * w / wd * np.sin(wd * s))
    channels = {"joint/1/position": 0.2 + 0.5 * y, "joint/1/reference": 0.2 + 0.5 * (t > 0)}
    run = Run(t, channels, {"joint/1/position": "rad", "joint/1/reference": "rad"})
    found = step_figures(run, "joint/1/position")
    assert found["overshoot"] == pytest.approx(
        np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-3
    )
    outside = np.abs(y - 1) > 0.02
    assert found["settling_s"] == pytest.approx(t[np.flatnonzero(outside)[-1] + 1], abs=0.01)
    inside = np.interp([0.1, 0.9], y[: int(np.argmax(y))], t[: int(np.argmax(y))])
    assert found["rise_s"] == pytest.approx(inside[1] - inside[0], abs=0.01)
    alone = Run(t + 5000, {"sensor/laser": channels["joint/1/position"]}, {"sensor/laser": "m"})
    again = step_figures(alone, "sensor/laser", start=5000.0)
    assert again["overshoot"] == pytest.approx(found["overshoot"], rel=1e-3)
    for key in ("target", "start"):
        for wrong in (np.nan, "1"):
            with pytest.raises(fx.InputError, match=rf"{key} = .*expected a finite number"):
                step_figures(alone, "sensor/laser", **{key: wrong})


@pytest.mark.slow
def test_the_emulated_strip_rings_at_the_plants_own_frequency(tmp_path):
    """The strip on the stepper's magnetic spring, linear about where it holds, within 0.5 %."""
    words = ["bench", "free-vibration", "--emulated", "--duration-s", "10", "--out", tmp_path / "a"]
    assert command(words)[0] == 0
    status, said, _ = command(["vibration", tmp_path / "a", "--json", "--out", tmp_path / "b"])
    found = json.loads(said)
    run = Run.read(tmp_path / "a")
    bench = rigs.load("rig")
    n, holding = bench.rig.stepper.full_steps_per_turn / 4, bench.rig.stepper.holding_torque_N_m
    detent, asked = bench.rig.stepper.detent_torque_N_m, run["joint/2/pulses"][-1]
    torque = lambda q: holding * np.sin(n * (asked - q)) - detent * np.sin(4 * n * q)
    q2 = brentq(torque, asked - 0.01, asked + 0.01)
    spring = -(torque(q2 + 1e-7) - torque(q2 - 1e-7)) / 2e-7
    system = fx.assemble(fx.Robot.from_dict(run.meta["truth"]["robot"]))
    q = np.zeros(system.n)
    q[1] = q2
    stiffness = np.array(system.stiffness(q))
    stiffness[0, 0] += 1e6  # the rail's
    stiffness[1, 1] += spring
    own = np.sqrt(eigh(stiffness, np.array(system.mass(q)), eigvals_only=True)[0]) / (2 * np.pi)
    assert status == 0 and found["modes"][0]["frequency_Hz"][0] == pytest.approx(own, rel=5e-3)
    assert tomllib.loads((tmp_path / "b" / "zvd.toml").read_text())["shaper"]["kind"] == "zvd"


def test_a_link_rings_free_from_when_its_prescribed_joint_rests():
    """The motion's own frequency (3.3 Hz, with a damping ratio of 0.66) is none of the link's."""
    robot = fx.load("single-r")
    t = np.linspace(0.0, 4.0, 2001)
    run = fx.inverse(robot, t, [signals.cycloid(0.04, 0.3, at_s=0.2)])
    found = record(run)
    assert "after the last command at 0.5 s" in found.why and found.t[0] > 0.49
    first = max(fit(found.t, found.y).modes, key=lambda mode: mode.amplitude)
    assert first.frequency == pytest.approx(fx.frequencies(robot)[0], rel=1e-3)
