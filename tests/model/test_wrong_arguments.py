"""Wrong types in every argument of every public function: an error that names the argument, never
one from inside."""

import inspect
import re
import warnings

import numpy as np
import pytest

import flexura as fx
from flexura import signals, twin
from flexura.control import lqr

RIG = "model/robots/rig.toml"
T = [0.0, 0.001]


class Thing:
    """Nothing that any function takes."""

    def __repr__(self) -> str:
        return "<a thing>"


WRONG = [
    None,
    Thing(),
    Thing,
    "text",
    b"bytes",
    True,
    -1,
    2.5,
    float("nan"),
    10**400,
    1j,
    [],
    ["a", "b"],
    [None, None],
    [1.0, 2.0, 3.0],
    [[1.0], [2.0, 3.0]],
    {"a": 1},
    {1, 2},
    np.zeros((2, 2)),
    np.array(["x"]),
    lambda: 0.0,
    lambda a: "text",
    fx.load(RIG),
    signals.constant(1.0),
    fx.Drive.none(5),
]
SIGNAL = signals.constant(1.0)
PID2 = (fx.PID(0.1), fx.PID(0.2))
STRIP = fx.Robot.from_dict(
    {"name": "strip", "link": [{"length_m": 0.6, "elements": 1, "joint": {"type": "R"}}
        | {"mass_per_length_kg_m": 0.2, "bending_stiffness_N_m2": 0.5}]}
)  # fmt: skip
RISE = signals.polynomial(0.1, 1.0)
RUN = fx.simulate(RIG, T, [0.1, 0.0])
BATCH = fx.Batch.vary(RIG, {"payload.mass_kg": [0.1]})

