"""Files that come with flexura are found by name from any folder; a path goes before a name."""

import logging
import tomllib
from pathlib import Path

import pytest
import tomli_w

import flexura as fx
from flexura.control import load_gains
from flexura.io import find, shipped_files

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_kind_is_listed_by_name():
    robots = {path.stem for path in (ROOT / "model" / "robots").glob("*.toml")}
    assert set(shipped_files("robots")) == robots and "rig" in robots
    assert "rig-step" in shipped_files("manoeuvres")
    assert {"rig", "rig-steps"} <= set(shipped_files("controllers"))
    assert {path.stem for path in (ROOT / "firmware").glob("rig*.toml")} == set(
        shipped_files("rigs")
    )


@pytest.mark.parametrize("name", shipped_files("robots"))
def test_a_robot_is_loaded_by_its_name(elsewhere, name):
    assert fx.load(name) == fx.load(ROOT / "model" / "robots" / f"{name}.toml")


def test_a_manoeuvre_and_gains_are_loaded_by_name(elsewhere):
    assert fx.load_manoeuvre("rig-step", 2).spec() == (
        fx.load_manoeuvre(ROOT / "model" / "manoeuvres" / "rig-step.toml", 2).spec()
    )
    given = load_gains("rig")
    assert given.settings == load_gains(ROOT / "model" / "controllers" / "rig.toml").settings
    assert given.file.endswith("rig.toml")


def test_a_file_of_that_name_goes_before_the_shipped_one(elsewhere):
    other = fx.load("single-r")
    (elsewhere / "rig").write_text(tomli_w.dumps(other.to_dict()))
    assert fx.load("rig") == other
    assert fx.load("rig") != fx.load(ROOT / "model" / "robots" / "rig.toml")


def test_a_folder_of_that_name_does_not(elsewhere):
    (elsewhere / "rig").mkdir()
    assert fx.load("rig").structure == "PaR"


@pytest.mark.parametrize(
    ("load", "name", "words"),
    [
        (fx.load, "rigg", "no robot file of this name comes with flexura; did you mean rig"),
        (fx.load, "two-link", "did you mean two-link-arm?"),
        (fx.load, "zzzzzz", "known: chain-r-pb-pa, quanser-2dsfl, rig"),
        (lambda name: fx.load_manoeuvre(name, 2), "rig-stap", "did you mean rig-step"),
        (load_gains, "rigs", "no gains file of this name comes with flexura; did you mean rig"),
    ],
)
def test_a_wrong_name_is_answered_with_the_near_ones(elsewhere, load, name, words):
    with pytest.raises(fx.InputError) as caught:
        load(name)
    assert caught.value.file == name and words in str(caught.value)


@pytest.mark.parametrize("name", ["rig.toml", "folder/rig", "../rig", "a\0b", ""])
def test_what_is_no_plain_name_is_a_path(elsewhere, name):
    assert find(name, "robots") == Path(name)
    with pytest.raises(fx.InputError):
        fx.load(name)


def test_the_file_that_was_found_is_in_the_log(elsewhere, caplog):
    with caplog.at_level(logging.DEBUG, logger="flexura"):
        fx.load("rig")
    assert any("rig.toml" in record.getMessage() for record in caplog.records)


def test_the_wheel_holds_what_is_found_by_name():
    tables = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    included = tables["tool"]["scikit-build"]["wheel"]["force-include"]
    for kind in ("robots", "manoeuvres", "controllers"):
        assert included[f"model/{kind}"] == f"flexura/{kind}"
    for path in (ROOT / "firmware").glob("rig*.toml"):
        assert included[f"firmware/{path.name}"] == f"flexura/rigs/{path.name}"
