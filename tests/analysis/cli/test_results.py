"""Where results go: tried before the work, nothing overwritten, finished results outlive an
interruption."""

import json
import os
import re
from pathlib import Path

import matplotlib
import numpy as np
import pytest

import flexura as fx
from commands import run
from flexlab.cli import results

ROOT = Path(__file__).resolve().parents[3]
RIG, LAW = "model/robots/rig.toml", "model/manoeuvres/rig-inverse-law.toml"
TYPE_1 = "model/robots/type-1-rr.toml"
BANG = "model/manoeuvres/type-1-bang-bang.toml"
STUDY = ["study", "payload", TYPE_1, BANG, "--values", "0:0.2:3", "--jobs", "1"]


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model").symlink_to(ROOT / "model")
    return tmp_path


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_default_folders_count_up_and_carry_the_names(place):
    for _ in range(2):
        assert run(["simulate", RIG, LAW])[0] == 0
    assert run(["simulate", RIG])[0] == 0
    assert run(["inverse", RIG, LAW])[0] == 0
    assert sorted(p.name for p in (place / "logs").iterdir()) == [
        "inverse-rig-rig-inverse-law-1",
        "simulate-rig-1",
        "simulate-rig-rig-inverse-law-1",
        "simulate-rig-rig-inverse-law-2",
    ]


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", RIG, LAW],
        ["inverse", RIG, LAW],
        ["crosscheck", RIG, LAW],
        STUDY,
        ["compare", "a", "a"],
    ],
    ids=lambda command: command[0],
)
def test_an_out_with_results_is_left_alone_without_force(command, place):
    """Whoever's results: here an experiment's."""
    t = np.linspace(0, 1, 5)
    experiment = fx.Run(t, {"tip/x": t}, {"tip/x": "m"}, {"source": "experiment", "events": []})
    experiment.save("out")
    if "a" in command:
        assert run(["simulate", RIG, LAW, "--out", "a"])[0] == 0
    (place / "out" / "notes.txt").write_text("mine")
    before = files(place)
    status, out, err = run([*command, "--out", "out"])
    assert status == 2 and out == "" and "--force" in err and err.count("\n") == 1
    assert files(place) == before
    assert run([*command, "--out", "out", "--force"])[0] == 0
    assert (place / "out" / "notes.txt").read_text() == "mine"
    assert files(place / "out") != before
    assert [p.name for p in (place / "out").iterdir() if p.name.startswith(".")] == []


@pytest.mark.parametrize("out", ["file", "file/deeper", "/dev/null/x", "x" * 300, "new/x/y"])
def test_an_out_is_tried_before_the_work(out, place, monkeypatch):
    """Also for the commands that go on in their folder. A new folder is made with its parents, and
    leaves none of them if the work fails."""
    (place / "file").write_text("a file")

    def failing(*_, **__):
        raise fx.InputError("the work has begun")

    monkeypatch.setattr(fx, "simulate", failing)
    for more in ([], ["--vary", "payload.mass_kg=0:0.1:2"]):
        status, out_, err = run(["simulate", RIG, LAW, "--out", out, *more])
        assert status == 2 and out_ == "" and err.count("\n") == 1
        assert ("the work has begun" in err) == (out == "new/x/y")
        assert sorted(p.name for p in place.iterdir()) == ["file", "model"]


def test_an_empty_folder_is_taken_and_the_working_folder_too(place):
    (place / "empty").mkdir()
    assert run(["simulate", RIG, LAW, "--out", "empty"])[0] == 0
    assert [p.name for p in (place / "empty").iterdir()] == ["run.parquet"]
    assert run(["simulate", str(ROOT / RIG), "--out", ".", "--force"])[0] == 0
    assert sorted(p.name for p in place.iterdir()) == ["empty", "model", "run.parquet"]


def test_an_interrupted_study_leaves_the_finished_one(place, monkeypatch):
    assert run([*STUDY, "--out", "out"])[0] == 0
    finished = files(place / "out")
    calls, simulate = [], fx.simulate

    def interrupted(*arguments, **options):
        calls.append(arguments)
        if len(calls) > 2:
            raise KeyboardInterrupt
        return simulate(*arguments, **options)

    monkeypatch.setattr(fx, "simulate", interrupted)
    status, _, err = run([*STUDY, "--out", "out", "--force"])
    assert status == 130 and re.search(r"interrupted after 2 runs", err)
    assert files(place / "out") == finished
    beside = place / "out-interrupted-1"
    assert {p.name for p in beside.iterdir()} == {"study.parquet", "study.png", "study.svg"}


