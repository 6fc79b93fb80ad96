"""Wrong files, command lines and Python arguments, from a grammar, all in one process.

Each ends with status 2 and one sentence, or in an InputError or a TypeError that names the
argument. Nothing is left behind.
"""

import random
import time
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from commands import run
from flexlab import rig as rigs
from flexura.control import load_gains

ROOT = Path(__file__).resolve().parents[3]
ROBOT = (ROOT / "model" / "robots" / "rig.toml").read_text()
LAW = (ROOT / "model" / "manoeuvres" / "rig-inverse-law.toml").read_text()
GAINS = (ROOT / "model" / "controllers" / "rig.toml").read_text()
RIG = (
    (ROOT / "firmware" / "rig.toml")
    .read_text()
    .replace("../model/robots/rig.toml", "robot.toml")
    .replace("../model/manoeuvres/rig-inverse-law.toml", "law.toml")
)
GOOD_FILES = {"robot.toml": ROBOT, "law.toml": LAW, "gains.toml": GAINS, "rig.toml": RIG}
SEED = 20260101
FILES, DAMAGED_RUNS, LINES, ARGUMENTS = 220, 20, 180, 100

# --- damage: each changes a good file so that it is wrong

WRONG_VALUES = (
    "nan",
    "inf",
    "-1e300",
    '"text"',
    "[]",
    "{}",
    "true",
    "1979-05-27",
    "[nan]",
    "1e400",
    '"\\u0000"',
)


def value_changed(text, rng):
    """One key's value is of another kind, or no number that has a sense."""
    lines = text.splitlines()
    places = [k for k, line in enumerate(lines) if " = " in line and not line.startswith("#")]
    k = rng.choice(places)
    lines[k] = f"{lines[k].split(' = ')[0]} = {rng.choice(WRONG_VALUES)}"
    return "\n".join(lines)


def key_changed(text, rng):
    """One key has a letter more."""
    lines = text.splitlines()
    places = [k for k, line in enumerate(lines) if " = " in line and not line.startswith("#")]
    k = rng.choice(places)
    lines[k] = "q" + lines[k].lstrip()
    return "\n".join(lines)


def cut(text, rng):
    """The file ends in the midst of a key."""
    places = [k for k in range(1, len(text)) if text[k - 1].isalpha() and text[k].isalpha()]
    places = [k for k in places if "#" not in text[text.rfind("\n", 0, k) + 1 : k]]
    return text[: rng.choice(places)]


def name_changed(text, rng):
    """A name with control characters, a wrong kind, or far too long."""
    bad = ('"\\u001b[31mred"', '"a\\u0000b"', '"two\\nlines"', "7", f'"{"x" * 5000}"', "[]")
    return f"name = {rng.choice(bad)}\n" + "\n".join(
        line for line in text.splitlines() if not line.startswith("name")
    )


def bytes_changed(text, rng):
    """Bytes that are no text."""
    raw = bytearray(text.encode())
    raw[rng.randrange(len(raw))] = rng.choice((0x00, 0xFF, 0xC0, 0x1B))
    return bytes(raw)


DAMAGE = (value_changed, key_changed, cut, name_changed)


def damaged(text, rng):
    change = rng.choice((*DAMAGE, bytes_changed))
    made = change(text, rng)
    return made if isinstance(made, bytes) else made.encode()


