"""Commands take loads and payloads of a manoeuvre file, or refuse them in a sentence."""

import pytest

import flexura as fx
from commands import run

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


def test_a_population_refuses_them(files):
    status, _, err = run(["simulate", *files, "--vary", "payload.mass_kg=0:0.1:2"])
    assert status == 2 and "a population takes no loads on links" in err


def test_a_place_beyond_the_link_is_refused_by_the_file(files, tmp_path):
    (tmp_path / "push.toml").write_text(PUSH.replace("link = 1", "link = 1\nat_m = 0.6"))
    status, _, err = run(["simulate", *files])
    assert status == 2 and "push.toml" in err and "load[1].at_m" in err
