"""Learning with the native model in place of the rig, and short trials on the emulated one."""

import dataclasses
import json

import numpy as np
import pytest

import flexura as fx
from commands import run
from flexlab import rig as rigs
from flexlab.experiment.run_experiment import ExperimentResult, RefusedToStart
from flexlab.experiment.stream import StreamResult
from flexlab.identification.estimate import Estimate
from flexlab.identification.identify_rig import Identified, parameters, read_nominal
from flexlab.identification.strip import with_parameters
from flexlab.learning import output
from flexlab.learning.drives import friction_side
from flexlab.learning.knowledge import Knowledge
from flexlab.learning.learn import learn
from flexlab.learning.model import RigModel
from flexlab.learning.task import REST_S, Task
from flexlab.recordings.unit_conversion import voltage_channel
from flexlab.rig.board_axes import board_axes
from flexlab.rig.nominal_robot import with_nominal_drives
from flexlab.rig.plant.strip_sensor import StripSensor

RIG_R = rigs.load("rig-r")
DRIVER = RIG_R.rig.driver.model_copy(update={"dead_zone_V": 0.0})
SETUP = dataclasses.replace(RIG_R, rig=RIG_R.rig.model_copy(update={"driver": DRIVER}))
SETTINGS = rigs.configuration(SETUP)
AXIS, FLEX = board_axes(SETTINGS)[0], SETUP.rig.flex
TRUE = {
    "stiffness": 1.06,
    "damping": 1.4,
    "payload": 0.92,
    "sensor_gain": 1.05,
    "backlash": 0.01,
    "contact": 1.0,
    "bearing": 1.0,
    "delay_s": 0.0,
}
NOISE_V = 4e-3
DONE = StreamResult(True, "all done", True)


def swing(height=0.4, duration_s=0.6, time_s=0.5):
    motion = fx.signals.polynomial(height, time_s)
    return fx.Manoeuvre("swing", duration_s, 0.005, fx.Drive.pd([motion], [0.0], [0.0]))


def task(goes_back=False):
    return Task.of(SETUP, SETTINGS, swing(), goes_back)


def known(off=1.0, spread=0.03):
    """An identification that is off by a factor of the stiffness."""
    t = np.arange(0.0, 1.0, 0.002)
    nominal = read_nominal(experiment(t, 0.1 * np.sin(5 * t), np.zeros_like(t)))
    values = TRUE | {"stiffness": off * TRUE["stiffness"]}
    found = tuple(parameters(nominal, values))
    covariance = np.diag([spread**2 if u.name == "stiffness" else 1e-4 for u in found])
    strip = Estimate(found, values, covariance, np.zeros((1, 1)), np.zeros((len(found), 1, 1)), 0)
    return Identified(nominal, {}, strip, None)


def experiment(t, joint, flex_V):
    channels = {"joint/1/position": joint, "joint/1/voltage": 0 * t}
    meta = {
        "robot": SETUP.robot.to_dict(),
        "rig": SETUP.rig.model_dump(mode="json"),
        "settings": SETTINGS,
        "label": "native model",
        "emulated": True,
    }
    units = {"joint/1/position": "rad", "joint/1/voltage": "V"}
    name = voltage_channel(1, "flex")
    return fx.Run(t, channels | {name: flex_V}, units | {name: "V"}, meta)


