"""Forces and moments on links: momentum, energy, statics, inverse dynamics, refusals."""

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.io import write_toml
from robots import beam, rigid, robot

METHODS = ("auto", "explicit", "implicit", "exponential")


def arm(**keys):
    """Two links on free joints: the angular momentum about the axis is the first row of M q'."""
    return robot(
        rigid(0.4, 0.5, 0.2, 0.01),
        beam(0.5, 0.3, 2.0, 3),
        payload=0.1,
        payload_inertia=1e-3,
        **keys,
    )


LOADS = [
    fx.Load(1, 0.3, [0.4, signals.harmonic(1.0, 2.0)]),
    fx.Load(2, 0.25, [0.0, 0.5], frame="link"),
    fx.Load(2, moment_N_m=signals.step(0.1, at_s=0.13)),
]


@pytest.mark.parametrize("method", METHODS)
def test_the_balance_closes_under_all_methods(method):
    t = np.linspace(0.0, 0.5, 51)
    run = fx.simulate(arm(), t, None, rtol=1e-8, method=method, loads=LOADS)
    assert run.complete and run.meta["energy_error"] < 1e-7
    assert run["energy/work"][-1] > 0.01
    other = fx.simulate(arm(), t, None, rtol=1e-9, method="explicit", loads=LOADS)
    for name in ("joint/1/position", "tip/x", "link/2/tip_deflection", "energy/work"):
        size = np.abs(other[name]).max()
        assert np.abs(run[name] - other[name]).max() < 1e-6 * size, name


@pytest.mark.parametrize(
    ("method", "rtol", "bound"),
    [("explicit", 1e-11, 1e-9), ("exponential", 1e-11, 1e-9), ("implicit", 1e-8, 1e-6)],
)
def test_angular_momentum_grows_by_the_moment(method, rtol, bound):
    """A constant moment on the second link: momentum about the axis is moment times time."""
    system, moment = fx.assemble(arm()), 0.2
    t = np.linspace(0.0, 1.0, 11)
    load = {"link": 2, "at_m": 0.2, "moment_N_m": moment}
    run = fx.simulate(system, t, rtol=rtol, method=method, loads=[load], numerical_damping=False)
    n = system.n
    momentum = [(system.mass(z[:n]) @ z[n:])[0] for z in run.states]
    assert momentum == pytest.approx(moment * t, abs=bound * moment)


def test_the_work_of_a_force_is_along_its_way():
    """A constant force does F times the way of its point; a follower of a rigid link turns."""
    t = np.linspace(0.0, 1.0, 5)
    run = fx.simulate(arm(), t, rtol=1e-10, loads=[fx.Load(2, force_N=[0.7, -0.2])])
    way = 0.7 * (run["tip/x"] - run["tip/x"][0]) - 0.2 * (run["tip/y"] - run["tip/y"][0])
    assert run["energy/work"] == pytest.approx(way, abs=1e-9)
    lone = robot(rigid(0.5, 0.4, 0.25, 0.01))
    run = fx.simulate(lone, t, rtol=1e-11, loads=[fx.Load(1, force_N=[3.0, 0.2], frame="link")])
    inertia = 0.01 + 0.4 * 0.25**2  # a follower's moment about the axis is constant
    assert run["joint/1/position"] == pytest.approx(0.5 * 0.1 / inertia * t**2, rel=1e-9)


def test_an_arc_under_a_moment_and_the_elastica():
    """A moment at the tip bends a cantilever to an arc; a force as `tip_force` does."""
    bot = robot(beam(0.6, 0.2, 0.5, 8))
    q = fx.static(bot, loads=[fx.Load(1, moment_N_m=4.0)])
    assert fx.tip_pose(bot, q)[2] == pytest.approx(4.0 * 0.6 / 0.5, rel=1e-9)
    force = (0.3, 5.0)
    by_tip = fx.static(bot, tip_force=force)
    assert fx.static(bot, loads=[fx.Load(1, force_N=force)]) == pytest.approx(by_tip, abs=1e-9)
    with pytest.raises(fx.NoEquilibrium, match="buckles"):
        fx.static(bot, loads=[fx.Load(1, force_N=(-10.0, 0.0))])  # Euler: 3.43 N
    with pytest.raises(fx.InputError, match="not both"):
        fx.static(bot, tip_force=force, loads=[fx.Load(1, force_N=force)])


