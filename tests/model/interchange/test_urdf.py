"""URDF files: public robots and random chains against an own computation in space, what is refused,
what bends, and the way back."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.errors import InputError
from flexura.interchange import read_urdf, urdf

FILES = sorted((Path(__file__).parent / "urdf").glob("*.urdf"))
DOWN = np.array([0.0, 0.0, -9.81])


def floats(element, key, default):
    return np.array([float(x) for x in (element.get(key) or default).split()])


def frame(element):
    """A homogeneous transform (4, 4) from an element's <origin>."""
    out, origin = np.eye(4), element.find("origin")
    if origin is not None:
        out[:3, 3] = floats(origin, "xyz", "0 0 0")
        for axis, angle in zip(np.eye(3), floats(origin, "rpy", "0 0 0"), strict=True):
            turn = about(axis, angle)
            out[:3, :3] = turn @ out[:3, :3]
    return out


def about(axis, angle):
    """Rodrigues' formula."""
    x = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * x + (1 - math.cos(angle)) * x @ x


def in_space(path, theta):
    """M, the gravity forces and their derivatives of a URDF's chain at theta, {joint: position}:
    by the Jacobians of each body in space, with nothing of flexura."""
    root = ET.fromstring(
        "".join(x for x in path.read_text().splitlines(True) if "<?xml" not in x).replace(
            ' xmlns="http://drake.mit.edu"', ""
        )
    )
    joints = root.findall("joint")
    links = {link.get("name"): link for link in root.findall("link")}
    names, count = list(theta), len(theta)
    M, g, K = np.zeros((count, count)), np.zeros(count), np.zeros((count, count))
    children = {j.find("child").get("link") for j in joints}
    base = ({j.find("parent").get("link") for j in joints} | set(links)) - children
    waiting = [(name, np.eye(4), []) for name in base]
    while waiting:
        name, at, moved = waiting.pop()
        inertial = links[name].find("inertial") if name in links else None
        if inertial is not None and moved:
            own = at @ frame(inertial)
            I = np.diag([float(inertial.find("inertia").get(k)) for k in ("ixx", "iyy", "izz")])
            for i, j, key in ((0, 1, "ixy"), (0, 2, "ixz"), (1, 2, "iyz")):
                I[i, j] = I[j, i] = float(inertial.find("inertia").get(key) or 0)
            I = own[:3, :3] @ I @ own[:3, :3].T
            m = float(inertial.find("mass").get("value"))
            v, w = np.zeros((3, count)), np.zeros((3, count))
            for joint, axis, place, slides in moved:
                k = names.index(joint)
                v[:, k] = axis if slides else np.cross(axis, own[:3, 3] - place)
                w[:, k] = 0.0 if slides else axis
            M += m * v.T @ v + w.T @ I @ w
            g -= m * v.T @ DOWN
            for n, (one, *_) in enumerate(moved):
                for other, *_ in moved[n:]:
                    i, j = names.index(one), names.index(other)
                    K[i, j] -= m * DOWN @ np.cross(w[:, i], v[:, j])
                    K[j, i] = K[i, j]
        for j in joints:
            if j.find("parent").get("link") != name:
                continue
            to, kind = at @ frame(j), j.get("type")
            more = moved
            if kind != "fixed":
                axis = floats(j.find("axis"), "xyz", "1 0 0")
                axis, x, step = axis / np.linalg.norm(axis), theta[j.get("name")], np.eye(4)
                more = [*moved, (j.get("name"), to[:3, :3] @ axis, to[:3, 3], kind == "prismatic")]
                if kind == "prismatic":
                    step[:3, 3] = x * axis
                else:
                    step[:3, :3] = about(axis, x)
                to = to @ step
            waiting.append((j.find("child").get("link"), to, more))
    return M, g, K


def theta_of(found, q):
    """Positions of the file's joints at q (n,) of the robot."""
    return {j.name: j.sense * (x - j.offset) for j, x in zip(found.joints, q, strict=True)}