class NativeRig:
    """The native strip on its motor and the board's controller, without backlash."""

    def __init__(self, folder, values=TRUE, fails_at=None):
        self.folder, self.values, self.fails_at = folder, values, fails_at
        self.random, self.tip, self.plans = np.random.default_rng(1), None, []

    def perform(self, plan, number, report):
        self.plans.append(plan)
        knots = plan.knots.columns["position_1"] / (256 * AXIS.setpoints)
        at = fx.signals.table(plan.knots.period_s * np.arange(len(knots)), knots)
        t = np.arange(0.0, plan.duration_s, 0.002)
        robot, (motor,) = with_nominal_drives(with_parameters(SETUP.robot, self.values), SETUP)
        pid = fx.PID(at, motor, kp=60.0, ki=120.0, kv=1.36, kc=0.4, limit=12.0)
        system = fx.assemble(robot)
        model = fx.simulate(system, t, fx.Controller((pid,)), rtol=1e-4)
        ends = np.array([FLEX.from_m, FLEX.from_m + FLEX.length_m])
        low, high = system.angles(1, ends) @ model.states[:, : system.n].T
        gain = self.values["sensor_gain"]
        sensor = StripSensor(FLEX, None, self.random, 1.0, gain)
        volts = np.array([sensor.voltage(bend) for bend in high - low])
        volts += NOISE_V * self.random.standard_normal(len(t))
        self.tip = np.column_stack([model["tip/x"], model["tip/y"]])
        folder = self.folder / f"trial-{number:02d}"
        folder.mkdir(parents=True)
        ended = DONE
        if number == self.fails_at:
            ended = StreamResult(False, "interrupted", True, interrupted=True)
        report(1.0)
        made = experiment(t, model["joint/1/position"], volts)
        return ExperimentResult(made, folder, [], ended)

    def stop_asked(self):
        return ""

    def true_tip(self, run):
        return self.tip


def test_a_task_rests_moves_and_goes_back():
    made = task(goes_back=True)
    assert made.first[0] == 0 and made.first[-1] == pytest.approx(0.4)
    assert made.wanted(np.array([0.0, made.t[-1]])) == pytest.approx(
        0.4 * np.array([[1, 0], [np.cos(0.4), np.sin(0.4)]])
    )
    plan = made.plan(made.first, 3, note="from trial 1")
    assert plan.failed == [] and plan.asked["lead_s"] == plan.asked["out_s"] == 0
    assert plan.asked["learning"]["trial"] == 3
    position = plan.knots.columns["position_1"]
    assert position[0] == position[-1] == 0 and position.max() > 0
    assert not position[: round(REST_S / plan.knots.period_s)].any()
    # a tip that is 1 mm ahead on its circle lacks -1 mm; inwards lacks nothing
    t = np.array([made.t[-1]])
    at = made.wanted(t)
    round_by = lambda a: at @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
    assert made.error(t, round_by(2.5e-3)) == pytest.approx(-1e-3)
    assert made.error(t, 0.99 * at) == pytest.approx(0)
    along = made.along(np.tile(np.array([[0.0], [2.0]]), (len(made.t), 1, 1)))
    assert along[0] == pytest.approx(2.0) and along[-1] == pytest.approx(2 * np.cos(0.4))
    (basis,) = made.basis
    assert not basis[: round(0.2 / 0.008)].any()
    assert not basis[-round(0.1 / 0.008) :, :-1].any() and basis.min() >= 0 < basis.max()
    stays = basis[:, -1]
    assert stays[0] == 0 and stays[-1] == pytest.approx(1) and np.ptp(stays[-9:]) < 1e-9
    assert made.share[0] == 1 > made.share[-1] > 0
    once = dataclasses.replace(made, goes_back=False).plan(made.first, 1)
    assert once.knots.columns["position_1"][-1] == position.max()


def test_an_uncertain_model_learns_less():
    """What vibrates is left where the robots disagree about its phase."""
    made = task()
    error = (np.sin(21.0 * made.t) * (made.t > 0.6))[:, None] * 1e-3
    sizes = []
    for spread in (0.01, 0.3):
        law = RigModel(made, Knowledge.of(known(spread=spread))).law
        assert len(law.responses) == 7
        sizes.append(np.abs(law.update(error)).max())
    assert sizes[1] < 0.8 * sizes[0]


def test_friction_is_given_before_a_joint_moves():
    v = np.zeros(1000)
    v[300:500], v[500:700] = 1.0, -1.0
    side = friction_side(v)
    assert side[280] > 0.9 and side[499] == pytest.approx(0.0, abs=0.1) and side[660] < -0.9
    assert not side[:200].any() and not side[750:].any() and not friction_side(0 * v).any()


