"""Commands take loads and payloads of a manoeuvre file, or refuse them in a sentence."""

import json

import pytest

import flexura as fx
from commands import run
from flexlab import rig
from flexlab.experiment import plan

ARM = """
[[link]]
length_m = 0.5
mass_kg = 0.4
centre_of_mass_m = 0.25
inertia_kg_m2 = 0.01
[link.joint]
type = "R"
hub_inertia_kg_m2 = 0.01
"""
PUSH = """
duration_s = 0.2
output_step_s = 0.01
[[joint]]
[[load]]
link = 1
force_N = [0.0, 2.0]
frame = "link"
[[payload]]
at_s = 0.1
mass_kg = 0.2
"""


@pytest.fixture
def files(tmp_path):
    (tmp_path / "arm.toml").write_text(ARM)
    (tmp_path / "push.toml").write_text(PUSH)
    return [str(tmp_path / name) for name in ("arm.toml", "push.toml")]


def test_simulate_takes_both(files, tmp_path):
    status, _, err = run(["simulate", *files, "--out", tmp_path / "out"])
    assert status == 0, err
    meta = fx.Run.read(tmp_path / "out").meta
    assert meta["loads"][0]["frame"] == "link" and meta["payloads"][0]["mass_kg"] == 0.2
    J = 0.02 + 0.4 * 0.25**2
    J1, w = J + 0.2 * 0.25, 2.0 * 0.5 * 0.1 / J
    lost = J * (J1 - J) * w**2 / (2 * J1)
    assert meta["energy_jumps"][0]["impact_J"] == pytest.approx(lost, rel=1e-6)


def test_a_population_varies_them(files, tmp_path):
    """The numbers of a single run under the load of the last robot."""
    vary = ["--vary", "load.1.force_N.2=0:2:2", "--vary", "payload.1.mass_kg=0:0.2:2"]
    out = ["--out", tmp_path / "many"]
    status, _, err = run(["simulate", *files, *vary, "--internal-forces", *out])
    assert status == 0, err
    done = fx.Population.read(tmp_path / "many")
    run(["simulate", *files, "--internal-forces", "--out", tmp_path / "one"])
    one = fx.Run.read(tmp_path / "one")
    assert set(done.units) <= set(one) and "joint/1/reaction_x" in done.units
    assert all((done[name][-1] == one[name]).all() for name in done.units)


WRONG = {
    "load.1.force_N.2=0:1e15:2": ("push.toml", "load[1].force_N[2] = 1000000000000000.0"),
    "load.2.at_m=0:1:2": ("push.toml", "load.2.at_m"),
    "payload.1.mass=0:1:2": ("push.toml", "payload[1].mass"),
    "link.1.mass_kgs=1:2:2": ("arm.toml", "link[1].mass_kgs"),
}


@pytest.mark.parametrize(("vary", "words"), WRONG.items(), ids=list(WRONG))
def test_a_wrong_variation_is_named_by_its_file(files, tmp_path, vary, words):
    out = tmp_path / "many"
    status, _, err = run(["simulate", *files, "--vary", vary, "--out", out])
    assert status == 2 and all(word in err for word in words) and not out.exists()


def test_a_cross_check_compares_internal_forces(files, tmp_path):
    pytest.importorskip("exudyn")
    asked = ["crosscheck", *files, "--internal-forces", "--json", "--out", tmp_path / "out"]
    status, out, err = run(asked)
    assert status == 0, err
    rows = json.loads(out)["channels"]
    assert rows["joint/1/reaction"]["max_relative"] < 1e-3
    assert rows["joint/1/reaction_moment"]["unit"] == "N m"


def test_the_bench_and_tune_say_why_they_refuse(files):
    asked = fx.load_manoeuvre(files[1], 1)
    with pytest.raises(fx.InputError, match="a rig has nothing that pushes") as refused:
        plan.inverse(rig.load("rig-r"), {}, asked)
    assert refused.value.file == files[1]
    status, _, err = run(["tune", *files, "--controller", "rig"])
    assert status == 2 and "push.toml" in err and "begin anew at the impact" in err


def test_a_place_beyond_the_link_is_refused_by_the_file(files, tmp_path):
    (tmp_path / "push.toml").write_text(PUSH.replace("link = 1", "link = 1\nat_m = 0.6"))
    status, _, err = run(["simulate", *files])
    assert status == 2 and "push.toml" in err and "load[1].at_m" in err
