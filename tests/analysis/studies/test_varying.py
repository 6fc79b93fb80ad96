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

RIG = Path(__file__).resolve().parents[3] / "model" / "robots" / "rig.toml"
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
        parameter_sweep.grid(fx.load(RIG), [text], fx.load_manoeuvre(LAW, 2))
    assert raised.value.key == "--vary" and raised.value.value == text


def test_a_key_that_is_no_number_of_the_robot_is_named():
    with pytest.raises(fx.InputError, match="unknown key"):
        parameter_sweep.grid(fx.load(RIG), ["payload.weight=0:1:2"], fx.load_manoeuvre(LAW, 2))


def run_command(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A population of six robots, and what was varied."""
    out = tmp_path_factory.mktemp("many") / "population"
    arguments = ["simulate", RIG, LAW, "--out", out]
    arguments += ["--vary", "payload.mass_kg=0.01:0.05:3", "--vary", "link.2.length_m=0.25:0.3:2"]
    done = run_command(*arguments)
    assert done.exit_code == 0, done.output
    return out


def test_a_population_is_read_with_what_was_varied(folder):
    pytest.importorskip("pandas")
    read = fx.Population.read(folder)
    assert read.complete and read.count == 6 and read.base == fx.load(RIG)
    frame = read.to_pandas()
    assert frame.index.tolist() == [1, 2, 3, 4, 5, 6] and frame.index.name == "robot"
    np.testing.assert_allclose(frame["payload.mass_kg"], np.repeat([0.01, 0.03, 0.05], 2))
    np.testing.assert_allclose(frame["link.2.length_m"], [0.25, 0.3] * 3)
    deflections = read["link/2/tip_deflection"]
    np.testing.assert_array_equal(
        frame["link/2/tip_deflection/peak"], np.abs(deflections).max(axis=1)
    )
    np.testing.assert_array_equal(frame["link/2/tip_deflection/end"], deflections[:, -1])
    assert frame.attrs["units"]["link/2/tip_deflection/peak"] == "m"
    assert (frame["status"] == "done").all()


def test_one_robot_of_a_population_is_a_run(folder):
    read, described, asked = fx.Population.read(folder), fx.load(RIG), fx.load_manoeuvre(LAW, 2)
    run = read.run(4)
    values = {"payload.mass_kg": 0.03, "link.2.length_m": 0.3}
    assert run.meta["population"]["robot"] == 4
    assert run.meta["population"]["vary"] == pytest.approx(values)
    each = described.replace(run.meta["population"]["vary"])
    assert fx.Robot.from_dict(run.meta["robot"]) == each
    alone = fx.simulate(each, asked.t, asked.drive)
    for name in run:
        np.testing.assert_array_equal(run[name], alone[name])
        assert run.units[name] == alone.units[name]
    for wrong in (0, 7, True, 1.0):
        with pytest.raises(fx.InputError, match="1 to 6"):
            read.run(wrong)


def test_a_population_is_exported_as_a_table(folder, tmp_path):
    import duckdb
    import scipy.io

    paths = {form: tmp_path / f"table.{form}" for form in ("csv", "parquet", "mat")}
    for form, path in paths.items():
        done = run_command("export", folder, "--to", form, "--out", path)
        assert done.exit_code == 0 and "population: 6 of 6 robots" in done.stdout
    columns, _ = fx.Population.read(folder).table()
    found = duckdb.sql(f"select * from read_parquet('{paths['parquet']}')").fetchnumpy()
    assert list(found) == list(columns)
    lines = [line for line in paths["csv"].read_text().splitlines() if not line.startswith("#")]
    assert lines[0].split(",") == list(columns) and len(lines) == 7
    held = scipy.io.loadmat(paths["mat"], simplify_cells=True)
    for k, (name, values) in enumerate(columns.items()):
        if values.dtype == float:
            np.testing.assert_array_equal(found[name], values)
            np.testing.assert_array_equal([float(line.split(",")[k]) for line in lines[1:]], values)
            np.testing.assert_array_equal(held[name.replace("/", "_").replace(".", "_")], values)
    assert (
        held["units"]["link_2_tip_deflection_peak"] == "m" and list(held["status"]) == ["done"] * 6
    )


def test_commands_take_one_robot_of_a_population(folder, tmp_path):
    rrd, figure, film, table = (tmp_path / f"a.{form}" for form in ("rrd", "svg", "gif", "csv"))
    for arguments in (
        ("review", folder, "--robot", 2, "--save", rrd),
        ("plot", folder, "--robot", 2, "--out", figure),
        ("animate", folder, "--robot", 2, "--out", film, "--duration-s", 0.2),
        ("export", folder, "--robot", 2, "--to", "csv", "--out", table),
    ):
        done = run_command(*arguments)
        assert done.exit_code == 0, done.output
    rows = [line for line in table.read_text().splitlines() if not line.startswith("#")]
    assert len(rows) == len(fx.Population.read(folder).t) + 1
    assert all(path.stat().st_size > 1000 for path in (rrd, figure, film, table))


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["review"], "a population of 6 robots: choose one with --robot K"),
        (["plot"], "a population of 6 robots: choose one with --robot K"),
        (["animate"], "a population of 6 robots: choose one with --robot K"),
        (["plot", "--robot", "9"], "expected the number of a robot, 1 to 6"),
        (["export", "--to", "tdms"], "expected one of csv, parquet, mat"),
    ],
)
def test_a_population_without_a_robot_is_told_what_to_do(arguments, words, folder):
    before = sorted(folder.iterdir())
    done = run_command(arguments[0], folder, *arguments[1:])
    assert words in str(done.exception) and sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    "content", [None, "", "{", "[]", "{}", '{"t_s": 1, "channels": [], "count": "x"}']
)
def test_a_folder_that_is_no_population_is_named(content, tmp_path):
    if content is not None:
        (tmp_path / "population.json").write_text(content)
    with pytest.raises(fx.InputError) as raised:
        fx.Population.read(tmp_path)
    assert str(tmp_path) in str(raised.value)


def test_a_chunk_with_a_wrong_bit_is_never_read(folder, tmp_path):
    """Each page has a checksum: what is read is right, or it is not read."""
    read = fx.Population.read(folder)
    right, rng = {name: read[name] for name in read.units}, np.random.default_rng(5)
    (good,) = folder.glob("chunk-*.parquet")
    (tmp_path / "population.json").write_bytes((folder / "population.json").read_bytes())
    content = good.read_bytes()
    for _ in range(60):
        raw = bytearray(content)
        raw[rng.integers(len(raw))] ^= 1 << int(rng.integers(8))
        (tmp_path / good.name).write_bytes(raw)
        try:
            found = {name: fx.Population.read(tmp_path)[name] for name in right}
        except (fx.InputError, KeyError):
            continue
        for name in right:
            np.testing.assert_array_equal(found[name], right[name])