def in_robot(found, M, g, K):
    S = np.diag([j.sense for j in found.joints])
    return S @ M @ S, S @ g, S @ K @ S


def close(a, b):
    assert np.abs(a - b).max() <= 1e-10 * max(np.abs(b).max(), 1e-3)


def positions(found, random):
    """Random positions inside the limits."""
    ends = [link.joint.limits or (-3.0, 3.0) for link in found.robot.links]
    return np.array([random.uniform(low, high) for low, high in ends])


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_public_robots_have_the_masses_and_forces_of_the_file(path):
    found, random = read_urdf(path), np.random.default_rng(5)
    system = fx.assemble(found.robot)
    for _ in range(5):
        q = positions(found, random)
        M, g, _ = in_robot(found, *in_space(path, theta_of(found, q)))
        close(system.mass(q), M)
        close(system.gravity(q), g)


HANGING = {
    "acrobot": [0.0, 0.0],
    "cart_pole": [0.0, 0.0],
    "rrbot": [math.pi, 0.0],
    "ur5_planar": [0.0, 0.0, 0.0],
}


@pytest.mark.parametrize("stem", HANGING)
def test_public_robots_swing_at_the_frequencies_of_the_file(stem):
    """Hanging: det(K - w^2 M) = 0 of the own computation."""
    (path,) = [p for p in FILES if p.stem == stem]
    found = read_urdf(path)
    system = fx.assemble(found.robot)
    near = zip(found.joints, HANGING[stem], strict=True)
    q = np.array([j.sense * x + j.offset for j, x in near])
    if stem == "ur5_planar":
        q = np.array([-math.pi / 2, 0.0, 0.0])
    for _ in range(8):  # cameras and hands are beside the line of the links
        q = q - np.linalg.lstsq(system.tangent(q), system.gravity(q))[0]
    M, g, K = in_robot(found, *in_space(path, theta_of(found, q)))
    assert np.abs(g).max() < 1e-9
    w2 = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    expected = np.sqrt(np.maximum(w2, 0.0)) / (2 * math.pi)
    assert expected[-1] > 0.1
    close(fx.frequencies(found.robot, q, joints="free"), expected)


def random_chain(path, random):
    """A planar chain of three to five joints, turned anyhow in space, with links fixed to it."""
    count = random.integers(3, 6)
    rows = ['<robot name="random"><link name="base"/>']
    before = "base"
    turned = random.uniform(-3, 3, 3)
    for k in range(count):
        I = np.diag(random.uniform(0.01, 0.02, 3))
        axes = about(np.array([0, 0, 1.0]), random.uniform(-3, 3))
        I = axes @ I @ axes.T
        for name, mass in ((f"a{k}", random.uniform(1, 2)), (f"b{k}", random.uniform(0.1, 0.2))):
            xyz = " ".join(map(repr, random.uniform(-0.3, 0.3, 3).tolist()))
            rows.append(
                f'<link name="{name}"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
                f'<inertia ixx="{I[0, 0]}" iyy="{I[1, 1]}" izz="{I[2, 2]}" ixy="{I[0, 1]}"/>'
                f"</inertial></link>"
            )
        slides = random.random() < 0.4
        kind = "prismatic" if slides else "revolute"
        angle = random.uniform(-3, 3)
        axis = f"{math.cos(angle)!r} {math.sin(angle)!r} 0" if slides else "0 0 1"
        axis = axis if slides or random.random() < 0.5 else "0 0 -2"
        xyz = " ".join(map(repr, random.uniform(-0.5, 0.5, 3).tolist()))
        rpy = f"0 0 {random.uniform(-3, 3)!r}" if k else " ".join(map(repr, turned.tolist()))
        fixed = " ".join(map(repr, random.uniform(-3, 3, 3).tolist()))
        rows.append(
            f'<joint name="j{k}" type="{kind}"><parent link="{before}"/><child link="a{k}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
            f'<limit lower="-0.5" upper="0.6" effort="1" velocity="1"/></joint>'
            f'<joint name="f{k}" type="fixed"><parent link="a{k}"/><child link="b{k}"/>'
            f'<origin xyz="0.1 0.2 0.3" rpy="{fixed}"/></joint>'
        )
        before = f"a{k}"
    path.write_text("".join([*rows, "</robot>"]))
    return path