TUNE = [
    "tune",
    RIG,
    "rig-step",
    "--controller",
    "rig",
    "--rig",
    "rig",
    "--free",
    "kp_1_V_m=100:9000",
]
TUNE += ["--algorithm", "cma-es", "--population", "4", "--generations", "1"]


@pytest.mark.parametrize("empty", [False, True], ids=["new", "empty"])
@pytest.mark.parametrize(
    "command, out, late",
    [
        (["simulate", RIG, LAW], "out", "out-1"),
        (["export", "a", "--to", "csv"], "out.csv", "out-1.csv"),
        (["plot", "a"], "out.png", "out-1.png"),
        (["new"], "out.toml", "out-1.toml"),
    ],
    ids=["simulate", "export", "plot", "new"],
)
def test_of_two_commands_at_once_one_stands_beside(command, out, late, empty, place, monkeypatch):
    """The second begins while the first one publishes: its own check came before."""
    assert run(["simulate", RIG, LAW, "--out", "a"])[0] == 0
    if empty:
        (place / "out").mkdir()
    arguments = [*command, out] if command == ["new"] else [*command, "--out", out]
    put, replace_results, others = results.put, results.replace_results, []

    def first(publish):
        def call(*given, **options):
            if not others:
                others.append(None)
                others[0] = run(arguments)
                others.append(files(place))
            publish(*given, **options)

        return call

    monkeypatch.setattr(results, "put", first(put))
    monkeypatch.setattr(results, "replace_results", first(replace_results))
    status, _, err = run(arguments)
    (other, said, _), before = others
    assert other == 0, said
    assert status == 2 and err.strip().endswith(f"what this one made is in {late}"), err
    after = files(place)
    assert {path: after[path] for path in before if "/.flexura-" not in f"/{path}"}.items() <= (
        before.items()
    )
    assert os.path.lexists(late) and not list(place.rglob(".flexura-*"))


@pytest.mark.parametrize("command", ["export a --to csv", "simulate rig"])
def test_a_link_to_nothing_is_called_so(command, place):
    assert run(["simulate", RIG, LAW, "--out", "a"])[0] == 0
    (place / "link").symlink_to("nowhere")
    status, _, err = run([*command.split(), "--out", "link"])
    assert status == 2 and "link': a link to nothing: expected" in err


def test_a_file_behind_a_link_is_replaced_and_keeps_its_permissions(place):
    assert run(["simulate", RIG, LAW, "--out", "a"])[0] == 0
    file, link = place / "real" / "old.csv", place / "link.csv"
    file.parent.mkdir()
    file.write_text("old")
    file.chmod(0o600)
    link.symlink_to(file)
    assert run(["export", "a", "--to", "csv", "--out", "link.csv", "--force"])[0] == 0
    assert link.is_symlink() and file.read_text().startswith("# simulation")
    assert file.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize(
    "command, kept",
    [
        ([*STUDY, "--channels"], ["study.parquet", "runs/001/run.parquet"]),
        (TUNE, ["gains.toml", "best/run.parquet"]),
        (["compare", "a", "a"], ["comparison.json"]),
    ],
    ids=["study", "tune", "compare"],
)
def test_a_picture_that_fails_loses_no_results(command, kept, place):
    """Here it is larger than matplotlib can draw."""
    if "a" in command:
        assert run(["simulate", RIG, LAW, "--out", "a"])[0] == 0
    with matplotlib.rc_context({"savefig.bbox": "tight", "savefig.pad_inches": 1e5}):
        status, _, err = run([*command, "--out", "out"])
    assert status == 1 and "cannot be drawn" in err and "stored in out" in err
    assert all((place / "out" / name).is_file() for name in kept)


def test_work_that_is_killed_leaves_the_finished_results(tmp_path):
    """Before the results are kept, nothing stands at their place."""
    target = tmp_path / "out"
    with results.results(target) as draft:
        (draft.folder / "a").write_text("old")
        draft.keep()
    with pytest.raises(RuntimeError), results.results(target, force=True) as draft:
        (draft.folder / "a").write_text("new")
        assert (target / "a").read_text() == "old"
        raise RuntimeError
    assert files(tmp_path) == {Path("out/a"): b"old"}
    assert list(target.iterdir()) == [target / "a"]


def test_folders_are_replaced_as_a_whole(tmp_path):
    target = tmp_path / "out"
    for text in ("old", "new"):
        with results.results(target, force=True) as draft:
            (draft.folder / "runs").mkdir()
            (draft.folder / "runs" / text).write_text(text)
            draft.keep()
    assert files(target) == {Path("runs/new"): b"new"}


