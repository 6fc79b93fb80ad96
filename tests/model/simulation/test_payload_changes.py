"""Payloads that are taken up and let go: momentum, energy of the impact, the motion after it."""

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.system import impact, with_payload
from robots import beam, rigid, robot

AT = 0.3


def pendulum(**keys):
    """A rigid link on an axis: 0.4 kg, 0.5 m, J about the axis 0.035 kg m^2."""
    return robot(rigid(0.5, 0.4, 0.25, 0.01), **keys)


def arm(**keys):
    return robot(rigid(0.4, 0.5, 0.2, 0.01), beam(0.5, 0.3, 2.0, 3), **keys)


def momentum(run, bot, changes):
    """The first row of M q' at the rows: angular momentum about the axis, each with its payload."""
    out = []
    for t, z in zip(run.t, run.states, strict=True):
        mass = bot.payload.mass_kg
        for at, new in changes:
            mass = new if t >= at else mass
        system = fx.assemble(bot.replace({"payload.mass_kg": mass}))
        out.append((system.mass(z[: system.n]) @ z[system.n :])[0])
    return np.array(out)


def test_the_impact_formula_of_a_pendulum():
    """J w is kept; the kinetic energy falls by J dJ w^2 / (2 (J + dJ)); letting go keeps w."""
    J, m, w = 0.01 + 0.4 * 0.25**2, 0.2, 3.0
    dJ = m * 0.5**2 + 1e-3
    t = np.linspace(0.0, 0.9, 10)
    changes = [
        {"at_s": AT, "mass_kg": m, "inertia_kg_m2": 1e-3},
        fx.PayloadChange(at_s=0.62, mass_kg=0.0),
    ]
    run = fx.simulate(pendulum(), t, qd0=[w], payloads=changes, rtol=1e-12)
    after = J * w / (J + dJ)
    speed = run["joint/1/velocity"]
    assert speed[t < AT] == pytest.approx(w, rel=1e-12)
    assert speed[t >= AT] == pytest.approx(after, rel=1e-12)  # also after it is let go
    jumps = run.meta["energy_jumps"]
    lost = J * dJ * w**2 / (2 * (J + dJ))
    assert jumps[0]["impact_J"] == pytest.approx(lost, rel=1e-12)
    assert jumps[0]["J"] == pytest.approx(-lost, rel=1e-12) and jumps[1]["impact_J"] == 0.0
    assert jumps[1]["J"] == pytest.approx(-0.5 * dJ * after**2, rel=1e-12)
    assert [event["name"] for event in run.meta["events"]] == ["payload", "payload"]
    assert run.complete and run.meta["energy_error"] < 1e-12
    position = np.where(t < AT, w * t, w * AT + after * (t - AT))
    assert run["joint/1/position"] == pytest.approx(position, rel=1e-10)


@pytest.mark.parametrize("method", ["auto", "explicit", "implicit", "exponential"])
def test_momentum_of_a_flexible_arm(method):
    """Angular momentum stays to 1e-9 while a payload is taken up; the balance closes."""
    bot, t = arm(payload=0.05), np.linspace(0.0, 0.5, 11)
    n = fx.assemble(bot).n
    rates = np.zeros(n)
    rates[0], rates[1] = 2.0, -1.0
    change = fx.PayloadChange(0.2371, 0.3)
    run = fx.simulate(bot, t, qd0=rates, payloads=change, rtol=1e-11, method=method)
    assert run.complete and len(run.t) == 11 and run.meta["energy_error"] < 1e-8
    assert run.meta["energy_jumps"][0]["J"] < 0
    bound = 1e-9 if method != "implicit" else 1e-8
    values = momentum(run, bot, [(0.2371, 0.3)])
    assert values == pytest.approx(values[0], rel=bound)


@pytest.mark.parametrize("stiffening", [True, False])
@pytest.mark.parametrize("centre", [None, (0.02, 0.01)])
def test_the_equations_at_the_impact(stiffening, centre):
    """Generalised momentum and the two forms of the energy, with the core's mass matrices."""
    before = fx.assemble(arm(payload=0.1, payload_inertia=2e-3, stiffening=stiffening))
    random = np.random.default_rng(2)
    q, qd = 0.2 * random.normal(size=before.n), random.normal(size=before.n)
    after = with_payload(before, fx.PayloadChange(0.1, 0.3, 1e-3, centre))
    happened = impact(before, after, q, qd, np.zeros(0, dtype=int))
    common = {"mass_kg": 0.1, "inertia_kg_m2": 1e-3} if centre is None else {"mass_kg": 0.0}
    kept = with_payload(before, fx.PayloadChange(0.1, **common)).mass(q)
    assert after.mass(q) @ happened.qd == pytest.approx(kept @ qd, abs=1e-12)
    fall = 0.5 * qd @ kept @ qd - 0.5 * happened.qd @ after.mass(q) @ happened.qd
    assert happened.lost == pytest.approx(fall, rel=1e-9)
    gone = 0.5 * qd @ (before.mass(q) - kept) @ qd
    assert happened.gone == pytest.approx(gone, rel=1e-9)


