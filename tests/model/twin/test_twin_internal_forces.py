"""Reactions of joints and forces along links against Exudyn: the forces of its joints, torque and
force of its cable elements, and the channels that the twin finds from Exudyn's accelerations."""

import exudyn as exu
import numpy as np
import pytest

import flexura as fx
from flexura import signals, twin
from robots import beam, rigid, robot

NEAR, LENGTH, ELEMENTS = 1e-3, 0.5, 16
T = np.linspace(0.0, 0.3, 4)
MIDDLES = [(k + 0.5) * LENGTH / ELEMENTS for k in (0, 3, 7, 8, 12)]  # of the twin's elements


@pytest.fixture
def built(monkeypatch):
    """The models that the twin builds; the last one is left in the run's last state."""
    kept, build = [], twin.solve.build

    def keep(*arguments, **keys):
        kept.append(build(*arguments, **keys))
        return kept[-1]

    monkeypatch.setattr(twin.solve, "build", keep)
    return kept


def objects(mbs, kind):
    count = mbs.systemData.NumberOfObjects()
    return [k for k in range(count) if mbs.GetObject(k)["objectType"] == kind]


def joint_forces(mbs):
    """Forces on the second body of every joint R; Exudyn's are those on the first."""
    joints = objects(mbs, "JointRevolute2D")
    found = [mbs.GetObjectOutput(k, exu.OutputVariableType.Force) for k in joints]
    return [-complex(x, y) for x, y, *_ in found]


def guide(mbs):
    """Multipliers of a prismatic joint: the force across its rail, and the moment."""
    (joint,) = objects(mbs, "JointPrismatic2D")
    return np.array(mbs.systemData.GetAECoordinates())[mbs.systemData.GetObjectLTGAE(joint)]


def element_outputs(mbs, what):
    """An output at the middle of each element."""
    middle = [LENGTH / ELEMENTS / 2, 0.0, 0.0]
    cables = objects(mbs, "ANCFCable2D")
    found = [mbs.GetObjectOutputBody(k, what, localPosition=middle) for k in cables]
    return np.array([np.ravel(x)[0] for x in found])


def sensors(link):
    kinds = ("bending_moment", "axial_force")
    return [
        {"name": f"{link}-{kind}-{k}", "kind": kind, "at_m": at}
        for kind in kinds
        for k, at in enumerate(MIDDLES)
    ]


def arm():
    one = beam(LENGTH, 0.3, 4.0, 8, hub_mass_kg=0.3, hub_inertia_kg_m2=0.02)
    one |= {"damping": {"beta_s": 1e-3}, "mass": [{"at_m": 0.25, "mass_kg": 0.1}]}
    two = beam(LENGTH, 0.2, 2.0, 8, start=0.6, hub_mass_kg=0.1, damping={"beta_s": 1e-3})
    two["joint"]["rotor_inertia_kg_m2"] = 0.01
    one["sensor"], two["sensor"] = sensors(1), sensors(2)
    made = robot(one, two, gravity=(0.0, -9.81), payload=0.1, payload_inertia=1e-3)
    return made.replace({"payload.centre_of_mass_m": [0.03, -0.02]})


def test_joints_and_beams_of_two_flexible_links(built):
    """To 1e-3 of the largest of its kind, on a smooth motion that does not ring the cables."""
    motion = [signals.polynomial(0.4, 0.5), signals.polynomial(-0.5, 0.5, start=0.6)]
    ours = fx.inverse(arm(), T, motion, rtol=1e-8, internal_forces=True)
    theirs = twin.simulate(arm(), T, fx.Drive.prescribed(*motion), elements=ELEMENTS)
    mbs = built[-1].mbs
    reaction = [ours[f"joint/{i}/reaction_x"] + 1j * ours[f"joint/{i}/reaction_y"] for i in (1, 2)]
    force = joint_forces(mbs)
    assert len(force) == 2 and theirs.complete
    for i in (0, 1):
        assert abs(force[i] - reaction[i][-1]) < NEAR * abs(force[0])
        rotor = 0.01 * motion[1](T[-1])[2] if i else 0.0
        moment = theirs[f"joint/{i + 1}/drive"][-1] - rotor
        assert ours[f"joint/{i + 1}/reaction_moment"][-1] == pytest.approx(
            moment, abs=NEAR * abs(theirs["joint/1/drive"]).max()
        )
    rows = [round(at / LENGTH * ELEMENTS - 0.5) for at in MIDDLES]
    outputs = exu.OutputVariableType
    torque = element_outputs(mbs, outputs.TorqueLocal).reshape(2, ELEMENTS)
    pull = element_outputs(mbs, outputs.ForceLocal).reshape(2, ELEMENTS)
    of = lambda kind, i, k: ours[f"sensor/{i + 1}-{kind}-{k}"][-1]
    for i in (0, 1):
        for k, row in enumerate(rows):
            near = NEAR * abs(torque[i]).max()
            assert of("bending_moment", i, k) == pytest.approx(torque[i, row], abs=near)
            if k:  # at the clamp a cable's stretch, a derivative of its cubics, is rough
                near = 5 * NEAR * abs(force[0])
                assert of("axial_force", i, k) == pytest.approx(pull[i, row], abs=near)