def test_a_static_start_takes_the_load_of_the_first_instant_in():
    """Nothing moves under a load that was there all the time; it swings under one that comes."""
    bot, t = robot(beam(0.6, 0.2, 0.5, 4, locked=True), gravity=(0.0, -1.0)), np.linspace(0, 0.2, 5)
    run = fx.simulate(bot, t, loads=[fx.Load(1, force_N=(0.0, 0.3))], rtol=1e-8)
    assert run.meta["start"] == "static" and np.ptp(run["tip/y"]) < 1e-9
    late = fx.Load(1, force_N=(0.0, signals.step(0.3, at_s=0.05)))
    moved = fx.simulate(bot, t, loads=[late])["tip/y"]
    assert moved[0] == pytest.approx(moved[1], abs=1e-9) and np.ptp(moved) > 0.01


@pytest.mark.parametrize("stiffening", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_the_drives_of_a_motion_bear_the_loads(stiffening):
    """The drives of inverse dynamics lead to the motion again, under the same loads."""
    bot, t = arm(stiffening=stiffening), np.linspace(0.0, 0.05, 51)
    motion = [signals.cycloid(0.1, 0.05), signals.cycloid(-0.1, 0.05)]
    asked = fx.inverse(bot, t, motion, loads=LOADS[:2], rtol=1e-8)
    assert asked.meta["energy_error"] < 1e-6
    without = fx.inverse(bot, t, motion, rtol=1e-8)
    assert np.abs(asked["joint/1/drive"] - without["joint/1/drive"]).max() > 0.1
    drives = [asked[f"joint/{i}/drive"] for i in (1, 2)]
    again = fx.simulate(bot, t, drives, rtol=1e-8, loads=LOADS[:2])
    for i in (1, 2):
        name = f"joint/{i}/position"
        assert np.abs(again[name] - asked[name]).max() < 1e-4  # of the drives between rows


def test_a_load_on_a_link_that_slides():
    """Through a sleeve and on a slider; a material point goes into the sleeve."""
    bot = robot(
        rigid(0.4, 0.3, 0.2, 1e-3),
        beam(0.6, 0.2, 1.0, 2, type="Pb", start=0.4),
    )
    t = np.linspace(0.0, 0.3, 31)
    loads = [fx.Load(2, 0.25, (-1.0, 0.3)), fx.Load(2, 0.5, (0.2, 0.1), frame="link")]
    run = fx.simulate(bot, t, loads=loads, rtol=1e-8)
    assert run.complete and run.meta["energy_error"] < 1e-6
    into = 0.6 - run["joint/2/position"]
    assert into[0] < 0.25 < into.max()  # the first load's point is in the sleeve at last


def test_functions_and_numbers_as_loads():
    t = np.linspace(0.0, 0.2, 11)
    given = fx.Load(2, force_N=[lambda t: np.sin(9.0 * t), None])
    same = fx.Load(2, force_N=[signals.harmonic(1.0, 9.0 / (2 * np.pi)), None])
    a, b = (fx.simulate(arm(), t, loads=[x], rtol=1e-9)["tip/x"] for x in (given, same))
    assert a == pytest.approx(b, abs=1e-8)
    with pytest.raises(fx.InputError, match="without jumps"):
        fx.simulate(arm(), t, loads=[fx.Load(1, force_N=[lambda t: float(t > 0.1), 0.0])])


WRONG = [
    ({"link": 3, "moment_N_m": 1.0}, "link from 1 to 2"),
    ({"link": 1, "at_m": 0.41, "moment_N_m": 1.0}, "from 0 to the link's length, 0.4 m"),
    ({"link": 1, "at_m": -0.1, "moment_N_m": 1.0}, "from 0 to the link's length"),
    ({"link": 1}, "force_N or a moment_N_m"),
    ({"moment_N_m": 1.0}, "link's number"),
    ({"link": 1, "force": [1, 2]}, "an unknown key"),
    ({"link": 1, "force_N": [1.0]}, "two components"),
    ({"link": 1, "force_N": 1.0}, "two components"),
    ({"link": 1, "force_N": [1.0, "x"]}, "number"),
    ({"link": 1, "moment_N_m": float("nan")}, "number"),
    ({"link": 1, "moment_N_m": 1.0, "frame": "tip"}, '"base" or "link"'),
    ({"link": 1.5, "moment_N_m": 1.0}, "whole number"),
    (3.0, "a list of fx.Load"),
]


@pytest.mark.parametrize(("load", "text"), WRONG)
def test_wrong_loads_are_refused_by_their_key(load, text):
    with pytest.raises(fx.InputError, match=text) as error:
        fx.simulate(arm(), [0.0, 0.1], loads=[load] if isinstance(load, dict) else load)
    assert error.value.key.startswith("load")


FILE = """
duration_s = 0.2
output_step_s = 0.05
[[joint]]
[[joint]]
[[load]]
link = 2
at_m = 0.25
force_N = [0.5, { kind = "step", value = 2.0, at_s = 0.05 }]
frame = "link"
[[load]]
link = 1
moment_N_m = 0.1
"""


def test_a_manoeuvre_file_has_loads(tmp_path):
    """Read, simulated, written and read again."""
    path = tmp_path / "push.toml"
    path.write_text(FILE)
    asked = fx.load_manoeuvre(path, 2)
    first, second = asked.loads
    assert (first.link, first.at_m, first.frame) == (2, 0.25, "link")
    assert list(first.at(0.1)) == [0.5, 2.0, 0.0] and list(second.at(0.0)) == [0.0, 0.0, 0.1]
    run = fx.simulate(arm(), asked.t, asked.drive, loads=asked.loads)
    assert run.meta["loads"][0]["frame"] == "link" and run["energy/work"][-1] != 0.0
    write_toml(tmp_path / "again.toml", asked.spec())
    again = fx.load_manoeuvre(tmp_path / "again.toml", 2)
    assert again.spec() == asked.spec()
    with pytest.raises(fx.InputError, match="nothing pushes links there") as error:
        asked.refuse_loads("nothing pushes links there")
    assert error.value.file == str(path)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("link = 2", "link = 3", "load[1].link"),
        ("[0.5, ", "[", "load[1].force_N"),
        ("0.5, {", '"much", {', "load[1].force_N[1]"),
        ('frame = "link"', "frames = 1", "load[1].frames"),
        ("moment_N_m = 0.1", "", "load[2].force_N"),
        ("0.5, {", "1e15, {", "load[1].force_N[1]"),
        ("moment_N_m = 0.1", "moment_N_m = -1e15", "load[2].moment_N_m"),
        ("moment_N_m = 0.1", 'moment_N_m = { kind = "steps" }', "load[2].moment_N_m.kind"),
    ],
)
def test_wrong_tables_are_refused_by_file_and_key(tmp_path, old, new, key):
    path = tmp_path / "push.toml"
    path.write_text(FILE.replace(old, new, 1))
    with pytest.raises(fx.InputError) as error:
        fx.load_manoeuvre(path, 2)
    assert error.value.key == key and error.value.file == str(path)


