"""The command `flexura compare`."""

import json

import pytest

from flexlab.comparison import table
from flexura.errors import InputError


def invoke(*arguments):
    from typer.testing import CliRunner

    from flexlab.cli.app import app

    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_the_command_compares_two_runs_and_leaves_them_as_they_are(compared, tmp_path):
    compared.experiment.save(tmp_path / "experiment")
    compared.simulation.save(tmp_path / "simulation")
    before = (tmp_path / "experiment" / "run.parquet").read_bytes()
    done = invoke("compare", tmp_path / "experiment", tmp_path / "simulation", "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert (
        found["emulated"] is True and found["runs"]["second"]["called"] == "experiment (emulated)"
    )
    assert {k: found[k] for k in ("deviations", "responses")} == {
        k: json.loads(json.dumps(table.numbers(compared)[k])) for k in ("deviations", "responses")
    }
    folder = tmp_path / "experiment" / "comparison-1"
    assert not (folder / "simulation").exists() and (folder / "report.html").is_file()
    assert (tmp_path / "experiment" / "run.parquet").read_bytes() == before


def test_the_command_exports_with_the_label(compared, tmp_path):
    compared.experiment.save(tmp_path)
    done = invoke("export", tmp_path, "--to", "csv", "--json")
    assert done.exit_code == 0 and json.loads(done.stdout)["emulated"] is True
    assert (tmp_path / "run.csv").read_text().startswith("# experiment (emulated)\n")


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["compare", "RUN", "RUN", "--by", "measured"], "--by = 'measured': expected one run"),
        (["compare", "RUN", "--by", "guess"], "by = 'guess': expected one of"),
        (["compare", "absent"], "absent: no run here"),
        (
            ["export", "RUN", "--to", "xlsx"],
            "--to = 'xlsx': expected one of csv, parquet, mat, tdms, mcap",
        ),
    ],
)
def test_the_command_names_what_is_wrong_and_leaves_nothing(arguments, words, compared, tmp_path):
    compared.experiment.save(tmp_path / "run")
    done = invoke(*(tmp_path / "run" if a == "RUN" else a for a in arguments))
    assert isinstance(done.exception, InputError) and words in str(done.exception)
    assert [p.name for p in (tmp_path / "run").iterdir()] == ["run.parquet"]
