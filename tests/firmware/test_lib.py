"""The firmware's portable library on this computer: sanitizers, independent computations, and its
own unit tests."""

import ctypes
import itertools
import json
import re
import subprocess
import sys
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from board_library import FIRMWARE, HERE, ROOT, compiled
from flexlab.board.protocol import frames
from flexlab.board.protocol.declaration import ADC_SAMPLES, CONFIG, CONTROL_HZ, DUTY_FULL
from flexura import signals
from flexura.control import gains

PARTS = {"test_numbers", "test_control", "test_trajectories", "test_states"}
SUITES = {"test_drives", "test_refusals", "test_faults", "test_rig", "test_session"}
TICK_S = 1 / CONTROL_HZ


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    """Trapping undefined behaviour; the address sanitizer watches the programs below, whose main is
    their own."""
    path = tmp_path_factory.mktemp("lib") / "library.so"
    arguments = [
        "-std=gnu++14",
        "-O1",
        "-shared",
        "-fPIC",
        "-fsanitize=undefined",
        str(HERE / "library.cpp"),
    ]
    library = ctypes.CDLL(str(compiled(path, *arguments)))
    library.c_crc.restype = ctypes.c_uint32
    return library


def test_both_sides_of_the_protocol_are_fresh():
    done = subprocess.run(
        [sys.executable, FIRMWARE / "protocol.py", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


@given(code=st.integers(0, 255), sequence=st.integers(0, 65535), fields=st.binary(max_size=61))
def test_board_and_host_read_each_others_frames(lib, code, sequence, fields):
    payload = bytes([code, sequence & 255, sequence >> 8]) + fields
    frame = (ctypes.c_uint8 * 80)()
    size = lib.c_encode(code, sequence, fields, len(fields), frame)
    assert bytes(frame[:size]) == frames.encode(payload)
    got = (ctypes.c_uint8 * 80)()
    assert (
        lib.c_receive(frames.encode(payload), size, got) == len(payload)
        and bytes(got[: len(payload)]) == payload
    )


@given(st.binary(max_size=300))
def test_crc_is_the_standard_librarys(lib, data):
    assert lib.c_crc(data, len(data)) == zlib.crc32(data)


@given(st.lists(st.sampled_from([1, -1]), max_size=400))
def test_counts_follow_the_shaft(lib, moves):
    gray = [0, 2, 3, 1]
    places = np.cumsum([0, *moves])
    lines = bytes(gray[p & 3] for p in places[1:])
    which = bytes(int((gray[a & 3] ^ gray[b & 3]) == 1) for a, b in itertools.pairwise(places))
    missed = ctypes.c_int()
    assert (
        lib.c_count(lines, which, len(lines), ctypes.byref(missed)) == sum(moves)
        and missed.value == 0
    )


def settings_of(**changes):
    values = {name: item.default for name, item in CONFIG.items()} | changes
    return values, (ctypes.c_float * len(values))(*values.values())


def seen(rows):
    names = ("deflection", "deflection_rate")
    kind = np.dtype(
        [
            ("error", "<i4"),
            ("rate", "<i2"),
            ("setpoint_rate", "<i2"),
            ("tip", "<i4"),
            *((n, "<i2") for n in names),
        ]
    )
    return np.array([(*row[:3], 0, *row[3:]) for row in rows], kind)


GAINS = st.floats(0, 1, width=32)
NAMES = (
    ("kp_1_V_m", "ki_1_V_m_s", "kd_1_V_s_m", "kf_1_V_m", "kg_1_V_s_m", "kv_1_V_s_m"),
    ("kp_2_1_s", "ki_2_1_s2", "kd_2", "kf_2_rad_s_m", "kg_2_rad_m", "kv_2"),
)
ROWS = st.lists(
    st.tuples(st.integers(-(2**19), 2**19), *[st.integers(-3000, 3000)] * 4),
    min_size=1,
    max_size=60,
)


@given(joint=st.integers(0, 1), g=st.tuples(*[GAINS] * 6), rows=ROWS)
def test_pid_in_si_units_is_its_formula(lib, joint, g, rows):
    """u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + kv r', as firmware/README.md defines
    it, in V and rad/s."""
    kp, ki, kd, kf, kg, kv = g
    if joint == 0:
        chosen = dict(
            kp_1_V_m=2000 * kp,
            ki_1_V_m_s=9000 * ki,
            kd_1_V_s_m=100 * kd,
            kf_1_V_m=300 * kf,
            kg_1_V_s_m=20 * kg,
        )
        chosen |= dict(kv_1_V_s_m=100 * kv, voltage_max_V=12, voltage_slew_V_s=3000)
    else:
        chosen = dict(
            kp_2_1_s=100 * kp,
            ki_2_1_s2=500 * ki,
            kd_2=kd,
            kf_2_rad_s_m=50 * kf,
            kg_2_rad_m=5 * kg,
            kv_2=kv,
        )
        chosen |= dict(rate_max_2_rad_s=7.8, acceleration_max_2_rad_s2=2000)
    values, array = settings_of(**chosen)
    given_ = seen(rows)
    out = (ctypes.c_int16 * len(rows))()
    assert lib.c_pid(array, joint, given_.ctypes, len(rows), out) == 255
    names = list(chosen)
    count = values["motor_counts_per_m"] if joint == 0 else values["stepper_steps_per_rad"]
    unit = values["supply_V"] / DUTY_FULL / 16 if joint == 0 else CONTROL_HZ / 4096 / count
    limit, slew = values[names[-2]], values[names[-1]] * TICK_S
    fine = 16 if joint else 1
    kp, ki, kd, kf, kg, kv = (values[name] for name in names[:6])
    integral = last = 0.0
    for row, got in zip(rows, out, strict=True):
        e = np.clip(row[0] * fine // 256, -32768, 32767) / fine / count
        rate, setpoint_rate = (value / 256 / count / TICK_S for value in row[1:3])
        w, w_rate = row[3] * 1e-5, row[4] / 256 * 1e-5 / (2 * TICK_S)
        grown = integral + ki * e * TICK_S
        grown = grown if abs(grown) < limit else integral
        u = kp * e + grown + kd * (setpoint_rate - rate) + kf * w + kg * w_rate + kv * setpoint_rate
        held = np.clip(np.clip(u, -limit, limit), last - slew, last + slew)
        # The board's own last output goes on: what is compared is one tick, not a sum of roundings.
        assert abs(got * unit - held) < 4 * unit + 2e-3 * abs(u) + slew * 0.02, (got * unit, held)
        if abs(u - held) < 2 * unit or (u > held) == (e < 0):
            integral = grown
        last = got * unit


def board(lib, values, rows):
    """Voltages [V] and rates [rad/s] of a whole board, tick by tick: rows (T, 4) of set-points,
    counts moved, reading."""
    kind = np.dtype([("setpoint", "<i4", 2), ("moved", "<i2"), ("flex", "<i2")])
    told = np.array([((a, b), m, f) for a, b, m, f in rows], kind)
    done = np.zeros(len(rows), np.dtype([("voltage", "<i2"), ("rate", "<i2")]))
    array = (ctypes.c_float * len(values))(*values.values())
    assert lib.c_board(array, told.ctypes, len(rows), done.ctypes) == 0
    return done["voltage"] * 0.002, done["rate"] / values["stepper_steps_per_rad"]


def model(values, rows):
    """The same by the model's law, which knows no integers: all T ticks, without a robot's
    mechanics, before their delays."""
    system = fx.assemble(fx.load(ROOT / "model/robots/rig.toml"))
    count, step = 1 / values["motor_counts_per_m"], 1 / values["stepper_steps_per_rad"]
    played = np.arange(len(rows)) * TICK_S
    reference = [signals.piecewise(played, rows[:, j] / 256 * (count, step)[j]) for j in range(2)]
    drive = gains.from_board(values).controller(reference, [fx.Motor(1.0, 0.0), fx.Stepper()])
    sampled = replace(
        drive, joints=tuple(replace(joint, delay_s=0.0) for joint in drive.joints)
    ).sampler(system)
    sampled.start(system.start())
    place, out = rows[0, 0] // 256, np.zeros((len(rows), 2))
    for k in range(1, len(rows)):
        place += rows[k, 2]
        w = (rows[k, 3] / (1024 * ADC_SAMPLES) - values["flex_zero"]) * values["flex_c1_m"]
        sampled.step(k - 1, k * TICK_S, np.array([place * count, rows[0, 1] // 256 * step]), w, 0.0)
    out[1:] = sampled.log[:, :, 1]
    return out.T


WIDE = dict(
    position_min_1_m=-9,
    position_max_1_m=9,
    position_min_2_rad=-900,
    position_max_2_rad=900,
    speed_max_1_m_s=10,
    speed_max_2_rad_s=1000,
    following_max_1_m=10,
    following_max_2_rad=1000,
    host_timeout_s=5,
    stall_voltage_V=30,
    lost_step_rad=10,
    flex_min=0,
    flex_max=1,
    supply_min_V=5,
    supply_max_V=20,
    flex_zero=0.5,
    flex_c1_m=-0.4,
)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    g=st.tuples(*[GAINS] * 10),
    tight=st.booleans(),
    filters=st.tuples(*[st.sampled_from([0.0, 2.0, 20.0])] * 2),
    observer=st.sampled_from([0.0, 4.0]),
)
def test_the_models_law_is_the_boards(lib, seed, g, tight, filters, observer):
    """Random gains, set-points, encoder counts and readings through the whole board: filters,
    strip, sum, pulses; and tight limits and slew, then without the sum, whose stop at a limit is a
    matter of round-off.

    The board's errors are whole counts of joint 1 and 1/16 microsteps of joint 2, rounded down; its
    rates 1/256 of them a tick, its deflection 10 um; its filters, rounded down too, end 1/256 of a
    count / a short; gains and slews are rounded to a thousandth; a report is in 2 mV.
    `bound` is these through the gains. (59.9218 rad/s^2 is a whole number of its units.)
    """
    r, T = np.random.default_rng(seed), 400
    kp, ki, kd, kf, kg, kv, p2, i2, f2, g2 = (float(x) for x in g)
    own = dict(
        kp_1_V_m=2000 * kp,
        ki_1_V_m_s=4000 * ki,
        kd_1_V_s_m=20 * kd,
        kf_1_V_m=50 * kf,
        kg_1_V_s_m=kg,
        kv_1_V_s_m=20 * kv,
        voltage_max_V=12,
        voltage_slew_V_s=20000,
        kp_2_1_s=60 * p2,
        ki_2_1_s2=100 * i2,
        kd_2=0.2 * kd,
        kf_2_rad_s_m=20 * f2,
        kg_2_rad_m=0.2 * g2,
        kv_2=kv,
        rate_max_2_rad_s=7.8,
        acceleration_max_2_rad_s2=8000,
        setpoint_1_Hz=filters[0],
        setpoint_2_Hz=filters[1],
        observer_1_Hz=observer,
        jo_1_V_s2_m=0.3 * kd,
        bo_1_V_s_m=20 * kv,
    )
    if tight:
        own |= dict(
            ki_1_V_m_s=0, ki_2_1_s2=0, kp_2_1_s=5 * p2, voltage_max_V=3, voltage_slew_V_s=300
        )
        own |= dict(rate_max_2_rad_s=2, acceleration_max_2_rad_s2=59.9218)
    values, _ = settings_of(**WIDE, **own)
    t, size = np.arange(T) * TICK_S, 1 if tight else 0.1
    waves = [
        size
        * sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in r.uniform(size=(3, 3)) * [1, 8, 6])
        for _ in range(3)
    ]
    rows = np.zeros((T, 4), np.int64)
    rows[:, 0] = 256 * (800 * (waves[0] - waves[0][0])).astype(int) + r.integers(0, 256, T)
    rows[:, 1] = 256 * (100 * (waves[1] - waves[1][0])).astype(int) + r.integers(0, 256, T)
    rows[0, :2] = rows[0, :2] // 256 * 256
    rows[2:, 2] = np.diff(np.round(700 * (waves[2] - waves[2][0])))[1:]
    rows[:, 3] = (
        2048 + 60 * waves[2] + r.integers(-3, 4, T)
    )  # faster than 0.64 m/s the board cannot count
    rows[:2, 3] = rows[1, 3]
    got, wanted = board(lib, values, rows), model(values, rows)
    for j, name in enumerate(("motor_counts_per_m", "stepper_steps_per_rad")):
        P, I, D, F, G, V = (values[gain] for gain in NAMES[j])
        fine = 1 / values[name] / 256
        short = 1 / (1 - np.exp(-2 * np.pi * filters[j] * TICK_S)) if filters[j] else 0
        error, rate, strip = fine * ((256, 18)[j] + short), 2 * fine / TICK_S, 3e-5
        reported = (0.002, 256 * fine)[j]
        bound = (P + I * t) * error + (D + V) * rate + F * strip + G * strip / (8 * TICK_S)
        if observer and j == 0:  # what u and the rate are off by, and what comes back through it
            c = values["jo_1_V_s2_m"] * np.expm1(4e-3 * np.pi * observer) / (2 * TICK_S)
            bound += (2 * c + values["bo_1_V_s_m"]) * rate
            bound *= 1 + 2 * np.pi * observer * t
        bound += 2 * reported + 1e-3 * np.abs(wanted[j])
        if tight:  # a limit hands an earlier error on, and pulses add it up
            bound = np.maximum.accumulate(bound) * np.exp(P * t if j else 0 * t)
        assert np.all(np.abs(got[j] - wanted[j])[1:] <= bound[1:])


def test_both_stop_their_sums_at_a_limit(lib):
    """0.3 s against both limits, then back: the sums end alike but for a tick's share where the
    limit begins and ends to hold."""
    own = dict(
        kp_1_V_m=1000,
        ki_1_V_m_s=8000,
        voltage_max_V=3,
        voltage_slew_V_s=300,
        kp_2_1_s=5,
        ki_2_1_s2=20,
        rate_max_2_rad_s=0.5,
        acceleration_max_2_rad_s2=59.9218,
        kv_2=0,
    )
    values, _ = settings_of(**WIDE, **own)
    rows = np.zeros((900, 4), np.int64)
    rows[2:300, :2], rows[300:, :2] = (220 * 256, 150 * 256), (-60 * 256, -40 * 256)
    rows[:, 3] = 2048
    got, wanted = board(lib, values, rows), model(values, rows)
    share = 8000 * 280 / 80000 * TICK_S, 20 * 190 / 509 * TICK_S
    for j in range(2):
        assert np.abs(wanted[j]).max() == pytest.approx((3, 0.5)[j])
        assert np.abs(got[j] - wanted[j])[1:].max() < 4 * share[j] + (0.05, 0.01)[j]


def test_settings_of_an_older_firmware_are_still_read():
    """A recording from before the observer has no settings of it: there was none."""
    values, _ = settings_of(kp_1_V_m=300.0)
    new = ("observer_", "jo_", "bo_")
    older = {name: value for name, value in values.items() if not name.startswith(new)}
    made = gains.from_board(older)
    assert made.settings["kp_1_V_m"] == 300.0 and not any(n.startswith(new) for n in made.settings)
    motor = fx.Motor(1.0, 0.0)
    drive = made.controller([signals.constant(0.0)] * 2, [motor, fx.Stepper()])
    now = gains.from_board(values).controller([signals.constant(0.0)] * 2, [motor, fx.Stepper()])
    assert np.array_equal(drive.gains(), now.gains())


@given(st.lists(st.integers(-16383, 16383), min_size=1, max_size=60))
def test_no_step_is_lost_or_added_and_none_is_too_soon(lib, rates):
    rates = np.repeat(rates, 5).astype(np.int16)
    at, direction = np.zeros(5 * len(rates), np.int64), np.zeros(5 * len(rates), np.int8)
    n = lib.c_steps(rates.ctypes, len(rates), at.ctypes, direction.ctypes)
    at, direction = at[:n], direction[:n].astype(int)
    wanted = np.concatenate([[0], np.cumsum(rates.astype(int)) / 4096])
    given_ = np.concatenate([[0], np.cumsum(direction)])
    when = np.searchsorted(at, np.arange(1, len(rates) + 1) * 2000, side="right")
    assert np.all(
        np.abs(given_[when] - wanted[1:]) <= 1.0
    )  # 3/4, and one that falls on the tick's very end
    assert np.all(np.diff(at) >= 240) and np.all(
        np.diff(at)[direction[1:] == direction[:-1]] >= 490
    )


def test_three_million_random_and_mutated_bytes(tmp_path):
    """Under both sanitizers; the judge of good frames is independent, the rig must stay in a state
    that is allowed."""
    fuzz = compiled(
        tmp_path / "fuzz",
        "-std=gnu++14",
        "-O1",
        "-fsanitize=address,undefined",
        str(HERE / "fuzz_frames.cpp"),
    )
    done = subprocess.run([fuzz, "3000000", "7"], capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr
    found = re.fullmatch(r"(\d+) bytes, (\d+) good frames, (\d+) commands obeyed\s*", done.stdout)
    assert found and int(found[1]) >= 3_000_000 and int(found[2]) > 15_000 and int(found[3]) > 1_500


@pytest.mark.parametrize(
    ("frames", "seed"), [(1_000_000, 1), pytest.param(10_000_000, 2, marks=pytest.mark.slow)]
)
def test_no_damaged_frame_is_obeyed(tmp_path, frames, seed):
    """Commands that would be obeyed but for their damage. A CRC of 16 bits takes 8 of 10^7 for
    whole and one is obeyed; of the CRC-32 2^16 times fewer are expected, 1e-4 of them."""
    program = compiled(
        tmp_path / "damaged", "-std=gnu++14", "-O2", str(HERE / "damaged_frames.cpp")
    )
    done = subprocess.run([program, str(frames), str(seed)], capture_output=True, text=True)
    said = f"{frames} damaged frames, 0 taken for whole, 0 obeyed\n"
    assert (done.returncode, done.stdout) == (0, said), done.stderr


@pytest.mark.parametrize(
    "environment, suites",
    [
        ("native", PARTS | SUITES),
        ("simavr", PARTS | {"test_interrupts"}),
        pytest.param("simavr", SUITES, marks=pytest.mark.slow),
    ],
)
def test_the_unit_tests_run_here_and_on_the_avr(environment, suites, tmp_path):
    """The same file on this computer, with sanitizers, and on an emulated AVR, where the interrupt
    handlers in assembly are compared with their C++ too. Each must have run all its tests."""
    report = tmp_path / "report.json"
    build = [sys.executable, FIRMWARE / "build.py", "--compiler", "debian"]
    chosen = [word for name in sorted(suites) for word in ("-f", name)]
    command = [*build, "pio", "test", "-e", environment, "--without-uploading", *chosen]
    done = subprocess.run([*command, "--json-output-path", report], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    ran = {
        suite["test_name"]: suite["test_cases"]
        for suite in json.loads(report.read_text())["test_suites"]
        if suite["env_name"] == environment and suite["status"] != "SKIPPED"
    }
    assert set(ran) == suites
    for suite, cases in ran.items():
        text = (FIRMWARE / "test" / suite / "test_main.cpp").read_text()
        if environment == "simavr":  # what stands in no program of the board
            text = re.sub(r"^#ifndef __AVR__$.*?^#endif$", "", text, flags=re.M | re.S)
        written = len(re.findall(r"^  RUN\(", text, re.M))
        assert written >= 5 and len(cases) == written
        assert all(case["status"] == "PASSED" for case in cases)