def test_given_joints_keep_to_their_motion():
    """A prescribed joint goes on; a locked one stays; the free unknowns take the impact."""
    bot, t = arm(), np.linspace(0.0, 0.2, 11)
    motion = [signals.cycloid(0.3, 0.2), signals.constant(0.1)]
    run = fx.inverse(bot, t, motion, payloads=[fx.PayloadChange(0.1, 0.2)], rtol=1e-8)
    expected = [motion[0](float(at))[1] for at in t]
    assert run["joint/1/velocity"] == pytest.approx(np.array(expected), abs=1e-12)
    assert run.complete and run.meta["energy_error"] < 1e-6


@pytest.mark.parametrize("keys", [{"stiffening": False}, {"sliding": "nodal"}])
def test_the_dissertations_models_take_up_too(keys):
    bot = robot(beam(0.5, 0.3, 2.0, 1), **keys)
    t = np.linspace(0.0, 0.1, 6)
    q = np.zeros(fx.assemble(bot).n)
    rates = q.copy()
    rates[0] = 1.0
    run = fx.simulate(bot, t, q0=q, qd0=rates, payloads=[fx.PayloadChange(0.05, 0.1)])
    assert run.complete and run.meta["energy_error"] < 1e-5
    assert run.meta["energy_jumps"][0]["J"] < 0


def test_a_sampled_drive_keeps_its_ticks():
    """The controller is called once a tick, as without a change; it may have a memory."""
    ticks = []

    def law(t, position, velocity, deflection):
        ticks.append(t)
        return [-0.1 * velocity[0]]

    change = [fx.PayloadChange(0.05, 0.1)]
    fx.simulate(pendulum(), [0, 0.1], fx.Sampled(law, 100.0), qd0=[1.0], payloads=change)
    assert ticks == pytest.approx(np.arange(10) / 100.0)
    between = [fx.PayloadChange(0.055, 0.1)]
    with pytest.raises(fx.InputError, match="at a tick"):
        fx.simulate(pendulum(), [0, 0.1], fx.Sampled(law, 100.0), payloads=between)


WRONG = [
    ({"at_s": 0.0, "mass_kg": 1.0}, "within the run"),
    ({"at_s": 0.1, "mass_kg": 1.0}, "within the run"),
    ({"at_s": 0.05, "mass_kg": -1.0}, "in kilograms, 0 or between"),
    ({"at_s": 0.05, "mass_kg": 1e12}, "in kilograms, 0 or between"),
    ({"at_s": 0.05}, "missing"),
    ({"at_s": 0.05, "mass": 1.0}, "an unknown key"),
    ({"at_s": 0.05, "mass_kg": 1.0, "centre_of_mass_m": 3}, "two numbers in metres"),
    ("much", "a list of fx.PayloadChange"),
]


@pytest.mark.parametrize(("change", "text"), WRONG)
def test_wrong_changes_are_refused(change, text):
    given = [change] if isinstance(change, dict) else change
    with pytest.raises(fx.InputError, match=text) as error:
        fx.simulate(pendulum(), [0.0, 0.1], payloads=given)
    assert error.value.key.startswith("payload")


def test_what_a_change_would_break_is_refused():
    t, change = [0.0, 0.1], [fx.PayloadChange(0.05, 0.1)]
    twice = [fx.PayloadChange(0.05, 0.1), fx.PayloadChange(0.05, 0.0)]
    with pytest.raises(fx.InputError, match="ascend"):
        fx.simulate(pendulum(), t, payloads=twice)
    with pytest.raises(fx.InputError, match="end the run at t_eval"):
        fx.simulate(pendulum(), t, payloads=change, until=lambda t, x, v, w: False)
    modal = robot(beam(0.5, 0.2, 1.0, 4, modes=2))
    with pytest.raises(fx.InputError, match="without modes"):
        fx.simulate(modal, t, payloads=change)
    run = fx.simulate(pendulum(), t, qd0=[1.0], payloads=change)
    with pytest.raises(fx.InputError, match="payload at the end"):
        fx.simulate(pendulum(), [0.1, 0.2], continue_from=run)
    on = fx.simulate(pendulum(payload=0.1), [0.1, 0.2], continue_from=run)
    assert on["joint/1/velocity"][0] == pytest.approx(run["joint/1/velocity"][-1])


def test_a_manoeuvre_file_has_payloads(tmp_path):
    path = tmp_path / "take.toml"
    path.write_text("duration_s = 0.2\n[[joint]]\n[[payload]]\nat_s = 0.1\nmass_kg = 0.2\n")
    asked = fx.load_manoeuvre(path, 1)
    assert asked.payloads == (fx.PayloadChange(0.1, 0.2),)
    assert asked.spec()["payload"] == [{"at_s": 0.1, "mass_kg": 0.2, "inertia_kg_m2": 0.0}]
    with pytest.raises(fx.InputError, match="nothing takes it up") as error:
        asked.refuse_payloads("nothing takes it up")
    assert error.value.file == str(path)
    path.write_text(path.read_text().replace("0.1", "0.3"))
    with pytest.raises(fx.InputError, match="within the run") as error:
        fx.load_manoeuvre(path, 1)
    assert error.value.file == str(path) and error.value.key == "payload[1].at_s"
