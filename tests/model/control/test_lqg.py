"""LQG on sensors: what it brings about, what it refuses, and the measurements of a Sampled."""

import numpy as np
import pytest

import flexura as fx
import robots
from flexura.control import loop_figures
from flexura.errors import InputError
from flexura.signals import step

T = np.linspace(0, 2, 401)


def arm(modes=None, **joint):
    link = robots.beam(
        0.6, 0.2355, 0.5, 3, hub_inertia_kg_m2=2e-3, damping={"beta_s": 5e-4}, **joint
    )
    link["sensor"] = [{"name": "gauge", "kind": "strain", "at_m": 0.03, "distance_m": 5e-4}]
    link["sensor"] += [{"name": "tip", "kind": "acceleration", "at_m": 0.6}]
    return robots.robot(link | ({"modes": modes} if modes else {}), payload=0.05)


def controller(robot, **keys):
    given = {"position": 0.02, "deflection": 0.004, "damping": 0.05, "disturbance": 0.05}
    given |= {"noise": {"joint/1/position": 1e-4, "sensor/gauge": 1e-6}, "limit": 1.0}
    return fx.lqg(robot, [step(0.3)], 0.5, 500.0, **(given | keys))


def test_strain_feedback_from_a_design_on_two_modes_brings_the_whole_mesh_to_rest():
    law, design = controller(arm(modes=2))
    assert design.outputs == ("joint/1/position", "sensor/gauge") and len(design.F) == 6
    run = fx.simulate(arm(), T, law)
    late = T > 1.5
    assert np.abs(run["joint/1/position"][late] - 0.3).max() < 4e-3
    assert np.abs(run["link/1/tip_deflection"][late]).max() < 2e-3
    assert np.abs(run["joint/1/drive"]).max() <= 1.0
    pd = fx.PID(step(0.3), kp=2.0, kd=0.1, limit=1.0)
    plain = fx.simulate(arm(), T, fx.Controller((pd,), 500.0))
    assert np.abs(plain["link/1/tip_deflection"][late]).max() > 1e-2
    again = fx.simulate(arm(), T, law)  # the estimate begins anew
    assert np.array_equal(again["joint/1/position"], run["joint/1/position"])


def test_it_holds_what_gravity_bends():
    data = arm().to_dict() | {"gravity_m_s2": [0.0, -9.81]}
    heavy = fx.Robot.from_dict(data)
    law = fx.lqg(heavy, [0.0], 0.5, 500.0, position=0.02, disturbance=0.05)[0]
    run = fx.simulate(heavy, T[:101], law)
    assert np.abs(run["joint/1/position"]).max() < 1e-6


def test_a_sampled_gets_the_measurements_that_it_asks_for():
    seen = {}

    def law(t, position, velocity, tip_deflection, *, sensors, tip_deflections, q, qd):
        seen[t] = dict(sensors=dict(sensors), tips=tip_deflections, state=np.append(q, qd))
        return [0.2]

    run = fx.simulate(arm(), T[:41], fx.Sampled(law, 200.0))
    k = 35
    at = seen[min(seen, key=lambda t: abs(t - T[k]))]
    assert at["state"] == pytest.approx(run.states[k], rel=1e-5, abs=1e-7)
    for name in ("gauge", "tip"):
        assert at["sensors"][name] == pytest.approx(run[f"sensor/{name}"][k], rel=1e-4)
    assert at["tips"][-1] == pytest.approx(run["link/1/tip_deflection"][k], rel=1e-5)


def test_the_dissertations_model_measures_too():
    linear = fx.Robot.from_dict(arm().to_dict() | {"stiffening": False})
    law, _ = controller(arm(modes=2))
    run = fx.simulate(linear, T[:13], law)
    assert run.complete and run["joint/1/position"][-1] > 0.01


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"measure": ["sensor/tip"]}, "measure"),
        ({"measure": ["joint/1/position", "joint/1/position"], "noise": 1e-4}, "measure"),
        ({"noise": {"joint/1/position": 1e-4}}, "noise.sensor/gauge"),
        ({"noise": {"sensor/laser": 1e-4}}, "noise"),
        ({"limit": -1.0}, "limit"),
        ({"measure": ["sensor/gauge"], "noise": 1e-6}, "noise"),  # the joint is not seen
    ],
)
def test_what_cannot_be_is_refused(keys, key):
    with pytest.raises(InputError) as caught:
        controller(arm(), **keys)
    assert caught.value.key == key


def test_other_wrong_arguments_are_refused():
    with pytest.raises(InputError, match="reference"):
        fx.lqg(arm(), [None], 0.5)
    with pytest.raises(InputError, match="Signal"):
        fx.lqg(arm(), [lambda t: t], 0.5)
    with pytest.raises(InputError, match="hertz"):
        fx.lqg(arm(), [0.1], 0.5, 0.0)
    with pytest.raises(InputError, match="free to move"):
        fx.lqg(arm(locked=True), [None], 0.5)
    with pytest.raises(InputError, match="Design"):
        loop_figures(arm())
    with pytest.raises(InputError, match="keywords"):
        fx.Sampled(lambda t, *, laser: [0.0], 100.0)


def test_figures_as_table_and_plots(tmp_path):
    found = loop_figures(controller(arm(modes=2))[1])
    text = str(found)
    assert "joint/1/drive" in text and "delay [ms]" in text and len(text.splitlines()) == 2
    assert max(len(line) for line in text.splitlines()) <= 80
    for draw in (found.responses[0].bode, found.responses[0].nyquist):
        draw(tmp_path / "loop.svg")
        assert (tmp_path / "loop.svg").read_text().startswith("<?xml")
    with pytest.raises(InputError, match="ends with"):
        found.responses[0].nyquist(tmp_path / "loop.txt")
