"""The help of every command: its example runs, and its sentences are short."""

import re
import shlex

import pytest

from commands import commands, examples, run

COMMANDS = {" ".join(words): command for words, command in commands()}
FASTER = {
    "tune": ["--population", "8", "--generations", "1"],
    "learn": ["--trials", "1"],
}  # beside what the example says
SLOW = {"flash", "demo", "compare", "identify", "doctor", "vibration", "learn"}
SLOW |= {name for name in COMMANDS if name.startswith("bench ")}
# what an example goes on from; {name} is the folder of the command's own example
FIRST = ["simulate", "rig", "rig-inverse-law"]
EXPERIMENT = ["bench", "free-vibration", "--duration-s", "2"]
BEFORE = {
    "review": [[*FIRST, "--out", "logs/first"], [*FIRST, "--out", "logs/second"]],
    "export": [[*FIRST, "--out", "logs/first"]],
    "plot": [[*FIRST, "--out", "logs/first"]],
    "animate": [[*FIRST, "--out", "logs/first"]],
    "compare": [[*EXPERIMENT, "--out", "logs/experiment"]],
    "vibration": [[*EXPERIMENT, "--out", "logs/free-vibration"]],
    "migrate": [["new", "my-arm.toml"]],
    "identify": [["bench", "excite", "--seed", "1", "--out", "logs/excite"]],
}
# files of others that an example begins with
FILES = {
    "import": {
        "log.csv": "Zeit;Weg\n[s];[mm]\n0,00;1,5\n0,01;1,6\n0,02;1,7\n",
        "map.toml": '[channel."joint/1/position"]\ncolumn = "Weg"\n',
    }
}
ELSEWHERE = {"bench recover", "bench step"}  # go on from an experiment that is no example's
MOST_WORDS = 25


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder that knows nothing of the checkout."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_one_complete_example(name):
    (example,) = examples(COMMANDS[name])
    words = shlex.split(example)
    assert words[: 1 + len(name.split())] == ["flexura", *name.split()]
    options = {option for p in COMMANDS[name].params for option in p.opts}
    assert {w.split("=")[0] for w in words if w.startswith("--")} <= options


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name
        for name in COMMANDS
        if name not in ELSEWHERE
    ],
)
def test_the_example_of_a_command_runs(name, place):
    for file, text in FILES.get(name, {}).items():
        (place / file).write_text(text)
    for arguments in BEFORE.get(name, ()):
        assert run(arguments)[0] == 0
    (example,) = examples(COMMANDS[name])
    before = set(place.rglob("*"))
    status, _, err = run([*shlex.split(example)[1:], *FASTER.get(name, ())])
    assert status == 0 or (name == "doctor" and status == 1), err
    left = {p for p in set(place.rglob("*")) - before if p.is_file()}
    assert not any(part.startswith(".") for p in left for part in p.relative_to(place).parts)
    assert left or name in ("frequencies", "doctor", "flash", "robots", "migrate")


def test_the_help_of_a_group_has_an_example_of_one_of_its_commands():
    status, shown, _ = run(["bench", "--help"])
    (example,) = re.findall(r"Example: flexura (bench \S+)", shown)
    assert status == 0 and example in COMMANDS


def sentences(text):
    """The sentences of a help text, without formulas and examples."""
    text = re.sub(r"\x08\n.*?(\n\n|\Z)", "\n\n", text, flags=re.DOTALL)
    for paragraph in text.split("\n\n"):
        yield from re.split(r"(?<=[.;:])\s+", " ".join(paragraph.split()))


@pytest.mark.parametrize("name", COMMANDS)
def test_the_sentences_of_a_help_are_short(name):
    command = COMMANDS[name]
    every = [command.help or "", *(getattr(p, "help", None) or "" for p in command.params)]
    long = [s for text in every for s in sentences(text) if len(s.split()) > MOST_WORDS]
    assert long == []
    first = (command.help or "").split("\n\n")[0]
    assert len(" ".join(first.split())) <= 78, "its line in the list of commands would be cut"


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_prints_json(name):
    """All but those that only open a window or ask a person."""
    assert "--json" in {option for p in COMMANDS[name].params for option in p.opts}