def test_a_folder_has_the_permissions_of_a_new_one(tmp_path):
    with results.results(tmp_path / "out") as draft:
        draft.keep()
    (tmp_path / "other").mkdir()
    assert os.stat(tmp_path / "out").st_mode == os.stat(tmp_path / "other").st_mode


def test_a_population_goes_on_in_its_folder_and_in_no_other(place):
    vary = ["simulate", RIG, LAW, "--vary", "payload.mass_kg=0:0.1:3", "--json"]
    first = json.loads(run(vary)[1])
    assert first["folder"] == "logs/population-rig-rig-inverse-law"
    stamps = {p: p.stat().st_mtime_ns for p in (place / "logs").rglob("*.parquet")}
    assert json.loads(run(vary)[1]) == first
    assert stamps == {p: p.stat().st_mtime_ns for p in (place / "logs").rglob("*.parquet")}
    status, _, err = run([*vary[:-3], "--vary", "payload.mass_kg=0:0.1:4"])
    assert status == 2 and "another folder" in err
    (place / "mine").mkdir()
    (place / "mine" / "run.parquet").write_text("x")
    status, _, err = run([*vary, "--out", "mine"])
    assert status == 2 and "other files are there" in err
    assert files(place / "mine") == {Path("run.parquet"): b"x"}


def test_a_file_is_left_alone_without_force(place):
    assert run(["simulate", RIG, LAW, "--out", "r"])[0] == 0
    (place / "x.csv").write_text("mine")
    export = ["export", "r", "--to", "csv", "--out", "x.csv"]
    status, _, err = run(export)
    assert status == 2 and "--force" in err and (place / "x.csv").read_text() == "mine"
    assert run([*export, "--force"])[0] == 0 and (place / "x.csv").read_text() != "mine"
    status, _, err = run(["export", "r", "--to", "parquet", "--force"])
    assert status == 2 and "the run itself" in err
    first, again = run(["review", "r", "--save", "r.rrd"]), run(["review", "r", "--save", "r.rrd"])
    assert (first[0], again[0]) == (0, 2)


@pytest.mark.parametrize(
    ("command", "key", "suffix"),
    [
        ("identify RUN --out a.csv", "--out", ".toml"),
        ("identify rig RUN --fit payload.mass_kg --out a.csv", "--out", ".toml"),
        ("import a.urdf --out a.csv", "--out", ".toml"),
        ("new a.csv", "FILE", ".toml"),
        ("review RUN --save a.csv", "--save", ".rrd"),
        ("review RUN --picture a.csv", "--picture", ".png"),
        ("compare RUN RUN --picture a.csv", "--picture", ".png"),
    ],
)
def test_a_file_has_the_suffix_of_its_format(command, key, suffix, place):
    fx.simulate("rig", np.arange(20) / 100).save(place / "RUN")
    before = files(place)
    status, out, err = run(command.split())
    said = f"{key} = 'a.csv': expected a name that ends with {suffix}"
    assert (status, out, err.count("\n")) == (2, "", 1) and said in err
    assert files(place) == before


def test_two_comparisons_of_a_run_stand_side_by_side(place):
    for name in ("a", "b"):
        assert run(["simulate", RIG, LAW, "--out", name])[0] == 0
    for _ in range(2):
        assert run(["compare", "a", "b"])[0] == 0
    assert sorted(p.name for p in (place / "a").iterdir() if p.is_dir()) == [
        "comparison-1",
        "comparison-2",
    ]


@pytest.mark.parametrize(
    "arguments, bound",
    [
        (["simulate", RIG, LAW, "--vary", "payload.mass_kg=0:1:999999999"], "1000000"),
        (["simulate", RIG, LAW] + ["--vary", "payload.mass_kg=0:1:9999"] * 2, "once"),
        (["bench", "free-vibration", "--duration-s", "1e9"], "600"),
        (["bench", "step", "--duration-s", "1e9"], "600"),
        (["study", "payload", TYPE_1, "--values", "0:1:999999999"], "10000"),
        (["simulate", RIG, "long.toml"], "10 million"),
    ],
)
def test_sizes_are_refused_before_memory_is_taken(arguments, bound, place):
    import tracemalloc

    long = (ROOT / LAW).read_text().replace("duration_s = 2.0", "duration_s = 9e7")
    (place / "long.toml").write_text(long)
    (place / "firmware").symlink_to(ROOT / "firmware")
    tracemalloc.start()
    status, _, err = run(arguments)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert status == 2 and bound in err and peak < 200e6
