"""Populations: the numbers of single runs to the last bit, however they are chunked, stopped,
killed or spread over workers."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

import flexura as fx
from flexura.population.batch import digest
from flexura.signals import constant, cycloid
from populations import ARM, DRIVE, same, varied
from robots import beam, few, forces, robot, robots, seeds

T = np.linspace(0.0, 0.2, 21)
ROOT = Path(__file__).resolve().parents[3]


# The numbers


@few
@given(robots(max_links=3, coulomb=True, locked=True, stiffening=True), seeds)
def test_a_population_has_the_numbers_of_single_runs(described, seed):
    """Any robot, any channel, to the last bit; where the run ends at a limit, up to there."""
    drive = fx.Drive.force(*map(constant, forces(fx.assemble(described), seed)))
    batch = fx.Batch.vary(described, {"payload.mass_kg": [0.05, 0.2]})
    several = fx.simulate(batch, T, drive, channels=["tip/x", "energy/work", "joint/1/drive"])
    default = fx.simulate(batch, T, drive, threads=1)
    for k, (each, _) in enumerate(batch):
        run = fx.simulate(fx.assemble(each), T, drive)
        assert (several.status[k] == "done") == run.complete
        rows = np.count_nonzero(np.isin(run.t, T))
        for done in (several, default):
            for name in done.units:
                assert (
                    np.array_equal(done[name][k, :rows], run[name][:rows])
                    and np.isnan(done[name][k, rows:]).all()
                )


def test_each_robot_has_its_own_drive_gains_or_prescribed_motion():
    motion = cycloid(0.2, 0.15)
    drives = [fx.Drive.pd([motion, motion], [k, k], [1.0, 0.1]) for k in (1.0, 5.0)] + [
        fx.Drive.prescribed(motion, None)
    ]
    done = fx.simulate(fx.Batch.of([(ARM, drive) for drive in drives]), T)
    for k, drive in enumerate(drives):
        run = fx.simulate(fx.assemble(ARM), T, drive)
        assert all(np.array_equal(done[name][k], run[name]) for name in done.units)
    assert np.allclose(done["joint/1/position"][2], [motion(t)[0] for t in T], rtol=0, atol=1e-15)


def test_a_varied_robot_has_the_rows_of_the_robot_made_anew():
    """To the last bit, for every key that the rows know; for others the robots are made."""
    from flexura.population.rows import one
    from flexura.population.rows import varied as vary

    B = 5
    up = lambda value: value * np.linspace(0.9, 1.1, B)
    section = ARM.replace(
        {
            "link.2.mass_per_length_kg_m": None,
            "link.2.bending_stiffness_N_m2": None,
            "link.2.density_kg_m3": 2700.0,
            "link.2.section": {"width_m": 0.02, "height_m": 0.003},
            "link.2.young_modulus_Pa": 7.1e10,
        }
    )
    cases = [
        (
            ARM,
            {
                "payload.mass_kg": up(0.3),
                "payload.inertia_kg_m2": up(1e-3),
                "link.2.length_m": up(0.3),
            },
        ),
        (
            ARM,
            {
                "gravity_m_s2.2": up(-9.81),
                "link.2.joint.hub_mass_kg": up(0.1),
                "link.1.joint.viscous_friction": up(0.1),
            },
        ),
        (ARM, {"link.2.mass_per_length_kg_m": up(0.37), "link.2.bending_stiffness_N_m2": up(0.7)}),
        (
            ARM,
            {
                "link.1.length_m": up(0.1),
                "link.1.mass_kg": up(1.3),
                "link.2.damping.beta_s": up(1e-4),
            },
        ),
        (section, {"link.2.section.height_m": up(0.003), "link.2.section.width_m": up(0.02)}),
        (
            section,
            {
                "link.2.density_kg_m3": up(2700.0),
                "link.2.young_modulus_Pa": up(7e10),
                "link.1.centre_of_mass_m": up(0.03),
            },
        ),
    ]
    for template, columns in cases:
        rows = vary(template, columns, len(next(iter(columns.values()))))
        assert rows is not None
        for k, (each, _) in enumerate(fx.Batch.vary(template, columns)):
            assert rows.contents(k) == one(each).contents(0), (k, columns)
            assert np.array_equal(rows.limits[k], fx.System(each).limits)
    assert (
        vary(ARM, {"link.2.joint.start": np.zeros(2)}, 2) is None
        and vary(ARM, {"link.3.length_m": np.ones(2)}, 2) is None
    )


def test_a_varied_value_out_of_its_range_is_refused_as_a_robots():
    for changes in (
        {"payload.mass_kg": [0.1, -1.0]},
        {"link.2.length_m": [0.1, np.nan]},
        {"link.2.nothing": [1.0, 2.0]},
    ):
        with pytest.raises(fx.InputError):
            fx.simulate(fx.Batch.vary(ARM, changes), T)


def test_robots_of_other_tapers_are_one_batch():
    """Kinks in other places and in another number: each robot has its own numbers all the same."""

    def kinked(*at: float) -> fx.Robot:
        taper = [{"at_m": x, "value": 0.3 - 0.2 * x} for x in (0.0, *at, 0.6)]
        return robot(beam(0.6, taper, 0.5, 3, modes=2, hub_inertia_kg_m2=1e-3))

    items = [kinked(0.1), kinked(0.2), kinked(0.25, 0.5), kinked(0.5)]
    drive = fx.Drive.force(constant(0.1))
    done = fx.simulate(fx.Batch.of(items), T, drive)
    for k, each in enumerate(items):
        assert np.array_equal(
            done["joint/1/position"][k], fx.simulate(each, T, drive)["joint/1/position"]
        )


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_do_not_change_the_numbers(threads):
    assert same(
        fx.simulate(varied(), T, DRIVE, threads=threads), fx.simulate(varied(), T, DRIVE, chunk=3)
    )


def test_robots_are_drawn_with_a_generator_of_their_own():
    """The k-th robot does not depend on who was drawn before it."""
    draw = lambda k, random: ARM.replace({"payload.mass_kg": float(random.uniform(0, 0.1))})
    batch = fx.Batch.of(draw, 5, seed=3)
    masses = [each.payload.mass_kg for each, _ in batch]
    assert len(set(masses)) == 5 and masses == [each.payload.mass_kg for each, _ in batch]
    assert masses[3] == draw(3, np.random.default_rng([3, 3])).payload.mass_kg
    assert masses != [each.payload.mass_kg for each, _ in fx.Batch.of(draw, 5, seed=4)]


def test_a_robot_that_fails_ends_alone():
    stopped = ARM.replace({"link.1.joint.limits": [-0.002, 0.002]})
    outside = ARM.replace({"link.1.joint.limits": [0.0, 0.01]})
    stuck = fx.Drive.force(constant(1e200), constant(1e200))
    prescribed = fx.Drive.prescribed(cycloid(0.5, 0.2, start=-0.1), None)
    items = [ARM, stopped, (outside, prescribed), (ARM, stuck), ARM]
    done = fx.simulate(fx.Batch.of(items), T, DRIVE, chunk=4)
    assert list(done.status) == ["done", "limit", "refused", "stuck", "done"]
    events = [event for chunk in done for event in chunk.event]
    assert (
        "left its limits, -0.002 to 0.002 m" in events[1]
        and "inside the limits of joint 1" in events[2]
    )
    x = done["joint/1/position"]
    assert np.array_equal(x[0], x[4]) and not np.isnan(x[0]).any() and np.isnan(x[2]).all()
    rows = np.count_nonzero(~np.isnan(x[1]))
    assert (
        1 < rows < len(T)
        and np.array_equal(x[1, :rows], x[0, :rows])
        and np.abs(x[0, :rows]).max() <= 0.002
    )
    reached = np.concatenate([chunk.reached_s for chunk in done])
    assert (
        T[rows - 1] <= reached[1] <= T[rows]
        and reached[0] == T[-1]
        and np.isnan(reached[2])
        and reached[3] < T[-1]
    )


def test_only_the_numbers_of_a_reduction_are_kept():
    whole = fx.simulate(varied(), T, DRIVE)
    largest = fx.simulate(
        varied(), T, DRIVE, reduce=lambda t, c: np.abs(c["link/2/tip_deflection"]).max()
    )
    assert np.array_equal(largest["value"], np.abs(whole["link/2/tip_deflection"]).max(axis=1))
    two = fx.simulate(
        varied(),
        T,
        DRIVE,
        channels=["tip/y"],
        reduce=lambda t, c: {"end": c["tip/y"][-1], "count": len(c)},
    )
    assert np.array_equal(
        two["end"], fx.simulate(varied(), T, DRIVE, channels=["tip/y"])["tip/y"][:, -1]
    )
    assert (two["count"] == 1).all()
    with pytest.raises(KeyError, match="tip/y"):
        two["tip/y"]


# Folders


@pytest.mark.parametrize("chunk", [1, 7, 100])
def test_chunks_do_not_change_the_numbers(tmp_path, chunk):
    seen = []
    done = fx.simulate(varied(), T, DRIVE, folder=tmp_path, chunk=chunk, progress=seen.append)
    assert same(done, fx.simulate(varied(), T, DRIVE)) and done.complete
    assert (
        len(seen) == -(-20 // chunk) == len(list(tmp_path.glob("chunk-*")))
        and seen[-1] == 1.0
        and seen == sorted(seen)
    )
    assert list(done.robots) == list(range(1, 21))


def test_what_is_done_is_not_done_again(tmp_path):
    done = fx.simulate(varied(), T, DRIVE, folder=tmp_path, chunk=6)
    files = sorted(tmp_path.glob("chunk-*"))
    stamps = [path.stat().st_mtime_ns for path in files]
    files[1].unlink()
    files[2].write_bytes(files[2].read_bytes()[:-40])  # cut short
    again = fx.simulate(varied(), T, DRIVE, folder=tmp_path, chunk=6)
    kept = [path.stat().st_mtime_ns == stamp for path, stamp in zip(files, stamps)]
    assert (
        kept == [True, False, False, True]
        and same(again, fx.simulate(varied(), T, DRIVE))
        and same(done, again)
    )


@pytest.mark.parametrize(
    "change, key",
    [
        ({"t_eval": T[:-1]}, "t_s"),
        ({"rtol": 1e-5}, "rtol"),
        ({"drive": None}, "drive"),
        ({"method": "implicit"}, "method"),
        ({"channels": ["tip/x"]}, "channels"),
        ({"reduce": lambda t, c: 1.0}, "reduce"),
        ({"chunk": 5}, "chunk"),
        ({"system": varied(19)}, "count"),
        ({"q0": np.zeros(4)}, "q0"),
    ],
)
def test_another_request_in_a_folder_is_refused_by_name(tmp_path, change, key):
    asked = {"system": varied(), "t_eval": T, "drive": DRIVE, "folder": tmp_path, "chunk": 6}
    batch, *rest = asked["system"], asked["t_eval"]
    fx.simulate(batch, *rest, DRIVE, folder=tmp_path, chunk=6)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    asked |= change
    with pytest.raises(fx.InputError) as raised:
        fx.simulate(asked.pop("system"), **asked)
    assert raised.value.key == key and raised.value.file == str(tmp_path / "population.json")
    assert before == {path: path.read_bytes() for path in tmp_path.iterdir()}


def test_another_robot_in_a_folder_is_refused_by_its_number(tmp_path):
    fx.simulate(varied(), T, DRIVE, folder=tmp_path, chunk=6)
    items = [each for each, _ in varied()]
    items[13] = items[13].replace({"payload.mass_kg": np.nextafter(items[13].payload.mass_kg, 1.0)})
    with pytest.raises(fx.InputError, match="another robot or drive") as raised:
        fx.simulate(fx.Batch.of(items), T, DRIVE, folder=tmp_path, chunk=6)
    assert raised.value.key == "robots[14]"


def test_a_changed_reduction_is_another_request():
    """Its code, constants, defaults and what it closes over count."""
    from flexura.population.request import identity

    def made(factor, power=2):
        return lambda t, c: factor * c["tip/x"][-1] ** power

    same_name = [
        made(1.0),
        made(2.0),
        lambda t, c: c["tip/y"][-1],
        lambda t, c: c["tip/x"][-1],
        lambda t, c: c["tip/x"][0],
    ]
    assert (
        identity(made(1.0)) == identity(made(1.0))
        and len({identity(f).split()[-1] for f in same_name}) == 5
    )


def test_every_number_of_a_robot_and_its_drive_is_in_its_digest():
    found = {
        digest(ARM, None),
        digest(ARM, DRIVE),
        digest(ARM, fx.Drive.pd([constant(0.0)] * 2, [1, 0], [0, 0])),
    }
    for path, value in (
        ("payload.mass_kg", 0.02 + 4e-18),
        ("link.1.mass_kg", 2.0),
        ("gravity_m_s2", [0.0, -1e-9]),
    ):
        found.add(digest(ARM.replace({path: value}), None))
    assert len(found) == 6 and digest(ARM, DRIVE) in found


# Interruptions

SCRIPT = """
import sys; sys.path[:0] = {path!r}
import numpy as np, flexura as fx
from populations import ARM, DRIVE
t = np.linspace(0, 2, 21)
batch = fx.Batch.vary(ARM, {{"payload.mass_kg": np.linspace(0, 0.1, 600)}})
said = []
told = lambda f: print(f, flush=True)
done = fx.simulate(batch, t, DRIVE, rtol=1e-9, folder={folder!r}, chunk=20, progress=told)
print("complete" if done.complete else f"interrupted {{len(done.robots)}}", flush=True)
"""


@pytest.mark.parametrize(
    "how", [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGKILL]
)
def test_a_stopped_population_goes_on_where_it_was(tmp_path, how):
    script = SCRIPT.format(path=[str(ROOT / "tests" / "support")], folder=str(tmp_path))
    environment = os.environ | {"PYTHONPATH": str(ROOT / "model")}
    command = [sys.executable, "-c", script]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        for _ in range(3):
            process.stdout.readline()
        process.send_signal(how)
        out, err = process.communicate(timeout=120)
    files = {path.name: path.read_bytes() for path in tmp_path.glob("chunk-*")}
    assert 3 <= len(files) < 30 and not [
        path for path in tmp_path.iterdir() if path.name[0] == "." and how == signal.SIGINT
    ]
    if how == signal.SIGINT:
        assert process.returncode == 0 and "Traceback" not in err
        assert f"interrupted {20 * len(files)}" in out
    else:
        assert process.returncode == -signal.SIGKILL
    rest = subprocess.run(
        command, capture_output=True, text=True, env=environment, timeout=120, check=True
    )
    assert rest.stdout.splitlines()[-1] == "complete"
    assert all((tmp_path / name).read_bytes() == content for name, content in files.items())
    batch = fx.Batch.vary(ARM, {"payload.mass_kg": np.linspace(0, 0.1, 600)})
    done = fx.simulate(batch, np.linspace(0, 2, 21), DRIVE, rtol=1e-9, folder=tmp_path, chunk=20)
    assert list(done.robots) == list(range(1, 601)) and done.complete
    whole = fx.simulate(batch, np.linspace(0, 2, 21), DRIVE, rtol=1e-9)
    assert same(done, whole)


MEMORY = """
import sys; sys.path[:0] = {path!r}
import resource, numpy as np, flexura as fx
from populations import ARM, DRIVE
draw = lambda k, random: ARM.replace({{"payload.mass_kg": float(random.uniform(0, 0.1))}})
unit = 1 if sys.platform == "darwin" else 1024
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
t = np.linspace(0, 0.01, 201)
def run(count, folder):
    done = fx.simulate(fx.Batch.of(draw, count), t, DRIVE, rtol=1e-3, folder=folder)
    good = sum(np.isfinite(c["joint/1/position"]).all(axis=1).sum() for c in done)
    assert done.complete and good == count
    return peak()
