"""The functions that the core binds: each refuses arrays of another shape, and places that are not
there, before it reads them."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import flexura as fx
from flexlab.board.protocol.declaration import CONFIG
from flexura import core, signals
from flexura.control import DriveFunction
from flexura.system import constants

ROBOT = fx.load("rig")
SYSTEM = fx.assemble(ROBOT)
EQUATIONS, N = SYSTEM.equations, SYSTEM.n
Q, FREE, NONE = SYSTEM.start(), np.ones(2, dtype=np.uint8), np.zeros(2, dtype=np.uint8)
COUNTS, NUMBERS, MATERIAL, LUMPS = constants.rows(ROBOT)
LIMITS = np.tile([-np.inf, np.inf], (2, 1))
SEGMENTS = np.zeros((2, 10))
T = np.array([0.0, 1e-3, 2e-3])
TIMES = {"t": T, "q": Q}
DRIVE = {
    "segments": SEGMENTS,
    "ranges": np.array([[0, 1, 1, 2], [0, 0, 0, 0]]),
    "gains": np.zeros((2, 2)),
    "prescribed": NONE,
    "sampled": NONE,
    "limits": LIMITS,
}
PIDS = fx.Controller(tuple(fx.PID(reference=signals.constant(0.0), kp=1.0) for _ in range(2)))
CONTROLLER = {
    "mechanics": EQUATIONS,
    "rate_Hz": 1000.0,
    "quantum": 0.0,
    "segments": SEGMENTS,
    "index": np.array([[0, 0, 1, 1, 2], [0, 0, 1, 0, 0]]),
    "gains": PIDS.gains(),
    "springs": np.zeros((2, 2)),
    "linear": [],
    "about": [],
}


def states(count: int) -> np.ndarray:
    return np.tile(Q, (count, 1))


def linear(**others: np.ndarray) -> dict[str, Any]:
    """The arguments of a controller with a law of three states and two measurements."""
    law = {"F": np.zeros((3, 3)), "G": np.zeros((3, 2)), "L": np.zeros((3, 2))}
    law |= {"C": np.zeros((2, 3)), "K": np.zeros((2, 3)), "Kr": np.eye(2), "Kv": np.eye(2)}
    about = {"offset": np.zeros(2), "hold": np.zeros(2)}
    both = law | about | others
    return CONTROLLER | {"linear": [both[k] for k in law], "about": [both[k] for k in about]}


SWEEP = {
    "mechanics": EQUATIONS,
    "controller": core.Controller(**CONTROLLER),
    "segments": SEGMENTS,
    "index": np.zeros((2, 5), dtype=np.int64),
    "gains": np.zeros((2, 2)),
    "limits": LIMITS,
    **TIMES,
    "references": np.zeros((2, 3)),
    "rtol": 1e-3,
    "method": "explicit",
}
RUN = {"robot": EQUATIONS, **TIMES, "v": np.zeros(N), "rtol": 1e-3, "method": "explicit"}
RUN |= DRIVE | {"function": None, "sampler": None, "rate_Hz": 0.0, "first_step": 0.0}
RUN |= {"numerical_damping": True, "most_steps": 0}
LOADS = (np.array([[1.0, 0.1, 0.0]]), np.array([[0, 1, 1, 2, 0, 0]]), SEGMENTS)
BENDING = sum(link.flexible for link in ROBOT.links)
MANY = {
    "counts": COUNTS,
    "numbers": np.stack([NUMBERS] * 3),
    "material": np.stack([MATERIAL] * 3),
    "lumps": np.zeros((3, 0, 3)),
    "gravity": np.zeros((3, 2)),
    "payload": np.stack([constants.payload(ROBOT)] * 3),
    "limits": np.stack([LIMITS] * 3),
    "drives": [core.Drive(**DRIVE)],
    "drive_of": np.zeros(3, dtype=np.int64),
    "t": T,
    "q": np.zeros(0),
    "v": np.zeros(0),
    "rtol": 1e-3,
    "method": "explicit",
    "numerical_damping": True,
    "most_steps": 0,
    "channels": [("position", 0)],
    "stations": 2,
    "threads": 1,
    "watch": core.Watch(),
}
COPIES = {"q": states(3), "v": states(3), "force": np.zeros((3, 2)), "limits": LIMITS.T.copy()}
COPIES |= {"moves": np.ones(3, dtype=bool), "arrived": np.zeros(3, dtype=bool)}
COPIES |= {"deflection": np.zeros((3, BENDING)), "tip": np.zeros((3, 2))}
COPIES |= {"step_s": 1e-3, "steps": 2, "threads": 1}
PROGRAM = {"R": np.zeros((3, 4, 4)), "G": np.zeros((3, 4, 1)), "d": np.zeros((3, 4))}
PROGRAM |= {"W": np.zeros((3, 2, 4)), "end": np.eye(4), "limited": np.zeros((1, 4))}
RENEWED = PROGRAM | {"by_force": np.zeros((3, 4, 3)), "u": np.zeros((3, 1))}
RENEWED |= {"start": np.zeros(4), "wanted": np.zeros((3, 4))}
AHEAD = core.PredictedMotion(EQUATIONS, [int(k) for k in SYSTEM.free_rows], [0])
M = len(SYSTEM.free_rows)
BOARD = {"settings": np.array([float(item.default) for item in CONFIG.values()])}
BOARD |= {"open_loop": True, "period_log2": 1, "knots": np.zeros((4, 4), dtype=np.int64)}
LAW = core.Controller(**CONTROLLER)

# Functions with good arguments. `open`: sizes that are the caller's choice.
Call = tuple[Callable[..., Any], dict[str, Any], set[tuple[str, int]]]
CALLS: dict[str, Call] = {
    "Mechanics": (
        core.Mechanics,
        {"gravity": np.zeros(2), "payload": np.zeros(4), "counts": COUNTS, "numbers": NUMBERS}
        | {"material": MATERIAL, "lumps": LUMPS},
        {("material", 0), ("lumps", 0)},  # more than a robot has
    ),
    "accelerations": (EQUATIONS.accelerations, {"q": Q, "v": Q, "force": Q}, set()),
    "forces": (
        EQUATIONS.forces,
        {"q": Q, "v": Q, "a": Q, "gravity": True, "stiffness": True, "damping": True},
        set(),
    ),
    "observe": (EQUATIONS.observe, {"q": states(2), "v": states(2), "stations": 2}, set()),
    "loads": (
        EQUATIONS.loads,
        {"q": states(2), "rows": LOADS[0], "values": np.zeros((2, 3))},
        set(),
    ),
    "line": (EQUATIONS.line, {"q": Q, "link": 1, "s": np.zeros(3)}, {("s", 0)}),
    "loss": (EQUATIONS.loss, {"q": Q, "v": Q}, set()),
    "equilibrium": (EQUATIONS.equilibrium, {"q": Q, "load": np.zeros(3), "free": NONE}, set()),
    "modes": (
        EQUATIONS.modes,
        {"q": Q, "free": FREE, "count": 2, "load": np.zeros(3), "shapes": True},
        set(),
    ),
    "mass": (EQUATIONS.mass, {"q": Q}, set()),
    "stiffness": (EQUATIONS.stiffness, {"q": Q, "v": Q}, set()),
    "rates": (EQUATIONS.rates, {"q": Q, "v": Q}, set()),
    "force_derivatives": (
        EQUATIONS.force_derivatives,
        {"q": states(2), "v": states(2), "a": states(2)},
        set(),
    ),
    "bends": (core.bends, {"robot": EQUATIONS, "q": states(2), "link": 1}, {("q", 0)}),
    "Drive": (core.Drive, DRIVE, {("segments", 0)}),
    "Simulation": (core.Simulation, RUN, {("segments", 0), ("t", 0)}),
    "population": (
        core.population,
        MANY,
        {("t", 0), ("material", 1), ("lumps", 1)},
    ),
    "population from states": (
        core.population,
        MANY | {"q": np.tile(Q, 3), "v": np.zeros(N)},
        {("t", 0), ("material", 1), ("lumps", 1)},
    ),
    "copies": (core.Copies(EQUATIONS).advance, COPIES, set()),
    "Controller": (core.Controller, CONTROLLER, {("segments", 0)}),
    "start": (LAW.start, {"q": Q}, set()),
    "tick": (LAW.tick, {"k": 0, "t": 0.0, "q": Q}, set()),
    "step": (
        LAW.step,
        {"k": 0, "t": 0.0, "positions": np.zeros(2), "deflection": 0.0, "slope": 0.0},
        set(),
    ),
    "GainSweep": (
        core.GainSweep,
        SWEEP,
        {("segments", 0)},
    ),
    "run": (
        core.GainSweep(**SWEEP).run,
        {"prices": np.zeros((2, 16)), "gains": PIDS.gains()[None], "limits": np.ones(1)}
        | {"threads": 1},
        set(),
    ),
    "joint_metrics": (core.joint_metrics, {"t": T, "r": T, "q": T}, set()),
    "strip_metrics": (core.strip_metrics, {"t": T, "w": T, "settled": 0.0}, set()),
    "vibration_lower_bound": (
        core.vibration_lower_bound,
        {"t": T, "w": T, "seen": 3, "enough": 1.0},
        set(),
    ),
    "board_pulses": (core.board_pulses, BOARD | {"given": 0, "ticks": 4}, {("knots", 0)}),
    "steps": (
        AHEAD.steps,
        {"x": np.zeros((2, 2 * M)), "u": np.zeros((2, 1)), "a": np.zeros((2, M))}
        | {"h": np.full(2, 1e-3)},
        set(),
    ),
    "condensed_program": (core.condensed_program, PROGRAM, {("limited", 0), ("W", 1), ("G", 2)}),
    "renewed_program": (core.renewed_program, RENEWED, {("limited", 0), ("W", 1)}),
}


def other_shapes(good: dict[str, Any]) -> Iterator[tuple[str, int, np.ndarray]]:
    """Each array of the arguments with one row or column more, or without any."""
    for name, array in good.items():
        for axis in range(array.ndim) if isinstance(array, np.ndarray) else ():
            if array.shape[axis]:
                last = np.take(array, [-1], axis)
                yield name, axis, np.concatenate([array, last], axis)
            if not (name == "v" and axis == 0):  # none: at rest
                yield name, axis, np.take(array, range(max(0, array.shape[axis] - 1)), axis)


@pytest.mark.parametrize("name", CALLS)
def test_another_shape_is_refused(name):
    function, good, free = CALLS[name]
    function(**good)
    for argument, axis, array in other_shapes(good):
        if (argument, axis) in free or array.shape == np.shape(good[argument]):
            continue
        with pytest.raises(ValueError) as refused:
            function(**(good | {argument: array}))
            pytest.fail(f"{argument} {array.shape}")
        assert str(refused.value)


def test_a_load_bends_the_strip_and_pulses_follow_knots():
    pull = SEGMENTS + [0.0, 0.0, *[0.0] * 8]
    pull[1, 1] = 1.0
    at = (np.array([[1.0, 0.3, 1.0]]), np.array([[0, 1, 1, 2, 0, 0]]), pull)
    assert np.asarray(ran(loads=at).state())[1] != 0.0
    knots = np.array([[0, 0, 0, 0], [0, 4096, 0, 64], [0, 8192, 0, 64], [0, 12288, 0, 0]] * 4)
    for others, rates in ({"open_loop": True}, [0, 400, -400, 0]), ({"open_loop": False}, None):
        rows = knots if rates is None else np.array([[0, 0, 0, rate] for rate in rates] * 4)
        times, directions = core.board_pulses(
            **(BOARD | {"period_log2": 6, "knots": rows, "given": 0, "ticks": 900} | others)
        )
        times, directions = np.asarray(times), np.asarray(directions)
        assert len(times) > 10 and (np.diff(times) > 0).all() and set(directions) <= {1.0, -1.0}


def test_more_knots_than_the_board_has_room_for_are_followed_to_the_last():
    count = 300
    place = np.cumsum(np.full(count, 64))
    knots = np.stack([np.zeros(count), place, np.zeros(count), np.zeros(count)], 1)
    rows = {"period_log2": 1, "knots": knots.astype(np.int64), "given": 0, "ticks": 3 * count}
    _, directions = core.board_pulses(**(BOARD | rows | {"open_loop": False}))
    assert np.asarray(directions).sum() == place[-1] / 256  # a step is 256 of its counts


def test_a_linear_law_of_another_shape_is_refused():
    core.Controller(**linear())
    shapes = {"F": (3, 4), "G": (3, 1), "L": (3, 1), "C": (1, 3), "K": (2, 2), "Kr": (2, 1)}
    shapes |= {"Kv": (2, 1), "offset": (1,), "hold": (1,)}
    for name, shape in shapes.items():
        with pytest.raises(ValueError, match="linear law"):
            core.Controller(**linear(**{name: np.zeros(shape)}))
    four = {"offset": np.zeros(4), "L": np.zeros((3, 4)), "C": np.zeros((4, 3))}
    with pytest.raises(ValueError, match="joints"):
        core.Controller(**linear(**four))
    three = {"offset": np.zeros(3), "L": np.zeros((3, 3)), "C": np.zeros((3, 3))}
    core.Controller(**linear(**three))
    for name in ("linear", "about"):
        with pytest.raises(ValueError, match="F, G, L"):
            core.Controller(**(linear() | {name: linear()[name][1:]}))


OTHER = fx.assemble(fx.load("rig-r")).equations
WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("line", {"link": -1}, "no such link"),
    ("line", {"link": 2}, "no such link"),
    ("bends", {"link": -1}, "no such link"),
    ("bends", {"link": 2}, "no such link"),
    ("loads", {"rows": np.array([[-1.0, 0.0, 0.0]])}, "no such link"),
    ("loads", {"rows": np.array([[2.0, 0.0, 0.0]])}, "no such link"),
    ("loads", {"rows": np.array([[np.nan, 0.0, 0.0]])}, "no such link"),
    ("Mechanics", {"counts": COUNTS + [[0, 0, 0, 0, 1, 0, 0, 0]] * 2}, "material"),
    ("Drive", {"ranges": np.array([[-1, 1, 0, 0], [0, 0, 0, 0]])}, "no such segments"),
    ("Drive", {"ranges": np.array([[2, 1, 0, 0], [0, 0, 0, 0]])}, "no such segments"),
    ("Drive", {"ranges": np.array([[0, 3, 0, 0], [0, 0, 0, 0]])}, "no such segments"),
    ("Drive", {"segments": np.zeros((2, 9))}, "ten numbers"),
    ("Controller", {"index": np.array([[3, 0, 1, 1, 2], [0, 0, 0, 0, 0]])}, "no such output"),
    ("Controller", {"index": np.array([[-1, 0, 1, 1, 2], [0, 0, 0, 0, 0]])}, "no such output"),
    ("Simulation", {"loads": (LOADS[0][:, :2], *LOADS[1:])}, "another shape"),
    ("Simulation", {"loads": (LOADS[0], LOADS[1][:, :5], LOADS[2])}, "another shape"),
    ("Simulation", {"loads": (LOADS[0], LOADS[1][:0], LOADS[2])}, "another shape"),
    ("copies", {"moves": np.ones(2, dtype=bool)}, "another shape"),
    ("copies", {"arrived": np.zeros(2, dtype=bool)}, "another shape"),
    ("copies", {"steps": 0}, "another shape"),
    ("copies", {"threads": 0}, "another shape"),
    ("Simulation", {"method": "none"}, "no method"),
    ("population", {"method": "none"}, "no method"),
    ("GainSweep", {"method": "none"}, "no method"),
    ("population", {"drive_of": np.array([0, 1, 0])}, "no such drive"),
    ("population", {"drive_of": np.array([0, -1, 0])}, "no such drive"),
    ("population", {"channels": [("colour", 0)]}, "no channel colour"),
    ("vibration_lower_bound", {"seen": -1}, "not so many"),
    ("vibration_lower_bound", {"seen": 4}, "not so many"),
    ("board_pulses", {"period_log2": -1}, "1 to 64 ticks"),
    ("board_pulses", {"period_log2": 7}, "1 to 64 ticks"),
    ("board_pulses", {"ticks": -1}, "1 to 64 ticks"),
    ("board_pulses", {"settings": BOARD["settings"] * np.nan}, "refuses setting number 0"),
]


@pytest.mark.parametrize("name, other, said", WRONG, ids=lambda x: x if isinstance(x, str) else "")
def test_what_is_not_there_is_refused(name, other, said):
    function, good, _ = CALLS[name]
    with pytest.raises(ValueError, match=said):
        function(**(good | other))


CONTACT = np.array([[0.0, 0.0, 1.0, 0.1, 1.0, 0.0]])


@pytest.mark.parametrize(
    "segments, rows, said",
    [
        (np.zeros((2, 9)), CONTACT, "another shape"),
        (SEGMENTS, np.zeros((1, 5)), "another shape"),
        (SEGMENTS, CONTACT - [1, 0, 0, 0, 0, 0], "no such joint"),
        (SEGMENTS, CONTACT + [2, 0, 0, 0, 0, 0], "no such joint"),
        (SEGMENTS, CONTACT - [0, 1, 0, 0, 0, 0], "no such joint"),
        (SEGMENTS, CONTACT + [0, 2, 0, 0, 0, 0], "no such joint"),
        (SEGMENTS, CONTACT + [0, 0, 2, 0, 0, 0], "no such joint"),
    ],
)
def test_contacts_that_are_none_are_refused(segments, rows, said):
    with pytest.raises(ValueError, match=said):
        core.Simulation(**(RUN | {"function": (segments, rows)}))


def test_drives_of_another_robot_are_refused():
    one = {name: array[:1] for name, array in DRIVE.items()} | {"segments": SEGMENTS}
    with pytest.raises(ValueError, match="an entry a joint"):
        core.population(**(MANY | {"drives": [core.Drive(**one)]}))


def test_nothing_is_no_row():
    for name in ("Simulation", "population", "joint_metrics", "strip_metrics", "GainSweep"):
        function, good, _ = CALLS[name]
        with pytest.raises(ValueError):
            function(**(good | {"t": np.zeros(0)}))
    with pytest.raises(ValueError, match="knots"):
        core.board_pulses(
            **(BOARD | {"knots": np.zeros((0, 4), dtype=np.int64), "given": 0, "ticks": 4})
        )
    sweep = SWEEP | {"t": np.zeros(1), "references": np.zeros((2, 1))}
    with pytest.raises(ValueError, match="a row a joint"):
        core.GainSweep(**sweep)
    assert np.asarray(EQUATIONS.stiffness(Q, np.zeros(0))) == pytest.approx(
        np.asarray(EQUATIONS.stiffness(Q, np.zeros(N)))
    )
    squares, shapes = EQUATIONS.modes(Q, NONE, 2, np.zeros(3), False)
    assert np.asarray(squares).shape == (2,) and np.asarray(shapes).shape == (0, 2)
    whole = np.asarray(EQUATIONS.modes(Q, FREE, 2, np.zeros(3), False)[0])
    held = fx.assemble(ROBOT.replace({"link.1.joint.locked": True})).equations
    alone = np.asarray(held.modes(Q, FREE, 2, np.zeros(3), False)[0])
    only = np.array([0, 1], dtype=np.uint8)
    assert alone == pytest.approx(np.asarray(EQUATIONS.modes(Q, only, 2, np.zeros(3), False)[0]))
    assert alone[1] != pytest.approx(whole[1])


def ran(**others: Any) -> Any:
    run = core.Simulation(**(RUN | others))
    while run.advance(100):
        pass
    return run


@pytest.mark.parametrize("kind", ["of time", "of the joints", "of the state"])
def test_a_function_of_the_callers_gives_a_force_a_joint(kind):
    """As an array that is read in place, or as anything that Python can make one of."""

    def function(given: Any) -> DriveFunction:
        made: Any = lambda t, position, velocity, tip: given
        if kind == "of time":
            made = lambda t: given
        if kind == "of the state":
            made = lambda t, position, velocity, tip, *, q: given
        return DriveFunction(made, 2, SYSTEM)

    force = np.array([0.3, 0.0])
    expected = np.asarray(ran(function=function(force)).state())
    assert expected[0] > 1e-7
    strided, backwards = np.stack([force, force], 1)[:, 0], force[::-1][::-1]
    for given in ([0.3, 0.0], strided, backwards, force.astype(object), force.astype(">f8")):
        assert np.array_equal(np.asarray(ran(function=function(given)).state()), expected)
    whole = np.array([1, 0])
    assert np.array_equal(
        np.asarray(ran(function=function(whole)).state()),
        np.asarray(ran(function=function(whole * 1.0)).state()),
    )
    for wrong in ([0.3], np.zeros(3), np.zeros((1, 2)), np.array([math.nan, 0.0]), None, b"ab"):
        with pytest.raises(fx.InputError, match="expected 2 finite forces"):
            ran(function=function(wrong))


def test_what_reads_a_function_must_give_forces():
    class Careless:
        function, of_time, of_state = staticmethod(lambda t: [0.0]), True, False

        @staticmethod
        def read(given: Any, t: float) -> Any:
            return np.zeros(3)

    with pytest.raises(ValueError, match="another number of forces"):
        ran(function=Careless())


def test_a_rigid_robot_has_no_deflection_to_tell():
    pendulum = {"length_m": 1.0, "elements": 0, "mass_kg": 1.0, "centre_of_mass_m": 0.5}
    pendulum |= {"inertia_kg_m2": 0.1, "joint": {"type": "R"}}
    robot = fx.Robot.from_dict({"name": "pendulum", "link": [pendulum]})
    seen = []
    fx.simulate(robot, T, lambda t, position, velocity, tip: seen.append(tip) or [0.0])
    assert set(seen) == {0.0}


def test_a_python_object_is_called_once_a_tick():
    ticks = []
    law = DriveFunction(lambda t: ticks.append(t) or [0.0, 0.0], 2, SYSTEM)
    ran(sampler=core.PythonSampler(EQUATIONS, law), rate_Hz=2000.0)
    assert ticks == pytest.approx([0.0, 5e-4, 1e-3, 1.5e-3])
    controller = core.Controller(**CONTROLLER)
    run = ran(sampler=controller, rate_Hz=1000.0)
    assert np.asarray(controller.log).shape == (2, 2, 6)
    t, states, accounts, drive = (np.asarray(part) for part in run.rows())
    assert t == pytest.approx(T) and states.shape == (3, 2 * N)
    assert accounts.shape == (3, 4) and drive.shape == (3, 2)


def test_a_run_ends_with_a_word():
    pushed = {"segments": np.array([[0.0, 1e3, *[0.0] * 8]] * 2)}
    steep = DriveFunction(lambda t, x, v, w: [(1e-9 - x[0]) ** -3.0, 0.0], 2, SYSTEM)
    ends = {
        "done": ran(),
        "running": core.Simulation(**RUN),
        "limit": ran(**pushed, limits=np.tile([-1e-6, 1e-6], (2, 1))),
        "exhausted": ran(most_steps=3),
        "diverged": ran(segments=pushed["segments"] * 1e305),
        "stuck": ran(function=steep, v=np.eye(N)[0] * 1e-5),
    }
    for word, run in ends.items():
        assert run.progress()["status"] == word


def test_a_population_tells_how_each_of_its_robots_ended():
    watch = core.Watch()
    numbers = np.stack([NUMBERS] * 3)
    numbers[1, :, 7], numbers[1, :, 13], numbers[1, :, 14] = 0.5, -0.1, 0.1  # starts outside
    numbers[2, 0, 1] = numbers[2, 0, 3] = np.nan
    limits = np.stack([LIMITS] * 3)
    found = core.population(**(MANY | {"numbers": numbers, "limits": limits, "watch": watch}))
    words, texts = found[1], found[6]
    assert words == ["done", "refused", "refused"] and set(texts) == {2}
    assert texts[2][:2] == (0, "joint") and watch.done == 3 and not watch.stopped
    few = core.population(**(MANY | {"most_steps": 2}))
    assert few[1] == ["exhausted"] * 3 and "budget of 2 steps" in few[6][0][2]
    watch.stop()
    stopped = core.population(**(MANY | {"watch": watch}))
    assert stopped[1] == ["running"] * 3 and watch.stopped


def test_a_whole_link_is_one_piece():
    slides = fx.Robot.from_dict(
        {
            "name": "slider on a strip",
            "link": [
                {"length_m": 0.6, "elements": 2, "mass_per_length_kg_m": 0.2}
                | {"bending_stiffness_N_m2": 0.5, "joint": {"type": "R"}},
                {"length_m": 0.1, "elements": 0, "mass_kg": 0.1, "inertia_kg_m2": 1e-4}
                | {"centre_of_mass_m": 0.05, "joint": {"type": "Pa", "start_m": 0.3}},
            ],
        }
    )
    equations = fx.assemble(slides).equations
    B, K, tip, sums = (np.asarray(part) for part in equations.whole_link(0))
    assert len(B) == len(K) == len(tip) == sums.shape[1] == 4 and len(sums) > 4
    assert [np.asarray(part).size for part in equations.whole_link(1)][:3] == [0, 0, 0]
    for link in (-1, 2):
        with pytest.raises(ValueError, match="no such link"):
            equations.whole_link(link)


def test_numbers_alone_and_four_at_once():
    built = importlib.import_module(f"flexura.{core.BUILDS[core.level]}")
    x = np.linspace(0.1, 2.0, 7)
    for name in ("sin", "cos", "exp", "log", "tanh"):
        one, four = (np.asarray(getattr(built, name)(x, packed)) for packed in (False, True))
        assert np.array_equal(one, four)
        assert one == pytest.approx(getattr(np, name)(x), rel=1e-14)
