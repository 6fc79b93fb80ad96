"""Paths that `flexura invert` refuses: one sentence with the option or file, status 2."""

import pytest

from commands import run

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
        "back.csv: t = 0.05: expected ascending times in seconds; row 3 is not later",
    ),
    "no rows": ("single-r --table empty.csv", "empty.csv: expected a CSV file of numbers"),
    "a text": ("single-r --table text.csv", "text.csv: expected a CSV file of numbers"),
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
