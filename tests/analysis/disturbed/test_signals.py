"""Commands that are killed: nothing half-written, nothing finished lost, and what resumes gets the
same numbers."""

import random
import signal
from collections import Counter

import pytest

from disturbance.calls import COMMANDS
from disturbance.judgement import ended_well, numbers, ready

pytestmark = pytest.mark.timeout(3600)
CHEAP = [name for name, command in COMMANDS.items() if not command.dear]
SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)


@pytest.mark.slow
@pytest.mark.parametrize("name", CHEAP)
def test_three_kills_of_each_command(name, place):
    killed(name, place, 1)


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_twenty_kills_of_each_command(name, place):
    killed(name, place, 20)


def killed(name, place, times):
    """kill -9, SIGINT and SIGTERM at random moments; then the command again."""
    command, work = ready(place, name)
    whole = place.run(command, work)
    assert whole.status == 0, whole.err
    right = numbers(work / command.out)
    chance, counts = random.Random(name), Counter()
    for number in SIGNALS:
        for _ in range(times):
            command, work = ready(place, name)
            moment = chance.uniform(0.0, whole.seconds)
            ended = place.run(command, work, signal=int(number), after_s=moment)
            by_itself = number != signal.SIGKILL or not ended.sent
            ended_well(ended, work, killed=not by_itself or ended.status < 0)
            counts[f"{number.name} {ended.status}"] += 1
            if ended.status == 0:
                assert numbers(work / command.out) == right
            elif command.resumes:
                again = place.run(command, work)
                assert again.status == 0 and numbers(work / command.out) == right, again.err
    print(f"{name}: {dict(counts)}")
