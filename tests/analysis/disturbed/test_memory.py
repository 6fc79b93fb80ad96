"""Commands whose memory is short: a sentence, and nothing half-written."""

import re
import signal
from collections import Counter

import numpy as np
import pytest

from disturbance.calls import COMMANDS
from disturbance.judgement import ended_well, ready

pytestmark = pytest.mark.timeout(3600)
CHEAP = [name for name, command in COMMANDS.items() if not command.dear]
FIRST = 6  # of a long series the first allocations fail, and of the rest ever fewer
BINDING = 4  # objects of the core that a command makes: nanobind's own table of them may not fail
# SciPy's slices of sparse matrices do not look whether they get an array (sparsetools.cxx,
# array_from_std_vector), and the process ends: make_smoothing_spline takes some
SPARSE, SPARSE_SLICES = "_get_submatrix", 8
CORE, NUMPY = "/flexura/_core", "_multiarray_umath"
MEGABYTE = 1 << 20
LIMITS = np.geomspace(0.25, 400, 20)  # MB


@pytest.mark.slow
@pytest.mark.parametrize("name", CHEAP)
def test_four_limits_of_memory(name, place):
    short_memory(name, place, LIMITS[3::5])


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_twenty_limits_of_memory(name, place):
    short_memory(name, place, LIMITS)


def short_memory(name, place, limits):
    """A command with so many megabytes more than it has when it begins."""
    counts = Counter()
    for megabytes in limits:
        command, work = ready(place, name)
        ended = place.run(command, work, memory=int(megabytes * MEGABYTE))
        counts[ended.status] += 1
        ended_well(ended, work)
    print(f"{name}: {len(limits)} limits, statuses {dict(counts)}")


def following(n):
    """The number of the allocation that fails next, after the n-th."""
    return n + (1 if n < FIRST else max(1, n // 4))


def innermost(said):
    """The function that a process was in when it ended, as Python's fault handler says it."""
    frames = re.findall(r"^  File .* in (\w+)$", said, re.MULTILINE)
    return frames[0] if frames else ""


def some(names, few):
    """The commands of a name each: a few in the slow tier, all of them in the long one."""
    slow = [pytest.param(name, marks=pytest.mark.slow) for name in few]
    return slow + [pytest.param(n, marks=pytest.mark.long) for n in names if n not in few]


@pytest.mark.parametrize(
    "name", some(COMMANDS, ["simulate", "simulate --vary", "inverse", "invert", "tune"])
)
def test_allocations_of_the_core_fail_once(name, place):
    """Its operator new: the n-th fails, n = 1, 2, ... until the command passes."""
    n, faults, binding = 1, 0, 0
    while True:
        command, work = ready(place, name)
        ended = place.run(command, work, kind="allocation", n=n, library=CORE, bytes=0)
        if ended.status == -signal.SIGABRT:
            binding, n = binding + 1, n + 1
            assert "bad_alloc" in ended.err and binding <= BINDING
            continue
        ended_well(ended, work)
        if not ended.disturbed:
            assert ended.status == 0
            break
        assert ended.status in (0, 1) and (ended.status == 0 or "not enough memory" in ended.err)
        faults += 1
        n = following(n)
    print(f"{name}: {faults} allocations of the core failed, {binding} of the binding's")
    assert faults > FIRST or name not in ("simulate", "simulate --vary", "inverse", "tune")


@pytest.mark.parametrize("name", some(COMMANDS, ["simulate", "export csv", "export mat", "import"]))
def test_large_arrays_fail_once(name, place):
    """Of NumPy, above 16 kB, since the examples are small: what is above 1 MB in use is among
    them."""
    n, faults, theirs = 1, 0, 0
    while True:
        command, work = ready(place, name)
        ended = place.run(command, work, kind="array", n=n, library=NUMPY, bytes=16_000)
        if ended.status == -signal.SIGSEGV and innermost(ended.err) == SPARSE:
            theirs, n = theirs + 1, following(n)
            assert theirs <= SPARSE_SLICES
            continue
        ended_well(ended, work)
        if not ended.disturbed:
            break
        assert ended.status in (0, 1), ended.err
        faults += 1
        n = following(n)
    print(f"{name}: {faults} arrays failed, {theirs} in slices of SciPy's sparse matrices")
    assert faults or name not in ("simulate", "export csv")
