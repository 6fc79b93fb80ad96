"""`flexura import`: what people have on their bench comes in; damaged files end in a sentence."""

import json
import random
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

import flexura as fx
from commands import run as command
from flexlab.cli.export import forms
from flexura.io import Run
from flexura.io.logs import read_log, read_map, understood
from foreign_logs import (
    bag,
    hdf5_file,
    json_mcap,
    klipper,
    lvm_file,
    mapped,
    numbers,
    tdms_file,
    text_file,
)

GERMAN = [
    ("Zeit", "Motorspannung", "Position Schlitten", "Auslenkung Spitze"),
    ("[s]", "[V]", "[mm]", "[mm]"),
]
MAP = """
[time]
column = "Zeit"
unit = "s"
[channel."joint/1/position"]
column = "Position Schlitten"
unit = "mm"
[channel."link/2/tip_deflection"]
column = 4
unit = "mm"
scale = -1.0
offset = 0.5
"""


def german(folder, t, voltage, position, deflection):
    """Case b02: as LabVIEW exports with German settings."""
    path = text_file(
        folder / "labview.csv", (t, voltage, position, deflection), GERMAN, ";", True, "utf-16"
    )
    (folder / "map.toml").write_text(MAP)
    return path, folder / "map.toml"


def test_a_german_export_of_labview_comes_in_by_a_map(tmp_path):
    t, u, x, w = numbers()
    path, asked = german(tmp_path, t, u, x, w)
    out = tmp_path / "run"
    status, said, err = command(["import", path, "--map", asked, "--robot", "rig", "--out", out])
    assert status == 0 and err == "" and "decimal comma" in said and "UTF-16" in said
    assert max(map(len, said.splitlines()[:-2])) <= 80 and "Motorspannung [V]" in said
    run = Run.read(out)
    assert (run.t == t).all() and (run["joint/1/position"] == x / 1000).all()
    assert (run["link/2/tip_deflection"] == (0.5 - w) / 1000).all()
    assert run.meta["robot"]["name"] == fx.load("rig").name
    assert run.meta["original_units"] == {"joint/1/position": "mm", "link/2/tip_deflection": "mm"}