def test_loads_and_payloads_are_in_the_internal_forces():
    """A load turns with its link, another acts on the tip: the clamp bears them, less what moves;
    a payload that is taken up weighs on the joint from then on."""
    strip = {"length_m": 0.5, "elements": 4, "mass_per_length_kg_m": 0.2}
    strip |= {"bending_stiffness_N_m2": 2.0, "joint": {"type": "R", "locked": True}}
    strip["sensor"] = [{"name": "root", "kind": "bending_moment", "at_m": 0.0}]
    made = fx.Robot.from_dict({"link": [strip], "gravity_m_s2": [0.0, -9.81]})
    loads = [
        {"link": 1, "at_m": 0.3, "force_N": [0.0, 0.2], "frame": "link"},
        {"link": 1, "force_N": [0.1, 0.0], "moment_N_m": 0.05},
    ]
    run = fx.simulate(made, [0.0, 0.01], loads=loads, internal_forces=True)
    x, y, angle = fx.assemble(made).line(fx.static(made, loads=loads), 1, [0.3, 0.5])
    turned = 0.2j * np.exp(1j * angle[0])
    at = x + 1j * y
    force = -0.1 - turned + 0.1 * 9.81j
    assert run["joint/1/reaction_x"] == pytest.approx(force.real, rel=1e-6)
    assert run["joint/1/reaction_y"] == pytest.approx(force.imag, rel=1e-6)
    found = fx.internal_forces(made, loads=loads)
    assert run["joint/1/reaction_moment"] == pytest.approx(found.reaction(1).moment, rel=1e-6)
    assert run["sensor/root"] == pytest.approx(-run["joint/1/reaction_moment"], rel=1e-9)
    own = fx.internal_forces(made, fx.static(made, loads=loads)).reaction(1).moment
    moment = (at[0].conjugate() * turned).imag + (at[1].conjugate() * 0.1).imag + 0.05
    assert found.reaction(1).moment == pytest.approx(own - moment, rel=1e-9)
    ahead, behind = found.link(1, [0.3 + 1e-6]), found.link(1, [0.3 - 1e-6])
    assert behind.shear_force - ahead.shear_force == pytest.approx([0.2], rel=1e-4)

    bar = {"length_m": 0.5, "mass_kg": 0.0, "joint": {"type": "R", "hub_inertia_kg_m2": 1.0}}
    arm = fx.Robot.from_dict({"link": [bar], "gravity_m_s2": [0.0, -9.81]})
    arm = arm.replace({"payload.mass_kg": 0.1})
    taken = [{"at_s": 0.1, "mass_kg": 0.3}]
    run = fx.inverse(arm, [0.0, 0.05, 0.15, 0.2], [0.0], payloads=taken, internal_forces=True)
    assert run["joint/1/reaction_y"] == pytest.approx(9.81 * np.array([0.1, 0.1, 0.3, 0.3]))
    assert run["joint/1/reaction_moment"] == pytest.approx(run["joint/1/drive"])