print(run(1000, {folder!r} + "/few"), run({count}, {folder!r} + "/many"))
"""


@pytest.mark.parametrize("count", [10_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_memory_does_not_grow_with_the_number_of_robots(tmp_path, count):
    """10 000 robots take no more than 50 MB beyond what 1000 take, 100 000 the same, and less than
    2 GiB in all."""
    script = MEMORY.format(
        path=[str(ROOT / "tests" / "support")], folder=str(tmp_path), count=count
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT / "model")}
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=True
    )
    few_bytes, many_bytes = map(int, done.stdout.split())
    assert many_bytes - few_bytes < 50e6 and many_bytes < 2**31


# Wrong arguments


@pytest.mark.parametrize(
    "make, key",
    [
        (lambda: fx.Batch.of(iter([ARM])), "count"),
        (lambda: fx.Batch.of([ARM], 0), "count"),
        (lambda: fx.Batch.of([]), "count"),
        (lambda: fx.simulate(fx.Batch.of([ARM], 2), T), "robots"),
        (lambda: fx.simulate(fx.Batch.of([ARM, ARM], 1), T), "robots"),
        (lambda: fx.simulate(fx.Batch.of([ARM, 3]), T), "robots[2]"),
        (
            lambda: fx.simulate(fx.Batch.of([ARM, ARM.replace({"link.2.elements": 4})]), T),
            "robots[2]",
        ),
        (lambda: fx.simulate(fx.Batch.of([(ARM, fx.Drive.none(1))]), T), "robots[1].drive"),
        (lambda: fx.simulate(varied(), T, fx.Drive.none(3)), "drive"),
        (lambda: fx.simulate(varied(), T, lambda t: 0), "drive"),
        (lambda: fx.simulate(varied(), T, q0=[1.0]), "q0"),
        (lambda: fx.simulate(varied(), T, qd0=np.ones((4, 1))), "qd0"),
        (lambda: fx.simulate(varied(), T, channels=["tip/z"]), "channels"),
        (lambda: fx.simulate(varied(), T, chunk=0), "chunk"),
        (lambda: fx.simulate(varied(), T, channels="tip/x"), "channels"),
        (lambda: fx.simulate(varied(), T, reduce=1), "reduce"),
        (lambda: fx.simulate(varied(), T, reduce=lambda t, c: "no"), "reduce"),
        (lambda: fx.simulate(varied(), []), "t_eval"),
        (lambda: fx.simulate(varied(), T, rtol=1.0), "rtol"),
        (lambda: fx.simulate(fx.assemble(ARM), T, chunk=3), "chunk"),
        (lambda: fx.simulate(varied(), T, threads=0), "threads"),
        (lambda: fx.Batch.vary(ARM, {"payload.mass_kg": [1, 2], "link.1.mass_kg": [1]}), "changes"),
    ],
)
def test_wrong_arguments_are_named(make, key):
    with pytest.raises(fx.InputError) as raised:
        make()
    assert raised.value.key == key


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "population.json").write_text(json.dumps({"rtol": 1e-3}))
    with pytest.raises(fx.InputError, match="not the request of a population"):
        fx.simulate(varied(), T, folder=tmp_path)
    (tmp_path / "population.json").rename(tmp_path / "chunk-0000000.parquet")
    with pytest.raises(fx.InputError, match=r"chunks without their population\.json"):
        fx.simulate(varied(), T, folder=tmp_path)
