"""A newcomer's first day: starts under gravity, motions from whatever there is, runs that go on,
end where they are told to, or say why they do nothing."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.control import lqr
from robots import beam, rigid, robot

ARM = "model/robots/two-link-arm.toml"
RIG = "model/robots/rig.toml"
G = (0.0, -9.81)
JOINT = {"hub_inertia_kg_m2": 0.01}


def vertical_arm() -> fx.Robot:
    """Three links that hang and stand in a vertical plane, bent by their weight by some percent."""
    links = [beam(0.5, 0.5, 10.0, 3, start=start, **JOINT) for start in (0.9, -0.6, -0.5)]
    return robot(*links, gravity=G, payload=0.5)


def falling_beam(**joint) -> fx.Robot:
    return robot(beam(1.0, 1.0, 30.0, 4, **joint), gravity=G)


def quintics() -> list[signals.Signal]:
    return [signals.polynomial(0.05, 1.0), signals.polynomial(0.8, 1.0)]


# ---- starts


def test_inverse_dynamics_under_gravity_begins_with_the_holding_torques():
    arm, t = vertical_arm(), np.linspace(0, 0.2, 11)
    rest = arm.start
    run = fx.inverse(arm, t, rest)
    q = fx.static(arm)
    assert run.meta["start"] == "static"
    held = fx.holding(arm, q)
    # by hand: all weight beyond a joint, at its horizontal distance from it
    assert np.allclose(held, fx.linearize(arm).hold, rtol=1e-12)
    for i in range(3):
        drive = run[f"joint/{i + 1}/drive"]
        assert np.allclose(drive, held[i], rtol=1e-7, atol=1e-9)  # at rest, so it stays
    straight = fx.inverse(arm, t, rest, start="straight")
    assert straight.meta["start"] == "straight"
    assert np.ptp(straight["joint/1/drive"]) > 0.3 * abs(held[0])  # it falls into its bend


def test_a_horizontal_beam_is_held_by_the_moment_of_its_weight():
    stiff = robot(beam(1.0, 2.0, 1e7, 4), gravity=G, payload=3.0)
    assert fx.holding(stiff)[0] == pytest.approx(9.81 * (2.0 * 0.5 + 3.0), rel=1e-6)
    assert fx.holding(stiff, np.zeros(fx.assemble(stiff).n))[0] == pytest.approx(39.24, rel=1e-9)


def test_a_robot_in_equilibrium_under_its_holding_drives_stays():
    arm, t = vertical_arm(), np.linspace(0, 0.5, 26)
    run = fx.simulate(arm, t, list(fx.holding(arm)))
    assert np.abs(run.states - run.states[0]).max() < 1e-6
    assert np.abs(run.states[0][: fx.assemble(arm).n] - fx.static(arm)).max() == 0.0


@pytest.mark.parametrize(
    "gravity, flexible, options, start",
    [
        (G, True, {}, "static"),
        ((0.0, 0.0), True, {}, "straight"),
        (G, False, {}, "straight"),
        (G, True, {"start": "straight"}, "straight"),
        ((0.0, 0.0), True, {"start": "static"}, "static"),
        (G, True, {"q0": [0.3] + [0.0] * 8}, "given"),
    ],
)
def test_the_run_says_how_it_started(gravity, flexible, options, start):
    link = beam(1.0, 1.0, 30.0, 4) if flexible else rigid(1.0, 1.0, 0.5, 0.1)
    run = fx.simulate(robot(link, gravity=gravity), [0.0, 0.01], **options)
    assert run.meta["start"] == start
    bent = flexible and start == "static" and any(gravity)
    assert ("link/1/tip_deflection" in run and bool(run["link/1/tip_deflection"][0])) == bent


@pytest.mark.parametrize("kind", ["linear", "nodal"])
def test_the_dissertations_models_start_in_their_equilibrium_too(kind):
    sleeve = {"type": "Pb", "start": 0.7} if kind == "nodal" else {}
    link, more = beam(1.0, 1.0, 30.0, 4, locked=True, **sleeve), {"sliding": "nodal"}
    one = robot(link, gravity=G, stiffening=False, **(more if kind == "nodal" else {}))
    run = fx.simulate(one, np.linspace(0, 0.2, 11))
    assert run.meta["start"] == "static" and abs(run["link/1/tip_deflection"][0]) > 0.01
    assert np.ptp(run["link/1/tip_deflection"]) < 1e-6


def test_a_start_that_does_not_exist_says_what_to_do():
    column = robot(beam(1.0, 1.0, 0.1, 4, start=np.pi / 2), gravity=G, payload=1.0)
    with pytest.raises(fx.NoEquilibrium, match='start = "straight"') as caught:
        fx.simulate(column, [0.0, 0.1])
    assert caught.value.share < 1
    assert fx.simulate(column, [0.0, 0.01], start="straight").complete
    batch = fx.Batch.vary(column, {"payload.mass_kg": [1.0, 0.0]})
    many = fx.simulate(batch, [0.0, 0.01])
    assert list(many.status) == ["refused", "refused"]
    assert 'start = "straight"' in next(iter(many)).event[0]


def test_a_population_starts_as_each_of_its_robots():
    values = [0.1, 0.5, 0.9]
    batch = fx.Batch.vary(vertical_arm(), {"payload.mass_kg": values})
    t = np.linspace(0, 0.1, 6)
    for start in (None, "straight"):
        many = fx.simulate(batch, t, start=start)
        for k, value in enumerate(values):
            one = vertical_arm().replace({"payload.mass_kg": value})
            run = fx.simulate(one, t, start=start)
            assert np.array_equal(many["link/3/tip_deflection"][k], run["link/3/tip_deflection"])


def test_a_prescribed_joint_starts_in_equilibrium_where_its_motion_begins():
    one = falling_beam()
    run = fx.inverse(one, [0.0, 0.1], [0.4])
    moved = one.replace({"link.1.joint.start_rad": 0.4})
    assert run["joint/1/drive"][0] == pytest.approx(fx.holding(moved)[0], rel=1e-9)


def test_q0_and_start_are_not_given_both():
    with pytest.raises(fx.InputError, match=r"^start = 'static': expected q0 or start, not both"):
        fx.simulate(falling_beam(), [0.0, 1.0], q0=np.zeros(9), start="static")


# ---- motions


def test_a_motion_that_nothing_follows_is_refused():
    asked = signals.load_manoeuvre("model/manoeuvres/rig-step.toml", 2)
    with pytest.raises(fx.InputError, match="joint 1 has a motion, but neither gains nor prescr"):
        fx.simulate(RIG, asked.t, asked.drive)
    exact = fx.simulate(RIG, asked.t, asked.prescribed().drive)
    assert exact["joint/1/position"][-1] == pytest.approx(0.1, abs=1e-12)
    mixed = fx.Controller((fx.PID(0.1, kp=10.0), fx.JointDrive(motion=0.1)))
    with pytest.raises(fx.InputError, match="joint 2 has a motion"):
        fx.simulate(RIG, [0.0, 0.1], mixed)


def test_a_run_in_which_nothing_moves_says_so():
    still = fx.simulate(RIG, [0.0, 0.5, 1.0])
    assert [event["name"] for event in still.meta["events"]] == ["still"]
    locked = falling_beam().replace({"link.1.joint.locked": True})
    assert fx.simulate(locked, [0.0, 0.5]).meta["events"][0]["name"] == "still"
    assert fx.simulate(locked, [0.0, 0.5], start="straight").meta["events"] == []
    assert fx.simulate(RIG, [0.0, 0.5], [0.0, 1e-6]).meta["events"] == []


def test_arrays_functions_and_signals_are_one_motion():
    t, system = np.linspace(0, 1, 1001), fx.assemble(RIG)
    exact = fx.inverse(system, t, quintics())
    sampled = [np.array([m(s)[0] for s in t]) for m in quintics()]
    functions = [lambda s, m=m: m(s)[0] for m in quintics()]
    for motion in (sampled, np.array(sampled).T, functions, [sampled[0], functions[1]]):
        run = fx.inverse(system, t, motion)
        for i in (1, 2):
            difference = np.abs(run[f"joint/{i}/drive"] - exact[f"joint/{i}/drive"]).max()
            assert difference < 1e-5 * np.abs(exact[f"joint/{i}/drive"]).max()


def test_a_measured_motion_may_begin_and_end_with_any_velocity():
    t = np.linspace(0, 1, 101)
    run = fx.inverse(RIG, t, [0.1 * np.sin(3 * t), 0.4 * t])
    assert run.complete and run["joint/2/velocity"] == pytest.approx(0.4, rel=1e-9)
    line = signals.table([0.0, 1.0], [0.0, 1.0])
    assert fx.inverse(RIG, t, [0.0, line])["joint/2/velocity"][-1] == pytest.approx(1.0)
    for motion in (line, signals.ramp(1.0, 1.0), lambda s: min(s, 1.0)):
        with pytest.raises(fx.InputError, match=r"near t = 0.9998 s|at t = 1 s: end the run there"):
            fx.inverse(RIG, np.linspace(0, 2, 101), [0.0, motion])


def test_forces_are_numbers_functions_arrays_and_signals():
    t, system = np.linspace(0, 0.5, 51), fx.assemble(RIG)
    wave = lambda s: 0.02 * np.sin(9 * s)
    exact = fx.simulate(system, t, lambda s: [0.1, wave(s)], rtol=1e-9)
    for drive in (
        [0.1, wave],
        [np.full(51, 0.1), wave],
        fx.Drive.force(0.1, wave),
        fx.Drive.force(signals.constant(0.1), wave),
        [0.1, signals.harmonic(0.02, 9 / (2 * np.pi), -np.pi / 2)],
        np.column_stack([np.full(51, 0.1), wave(t)]),
        fx.Drive.force(0.1, wave(t), t_s=t),
    ):
        run = fx.simulate(system, t, drive, rtol=1e-9)
        assert run["tip/y"] == pytest.approx(exact["tip/y"], abs=3e-6)
    mixed = fx.Drive((fx.JointDrive(motion=lambda s: 0.01 * s**3, prescribed=True), *exact_force()))
    run = fx.simulate(system, t, mixed)
    assert run["joint/1/position"] == pytest.approx(0.01 * t**3, abs=1e-10)
    assert run["joint/2/drive"] == pytest.approx(wave(t), abs=1e-12)


def exact_force() -> tuple[fx.JointDrive]:
    return (fx.JointDrive(force=lambda s: 0.02 * np.sin(9 * s)),)


def test_one_joint_takes_its_entry_alone():
    pendulum, t = falling_beam(), np.linspace(0, 0.2, 21)
    runs = [fx.simulate(pendulum, t, drive) for drive in (2.0, [2.0], np.full(21, 2.0))]
    assert all(np.allclose(run["tip/y"], runs[0]["tip/y"], atol=1e-6) for run in runs)
    assert fx.inverse(pendulum, t, lambda s: s**3)["joint/1/position"][-1] == pytest.approx(0.008)


@pytest.mark.parametrize("stiffening", [True, False])
def test_functions_as_forces_act_in_both_models(stiffening):
    t, rig = np.linspace(0, 0.2, 21), fx.load(RIG).replace({"stiffening": stiffening})
    run = fx.simulate(rig, t, [lambda s: 0.1, 0.0])
    assert run["joint/1/drive"] == pytest.approx(0.1, abs=1e-15)


# ---- robots, paths and systems


def test_robots_paths_and_systems_are_one():
    described, t = fx.load(RIG), [0.0, 0.1]
    pid = fx.Controller((fx.PID(0.1), fx.PID(0.2)))
    vary = lambda r: fx.simulate(fx.Batch.vary(r, {"payload.mass_kg": [0.1]}), t)
    calls = {
        "simulate": lambda r: fx.simulate(r, t, [0.1, 0.0])["tip/x"],
        "inverse": lambda r: fx.inverse(r, t, [0.0, 0.0])["tip/x"],
        "static": fx.static,
        "holding": fx.holding,
        "frequencies": fx.frequencies,
        "modes": lambda r: fx.modes(r).frequencies_Hz,
        "linearize": lambda r: fx.linearize(r).A,
        "assemble": lambda r: fx.assemble(r).mass(fx.assemble(r).start()),
        "tip_pose": lambda r: fx.tip_pose(r, np.zeros(10)),
        "lqr": lambda r: lqr(r, pid, [1.0, 1.0])[1].K,
        "vary": lambda r: vary(r)["joint/1/position"],
    }
    for name, call in calls.items():
        results = [call(r) for r in (described, RIG, fx.assemble(described))]
        assert all(np.array_equal(results[0], found) for found in results), name


def test_the_old_module_of_signals_answers(monkeypatch):
    monkeypatch.delitem(sys.modules, "flexura.signal", raising=False)
    with pytest.warns(DeprecationWarning):
        import flexura.signal as old
    assert old.step(1.0)(0.5)[0] == 1.0


# ---- controllers


def test_a_controller_with_the_gains_of_pd_follows_the_same_motion():
    """The published arm, undamped: the sampled law in place of the continuous one."""
    t = np.linspace(0, 0.5, 51)
    motion = [signals.polynomial(0.5, 0.4), signals.polynomial(-0.3, 0.4)]
    kp, kd = (5.0, 0.2), (1.0, 0.0005)
    pd = fx.simulate(ARM, t, fx.Drive.pd(motion, kp, kd))
    pids = [
        fx.PID(m, kp=p, kd=d, derivative_Hz=0.0) for m, p, d in zip(motion, kp, kd, strict=True)
    ]
    sampled = fx.simulate(ARM, t, fx.Controller(tuple(pids), rate_Hz=2000.0))
    assert pd.complete and sampled.complete
    for i in (1, 2):
        name = f"joint/{i}/position"
        assert np.abs(sampled[name] - pd[name]).max() < 0.02 * np.abs(pd[name]).max()
    stiff = [replace(pid, kp=40.0, kd=4.0) for pid in pids]  # faster than its ticks: it runs away
    wild = fx.simulate(ARM, np.linspace(0, 0.01, 11), fx.Controller(tuple(stiff), rate_Hz=2000.0))
    assert wild.complete and np.abs(wild["joint/1/position"]).max() > 0.1


def test_a_reference_may_be_a_number_or_a_function():
    t = np.linspace(0, 0.2, 21)
    law = lambda reference: fx.Controller((fx.PID(0.0), fx.PID(reference, kp=0.5, kd=0.05)))
    a = fx.simulate(RIG, t, law(signals.cycloid(0.2, 0.2)))
    wave = lambda s: 0.2 * (s / 0.2 - np.sin(10 * np.pi * s) / (2 * np.pi))
    b = fx.simulate(RIG, t, law(wave))
    assert b["joint/2/position"] == pytest.approx(a["joint/2/position"], abs=1e-7)


def test_an_own_controller_with_a_memory_is_called_in_order():
    times = []

    def law(t, position, velocity, tip_deflection):
        times.append(t)
        return -0.05 * position - 0.005 * velocity

    fx.simulate(RIG, np.linspace(0, 0.1, 11), fx.Sampled(law, 200.0), qd0=[0.0, 1.0] + [0.0] * 8)
    assert times == pytest.approx(np.arange(20) / 200.0, abs=1e-12)


# ---- runs that go on


@pytest.mark.parametrize("stiffening", [True, False])
def test_a_run_goes_on_as_if_it_had_not_stopped(stiffening):
    one = robot(beam(0.5, 0.5, 10.0, 2, **JOINT), gravity=G, payload=0.5)
    described = vertical_arm() if stiffening else one.replace({"stiffening": False})
    t, rtol = np.linspace(0, 0.4, 41), 1e-9 if stiffening else 1e-7
    others = [None, lambda s: 0.2 * s] if stiffening else []
    drive = fx.Drive.force(signals.harmonic(3.0, 4.0), *others)
    whole = fx.simulate(described, t, drive, rtol=rtol)
    first = fx.simulate(described, t[:21], drive, rtol=rtol)
    second = fx.simulate(described, t[20:], drive, rtol=rtol, continue_from=first)
    assert second.meta["start"] == "continued" and second.complete
    for name in ("tip/x", "tip/y", "energy/work", "energy/loss", "energy/kinetic"):
        scale = np.abs(whole[name]).max()
        assert np.abs(second[name] - whole[name][20:]).max() <= 1e-5 * max(scale, 1e-9), name
        assert second[name][0] == pytest.approx(first[name][-1], abs=1e-12)
    total = lambda run: sum(run[f"energy/{x}"] for x in ("kinetic", "strain", "potential"))
    gained = total(second)[-1] - total(first)[0]
    paid = second["energy/work"][-1] - second["energy/loss"][-1]
    paid -= second["energy/numerical_loss"][-1]
    assert gained == pytest.approx(paid, abs=1e-5 * np.abs(total(second)).max())


def test_a_run_goes_on_with_another_payload():
    t = np.linspace(0, 0.2, 21)
    first = fx.simulate(RIG, t, [0.5, 0.0])
    light = fx.load(RIG).replace({"payload.mass_kg": 0.0})
    second = fx.simulate(light, t + 0.2, [0.5, 0.0], continue_from=first)
    assert second["tip/x"][0] == pytest.approx(first["tip/x"][-1], abs=1e-12)


def test_what_cannot_be_continued_says_why(tmp_path):
    t = np.linspace(0, 0.2, 21)
    first = fx.simulate(RIG, t, [0.5, 0.0])
    first.save(tmp_path)
    for key, options in {
        "continue_from": {"continue_from": fx.Run.read(tmp_path)},
        "q0": {"continue_from": first, "q0": np.zeros(10)},
        "start": {"continue_from": first, "start": "static"},
    }.items():
        with pytest.raises(fx.InputError) as caught:
            fx.simulate(RIG, t + 0.2, [0.5, 0.0], **options)
        assert caught.value.key == key
    with pytest.raises(fx.InputError, match=r"^t_eval = 0.3: expected times that begin at the end"):
        fx.simulate(RIG, t + 0.3, continue_from=first)
    with pytest.raises(
        fx.InputError, match=r"'a run with 10': expected a run of this robot, which"
    ):
        fx.simulate(ARM, t + 0.2, continue_from=first)
    longer = fx.load(RIG).replace({"link.2.length_m": 1.1 * fx.load(RIG).links[1].length_m})
    with pytest.raises(fx.InputError, match=r"its tip would jump from .* to .* m$"):
        fx.simulate(longer, t + 0.2, continue_from=first)


@pytest.mark.parametrize(
    ("name", "beyond", "key"),
    [
        ("single-pb", 5.0, "q0"),
        ("single-pb", 0.0, "motion of joint 1"),
        ("rig", 9.0, "q0"),
        ("rig", -1.0, "motion of joint 1"),
    ],
)
def test_a_start_beyond_the_ends_of_a_link_is_refused(name, beyond, key):
    """A sleeve has a least free length; a slider of type IV has the file's limits, or none."""
    robot = fx.load(name)
    system, t = fx.assemble(robot), [0.0, 0.1]
    if not np.isfinite(system.limits[0]).all():
        robot = robot.replace({"link.1.joint.limits_m": [-0.5, 0.5]})
        system = fx.assemble(robot)
    low, high = system.limits[0]
    with pytest.raises(
        fx.InputError, match=f"inside the limits of joint 1, {low:g} to {high:g}"
    ) as caught:
        if key == "q0":
            fx.simulate(robot, t, q0=np.r_[beyond, system.start()[1:]])
        else:
            others = [0.0] * (len(robot.links) - 1)
            fx.inverse(robot, t, [fx.signals.constant(beyond), *others])
    assert caught.value.key == key