def test_trials_get_better_and_what_is_best_is_kept(tmp_path):
    told = []
    made = learn(
        task(),
        NativeRig(tmp_path),
        2,
        known=known(off=1.02),
        progress=lambda what, part: told.append(part),
        done=lambda learned: output.save(learned, tmp_path, "native", True),
    )
    errors = [t.true_m for t in made.trials]
    assert made.complete and errors[0] > 5e-3
    assert min(errors[1:]) < errors[0] / 5 and max(errors) <= errors[0]
    for trial in made.trials:
        assert trial.sensed_rms_m == pytest.approx(trial.true_rms_m, rel=0.2, abs=2e-4)
    stored = fx.Run.read(made.trials[1].folder)
    assert stored.meta["learning"]["error_m"] == errors[1]
    assert np.nanmax(stored["sensor/true_tip_error"]) == errors[1]
    assert told[-1] == 1.0 and sorted(told) == told
    summary = json.loads((tmp_path / output.SUMMARY).read_text())
    assert [t["error_m"] for t in summary["trials"]] == errors
    assert summary["resolution"]["backlash_1_m"] == pytest.approx(4e-4)
    best = fx.load_manoeuvre(tmp_path / output.BEST, 1)
    played = np.array([best.drive.joints[0].motion(t)[0] for t in made.task.t])
    assert played == pytest.approx(made.best.references[:, 0], abs=1e-9)


@pytest.mark.slow
def test_worse_trials_are_left_and_end_the_learning(tmp_path):
    made = learn(task(), Drunken(tmp_path), 9, known=known())
    assert made.complete and "in a row" in made.ended
    assert len(made.trials) == made.best.number + 2
    assert made.trials[-1].note.startswith(f"from trial {made.best.number}, 0.5 of the change")


class Drunken(NativeRig):
    """A rig that gets looser with each trial."""

    def perform(self, plan, number, report):
        self.values = TRUE | {"stiffness": TRUE["stiffness"] * 0.8 ** max(number - 2, 0)}
        return super().perform(plan, number, report)


def test_what_is_finished_is_kept_when_a_trial_ends_early(tmp_path):
    made = learn(task(), NativeRig(tmp_path, fails_at=2), 5, known=known())
    assert len(made.trials) == 1 and made.interrupted and not made.complete
    assert made.ended == "interrupted" and made.best.number == 1

    class Refused(NativeRig):
        def perform(self, plan, number, report):
            raise RefusedToStart("not started")

    with pytest.raises(RefusedToStart):
        learn(task(), Refused(tmp_path), 5, known=known())


@pytest.mark.slow
def test_limits_hold_a_change_back(tmp_path):
    """The joint has to begin backwards, and its limit is just there."""
    setup = dataclasses.replace(SETUP, limits=((-5e-5, 1.6),))
    rig, settings = NativeRig(tmp_path), rigs.configuration(setup)
    made = learn(Task.of(setup, settings, swing(), goes_back=False), rig, 2, known=known())
    assert all(not plan.failed for plan in rig.plans)
    second = made.trials[1].note if len(made.trials) > 1 else ""
    assert made.ended == "the rig's limits allow no further change" or "limit: " in second


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rig-r", "--trials", "0"], "--trials"),
        (["rig-r", "rig-inverse-law"], "joint"),
        (["absent.toml"], "absent.toml"),
        (["rig-r", "--emulated", "--port", "x"], "--port"),
        (["rig-r", "fast.toml"], "the rig cannot do this"),
        (["rig-r", "--out", "full"], "results are there"),
        (["rig-r", "--model", "absent"], "absent"),
        (["rig-rr", "--gains", "rig"], "rig: kp_1_V_rad = 0.0: expected a gain above 0"),
    ],
)
def test_wrong_calls_end_in_one_line(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = 'duration_s = 1.0\n[[joint]]\nmotion = {kind="polynomial", end=1.5, duration_s=0.2}\n'
    (tmp_path / "fast.toml").write_text(text)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").write_text("")
    status, _, err = run(["learn", *arguments])
    assert status == 2 and said in err and err.count("\n") == 1, err
    assert {p.name for p in tmp_path.iterdir()} == {"fast.toml", "full"}
