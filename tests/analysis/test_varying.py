"""`flexura simulate --vary`: the numbers of single runs, a folder that goes on, and wrong arguments
by name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexlab.cli.app import app
from flexlab.studies import parameter_sweep

RIG = Path(__file__).resolve().parents[2] / "model" / "robots" / "rig.toml"
LAW = RIG.parents[1] / "manoeuvres" / "rig-inverse-law.toml"


def test_the_largest_peak_is_that_of_its_robot(tmp_path):
    arguments = ["simulate", str(RIG), str(LAW), "--out", str(tmp_path), "--json"]
    arguments += ["--vary", "payload.mass_kg=0.01:0.05:3", "--vary", "link.2.length_m=0.25:0.3:2"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["robots"] == 6 and found["ended"] == {"done": 6} and found["complete"]
    peak = {row["channel"]: row for row in found["peaks"]}["link/2/tip_deflection"]
    described, asked = fx.load(RIG).replace(peak["at"]), fx.load_manoeuvre(LAW, 2)
    run = fx.simulate(fx.assemble(described), asked.t, asked.drive)
    assert peak["peak"] == np.abs(run["link/2/tip_deflection"]).max() > peak["least_peak"]
    stamps = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    again = CliRunner().invoke(app, arguments)
    assert json.loads(again.stdout) == found and stamps == {
        path: path.stat().st_mtime_ns for path in tmp_path.iterdir()
    }
    assert (
        "6 robots: 6 done"
        in CliRunner().invoke(app, [a for a in arguments if a != "--json"]).stdout
    )


@pytest.mark.parametrize(
    "text",
    ["payload.mass_kg", "payload.mass_kg=0:1", "payload.mass_kg=0:inf:3", "payload.mass_kg=0:1:0"],
)
def test_a_wrong_variation_is_named(text):
    with pytest.raises(fx.InputError) as raised:
        parameter_sweep.grid(fx.load(RIG), [text])
    assert raised.value.key == "--vary" and raised.value.value == text


def test_a_key_that_is_no_number_of_the_robot_is_named():
    with pytest.raises(fx.InputError, match="unknown key"):
        parameter_sweep.grid(fx.load(RIG), ["payload.weight=0:1:2"])