# Public functions with good arguments. Those of functions in the core's loop are short runs.
CALLS = {
    "simulate": (fx.simulate, {"robot": RIG, "t_eval": T, "drive": [0.1, 0.0], "q0": None}
        | {"qd0": None, "rtol": 1e-4, "method": "auto", "start": None, "continue_from": None}
        | {"until": None, "numerical_damping": True, "progress": None}
        | {"internal_forces": False}),
    "population": (fx.simulate, {"robot": BATCH, "t_eval": T, "drive": None, "q0": None}
        | {"qd0": None, "rtol": 1e-4, "method": "auto", "start": None, "channels": None}
        | {"numerical_damping": True, "progress": None, "reduce": None, "chunk": 2, "threads": 1}),
    "inverse": (fx.inverse, {"robot": RIG, "t_eval": T, "motion": [0.0, 0.0], "q0": None}
        | {"qd0": None, "rtol": 1e-4, "method": "auto", "start": None, "progress": None}
        | {"internal_forces": False}),
    "internal_forces": (fx.internal_forces, {"robot": RIG, "q": None, "qd": None, "qdd": None}
        | {"tip_force": (0.0, 0.0), "tip_moment": 0.0, "loads": None, "t": 0.0}),
    "twin": (twin.simulate, {"robot": RIG, "t_eval": T, "drive": [0.1, 0.0], "qd0": None}
        | {"start": None, "beam": "ancf", "elements": 4, "step_s": 5e-4, "hub_length_m": None}
        | {"progress": None}),
    "static": (fx.static, {"robot": RIG, "joints": None, "tip_force": (0.0, 0.0)}
        | {"tip_moment": 0.0}),
    "holding": (fx.holding, {"robot": RIG, "q": None}),
    "frequencies": (fx.frequencies, {"robot": RIG, "q": None, "joints": "locked"}
        | {"count": None, "qd": None}),
    "modes": (fx.modes, {"robot": RIG, "q": None, "joints": "locked", "count": None}),
    "frequency_response": (fx.frequency_response, {"robot": RIG, "drive": "joint/1/drive"}
        | {"channel": "tip/x", "frequencies_Hz": [1.0], "q": None}),
    "invert": (fx.invert, {"robot": STRIP, "t": [0.0, 1.0], "tip": RISE, "least_squares": False}
        | {"progress": None}),
    "inverse_kinematics": (fx.inverse_kinematics, {"robot": RIG, "tip": [0.3, 0.2]}
        | {"joints": None}),
    "feedforward": (fx.feedforward, {"run": RUN, "kp": 0.0, "kd": 0.0}),
    "parameter_derivatives": (fx.parameter_derivatives, {"robot": RIG, "t_eval": T}
        | {"drive": [0.1, 0.0], "parameters": ["payload.mass_kg"], "q0": None}),
    "time_optimal": (fx.time_optimal, {"robot": STRIP, "start": [0.0], "end": [0.5]}
        | {"limits": {"drive": [0.5]}, "robust": 0.0, "intervals": 20}),
    "line_path": (signals.paths.line, {"start": [0.0, 0.0], "end": [1.0, 0.0], "duration_s": 1.0}
        | {"at_s": 0.0}),
    "polyline": (signals.paths.polyline, {"points": [[0.0, 0.0], [1.0, 0.0]], "duration_s": 1.0}
        | {"at_s": 0.0}),
    "circle": (signals.paths.circle, {"centre": [0.0, 0.0], "radius": 1.0, "duration_s": 1.0}
        | {"start_rad": 0.0, "turn_rad": 1.0, "at_s": 0.0}),
    "linearize": (fx.linearize, {"robot": RIG, "q": None, "qd": None, "joints": "free"}),
    "assemble": (fx.assemble, {"robot": RIG}),
    "tip_pose": (fx.tip_pose, {"robot": RIG, "q": np.zeros(10)}),
    "line": (fx.assemble(RIG).line, {"q": np.zeros(10), "link": 2, "s": None}),
    "load": (fx.load, {"path": RIG}),
    "load_manoeuvre": (fx.load_manoeuvre, {"path": "model/manoeuvres/rig-step.toml", "joints": 2}),
    "lqr": (lqr, {"robot": RIG, "controller": fx.Controller(PID2), "effort": [1.0, 1.0]}
        | {"position": 1.0, "deflection": 1.0, "damping": 0.0, "disturbance": 1.0, "noise": 1e-4}
        | {"q": None}),
    "lqg": (fx.lqg, {"robot": RIG, "references": [SIGNAL] * 2, "effort": [1.0, 1.0]}
        | {"rate_Hz": 500.0}
        | {"measure": None, "limit": None, "follow": "joints", "position": 1.0, "deflection": 1.0}
        | {"damping": 0.0, "disturbance": 1.0, "noise": 1e-4, "q": None}),
    "nmpc": (fx.nmpc, {"robot": RIG, "references": [SIGNAL] * 2, "effort": [1.0, 1.0]}
        | {"rate_Hz": 500.0}
        | {"intervals": 4, "horizon_s": None, "spread": 1, "measure": None, "limit": None}
        | {"speed_limit": None, "deflection_limit": None, "follow": "tips", "position": 1.0}
        | {"deflection": 1.0, "damping": 0.0, "disturbance": 1.0, "noise": 1e-4, "q": None}),
    "Drive": (fx.Drive, {"joints": (fx.JointDrive(),), "meta": {}}),
    "Drive.none": (fx.Drive.none, {"joints": 2}),
    "Drive.pd": (fx.Drive.pd, {"motions": [SIGNAL], "kp": [1.0], "kd": [1.0], "t_s": None}),
    "JointDrive": (fx.JointDrive, {"force": None, "motion": None, "kp": 0.0, "kd": 0.0}
        | {"prescribed": False}),
    "Batch.of": (fx.Batch.of, {"robots": [fx.load(RIG)], "count": None, "seed": 0}),
    "Batch.vary": (fx.Batch.vary, {"robot": RIG, "changes": {"payload.mass_kg": [0.1]}}),
    "PID": (fx.PID, {f.name: f.default for f in list(fx.PID.__dataclass_fields__.values())[1:]}
        | {"reference": SIGNAL}),
    "Motor": (fx.Motor, {"force_per_V": 1.0, "damping": 1.0}),
    "Stepper": (fx.Stepper, {"stiffness": None, "damping": 0.0, "encoder": False}),
    "Controller": (fx.Controller, {"joints": PID2, "rate_Hz": 1000.0, "deflection_Hz": 50.0}
        | {"deflection_quantum_m": 0.0, "linear": None}),
    "Sampled": (fx.Sampled, {"function": lambda t: [0.0, 0.0], "rate_Hz": 100.0}),
    "Signal": (fx.Signal, {"segments": np.zeros((1, 10)), "spec": {}}),
    "constant": (signals.constant, {"value": 1.0}),
    "step": (signals.step, {"value": 1.0, "at_s": 0.0}),
    "harmonic": (signals.harmonic, {"amplitude": 1.0, "frequency_Hz": 1.0, "phase_rad": 0.0}
        | {"offset": 0.0}),
    "cycloid": (signals.cycloid, {"end": 1.0, "duration_s": 1.0, "start": 0.0, "at_s": 0.0}),
    "polynomial": (signals.polynomial, {"end": 1.0, "duration_s": 1.0, "start": 0.0, "at_s": 0.0}),
    "ramp": (signals.ramp, {"end": 1.0, "duration_s": 1.0, "start": 0.0, "at_s": 0.0}),
    "trapezoidal": (signals.trapezoidal, {"end": 1.0, "duration_s": 1.0, "rise_s": 0.1}
        | {"start": 0.0, "at_s": 0.0}),
    "bang_bang": (signals.bang_bang, {"amplitude": 1.0, "duration_s": 1.0, "rise_s": 0.0}
        | {"at_s": 0.0}),
    "table": (signals.table, {"t_s": [0.0, 1.0], "y": [0.0, 1.0]}),
    "piecewise": (signals.piecewise, {"at_s": [0.0, 1.0], "value": [0.0, 1.0]}),
    "zv": (signals.zv, {"signal": SIGNAL, "frequency_Hz": 1.0, "damping_ratio": 0.0}),
    "zvd": (signals.zvd, {"signal": SIGNAL, "frequency_Hz": 1.0, "damping_ratio": 0.0}),
    "ei": (signals.shaping.ei, {"signal": SIGNAL, "frequency_Hz": 1.0, "damping_ratio": 0.0}),
    "pulse": (signals.pulse, {"value": 1.0, "duration_s": 1.0, "at_s": 0.0}),
    "chirp": (signals.chirp, {"amplitude": 1.0, "start_Hz": 1.0, "end_Hz": 2.0, "duration_s": 1.0}
        | {"at_s": 0.0}),
    "noise": (signals.noise, {"rms": 1.0, "cutoff_Hz": 5.0, "duration_s": 1.0, "seed": 0}
        | {"at_s": 0.0}),
    "delayed": (signals.delayed, {"signal": SIGNAL, "by_s": 1.0}),
    "sum": (signals.sum, {"signals": [SIGNAL]}),
    "matched_cycloid": (signals.matched_cycloid, {"end": 1.0, "frequency_Hz": 1.0, "periods": 2}
        | {"start": 0.0, "at_s": 0.0}),
}  # fmt: skip
CASES = [(name, argument) for name, (_, good) in CALLS.items() for argument in good]
# as many of the one as of the other; the one must fit into the other
PAIRS = {"t_s": "y", "at_s": "value", "rate_Hz": "horizon_s"}