@pytest.mark.parametrize("seed", range(12))
def test_random_chains_in_space_have_the_masses_and_forces_of_the_file(seed, tmp_path):
    random = np.random.default_rng(seed)
    path = random_chain(tmp_path / "robot.urdf", random)
    found = read_urdf(path)
    system = fx.assemble(found.robot)
    for _ in range(3):
        q = positions(found, random)
        M, g, _ = in_robot(found, *in_space(path, theta_of(found, q)))
        close(system.mass(q), M)
        close(system.gravity(q), g)


def rigid_robot(gravity):
    """All kinds of joints and masses that a rigid robot has."""
    return fx.Robot.from_dict(
        {
            "name": "all",
            "gravity_m_s2": gravity,
            "link": [
                {
                    "length_m": 0.5,
                    "mass_kg": 1.0,
                    "centre_of_mass_m": [0.2, 0.1],
                    "inertia_kg_m2": 0.02,
                    "joint": {"type": "Pa", "angle_rad": 0.4, "hub_mass_kg": 0.3},
                },
                {
                    "length_m": 0.4,
                    "mass_kg": 0.8,
                    "inertia_kg_m2": 0.01,
                    "mass": [{"at_m": 0.1, "mass_kg": 0.2, "inertia_kg_m2": 1e-3}],
                    "joint": {
                        "type": "R",
                        "start_rad": 0.2,
                        "limits_rad": [-1.0, 2.0],
                        "hub_radius_m": 0.03,
                        "hub_mass_kg": 0.4,
                        "hub_inertia_kg_m2": 1e-3,
                        "viscous_friction_N_m_s_rad": 0.2,
                        "coulomb_friction_N_m": 0.1,
                    },
                },
                {
                    "length_m": 0.6,
                    "mass_kg": 0.5,
                    "inertia_kg_m2": 0.02,
                    "joint": {
                        "type": "Pb",
                        "angle_rad": -0.7,
                        "start_m": 0.3,
                        "limits_m": [0.1, 0.5],
                        "hub_mass_kg": 0.25,
                        "hub_inertia_kg_m2": 2e-3,
                    },
                },
                {
                    "name": "elbow",
                    "length_m": 0.2,
                    "mass_kg": 0.3,
                    "inertia_kg_m2": 1e-3,
                    "joint": {"type": "R", "start_rad": 0.8, "locked": True},
                },
                {
                    "length_m": 0.25,
                    "mass_kg": 0.2,
                    "inertia_kg_m2": 1e-3,
                    "joint": {"type": "Pa", "start_m": 0.1, "angle_rad": 1.1},
                },
            ],
            "payload": {"mass_kg": 0.4, "inertia_kg_m2": 2e-3, "centre_of_mass_m": [0.05, -0.02]},
        }
    )


@pytest.mark.parametrize("gravity", [[0.0, -9.81], [0.0, 0.0], [9.81, 0.0], [-5.886, 7.848]])
def test_a_robot_comes_back_from_its_urdf_with_its_masses_and_tip(gravity, tmp_path):
    robot, path = rigid_robot(gravity), tmp_path / "all.urdf"
    text, left_out = urdf(robot)
    assert left_out == []
    path.write_text(text)
    found = read_urdf(path)
    assert found.robot.structure == "PaRPbPb" and found.left_out == []
    first, second = fx.assemble(robot), fx.assemble(found.robot)
    random = np.random.default_rng(2)
    free = ~first.locked
    for _ in range(4):
        q = np.array([random.uniform(0.1, 0.18) for _ in robot.links])
        q[3] = robot.links[3].joint.start
        theta = q[free]  # a URDF's positions are the robot's
        eta = np.array([j.sense * x + j.offset for j, x in zip(found.joints, theta, strict=True)])
        close(second.mass(eta), first.mass(q)[np.ix_(free, free)])
        close(second.gravity(eta), first.gravity(q)[free])
        close(second.mass(eta), in_robot(found, *in_space(path, theta_of(found, eta)))[0])
        here = [abs(complex(*fx.tip_pose(s, x)[:2])) for s, x in ((first, q), (second, eta))]
        assert here[1] == pytest.approx(here[0], abs=1e-12)
    joint = found.robot.links[1].joint
    assert joint.viscous_friction == 0.2 and joint.coulomb_friction == 0.1
    assert np.diff(joint.limits) == pytest.approx(3.0)


