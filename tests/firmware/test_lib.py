"""The firmware's portable library on this computer: sanitizers, independent computations, and its own unit tests."""

import binascii
import ctypes
import itertools
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexlab.board import frames
from flexlab.board.declaration import CONFIG, CONTROL_HZ, DUTY_FULL

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
HERE = Path(__file__).resolve().parent
SOURCES = [str(path) for path in sorted(FIRMWARE.glob("lib/*/src/*.cpp"))]
INCLUDES = [f"-I{path}" for path in sorted(FIRMWARE.glob("lib/*/src"))]
STRICT = ["-Wall", "-Wextra", "-Werror", "-g", "-fno-sanitize-recover=all"]
TICK_S = 1 / CONTROL_HZ


def compiled(out: Path, *arguments: str) -> Path:
    assert SOURCES and shutil.which("g++"), "g++ is missing: apt-get install g++"
    subprocess.run(["g++", *STRICT, *INCLUDES, *arguments, *SOURCES, "-o", str(out)], check=True)
    return out


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    """Trapping undefined behaviour; the address sanitizer watches the programs below, whose main is their own."""
    path = tmp_path_factory.mktemp("lib") / "library.so"
    arguments = ["-std=gnu++14", "-O1", "-shared", "-fPIC", "-fsanitize=undefined", str(HERE / "library.cpp")]
    library = ctypes.CDLL(str(compiled(path, *arguments)))
    library.c_crc.restype = ctypes.c_uint16
    return library


def test_both_sides_of_the_protocol_are_fresh():
    done = subprocess.run([sys.executable, FIRMWARE / "protocol.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@given(code=st.integers(0, 255), sequence=st.integers(0, 65535), fields=st.binary(max_size=61))
def test_board_and_host_read_each_others_frames(lib, code, sequence, fields):
    payload = bytes([code, sequence & 255, sequence >> 8]) + fields
    frame = (ctypes.c_uint8 * 80)()
    size = lib.c_encode(code, sequence, fields, len(fields), frame)
    assert bytes(frame[:size]) == frames.encode(payload)
    got = (ctypes.c_uint8 * 80)()
    assert lib.c_receive(frames.encode(payload), size, got) == len(payload) and bytes(got[: len(payload)]) == payload


@given(st.binary(max_size=300))
def test_crc_is_the_standard_librarys(lib, data):
    assert lib.c_crc(data, len(data)) == binascii.crc_hqx(data, 0xFFFF)


@given(st.lists(st.sampled_from([1, -1]), max_size=400))
def test_counts_follow_the_shaft(lib, moves):
    gray = [0, 2, 3, 1]
    places = np.cumsum([0, *moves])
    lines = bytes(gray[p & 3] for p in places[1:])
    which = bytes(int((gray[a & 3] ^ gray[b & 3]) == 1) for a, b in itertools.pairwise(places))
    missed = ctypes.c_int()
    assert lib.c_count(lines, which, len(lines), ctypes.byref(missed)) == sum(moves) and missed.value == 0


def settings(**changes):
    values = {name: item.default for name, item in CONFIG.items()} | changes
    return values, (ctypes.c_float * len(values))(*values.values())


def signals(rows):
    names = ("deflection", "deflection_rate")
    kind = np.dtype([("error", "<i4"), ("rate", "<i2"), ("setpoint_rate", "<i2"), ("tip", "<i4"), *((n, "<i2") for n in names)])
    return np.array([(*row[:3], 0, *row[3:]) for row in rows], kind)


GAINS = st.floats(0, 1, width=32)
ROWS = st.lists(
    st.tuples(st.integers(-(2**19), 2**19), *[st.integers(-3000, 3000)] * 4), min_size=1, max_size=60
)


@given(joint=st.integers(0, 1), g=st.tuples(*[GAINS] * 6), rows=ROWS)
def test_pid_in_si_units_is_its_formula(lib, joint, g, rows):
    """u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + kv r', as firmware/README.md defines it, in V and rad/s."""
    kp, ki, kd, kf, kg, kv = g
    if joint == 0:
        gains = dict(kp_1_V_m=2000 * kp, ki_1_V_m_s=9000 * ki, kd_1_V_s_m=100 * kd, kf_1_V_m=300 * kf, kg_1_V_s_m=20 * kg)
        gains |= dict(kv_1_V_s_m=100 * kv, voltage_max_V=12, voltage_slew_V_s=3000)
    else:
        gains = dict(kp_2_1_s=100 * kp, ki_2_1_s2=500 * ki, kd_2=kd, kf_2_rad_s_m=50 * kf, kg_2_rad_m=5 * kg, kv_2=kv)
        gains |= dict(rate_max_2_rad_s=7.8, acceleration_max_2_rad_s2=2000)
    values, array = settings(**gains)
    given_ = signals(rows)
    out = (ctypes.c_int16 * len(rows))()
    assert lib.c_pid(array, joint, given_.ctypes, len(rows), out) == 255
    names = list(gains)
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


@given(st.lists(st.integers(-16383, 16383), min_size=1, max_size=60))
def test_no_step_is_lost_or_added_and_none_is_too_soon(lib, rates):
    rates = np.repeat(rates, 5).astype(np.int16)
    at, direction = np.zeros(5 * len(rates), np.int64), np.zeros(5 * len(rates), np.int8)
    n = lib.c_steps(rates.ctypes, len(rates), at.ctypes, direction.ctypes)
    at, direction = at[:n], direction[:n].astype(int)
    wanted = np.concatenate([[0], np.cumsum(rates.astype(int)) / 4096])
    given_ = np.concatenate([[0], np.cumsum(direction)])
    when = np.searchsorted(at, np.arange(1, len(rates) + 1) * 2000, side="right")
    assert np.all(np.abs(given_[when] - wanted[1:]) <= 1.0)               # 3/4, and one that falls on the tick's very end
    assert np.all(np.diff(at) >= 240) and np.all(np.diff(at)[direction[1:] == direction[:-1]] >= 490)


def test_ten_million_random_and_mutated_bytes(tmp_path):
    """Under both sanitizers; the judge of good frames is independent, the rig must stay in a state that is allowed."""
    fuzz = compiled(tmp_path / "fuzz", "-std=gnu++14", "-O1", "-fsanitize=address,undefined", str(HERE / "fuzz_frames.cpp"))
    done = subprocess.run([fuzz, "10000000", "7"], capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr
    found = re.fullmatch(r"(\d+) bytes, (\d+) good frames, (\d+) commands obeyed\s*", done.stdout)
    assert found and int(found[1]) >= 10_000_000 and int(found[2]) > 50_000 and int(found[3]) > 5_000


@pytest.mark.parametrize("environment", ["native", "simavr"])
def test_the_unit_tests_run_here_and_on_the_avr(environment, tmp_path):
    """The same file on this computer, with sanitizers, and on an emulated AVR; each must have run every test that it has."""
    report = tmp_path / "report.json"
    command = [sys.executable, FIRMWARE / "build.py", "--compiler", "debian", "pio", "test", "-e", environment]
    done = subprocess.run([*command, "--without-uploading", "--json-output-path", report], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    result = json.loads(report.read_text())
    written = len(re.findall(r"^  RUN\(", (FIRMWARE / "test/test_lib/test_main.cpp").read_text(), re.M))
    suites = [suite for suite in result["test_suites"] if suite["env_name"] == environment and suite["status"] != "SKIPPED"]
    cases = [case for suite in suites for case in suite["test_cases"]]
    assert written > 20 and len(cases) == written and all(case["status"] == "PASSED" for case in cases)
