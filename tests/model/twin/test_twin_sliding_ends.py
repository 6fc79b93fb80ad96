"""Drives, friction and ends of joints that slide in the twin."""

import numpy as np
import pytest

from flexura import signals
from flexura.errors import FlexuraError, InputError
from flexura.signals import Drive
from robots import beam, rigid, robot
from twin_runs import let_go, soft


def test_pd_control_as_data_and_as_a_function_and_the_sensed_deflection():
    seen = []
    drive = Drive.pd([None, signals.cycloid(0.6, 0.3, start=0.5)], [0.0, 300.0], [0.0, 20.0])

    def function(t, position, velocity, tip):
        seen.append(tip)
        return drive(t, position, velocity)

    arm = robot(
        rigid(0.2, 0.5, 0.1, 0.01, start=0.4, locked=True),
        beam(
            0.9,
            0.5,
            20.0,
            4,
            "Pb",
            start=0.5,
            angle_rad=0.3,
            coulomb_friction=0.05,
            viscous_friction=0.5,
            rotor_inertia=0.1,
        ),
        gravity=(0.0, -2.0),
        payload=0.1,
    )
    t = np.linspace(0, 0.3, 31)
    one, two = (
        let_go(arm, t, each, hub_length_m=0.0675, step_s=5e-4) for each in (drive, function)
    )
    for name in ("joint/2/position", "joint/2/drive", "link/2/tip_deflection"):
        assert abs(one[name] - two[name]).max() < 1e-6 * abs(one[name]).max(), name
    assert seen[-1] == pytest.approx(two["link/2/tip_deflection"][-1], rel=1e-6)


def test_friction_stops_a_link_in_its_sleeve():
    arm = robot(beam(0.8, 1.0, 50.0, 4, "Pb", start=0.4, coulomb_friction=0.8, hub_mass_kg=5.0))
    t = np.linspace(0, 0.6, 61)
    run = let_go(arm, t, qd0=[0.4], hub_length_m=0.06)
    moving = t < 0.38
    assert run["joint/1/velocity"][moving] == pytest.approx(
        0.4 - t[moving], abs=1e-4
    )  # 0.8 N on 0.8 kg
    assert abs(run["joint/1/velocity"][t > 0.42]).max() < 1e-3 and run["joint/1/position"][
        -1
    ] == pytest.approx(0.48, abs=1e-3)


@pytest.mark.parametrize(
    ("arm", "speeds", "joint"),
    [
        (robot(beam(0.5, 0.5, 20.0, 4, "Pb", start=0.45)), [1.0], 1),
        (robot(beam(0.5, 0.5, 20.0, 4, "Pb", start=0.1)), [-1.0], 1),
        (
            robot(beam(0.5, 0.5, 20.0, 4), rigid(0.0, 0.1, 0.0, 0.0, "Pa", start=0.45)),
            [0.0, 1.0],
            2,
        ),
        (
            robot(beam(0.5, 0.5, 20.0, 4), rigid(0.0, 0.1, 0.0, 0.0, "Pa", start=0.05)),
            [0.0, -1.0],
            2,
        ),
    ],
)
def test_sliding_off_the_end_is_an_error_with_its_time(arm, speeds, joint, capfd):
    with pytest.raises(
        FlexuraError, match=rf"joint {joint} slid off the end of its link at t = 0\.(05|1)"
    ):
        let_go(arm, [0.0, 0.2], qd0=speeds)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("change", "arguments", "key"),
    [
        ({"link.1.joint.start": 0.0}, {}, r"link\[1\]\.joint\.start"),
        ({"link.1.joint.start": 0.91}, {}, r"link\[1\]\.joint\.start"),
        ({"link.2.joint.start": -0.1}, {}, r"link\[2\]\.joint\.start"),
        ({}, {"beam": "ge"}, "beam"),
        ({}, {"hub_length_m": 0.0}, "hub_length_m"),
    ],
)
def test_what_cannot_slide_is_refused_by_name(change, arguments, key):
    with pytest.raises(InputError, match=key):
        let_go(soft().replace(change), [0.0, 0.1], **arguments)