@pytest.mark.parametrize("method", ["auto", "exponential", "implicit"])
@pytest.mark.parametrize("begins_s", [0.0, 0.3])
@pytest.mark.parametrize("kind", ["R", "Pa", "Pb"])
def test_a_load_that_grows_from_nothing_moves_a_locked_robot(kind, begins_s, method):
    """At rest there is neither energy nor work to weigh errors of work by. A joint that is held by
    a drive, which is not locked, is the same robot."""
    link = {
        "length_m": 1.0,
        "elements": 4,
        "mass_per_length_kg_m": 0.3,
        "damping": {"beta_s": 1e-3},
    }
    joint = {"R": {"type": "R"}, "Pa": {"type": "Pa"}, "Pb": {"type": "Pb", "start_m": 0.2}}[kind]
    tables = {"link": [link | {"bending_stiffness_N_m2": 1.0, "joint": joint}]}
    force = fx.signals.delayed(fx.signals.cycloid(0.1, 1.0 - begins_s), begins_s)
    load, t = [fx.Load(link=1, force_N=[0.0, force])], np.linspace(0.0, 1.0, 11)
    held = fx.Drive.prescribed(joint.get("start_m", 0.0))
    expected = fx.simulate(fx.Robot.from_dict(tables), t, held, loads=load, rtol=1e-8)
    joint["locked"] = True
    locked = fx.simulate(fx.Robot.from_dict(tables), t, loads=load, method=method)
    assert locked.complete and locked.meta["events"] == []
    assert np.ptp(expected["tip/y"]) > 1e-4
    assert locked["tip/y"] == pytest.approx(expected["tip/y"], abs=1e-6 * np.ptp(expected["tip/y"]))