def test_a_slider_and_a_link_on_it(built):
    """The rail's force across it, and the joint R of a carriage with a flexible link."""
    carriage = rigid(0.1, 0.6, 0.05, 5e-4, type="Pa", angle_rad=0.7)
    strip = beam(LENGTH, 0.2, 2.0, 8, start=0.6, hub_mass_kg=0.1, damping={"beta_s": 1e-3})
    rig = robot(carriage, strip, gravity=(0.0, -9.81), payload=0.1)
    motion = [signals.polynomial(0.3, 0.5), signals.polynomial(-0.5, 0.5, start=0.6)]
    ours = fx.inverse(rig, T, motion, rtol=1e-8, internal_forces=True)
    theirs = twin.simulate(rig, T, fx.Drive.prescribed(*motion), elements=ELEMENTS)
    mbs = built[-1].mbs
    end = {name: values[-1] for name, values in ours.items()}
    across, moment = -guide(mbs)
    assert end["joint/1/reaction_across"] == pytest.approx(across, rel=NEAR)
    about_base = end["joint/1/reaction_moment"] + end["joint/1/position"] * across
    assert about_base == pytest.approx(-moment, rel=NEAR)
    assert end["joint/1/reaction_along"] == pytest.approx(theirs["joint/1/drive"][-1], rel=NEAR)
    assert end["joint/1/reaction_x"] == pytest.approx(end["joint/1/reaction_along"])
    (force,) = joint_forces(mbs)
    own = complex(end["joint/2/reaction_x"], end["joint/2/reaction_y"])
    assert abs(own - force) < NEAR * abs(force)


SENSED = [
    {"name": "acc", "kind": "acceleration", "at_m": 0.3},
    {"name": "slope", "kind": "slope", "at_m": 0.3},
    {"name": "gauge", "kind": "strain", "at_m": 0.3, "distance_m": 1e-3},
    {"name": "shear", "kind": "shear_force", "at_m": 0.31},
]


def wound():
    """A transmission between two links of which the first winds up, and a hub with a radius."""
    one = beam(LENGTH, 0.3, 4.0, 8, hub_inertia_kg_m2=0.01, damping={"beta_s": 1e-3})
    one["joint"] |= {
        "transmission": {"stiffness_N_m_rad": 50.0, "damping_N_m_s_rad": 0.2},
        "rotor_inertia_kg_m2": 0.02,
    }
    two = beam(LENGTH, 0.2, 2.0, 8, start=0.6, damping={"beta_s": 1e-3})
    two["joint"]["hub_radius_m"] = 0.05
    two["mass"] = [{"at_m": 0.25, "mass_kg": 0.1, "inertia_kg_m2": 1e-4}]
    two["sensor"] = SENSED
    made = robot(one, two, gravity=(0.0, -9.81), payload=0.1, payload_inertia=1e-3)
    return made.replace({"payload.centre_of_mass_m": [0.03, -0.02]})


def sleeved():
    """A flexible link in a sleeve on a rigid one that turns."""
    two = beam(LENGTH, 0.2, 2.0, 8, "Pb", start=0.3, hub_mass_kg=0.1, damping={"beta_s": 1e-3})
    two["joint"]["angle_rad"] = 0.2
    return robot(rigid(0.1, 0.6, 0.05, 5e-4, start=0.3), two, gravity=(0.0, -9.81), payload=0.1)


def ridden():
    """A slider on a flexible link that turns."""
    one = beam(LENGTH, 0.3, 4.0, 8, damping={"beta_s": 1e-3})
    two = rigid(0.1, 0.2, 0.05, 5e-4, type="Pa", start=0.2, angle_rad=0.5)
    return robot(one, two, gravity=(0.0, -9.81), payload=0.1)


MOVING = {
    "transmission": (wound, (0.4, -0.5), (0.0, 0.6), 1e-3),
    "sleeve": (sleeved, (0.8, 0.4), (0.3, 0.3), 3e-3),
    "slider": (ridden, (0.4, 0.3), (0.0, 0.2), 3e-3),
}


@pytest.mark.slow
@pytest.mark.parametrize(("made", "ends", "starts", "near"), MOVING.values(), ids=MOVING)
def test_the_twins_forces_of_any_joint(made, ends, starts, near):
    """All reactions, forces along links and sensors, under loads, of the largest of their unit: the
    twin has no convective term."""
    motion = [signals.polynomial(a, 0.5, start=b) for a, b in zip(ends, starts, strict=True)]
    loads = [fx.Load(2, None, (0.3, 0.0)), fx.Load(1, 0.05, moment_N_m=0.2, frame="link")]
    ours = fx.inverse(made(), T, motion, rtol=1e-8, internal_forces=True, loads=loads)
    drive = fx.Drive.prescribed(*motion)
    theirs = twin.simulate(made(), T, drive, elements=ELEMENTS, internal_forces=True, loads=loads)
    kinds = ("reaction", "moment", "force", "sensor")
    names = [name for name in theirs if any(kind in name for kind in kinds)]
    assert len(names) > 30 and set(names) <= set(ours)
    for name in names:
        unit = ours.units[name]
        scale = max(abs(ours[each]).max() for each in names if ours.units[each] == unit)
        assert abs(ours[name] - theirs[name]).max() < near * scale, name
