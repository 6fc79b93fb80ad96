"""A measured robot: its file is the data sheet's, and it rings as the measured one does.

The data are not part of the project: docs/guide/measured.md says where they are. The environment
variable FLEXURA_QUANSER names their folder.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from commands import run as command
from flexlab.identification.fit.model import low_pass
from flexlab.identification.vibration.damped_sinusoids import fit
from flexlab.studies.measured import GAUGE, measured, ring
from flexlab.studies.measured_fit import FILTER, angle_per_strain, measured_fit
from flexlab.studies.measured_loop import closed_loop


@pytest.fixture
def data():
    folder = Path(os.environ.get("FLEXURA_QUANSER", "quanser2dsfl"))
    if not (folder / "lqg").is_dir():
        pytest.skip("FLEXURA_QUANSER names no folder with the data (docs/guide/measured.md)")
    return folder


def test_the_payload_has_the_inertia_of_the_data_sheet_about_the_axis():
    robot = fx.load("quanser-2dsfl")
    payload, link = robot.payload, robot.links[0]
    arm = link.length_m + payload.centre_of_mass_m[0]
    assert payload.inertia_kg_m2 + payload.mass_kg * arm**2 == pytest.approx(0.18028, abs=1e-8)


def test_its_first_frequency_is_that_of_a_strip_without_mass_but_for_the_strips_mass():
    robot = fx.load("quanser-2dsfl")
    link, payload = robot.links[0], robot.payload
    EI = link.young_modulus_Pa * 0.0762 * 0.00127**3 / 12
    L, c = link.length_m, payload.centre_of_mass_m[0]
    K = EI * np.array([[12 / L**3, -6 / L**2], [-6 / L**2, 4 / L]])  # tip deflection and slope
    m, J = payload.mass_kg, payload.inertia_kg_m2
    M = np.array([[m, m * c], [m * c, J + m * c**2]])
    light = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).min()) / (2 * np.pi)
    own = fx.frequencies(robot)[0]
    assert own < light and own == pytest.approx(light, rel=0.01)


def test_the_ring_of_a_known_vibration():
    t = np.arange(2000) / 500
    y = 0.003 * np.exp(-0.2 * t) * np.sin(2 * np.pi * 1.83 * t) + 0.001
    assert ring(t, y) == pytest.approx(1.83, rel=2e-3)
    with pytest.raises(fx.InputError, match="expected 256"):
        ring(t[:800], y[:800])


def test_the_data_sheet_is_within_7_percent_of_every_measured_step(data):
    from scipy.io import loadmat

    own = fx.frequencies(fx.load("quanser-2dsfl"))[0]
    paths = sorted(data.glob("*/*step*.mat"))
    assert len(paths) >= 6
    for path in paths:
        run = loadmat(path, squeeze_me=True)
        found = ring(run["time"], run["theta12"])
        assert 1.79 < found < 1.88 and abs(own / found - 1) < 0.07, path.name


@pytest.mark.slow
def test_fitted_to_one_run_it_predicts_the_others_and_the_closed_loop(data):
    robot = fx.load("quanser-2dsfl")
    made = measured_fit(robot, measured(robot, data))
    assert made.name == "lqg_step_10deg_run01" and len(made.runs) >= 6
    for run in made.runs:
        assert abs(run.deviation) < 0.02, run.name
        assert run.rms_of_peak < 0.10, run.name
    loop = closed_loop(made, data)
    assert loop is not None and max(loop.hub, loop.gauge, loop.current) < 0.20
    assert loop.hub < 0.02


def test_the_measured_ring_loses_less_the_smaller_it_is(data):
    """Why one damping ratio and one modulus do not fit all runs (docs/guide/measured.md)."""
    from scipy.io import loadmat

    for name, least in (("10deg", 0.02), ("5deg", 0.02), ("20deg", 0.01)):
        run = loadmat(data / "lqg" / f"lqg_step_{name}_run01.mat", squeeze_me=True)
        t, y = run["time"], run["theta12"]
        early, late = (
            max(fit(t[part], y[part]).modes, key=lambda mode: mode.amplitude)
            for part in ((t >= begin) & (t < begin + 1.2) for begin in (1.6, 2.8))
        )
        assert late.amplitude < early.amplitude and late.ratio < 0.7 * early.ratio, name
        assert 1 - late.frequency / early.frequency > least, name


def test_the_makers_filter_and_conversion_are_those_of_its_file(data):
    from scipy.io import loadmat

    made = loadmat(data / "lqr_full_10deg.mat", squeeze_me=True)
    assert made["wcfa"] / (2 * np.pi) == pytest.approx(FILTER[f"{GAUGE}.cutoff_Hz"])
    assert made["zetaf"] == FILTER[f"{GAUGE}.cutoff_ratio"]
    assert made["K1_defl_b"] == pytest.approx(angle_per_strain(fx.load("quanser-2dsfl")))


@pytest.fixture
def written(tmp_path):
    """Step runs of a stiffer strip, written as the published ones are."""
    from scipy.io import savemat

    stiff = fx.load("quanser-2dsfl").replace({"link.1.young_modulus_Pa": 2.2e11})
    t = np.arange(2000) / 500
    motion = fx.signals.cycloid(0.3, 0.4)
    hub = np.array([motion(x)[0] for x in t])
    run = fx.simulate(stiff, t, fx.Drive.prescribed(motion))
    strain = run["sensor/strain_gauge"]
    angle = low_pass(t, 0.202 / (3 * 0.000635) * strain, 2.0, 0.9)
    (tmp_path / "lqg").mkdir()
    path = tmp_path / "lqg" / "lqg_step_17deg_run01.mat"
    savemat(path, {"time": t[:, None], "theta11": hub[:, None], "theta12": angle[:, None]})
    return path


@pytest.mark.slow
def test_the_study_finds_a_stiffer_strip_by_its_ring(written, tmp_path):
    out = tmp_path / "out"
    status, _, said = command(["study", "measured", "--data", written.parents[1], "--out", out])
    assert status == 0, said
    (row,) = json.loads((out / "measured.json").read_text())["runs"]
    ratio = np.sqrt(2.068427e11 / 2.2e11)
    assert row["simulated_deviation"] == pytest.approx(ratio - 1, abs=2e-3)
    assert row["held_deviation"] == pytest.approx(ratio - 1, abs=4e-3)
    assert (out / "measured.png").stat().st_size > 10_000
    made = json.loads((out / "measured.json").read_text())["identified"]
    modulus, ratio, gain = (row["value"] for row in made["parameters"])
    assert modulus == pytest.approx(2.2e11, rel=1e-3) and ratio < 0.01
    assert gain == pytest.approx(106.0367, rel=1e-3)
    assert abs(made["runs"][0]["deviation"]) < 1e-3 and made["runs"][0]["rms_of_peak"] < 1e-2
    assert fx.load(out / "identified.toml").links[0].young_modulus_Pa == modulus
    folder = out / written.stem
    assert (folder / "review.rrd").is_file() and GAUGE in fx.Run.read(folder / "experiment")


def test_what_is_no_such_run_is_refused(tmp_path):
    from scipy.io import savemat

    robot = fx.load("quanser-2dsfl")
    with pytest.raises(fx.InputError, match=r"no \*step\*.mat"):
        measured(robot, tmp_path)
    savemat(tmp_path / "a_step.mat", {"time": np.arange(9.0)[:, None]})
    with pytest.raises(fx.InputError, match="theta11"):
        measured(robot, tmp_path)
    with pytest.raises(fx.InputError, match="one flexible link"):
        measured(fx.load("rig"), tmp_path)
