"""Paths that `flexura invert` refuses: one sentence with the option or file, status 2."""

import numpy as np
import pytest

import flexura as fx
from commands import run
from flexlab.cli.invert import table_of

WRONG = {
    "out of reach": (
        "rig --circle 0.38 0.1 0.9",
        "--circle = (1.25569, 0.30777): expected a place within reach",
    ),
    "an angle for two joints": ("rig --angle 0 1", "--angle: expected a path of two entries"),
    "a line for one joint": (
        "single-r --line 0.1 0.1 0.2 0.2",
        "expected a path of one entry, not a pair",
    ),
    "no end": ("single-r --angle 0 inf", "--angle = (0.0, inf): expected two finite numbers"),
    "times that go back": (
        "single-r --table back.csv",
        "back.csv: row 3 (line 4), clock 't': the time falls from 0.1 to 0.05 s",
    ),
    "no rows": ("single-r --table empty.csv", "empty.csv: empty"),
    "a text": (
        "single-r --table text.csv",
        "text.csv: no table of numbers",
    ),
    "a gap": ("rig --table gap.csv", "gap.csv: row 2 (line 3): a cell without a number"),
    "one column": (
        "rig --table one.csv",
        "one.csv: expected the columns t, x, y for this robot; there are 1: 'x'",
    ),
    "a path for two joints": (
        "single-r --table gap.csv",
        "gap.csv: expected the columns t, angle for this robot; there are 3: 't'",
    ),
    "other heads": (
        "rig --table other.csv",
        "other.csv: expected the heads t, x, y, or these with units, not 't', 'x', 'z [mm]'",
    ),
    "a wrong unit": (
        "single-r --table metres.csv",
        "metres.csv: unit of column 'angle [m]' = 'm': link/1/angle is in rad, not in m",
    ),
    "a unit that is none": ("rig --table grad.csv", "unit of column 'x [Grad]' = 'Grad'"),
    "a path that begins with a velocity": (
        "rig --table moving.csv",
        "moving.csv: tip = '0.02 per second': expected a path that begins and ends at rest",
    ),
    "one place": ("rig --point 0.38,0.1", "points = [[0.38, 0.1]]: expected two places"),
    "a place of one number": ("rig --point 0.38", "--point = '0.38': expected two numbers, X,Y"),
    "three numbers of four": (
        "rig --line 0.6 0.1 0.5 --out x",
        "--line = '0.6 0.1 0.5 --out': expected 4 numbers, X Y X Y",
    ),
    "no radius": ("rig --circle 0.38 0.1 0", "radius = 0.0: expected a radius above 0"),
    "no time": ("single-r --angle 0 1 --duration 0", "--duration = 0.0: expected a time above 0"),
    "two paths": ("rig --angle 0 1 --line 0 0 1 1", "path = '--line, --angle': expected one of"),
}
TABLES = {
    "gap.csv": "t,x,y\n0,0.38,0.1\n0.5,,0.1\n1.0,0.4,0.1\n",
    "one.csv": "x\n0.38\n0.39\n",
    "other.csv": "t,x,z [mm]\n0,0.38,100\n0.5,0.39,100\n",
    "metres.csv": "t,angle [m]\n0,0\n0.5,0.1\n",
    "grad.csv": "t,x [Grad],y\n0,0,0.1\n0.5,0.1,0.1\n",
    "back.csv": "t,angle\n0,0\n0.1,0.1\n0.05,0.2\n",
    "empty.csv": "",
    "text.csv": "t,angle\n0,0\n0.1,x\n",
    "moving.csv": "t,x,y\n0,0.38,0.1\n0.5,0.39,0.1\n1.0,0.4,0.1\n",
}


@pytest.mark.parametrize(("arguments", "words"), WRONG.values(), ids=WRONG)
def test_a_wrong_path_is_one_sentence_and_leaves_nothing(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in TABLES.items():
        (tmp_path / name).write_text(text)
    status, said, err = run(["invert", *arguments.split()])
    assert (status, said) == (2, "")
    assert err.count("\n") == 1 and words in err
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(TABLES)


T = np.linspace(0.0, 0.5, 51)
RAIL = fx.Robot.from_dict(
    {"link": [{"length_m": 0.5, "mass_kg": 1.0, "inertia_kg_m2": 1.0, "joint": {"type": "Pa"}}]}
)
RISE = 0.1 * fx.signals.paths.smooth_rise(T / 0.5)


@pytest.mark.parametrize(
    ("heads", "scales", "order"),
    [
        ("t,x,y", (1, 1, 1), (0, 1, 2)),
        ("t [ms],x [mm],y [cm]", (1e3, 1e3, 1e2), (0, 1, 2)),
        ("Y;X_mm;Time", (1, 1e3, 1), (2, 1, 0)),
        ("", (1, 1, 1), (0, 1, 2)),
        ("tip/y [mm],t,tip/x [mm]", (1, 1e3, 1e3), (2, 0, 1)),
    ],
)
def test_a_table_is_read_by_its_heads_and_units(heads, scales, order, tmp_path):
    columns = [c * s for c, s in zip((T, 0.38 + RISE, 0.1 + RISE), scales, strict=True)]
    mark = ";" if ";" in heads else ","
    lines = [mark.join(f"{row[k]:.17g}" for k in order) for row in zip(*columns, strict=True)]
    if mark == ";":
        lines = [line.replace(".", ",") for line in lines]
    (tmp_path / "a.csv").write_text("\n".join([*filter(None, [heads]), *lines]) + "\n")
    t, (x, y) = table_of(tmp_path / "a.csv", fx.load("rig"))
    for found, given in ((t, T), (x, 0.38 + RISE), (y, 0.1 + RISE)):
        np.testing.assert_allclose(found, given, atol=1e-15)


@pytest.mark.parametrize(
    ("robot", "head", "scale"),
    [
        ("single-r", "angle [deg]", 180 / np.pi),
        ("single-r", "angle", 1),
        (RAIL, "place [mm]", 1e3),
    ],
)
def test_a_path_of_one_entry_is_an_angle_or_a_place(robot, head, scale, tmp_path):
    rows = "".join(f"{t:.17g},{scale * y:.17g}\n" for t, y in zip(T, RISE, strict=True))
    (tmp_path / "a.csv").write_text(f"t,{head}\n{rows}")
    t, y = table_of(tmp_path / "a.csv", fx.load(robot) if isinstance(robot, str) else robot)
    np.testing.assert_allclose((t, y), (T, RISE), atol=1e-15)