@pytest.mark.parametrize("name, argument", CASES, ids=[f"{n}-{a}" for n, a in CASES])
def test_a_wrong_argument_is_named(name, argument):
    """A text in place of a robot is the name of a file, which the error then names."""
    function, good = CALLS[name]
    for value in WRONG:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                function(**(good | {argument: value}))
            except (TypeError, ValueError, fx.InputError) as error:
                said = str(error)
                names = "|".join([argument.rstrip("s"), PAIRS.get(argument, argument)])
                named = re.search(rf"\b({names})", said) or said.startswith("text: ")
                assert named, f"{value!r}: {type(error).__name__}: {said}"


def test_every_public_function_is_tried():
    tried = {function for function, _ in CALLS.values()}
    public = {getattr(fx, n) for n in fx.__all__ if inspect.isfunction(getattr(fx, n))}
    public |= set(signals.KINDS.values())
    assert public - tried <= {fx.save}


def test_the_good_arguments_are_good():
    for function, good in CALLS.values():
        function(**good)


def test_a_batch_of_no_robots_is_refused():
    with pytest.raises(fx.InputError, match=r"changes = .*at least one"):
        fx.Batch.vary(RIG, {"payload.mass_kg": []})


@pytest.mark.parametrize(
    "function",
    [lambda *a: [0.1, 0.0], lambda t, *a: [0.1, 0.0], lambda t, p, v, w=0.0: [0.1, 0.0]],
)
def test_a_function_that_gathers_its_arguments_is_a_drive(function):
    t = [0.0, 0.1]
    asked = fx.simulate(RIG, t, lambda t, p, v, w: [0.1, 0.0])
    np.testing.assert_array_equal(fx.simulate(RIG, t, function)["tip/x"], asked["tip/x"])
    assert fx.simulate(RIG, t, fx.Sampled(function, 100.0)).complete


@pytest.mark.parametrize("place", [None, 3, ["a"]])
def test_a_place_that_is_no_path_is_named(place):
    run = fx.Run(np.zeros(2) + [0, 1], {"a": np.zeros(2)}, {"a": "m"})
    robot = fx.load(RIG)
    calls = {
        "folder": lambda: run.save(place),
        "path": lambda: fx.save(robot, place),
        "out": lambda: run.animate(place),
    }
    for key, call in calls.items():
        with pytest.raises(fx.InputError, match="expected a path") as caught:
            call()
        assert caught.value.key == key
    with pytest.raises(fx.InputError, match="channel = 3: expected a name"):
        run.plot(3)
    with pytest.raises(fx.InputError, match="robot: expected a Robot"):
        fx.save(None, "a.toml")
    with pytest.raises(fx.InputError, match="folder"):
        fx.Run.read(place)


def test_what_is_no_table_and_no_key_of_a_robot_is_named():
    robot = fx.load(RIG)
    with pytest.raises(fx.InputError, match="changes = 3: expected values by key"):
        robot.replace(3)
    for call in (lambda: robot.value(3), lambda: robot.replace({3: 1.0})):
        with pytest.raises(fx.InputError, match="key = 3: expected the key of a value"):
            call()
    with pytest.raises(fx.InputError, match="data = 3: expected the tables of a robot file"):
        fx.Robot.from_dict(3)


def test_drives_where_motions_are_expected_and_manoeuvres_where_drives_are():
    t, one = np.linspace(0, 0.1, 3), "single-r"
    drive = fx.Drive.prescribed(0.1)
    with pytest.raises(fx.InputError, match="motion = 'Drive': expected motions, one entry"):
        fx.inverse(one, t, drive)
    asked = fx.load_manoeuvre("rig-step", 2)
    for call in (fx.simulate, fx.inverse):
        with pytest.raises(fx.InputError, match="= 'Manoeuvre': expected"):
            call("rig", t, asked)