def test_what_a_urdf_does_not_say_of_a_robot_is_told():
    text, left_out = urdf("rig")
    assert "strip" in text
    assert left_out == [
        "link strip bends: it is written as rigid",
        "joint joint_2: the rotor's inertia",
    ]


SECTIONS = """
[link_1]
elements = 4
bending_stiffness_N_m2 = 30.0
damping = { beta_s = 1e-4 }

[link_2]
elements = 3
modes = 2
section = { width_m = 0.05, height_m = 0.02 }
young_modulus_Pa = 7e10
density_kg_m3 = 2700.0
joint = { hub_mass_kg = 0.2 }
"""


def test_a_table_of_sections_makes_links_bend(tmp_path):
    """SCARA: what is fixed to the flexible last link hangs at its tip."""
    text = next(p for p in FILES if p.stem == "scara").read_text()
    path, table = tmp_path / "scara.urdf", tmp_path / "table.toml"
    path.write_text(text)
    table.write_text(SECTIONS)
    found = read_urdf(path, table)
    one, two = found.robot.links
    assert one.mass_per_length_kg_m == pytest.approx(6.5 / 0.5, rel=1e-12)
    assert (one.elements, one.damping.beta_s) == (4, 1e-4)
    assert (two.elements, two.modes, two.joint.hub_mass_kg) == (3, 2, 0.2)
    load = found.robot.payload
    assert load.mass_kg == 4.0  # quill and gripper
    assert load.centre_of_mass_m == pytest.approx((0.0, -0.03 * 1.5 / 4), abs=1e-12)
    distance = 0.03
    between = 2.5 * 1.5 / 4 * distance**2
    assert load.inertia_kg_m2 == pytest.approx(0.0021 + 0.0025 + between, rel=1e-12)
    # its straight links are rods
    rods = found.robot.to_dict()
    for link, mass in zip(rods["link"], (6.5, 2700.0 * 0.05 * 0.02 * two.length_m), strict=True):
        length, joint = link["length_m"], link["joint"]
        link.clear()
        link |= {"length_m": length, "joint": joint}
        link |= {"mass_kg": mass, "inertia_kg_m2": mass * length**2 / 12}
    system, rods = fx.assemble(found.robot), fx.assemble(fx.Robot.from_dict(rods))
    rows = system.joint_rows
    close(system.mass(system.start())[np.ix_(rows, rows)], rods.mass(rods.start()))


def test_a_link_that_bends_in_its_sleeve_keeps_a_part_outside(tmp_path):
    path = edited(tmp_path, 'type="continuous"', 'type="prismatic"')
    text = path.read_text().replace(
        'name="elbow" type="continuous"', 'name="elbow" type="prismatic"'
    )
    text = text.replace('"0 1 0"', '"0 0 -1"').replace(
        "<dynamics", '<limit lower="-0.2" upper="0.6"/>\n    <dynamics'
    )
    path.write_text(text)
    table = tmp_path / "table.toml"
    table.write_text("[lower_link]\nelements = 3\nbending_stiffness_N_m2 = 40.0\nlength_m = 1.0\n")
    robot = read_urdf(path, table).robot
    sleeved = robot.links[1]
    assert robot.structure == "PaPb" and sleeved.length_m == 1.0
    assert sleeved.joint.limits == pytest.approx((0.2, 1.0))
    assert sleeved.mass_per_length_kg_m == 1.0
    table.write_text("[lower_link]\nelements = 3\nbending_stiffness_N_m2 = 40.0\nlength_m = 0.7\n")
    with pytest.raises(InputError, match=r"lower_link = 0\.7: expected a length_m of 0\.8 or more"):
        read_urdf(path, table)