@pytest.mark.parametrize(
    "heads, row",
    [
        ('"Time [s]","joint/1/position [mm]"', '"{},{:02d}","{},50"'),  # commas in quotes
        ("Bench 3, second day;;\nTime;joint/1/position;\ns;mm;", "{},{:02d};{},50;"),
    ],
)
def test_what_spreadsheets_write_where_the_decimal_sign_is_a_comma(heads, row, tmp_path):
    rows = [row.format(k // 100, k % 100, k) for k in range(250)]
    (tmp_path / "log.csv").write_text("\n".join([heads, *rows, ""]))
    status, _, err = command(["import", tmp_path / "log.csv", "--out", tmp_path / "run"])
    assert (status, err) == (0, "")
    run = Run.read(tmp_path / "run")
    assert run.t == pytest.approx(np.arange(250) / 100)
    assert run["joint/1/position"] == pytest.approx((np.arange(250) + 0.5) / 1000)


def test_without_a_map_it_says_what_there_is_and_leaves_nothing(tmp_path):
    path, _ = german(tmp_path, *numbers())
    before = sorted(tmp_path.iterdir())
    status, said, err = command(["import", path, "--out", tmp_path / "run"])
    assert status == 2 and said == "" and err.count("\n") == 1
    assert "--map" in err and "Position Schlitten [mm]" in err
    assert sorted(tmp_path.iterdir()) == before


def test_look_writes_nothing_and_all_takes_every_column(tmp_path):
    path, _ = german(tmp_path, *numbers())
    before = sorted(tmp_path.iterdir())
    status, said, _ = command(["import", path, "--all", "--look", "--json"])
    found = json.loads(said)
    assert status == 0 and sorted(tmp_path.iterdir()) == before
    assert list(found["channels"]) == [
        "sensor/Motorspannung",
        "sensor/Position_Schlitten",
        "sensor/Auslenkung_Spitze",
    ]
    assert found["channels"]["sensor/Auslenkung_Spitze"]["si"] == "m"


def test_what_all_leaves_out_is_said_with_its_reason(tmp_path):
    rows = "".join(f"{k / 100},{k},RUN,{k}\n" for k in range(20))
    (tmp_path / "a.csv").write_text(f"Time [s],n,state,joint/1/position [deg]\n{rows}")
    why = "no numbers: row 1 (line 2): 'RUN' is no number"
    words = ["import", tmp_path / "a.csv", "--look"]
    said = " ".join(command(words)[1].split())
    assert "left out: n; --map or --all takes other columns" in said and why in said
    said = " ".join(command([*words, "--all"])[1].split())
    assert f"left out: state; {why}" in said and "--map or --all" not in said
    found = json.loads(command([*words, "--all", "--json"])[1])
    assert found["left_out"] == ["state"] and found["left_out_because"] == {"state": why}
    (tmp_path / "b.csv").write_text("Time [s],state\n" + "0.0,RUN\n0.1,RUN\n" * 9)
    status, _, err = command(["import", tmp_path / "b.csv", "--all", "--out", tmp_path / "run"])
    assert status == 2 and "or --all" not in err and not (tmp_path / "run").exists()


def test_a_missing_package_is_one_sentence(tmp_path, monkeypatch):
    path = hdf5_file(tmp_path / "a.h5", ["t"], [np.arange(9.0)], matlab=False)
    monkeypatch.setitem(sys.modules, "h5py", None)
    status, said, err = command(["import", path, "--out", tmp_path / "run"])
    assert (status, said) == (2, "") and not (tmp_path / "run").exists()
    assert err == 'flexura: h5py is not installed; type: pip install "flexura[logs]"\n'


def own_run():
    rng = np.random.default_rng(5)
    channels = {
        "joint/1/position": rng.normal(size=300),
        "joint/1/drive": rng.normal(size=300),
        "link/2/tip_deflection": np.where(rng.random(300) < 0.1, np.nan, rng.normal(size=300)),
        "energy/strain": rng.random(300),
        "sensor/temperature": rng.normal(290, 1, 300),
        "state/3": rng.normal(size=300),
    }
    units = dict(zip(channels, ("m", "N", "m", "J", "K", "1")))
    meta = {"source": "experiment", "emulated": True, "robot": fx.load("rig").to_dict(), "seed": 7}
    meta["started"] = "2026-03-02T10:20:30+00:00"
    t = np.cumsum(rng.uniform(1e-3, 2e-3, 300)) - 0.1
    events = [{"t": 0.1, "text": "[x] ä", "level": "INFO"}]
    return Run(t, channels, units, meta | {"events": events, "complete": False})


@pytest.mark.parametrize("form", list(forms()))
def test_own_exports_come_back_bit_for_bit(form, tmp_path):
    run = own_run()
    run.save(tmp_path / "run")
    assert (
        command(["export", tmp_path / "run", "--to", form, "--out", tmp_path / f"x.{form}"])[0] == 0
    )
    status, _, err = command(["import", tmp_path / f"x.{form}", "--out", tmp_path / "again"])
    assert (status, err) == (0, "")
    again = Run.read(tmp_path / "again")
    assert again.t.tobytes() == run.t.tobytes() and list(again) == list(run)
    assert again.units == run.units and again.meta == run.meta
    assert all(again[name].tobytes() == run[name].tobytes() for name in run)


def clocks():
    """Case b04: what goes wrong with hand-made clocks, and the row."""
    t = np.arange(0, 4, 2e-3)
    reset, gone = t.copy(), t.copy()
    reset[1000:] -= reset[1000]
    gone[5] = np.nan
    doubled = np.floor(t / 4e-3) * 4e-3
    return {
        "reset": (reset, 1001),
        "doubled": (doubled, 2),
        "reversed": (t[::-1], 2),
        "nan": (gone, 6),
        "ms": (t * 1e3, 2),
    }


@pytest.mark.parametrize("name", clocks())
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_bad_clock_ends_with_its_row_and_no_figure(name, form, tmp_path):
    t, row = clocks()[name]
    x = np.sin(np.arange(len(t)) / 100)
    if form == "csv":
        path = text_file(tmp_path / "log.csv", (t, x), [("Time [s]", "joint/1/position [m]")])
        commands = [["import", path, "--out", tmp_path / "run"]]
    else:  # a run that somebody wrote without flexura
        path = tmp_path / "run.parquet"
        about = {"flexura": json.dumps({"source": "experiment"})}
        fields = [pa.field("time_s", pa.float64()), pa.field("joint/1/position_m", pa.float64())]
        pq.write_table(pa.table([t, x], schema=pa.schema(fields, metadata=about)), path)
        commands = [
            ["import", path, "--out", tmp_path / "run"],
            ["plot", path],
            ["vibration", path],
            ["identify", path],
            ["review", path, "--save", tmp_path / "x.rrd"],
            ["compare", path, path, "--out", tmp_path / "x"],
            ["export", path, "--to", "csv"],
        ]
    before = sorted(tmp_path.iterdir())
    for words in commands:
        status, said, err = command(words)
        assert (status, said, err.count("\n")) == (2, "", 1) and f"row {row}" in err, words
        assert sorted(tmp_path.iterdir()) == before, words


def whole(folder):
    """One file of each format, with a map for it."""
    t, a, w, f = numbers()
    heads = ("Time", "Angle", "Deflection", "Force")
    own = heads[1:]
    parts = (a, w, f)
    savemat(folder / "a.mat", dict(zip(heads, (t, a, w, f))), do_compression=True)
    own_run().save(folder / "own")
    for form in ("mat", "mcap", "tdms", "csv", "parquet"):
        (folder / f"own.{form}").write_bytes(forms()[form](own_run()))
    no_clock = mapped("", *own).split("\n[channel", 1)[1]
    return {
        text_file(folder / "a.csv", (t, *parts), [heads], ";", True): mapped(*heads),
        text_file(folder / "b.csv", (t, *parts), [heads], encoding="utf-16"): mapped(*heads),
        tdms_file(folder / "a.tdms", (t, *parts), heads, "s rad m N".split()): mapped(*heads),
        lvm_file(folder / "a.lvm", t, parts): f"[channel{no_clock}",
        folder / "a.mat": mapped(*heads),
        hdf5_file(folder / "b.mat", heads, (t, *parts), matlab=True): mapped(*heads),
        json_mcap(folder / "a.mcap", t, parts, own): mapped(
            "/rig/state.clock", *(f"/rig/state.{n}" for n in own)
        ),
        next(bag(folder / "bag", t, parts, "mcap").glob("*.mcap")): "",
        klipper(folder / "k.csv", t, parts): "",
        **{folder / f"own.{form}": "" for form in ("mat", "mcap", "tdms", "csv", "parquet")},
    }


def broken(raw, seed):
    """A file cut off, with a hole, with noise, or in the wrong order."""
    chance = random.Random(seed)
    at = chance.randrange(1, len(raw))
    few = chance.randrange(1, 400)
    noise = bytes(chance.randrange(256) for _ in range(few))
    return [
        raw[:at],
        raw[:at] + raw[at + few :],
        raw[:at] + noise + raw[at + few :],
        raw[at:] + raw[:at],
        raw[:at] + bytes(few) + raw[at + few :],
        raw[:at] + raw[:few] + raw[at:],
    ][seed % 6]


def damaged(folder, each):
    """So many damaged files of each format: their place and map."""
    for kind, (path, text) in enumerate(whole(folder).items()):
        raw = path.read_bytes()
        (folder / f"{kind}.toml").write_text(text or "")
        for seed in range(each):
            place = folder / f"damaged-{kind}-{seed}{path.suffix}"
            place.write_bytes(broken(raw, 1000 * kind + seed))
            yield place, folder / f"{kind}.toml" if text else None


def read(path, asked):
    return understood(read_log(path), None if asked is None else read_map(asked))


def judged(path, asked):
    """The sentence on a damaged file, or what it is understood as."""
    try:
        return read(path, asked)
    except fx.InputError as error:
        return str(error)


def same(run, other):
    return (
        list(run) == list(other)
        and run.t.tobytes() == other.t.tobytes()
        and all(run[name].tobytes() == other[name].tobytes() for name in run)
    )


SAYS = ("may be cut", "rows are missing", "edited or is damaged")  # notes on damage


@pytest.mark.parametrize("each", [3, pytest.param(25, marks=pytest.mark.slow)])
def test_300_damaged_files_end_in_a_sentence_each(each, tmp_path):
    """Refused, read with a note on the damage, or read as what they were before; the rest are
    files of formats without checksums, where other bytes are other numbers: nobody can know."""
    (tmp_path / "whole").mkdir()
    originals = list(whole(tmp_path / "whole"))
    counts = dict.fromkeys(("refused", "noted", "unharmed", "nobody can know"), 0)
    for path, asked in damaged(tmp_path, each):
        found = judged(path, asked)
        if isinstance(found, str):
            assert "\n" not in found and path.name in found
            counts["refused"] += 1
            continue
        run = found.run
        assert np.isfinite(run.t).all() and (np.diff(run.t) > 0).all()
        before = read(originals[int(path.stem.split("-")[1])], asked)
        if same(run, before.run):
            counts["unharmed"] += 1
        elif set(found.notes) - set(before.notes) and any(
            word in note for note in found.notes for word in SAYS
        ):
            counts["noted"] += 1
        else:  # no checksum in the format; counts, clock and the size of the numbers fit
            assert path.suffix in (".tdms", ".mat", ".csv") and list(run) == list(before.run)
            if path.suffix == ".csv":  # whole rows are gone, of an uneven clock
                assert len(run) < len(before.run) and np.isin(run.t, before.run.t).all()
            else:
                assert run.t.tobytes() == before.run.t.tobytes(), path
            counts["nobody can know"] += 1
    print(counts)
    assert counts["refused"] + counts["noted"] >= (30 if each == 3 else 300)
    assert counts["nobody can know"] <= 0.05 * sum(counts.values())


def test_a_damaged_file_leaves_no_folder(tmp_path):
    for path, asked in list(damaged(tmp_path, 1)):
        if isinstance(sentence := judged(path, asked), str):
            words = ["import", path, "--out", tmp_path / "run"] + (
                ["--map", asked] if asked else []
            )
            assert command(words) == (2, "", f"flexura: {sentence}\n")
            assert not (tmp_path / "run").exists()


def test_damage_that_the_format_does_not_show_is_said(tmp_path):
    """Rows that are gone, an export with another number, numbers of noise, bytes put in."""
    run = own_run()
    text = forms()["csv"](run).decode()
    row = text.splitlines()[-4]
    (tmp_path / "own.csv").write_text(text.replace(row, row.replace("1", "2", 1)))
    t = np.arange(400) / 500
    gone = np.delete(t, [100, 101, 250])
    text_file(tmp_path / "gone.csv", (gone, np.sin(gone)), [("Time [s]", "joint/1/position [rad]")])
    for name, said in (
        ("own.csv", "its numbers are not those that flexura wrote: it was edited or is damaged"),
        (
            "gone.csv",
            "rows are missing after row 100 (line 101), and at 1 others: a step of 0.006 s, the "
            "others are 0.002 s",
        ),
    ):
        status, out, err = command(["import", tmp_path / name, "--look", "--json"])
        assert (status, err) == (0, "") and said in json.loads(out)["notes"]
    wild = np.sin(t)
    wild[6] = 3e45
    text_file(tmp_path / "wild.csv", (t, wild), [("Time [s]", "joint/1/position [rad]")])
    status, _, err = command(["import", tmp_path / "wild.csv", "--out", tmp_path / "run"])
    assert status == 2 and "row 7 (line 8)" in err and "larger than anything" in err
    longer = hdf5_file(tmp_path / "a.h5", ["Time"], [t], matlab=False)
    raw = longer.read_bytes()
    longer.write_bytes(raw[:-400] + raw[:7] + raw[-400:])
    status, _, err = command(["import", longer, "--out", tmp_path / "run"])
    assert status == 2 and f"{len(raw) + 7} bytes, its head says {len(raw)}" in err
    assert not (tmp_path / "run").exists()