# ---- runs that are ended


FREE_FALL = np.sqrt(2 * 0.3 / 9.81)


def dropped() -> fx.Robot:
    """A mass that falls along a vertical rail: 0.3 m after FREE_FALL."""
    link = rigid(0.0, 2.0, 0.0, 0.0, "Pa", angle_rad=0.0)
    return robot(link, gravity=(9.81, 0.0))


@pytest.mark.parametrize("change", [{}, {"stiffening": False}], ids=["core", "dense"])
@pytest.mark.parametrize(
    "until",
    [lambda t, x, v, w: x[0] - 0.3, lambda t, x, v, w: x[0] > 0.3, lambda t, x, v, w: 0.3 - x[0]],
    ids=["rising", "bool", "falling"],
)
def test_a_condition_ends_a_run_at_its_instant(until, change):
    t = np.linspace(0, 1, 23)
    run = fx.simulate(dropped().replace(change), t, until=until)
    assert run.complete and run.t[-1] == pytest.approx(FREE_FALL, rel=1e-8)
    assert run["joint/1/position"][-1] == pytest.approx(0.3, rel=1e-8)
    assert list(run.t[:-1]) == list(t[t < FREE_FALL])
    (event,) = run.meta["events"]
    assert (event["name"], event["level"]) == ("until", "INFO")
    assert event["t"] == run.t[-1] and run.meta["energy_error"] < 1e-8
    assert len(run.states) == len(run.t)
    on = fx.simulate(dropped().replace(change), [run.t[-1], 0.5], continue_from=run)
    assert on["joint/1/position"][-1] == pytest.approx(9.81 / 2 * 0.25, rel=1e-8)