def edited(tmp_path, old, new, stem="acrobot"):
    text = next(p for p in FILES if p.stem == stem).read_text()
    assert old in text
    path = tmp_path / "robot.urdf"
    path.write_text(text.replace(old, new, 1))
    return path


DOCTYPE = '<!DOCTYPE robot [<!ENTITY a "aaaa">]>\n<robot name="acrobot"'
REFUSED = [
    (
        '<axis xyz="0 1 0"/>\n    <dynamics',
        '<axis xyz="1 0 0"/>\n    <dynamics',
        "joint elbow.*90 degrees",
    ),
    (
        'name="elbow" type="continuous"',
        'name="elbow" type="floating"',
        "joint elbow: type.*floating",
    ),
    ('<parent link="upper_link"/>', '<parent link="base_link"/>', "joint elbow.*serial.*shoulder"),
    ('<parent link="upper_link"/>', '<parent link="nobody"/>', "joint elbow: <parent>.*nobody"),
    (
        '<parent link="upper_link"/>',
        '<parent link="lower_link"/>',
        "joint elbow.*no way leads from link world",
    ),
    ('<mass value="1"/>', '<mass value="heavy"/>', "link upper_link: <mass> value.*heavy"),
    ('<mass value="1"/>', "", "link upper_link: <inertial>.*<mass>"),
    ('<mass value="1"/>', '<mass value="-1"/>', "link upper_link: mass.*0 or more"),
    ('xyz="0 0 -0.5"', 'xyz="0 0"', "link upper_link: <origin> xyz.*3 finite numbers"),
    ('iyy="0.083"', 'iyy="nan"', "link upper_link: <inertia> iyy"),
    ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "joint shoulder: <axis>.*direction"),
    ("</robot>", "</rowboat>", "line 38: not XML"),
    ('<robot name="acrobot"', DOCTYPE, "line 3: a document type"),
    ('<dynamics damping="0.1"/>', '<mimic joint="elbow"/>', "joint shoulder: <mimic>"),
    ('<link name="base_link"/>', '<xacro:macro name="x"/>', "a xacro file"),
    ('type="continuous"', 'type="prismatic"', "joint shoulder: <limit>.*missing"),
    ('name="elbow"', 'name="shoulder"', "joint shoulder.*another name"),
]


@pytest.mark.parametrize(("old", "new", "said"), REFUSED, ids=range(len(REFUSED)))
def test_what_is_no_serial_planar_chain_is_refused_with_the_reason(old, new, said, tmp_path):
    path = edited(tmp_path, old, new)
    if 'axis xyz="1 0 0"' in new:  # the second joint's
        text = path.read_text().replace('xyz="1 0 0"', 'xyz="0 1 0"')
        path.write_text(text[::-1].replace('"0 1 0"'[::-1], '"1 0 0"'[::-1], 1)[::-1])
    with pytest.raises(InputError, match=said) as caught:
        read_urdf(path)
    assert str(path) in str(caught.value)


def test_a_mass_beside_a_link_that_bends_is_refused(tmp_path):
    path = edited(tmp_path, '<origin xyz="0 0.1 0.9"/>', '<origin xyz="0 0.1 0.9"/>', "rrbot")
    table = tmp_path / "table.toml"
    table.write_text("[link3]\nelements = 2\nbending_stiffness_N_m2 = 100.0\n")
    with pytest.raises(InputError, match=r"link link3.*camera_link.*0\.05 m beside"):
        read_urdf(path, table)
    table.write_text("[link9]\nelements = 2\n")
    with pytest.raises(InputError, match="link9: expected a link that moves: link2, link3"):
        read_urdf(path, table)
    table.write_text("[link3]\nelments = 2\n")
    with pytest.raises(InputError, match=r"link3\.elments"):
        read_urdf(path, table)
