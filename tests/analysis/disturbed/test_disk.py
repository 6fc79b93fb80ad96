"""Commands whose disk fails: a sentence, nothing half-written, nothing finished lost."""

from collections import Counter

import pytest

from commands import commands
from disturbance.calls import COMMANDS, LEFT_OUT, files
from disturbance.judgement import drafts, ended_well, ready
from flexura.io import settle

KINDS = ("write", "sync", "rename", "create")
QUICK = ("simulate", "new")
KEEPING = [name for name, command in COMMANDS.items() if command.out]
DEAR = [name for name in KEEPING if COMMANDS[name].dear]
SLOW = [n for n in KEEPING if n not in (*QUICK, *DEAR)]
FIRST, STEP = 3, 61  # of long series the first operations are failed, and of the rest a sample
pytestmark = pytest.mark.timeout(3600)  # a command is called up to some hundreds of times


def test_every_command_is_disturbed():
    """A new command stands in disturbance/calls.py too, or says there why not."""
    there = {words for words, _ in commands()}
    called = {w for w in there for c in COMMANDS.values() if tuple(c.arguments[: len(w)]) == w}
    assert called | set(LEFT_OUT) == there
    assert not called & set(LEFT_OUT) and all(len(why) > 40 for why in LEFT_OUT.values())


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)])
def test_operations_on_the_disk_fail_once(name, place):
    failing_disk(name, place, STEP)


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_every_operation_on_the_disk_fails_once(name, place):
    failing_disk(name, place, 1)


def failing_disk(name, place, step):
    """The n-th operation fails, n = 1, 2, 3, ... until the command passes."""
    counts = Counter()
    for kind in KINDS:
        n = 1
        while True:
            command, work = ready(place, name)
            before = files(work)
            ended = place.run(command, work, kind=kind, n=n)
            ended_well(ended, work)
            if not ended.disturbed:
                assert ended.status == 0, ended.err
                break
            assert ended.status in (1, 2), (kind, n, ended.err)
            assert {k: files(work).get(k) for k in before} == before, "inputs were changed"
            counts[kind] += 1
            if command.resumes and kind == "write":
                again = place.run(command, work)
                assert again.status == 0, again.err
            n += 1 if n < FIRST else step
    print(f"{name}: {sum(counts.values())} faults, {dict(counts)}")
    assert set(counts) == (set(KINDS) if command.out else set())


@pytest.mark.parametrize(
    "name",
    [
        "simulate",
        *(pytest.param(n, marks=pytest.mark.slow) for n in ("study", "crosscheck", "review")),
    ],
)
def test_a_failing_disk_keeps_the_finished_results(name, place):
    """A second run over finished results, with other numbers: the old files or the new ones."""
    command, work = ready(place, name)
    assert place.run(command, work).status == 0
    first, faults = files(work), 0
    for kind in KINDS:
        n = 1
        while True:
            _, work = ready(place, name)
            for path, content in first.items():
                (work / path).parent.mkdir(parents=True, exist_ok=True)
                (work / path).write_bytes(content)
            ended = place.run(command, work, "--force", *command.other, kind=kind, n=n)
            assert "Traceback" not in ended.err, ended.err
            settle(work / command.out)
            now = files(work)
            kept = [now.get(path) == content for path, content in first.items()]
            assert set(now) >= set(first), (kind, n, set(first) - set(now))
            assert all(kept) or not any(kept) or not command.other, (kind, n, kept)
            assert not drafts(work)
            if not ended.disturbed:
                assert ended.status == 0
                break
            assert ended.status in (1, 2)
            faults += 1
            n += 1 if n < FIRST else STEP
    print(f"{name} over finished results: {faults} faults")
    assert faults >= 6
