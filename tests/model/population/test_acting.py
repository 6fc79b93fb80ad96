"""Populations under loads, with payloads that change, with sensors and internal forces: the numbers
of single runs to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.population.store import Chunk, Store
from flexura.signals import Acting, harmonic
from populations import same
from robots import beam, rigid, robot

T = np.linspace(0.0, 0.1, 11)
DRIVE = fx.Drive.force(0.5, 0.02)
LOADS = [
    fx.Load(2, force_N=(0.1, harmonic(0.2, 3.0))),
    fx.Load(2, 0.1, moment_N_m=lambda t: 0.01 * np.sin(9.0 * t), frame="link"),
]
PAYLOADS = fx.PayloadChange(0.035, 0.08)
SENSORS = [
    {"name": "gauge", "kind": "strain", "at_m": 0.05, "distance_m": 0.0005},
    {"name": "acc", "kind": "acceleration", "at_m": 0.2},
    {"name": "moment", "kind": "bending_moment", "at_m": 0.1},
]


def arm(gravity=(0.0, 0.0), **link):
    strip = beam(0.3, 0.157, 0.33, 3, hub_inertia_kg_m2=1e-3, damping={"beta_s": 1e-4}) | link
    return robot(rigid(0.1, 1.0, 0.05, 1e-3, "Pa"), strip, gravity=gravity, payload=0.02)


def single(batch, k, **options):
    """Robot k (from 0) of a batch of `vary` by itself, with its own loads and payloads."""
    acting = Acting.of(options.pop("loads", None), options.pop("payloads", None), 0.0, T[-1])
    own = acting.varied({key: v[k] for key, v in batch.varied.items() if fx.signals.acts(key)})
    changes = {key: v[k] for key, v in batch.varied.items() if not fx.signals.acts(key)}
    described = batch.base.replace(changes)
    return fx.simulate(described, T, DRIVE, loads=own.loads, payloads=own.payloads, **options)


CHANGES = {
    "link.2.length_m": [0.29, 0.3, 0.31],
    "load.1.force_N.2.amplitude": [0.0, 0.1, 0.2],
    "load.2.at_m": [0.0, 0.1, 0.2],
}
CASES = {
    "loads": (arm(), {"loads": LOADS}, CHANGES),
    "under gravity": (arm((0.0, -9.81)), {"loads": LOADS}, CHANGES),
    "static": (arm(), {"loads": LOADS, "start": "static"}, CHANGES),
    "implicit": (arm(), {"loads": LOADS, "method": "implicit"}, CHANGES),
    "linear": (
        arm(modes=1).replace({"stiffening": False}),
        {"loads": LOADS[:1]},
        {"load.1.force_N.2.amplitude": [0.0, 0.1, 0.2]},
    ),
    "payloads": (
        arm(),
        {"payloads": PAYLOADS},
        {"payload.mass_kg": [0.0, 0.02, 0.1], "payload.1.mass_kg": [0.1, 0.02, 0.0]},
    ),
    "both": (
        arm(),
        {"loads": LOADS, "payloads": PAYLOADS},
        {"payload.1.at_s": [0.03, 0.05, 0.07], "load.1.force_N.1": [0.0, -1.0, 1.0]},
    ),
}


@pytest.mark.parametrize(("described", "options", "changes"), CASES.values(), ids=CASES)
def test_what_acts_gives_the_numbers_of_single_runs(described, options, changes, tmp_path):
    """Whatever the chunks and threads, and from a folder too."""
    batch = fx.Batch.vary(described, changes)
    names = ["joint/2/position", "link/2/tip_deflection", "energy/work", "tip/x"]
    done = fx.simulate(batch, T, DRIVE, channels=names, **options)
    again = fx.simulate(
        batch, T, DRIVE, channels=names, chunk=2, threads=1, folder=tmp_path, **options
    )
    assert list(done.status) == ["done"] * 3 and same(done, again)
    for k in range(3):
        run = single(batch, k, **options)
        assert all(np.array_equal(done[name][k], run[name]) for name in names)
    kept = fx.Population.read(tmp_path).run(3).meta
    assert kept["population"]["vary"] == {key: values[2] for key, values in changes.items()}
    assert kept.get("payloads") == run.meta.get("payloads")
    for told, own in zip(kept.get("loads", []), run.meta.get("loads", []), strict=True):
        force = told.get("force_N", [0.0])[0]
        assert told.get("at_m", own["at_m"]) == own["at_m"]
        assert force in (0.0, 1.0) or force == own["force_N"][0]


def test_sensors_and_internal_forces_are_those_of_single_runs():
    """By name, and all of them; of a robot that slides from node to node no forces."""
    batch = fx.Batch.vary(arm(sensor=SENSORS), {"payload.mass_kg": [0.0, 0.1]})
    names = ["sensor/gauge", "sensor/acc", "sensor/moment", "link/2/shear_force/3", "tip/y"]
    named = fx.simulate(batch, T, DRIVE, channels=names, loads=LOADS)
    every = fx.simulate(batch, T, DRIVE, internal_forces=True, loads=LOADS)
    assert named.units["sensor/acc"] == "m/s^2" and every.units["joint/1/reaction_x"] == "N"
    for k in range(2):
        run = single(batch, k, loads=LOADS, internal_forces=True)
        for done in (named, every):
            assert all(np.array_equal(done[name][k], run[name]) for name in done.units)
    forces = [name for name in run if "reaction" in name or "moment/" in name]
    assert set(forces) <= set(every.units)
    reduced = fx.simulate(
        batch, T, DRIVE, channels=names, reduce=lambda t, c: np.abs(c["sensor/gauge"]).max()
    )
    assert reduced["value"].shape == (2,) and (reduced["value"] > 0).all()


def test_robots_that_slide_from_node_to_node_run_in_a_batch():
    sleeve = beam(0.4, 0.2, 1.0, 4, "Pb", start=0.2)
    batch = fx.Batch.vary(
        robot(sleeve).replace({"sliding": "nodal"}), {"payload.mass_kg": [0.1, 0.2]}
    )
    done = fx.simulate(batch, T, fx.Drive.force(0.1))
    run = fx.simulate(batch.base.replace({"payload.mass_kg": 0.2}), T, fx.Drive.force(0.1))
    assert np.array_equal(done["joint/1/position"][1], run["joint/1/position"])
    with pytest.raises(fx.InputError, match="link/1/deflection/K"):
        fx.simulate(batch, T, channels=["joint/1/reaction_x"])
    with pytest.raises(fx.InputError, match="forces at a cut do not balance"):
        fx.simulate(batch, T, internal_forces=True)


def test_a_robot_that_is_too_short_for_a_load_ends_alone():
    batch = fx.Batch.vary(arm(), {"link.2.length_m": [0.3, 0.2]})
    done = fx.simulate(batch, T, DRIVE, loads=fx.Load(2, 0.25, (0.0, 1.0)))
    assert list(done.status) == ["done", "refused"] and np.isnan(done["joint/2/position"][1]).all()
    (chunk,) = done
    assert "load[1].at_m" in chunk.event[1] and "0.2 m" in chunk.event[1]


def test_another_load_does_not_go_on_in_a_folder(tmp_path):
    batch = fx.Batch.vary(arm(), {"payload.mass_kg": [0.0, 0.1]})
    fx.simulate(batch, T, DRIVE, loads=LOADS, folder=tmp_path)
    other = fx.Load(2, 0.1, moment_N_m=lambda t: 0.02 * np.sin(9.0 * t), frame="link")
    with pytest.raises(fx.InputError) as refused:
        fx.simulate(batch, T, DRIVE, loads=[LOADS[0], other], folder=tmp_path)
    assert refused.value.key == "acting"
    varied = fx.Batch.vary(arm(), {"load.1.force_N.1": [0.0, 0.1]})
    fx.simulate(varied, T, DRIVE, loads=LOADS, folder=tmp_path / "own")
    moved = fx.Batch.vary(arm(), {"load.1.force_N.1": [0.0, 0.2]})
    with pytest.raises(fx.InputError, match="another robot or drive"):
        fx.simulate(moved, T, DRIVE, loads=LOADS, folder=tmp_path / "own")


REFUSED = {
    "no such load": ("load.3.at_m", "number from 1 to 2"),
    "no load": ("payload.1.at_s", "no [[payload]]"),
    "a signal's unknown key": ("load.1.force_N.2.amplitudes", "unknown key"),
    "a function's key": ("load.2.moment_N_m.amplitude", "a number of a signal"),
    "a force without component": ("load.1.force_N", "force_N.1 or force_N.2"),
    "the link": ("load.1.link", "on the same links"),
    "an unknown key": ("load.1.force", "unknown key"),
}


@pytest.mark.parametrize(("key", "words"), REFUSED.values(), ids=REFUSED)
def test_keys_that_lead_nowhere_are_refused(key, words):
    with pytest.raises(fx.InputError) as refused:
        fx.simulate(fx.Batch.vary(arm(), {key: [0.0, 0.1]}), T, DRIVE, loads=LOADS)
    assert words in str(refused.value)


def test_a_load_on_a_link_that_no_robot_has_is_refused():
    with pytest.raises(fx.InputError) as refused:
        fx.simulate(fx.Batch.of([arm()]), T, DRIVE, loads=fx.Load(3, moment_N_m=1.0))
    assert refused.value.key == "load[1].link"


def test_a_chunk_of_other_robots_is_not_replaced(tmp_path):
    """Two calls began while the folder was empty; what each varies is not in its request."""
    chunk = lambda *digests: Chunk(
        0,
        np.array(["done"] * len(digests)),
        np.ones(len(digests)),
        np.ones(len(digests), int),
        [""] * len(digests),
        list(digests),
        {"a": np.zeros(len(digests))},
    )
    one, other = Store(tmp_path), Store(tmp_path)
    one.put(chunk(b"a" * 16, b"b" * 16))
    before = [path.read_bytes() for path in tmp_path.iterdir()]
    with pytest.raises(fx.InputError, match="another robot or drive"):
        other.put(chunk(b"a" * 16, b"c" * 16))
    other.put(chunk(b"a" * 16, b"b" * 16))
    assert [path.read_bytes() for path in tmp_path.iterdir()] == before