def test_a_condition_sees_the_tip_deflection():
    t = np.linspace(0, 1, 201)
    whole = fx.simulate(RIG, t, [0.0, 0.02])
    peak = float(np.abs(whole["link/2/tip_deflection"]).max())
    level = lambda t, x, v, w: abs(w) - peak / 2
    run = fx.simulate(RIG, t, [0.0, 0.02], until=level)
    assert abs(run["link/2/tip_deflection"][-1]) == pytest.approx(peak / 2, rel=1e-5)


def test_a_condition_ends_a_sampled_run_at_an_output_time():
    t = np.linspace(0, 1, 101)
    law = fx.Sampled(lambda t, x, v, w: np.zeros(1), 100.0)
    run = fx.simulate(dropped(), t, law, until=lambda t, x, v, w: x[0] - 0.3)
    assert run.complete and run.t[-1] == t[t >= FREE_FALL][0]


def test_a_condition_that_is_never_met_changes_nothing():
    t = np.linspace(0, 0.5, 51)
    run = fx.simulate(RIG, t, [0.1, 0.0], until=lambda t, x, v, w: False)
    plain = fx.simulate(RIG, t, [0.1, 0.0])
    assert np.array_equal(run["tip/x"], plain["tip/x"]) and run.meta["events"] == []


def test_events_have_names():
    fast = fx.simulate(RIG, [0.0, 10.0], [1.0, 0.0])
    assert fast.meta["events"][0]["name"] == "limit"
    rail = robot(beam(1.0, 1.0, 1e3, 2), rigid(0.1, 1.0, 0.0, 0.1, "Pa", start=0.5))
    off = fx.simulate(rail, [0.0, 10.0], [0.0, 1.0])
    assert off.meta["events"][0]["name"] == "end_of_link"


def test_an_error_in_a_condition_reaches_the_caller():
    def until(t, x, v, w):
        raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        fx.simulate(RIG, [0.0, 0.1], [0.1, 0.0], until=until)
    with pytest.raises(fx.InputError, match=r"^until = 'far': expected a bool or a finite number"):
        fx.simulate(RIG, [0.0, 0.1], [0.1, 0.0], until=lambda t, x, v, w: "far")