# --- running the command


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A working folder with good files, and a run."""
    for name, text in GOOD_FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    t = np.linspace(0, 1, 5)
    fx.Run(t, {"tip/x": t}, {"tip/x": "m"}, {"source": "simulation"}).save("run")
    return tmp_path


def listing(folder):
    return {p: p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}


def complaint(place, arguments, before):
    """What is wrong with how a case ends: "" for status 2, one sentence, no trace on the disk."""
    said = f"flexura {' '.join(map(repr, map(str, arguments)))}"
    try:
        status, out, err = run(arguments)
    except Exception as error:
        return f"{said}: {type(error).__name__}: {error}"
    if status != 2 or out:
        return f"{said}: status {status}: {out}{err}"
    if any(mark in err for mark in ("Traceback", "\x1b", "\0")):
        return f"{said}: {err}"
    one = err.startswith("flexura: ") and err.count("\n") == 1
    if not (one or err.startswith("Usage: ")):
        return f"{said}: {err}"
    return "" if listing(place) == before else f"{said}: left {set(listing(place)) - set(before)}"


# --- wrong files


READERS = {  # the commands that read a file, with the damaged one in its place
    "robot.toml": [
        ["simulate", "bad.toml", "law.toml"],
        ["frequencies", "bad.toml"],
        ["inverse", "bad.toml", "law.toml"],
        ["crosscheck", "bad.toml", "law.toml"],
        ["study", "payload", "bad.toml", "--values", "0:1:3"],
        ["simulate", "bad.toml", "law.toml", "--vary", "payload.mass_kg=0:1:2"],
        ["tune", "bad.toml", "law.toml", "--controller", "gains.toml"],
    ],
    "law.toml": [
        ["simulate", "robot.toml", "bad.toml"],
        ["inverse", "robot.toml", "bad.toml"],
        ["crosscheck", "robot.toml", "bad.toml"],
        ["study", "payload", "robot.toml", "bad.toml"],
        ["tune", "robot.toml", "bad.toml", "--controller", "gains.toml"],
    ],
    "gains.toml": [
        ["simulate", "robot.toml", "law.toml", "--controller", "bad.toml"],
        ["tune", "robot.toml", "law.toml", "--controller", "bad.toml"],
    ],
    "rig.toml": [
        ["bench", "step", "bad.toml"],
        ["bench", "calibrate", "bad.toml"],
        ["tune", "robot.toml", "law.toml", "--controller", "gains.toml", "--rig", "bad.toml"],
        ["flash", "bad.toml", "--emulated"],
    ],
}


def test_wrong_files(place):
    rng = random.Random(SEED)
    begun = time.process_time()
    cases, found = 0, []
    while cases < FILES:
        which = rng.choice(list(GOOD_FILES))
        bad = damaged(GOOD_FILES[which], rng)
        if still_good(which, bad, place):
            continue
        (place / "bad.toml").write_bytes(bad)
        found.append(complaint(place, rng.choice(READERS[which]), listing(place)))
        cases += 1
    assert not any(found), "\n".join(filter(None, found))
    assert time.process_time() - begun < 60


def still_good(which, data, place):
    """Whether the damage left a file that may be read: a comment, or another good value."""
    path = place / "trial.toml"
    path.write_bytes(data)
    try:
        if which == "robot.toml":
            fx.load(path)
        elif which == "law.toml":
            fx.load_manoeuvre(path, 2)
        elif which == "rig.toml":
            rigs.load(path)
        else:
            load_gains(path)
    except fx.FlexuraError:
        return False
    finally:
        path.unlink()
    return True


# --- runs whose file is cut, or has other bytes


def test_damaged_runs(place):
    rng = random.Random(SEED)
    good = (place / "run" / "run.parquet").read_bytes()
    found = []
    for _ in range(DAMAGED_RUNS):
        (place / "run" / "run.parquet").write_bytes(good[: rng.randrange(len(good) - 1)])
        command = rng.choice(
            (["export", "run", "--to", "csv"], ["review", "run"], ["compare", "run", "run"])
            + (["identify", "run"], ["compare", "run"])
        )
        found.append(complaint(place, command, listing(place)))
    assert not any(found), "\n".join(filter(None, found))


# --- wrong command lines

TEXTS = ("", "-1", "nan", "1e400", "x", "\x1b[31m", "a\nb", "ü" * 300, "0:1", "../..", "--", "[/]")
GOOD = {
    "simulate": ["robot.toml", "law.toml"],
    "inverse": ["robot.toml", "law.toml"],
    "frequencies": ["robot.toml"],
    "crosscheck": ["robot.toml", "law.toml"],
    "study": ["payload", "robot.toml", "law.toml"],
    "tune": ["robot.toml", "law.toml", "--controller", "gains.toml"],
    "identify": ["run"],
    "learn": ["rig-r", "rig-r-swing"],
    "compare": ["run"],
    "review": ["run"],
    "export": ["run", "--to", "csv"],
    "migrate": ["robot.toml"],
    "new": ["robot.toml"],
}
# options with a value that is wrong, whatever the rest of the line
OPTIONS = {
    "simulate": {
        "--rtol": ("0", "-1", "nan", "2", "x"),
        "--method": ("euler", "", "EXPLICIT"),
        "--controller": ("absent.toml", ".", "law.toml"),
        "--vary": (
            "x",
            "payload.mass_kg",
            "payload.mass_kg=0:1",
            "payload.mass_kg=0:1:0",
            "payload.mass_kg=0:1:-3",
            "payload.mass_kg=0:1:999999999",
            "payload.mass_kg=nan:1:3",
            "payload.weight=0:1:3",
            "link.9.length_m=0:1:3",
            "name=0:1:3",
            "link=0:1:2",
            "payload.mass_kg=0:1:2.5",
            "=0:1:2",
            "link.2.elements=1:2:2",
        ),
        "--scheduler": ("tcp://127.0.0.1:1",),
        "--out": ("robot.toml", "run", "robot.toml/deeper", "/dev/null/x", "ü" * 300),
    },
    "inverse": {
        "--rtol": ("0", "nan", "x"),
        "--method": ("euler",),
        "--out": ("robot.toml", "run", "/dev/null/x"),
    },
    "frequencies": {"--count": ("x",), "--joints": ("up",)},
    "crosscheck": {
        "--rtol": ("0", "nan"),
        "--beam": ("", "timoshenko"),
        "--tolerance": ("-1", "x", "nan"),
        "--step-s": ("0", "-1", "nan", "1e-300", "inf"),
        "--out": ("robot.toml", "run", "/dev/null/x"),
    },
    "study": {
        "--values": ("0:1", "0:1:2", "1:0:5", "nan:1:5", "0:1:1e9", "-1:1:3", "0:1:99999999"),
        "--keep": ("all", "first"),
        "--jobs": ("0", "-1", "x"),
        "--out": ("robot.toml", "run", "/dev/null/x"),
    },
    "tune": {
        "--algorithm": ("anneal", ""),
        "--population": ("0", "-5", "x"),
        "--generations": ("0", "-1"),
        "--patience": ("-1", "0"),
        "--polish": ("-1",),
        "--free": ("x", "kp_1_V_m", "kp_1_V_m=2:1", "kp_1_V_m=nan:1", "kp_9_V_m=1:2"),
        "--free-file": ("absent.toml", "law.toml", "."),
        "--payload-factors": ("x", "-1", "", "nan", "1e9"),
        "--stiffness-factors": ("0", "x", "1,,2"),
        "--rtol": ("0", "nan"),
        "--modes": ("-1", "x"),
        "--rig": ("absent.toml", "robot.toml"),
        "--vibration": ("nan", "-1"),
        "--out": ("robot.toml", "run", "/dev/null/x"),
        "--jobs": ("0",),
    },
    "learn": {
        "--trials": ("0", "-1", "x", "1.5"),
        "--gains": ("absent.toml", "law.toml"),
        "--model": ("absent", "robot.toml"),
        "--calibration": ("absent.toml", "."),
        "--out": ("robot.toml", "run", "/dev/null/x"),
    },
    "identify": {"--check": ("absent",), "--by": ("guess",), "--out": ("robot.toml", ".")},
    "compare": {
        "--by": ("guess",),
        "--robot": ("absent.toml",),
        "--rtol": ("0",),
        "--out": ("run",),
        "--picture": ("robot.toml",),
    },
    "review": {
        "--save": ("robot.toml", ".", "/dev/null/x"),
        "--picture": ("robot.toml", "/dev/null/x"),
        "--time-s": ("x", "1"),
    },
    "migrate": {"--keys": ("x",)},
    "new": {"--links": ("2",)},
    "export": {"--to": ("doc", "", "CSV"), "--out": ("robot.toml", ".", "run/run.parquet")},
}


def wrong_line(rng):
    """A command line that is wrong: an option, an argument, a name, or too many of them."""
    command = rng.choice(list(GOOD))
    arguments = list(GOOD[command])
    kind = rng.randrange(5)
    if kind <= 1:
        option = rng.choice(list(OPTIONS[command]))
        return [command, *arguments, option, rng.choice(OPTIONS[command][option])]
    if kind == 2:  # a file that is not there
        k = rng.choice([k for k, a in enumerate(arguments) if not a.startswith("-")])
        arguments[k] = rng.choice(["absent", "", ".", "law.toml/x", "\x1b[31m", "a\nb", "x" * 300])
        return [command, *arguments]
    if kind == 3:  # what no command knows
        return [command, *arguments, f"--{rng.choice(['speed', 'fast', 'x' * 50, '[/]'])}"]
    return [rng.choice(["fly", "Simulate", "sim", "[/]", "\x1b", "--verison", "-x"])]


def test_wrong_command_lines(place):
    rng = random.Random(SEED)
    before = listing(place)
    found = [complaint(place, wrong_line(rng), before) for _ in range(LINES)]
    assert not any(found), "\n".join(filter(None, found))


# --- wrong Python arguments

WRONG = (
    None,
    "x",
    -1.0,
    float("nan"),
    float("inf"),
    [],
    [[1.0]],
    {},
    object(),
    np.array([1.0, np.nan]),
    np.zeros((2, 2)),
    [0.0, 1.0, 0.5],
    True,
    b"bytes",
    "rig\0",
    1 + 2j,
    lambda: 0.0,
    fx,
)


def calls(robot, wrong):
    """Functions that read, each with an argument that is wrong."""
    return {
        "load": lambda: fx.load(wrong),
        "from_dict": lambda: fx.Robot.from_dict(wrong),
        "replace": lambda: robot.replace({"link.2.length_m": wrong}),
        "read": lambda: fx.Run.read(wrong),
        "load_manoeuvre": lambda: fx.load_manoeuvre(wrong, 2),
        "load_gains": lambda: load_gains(wrong),
    }


def test_wrong_python_arguments(place):
    """Of the functions that read; `tests/model` has those that compute."""
    robot = fx.load(place / "robot.toml")
    before = listing(place)
    every = [(name, wrong) for name in calls(robot, None) for wrong in WRONG]
    assert len(every) >= ARGUMENTS
    found = []
    for name, wrong in every:
        try:
            calls(robot, wrong)[name]()
        except (fx.InputError, TypeError) as error:
            text = str(error)
            if not text or "\n" in text or "\0" in text:
                found.append(f"{name}({wrong!r}): {text!r}")
        except Exception as error:
            found.append(f"{name}({wrong!r}): {type(error).__name__}: {error}")
        else:
            found.append(f"{name} took {wrong!r}")
    assert not found, "\n".join(found)
    assert listing(place) == before
