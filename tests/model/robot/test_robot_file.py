"""Robot files: what is accepted, and a robot that is frozen, replaced and saved."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.control import load_gains
from robot_files import ABSENT, BASE, BY_NUMBER, CART, COMPLETE, STRIP, changed

ROOT = Path(__file__).resolve().parents[3]
ROBOTS = sorted((ROOT / "model" / "robots").glob("*.toml"))
MANOEUVRES = sorted((ROOT / "model" / "manoeuvres").glob("*.toml"))


def test_a_file_with_every_key_loads(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(COMPLETE)
    robot = fx.load(path)
    assert robot.structure == "PaR" and robot.name == "rig (type IV, PaR)"
    carriage, strip = robot.links
    assert (
        carriage.flexible,
        carriage.mass_kg,
        carriage.centre_of_mass_m,
        carriage.inertia_kg_m2,
    ) == (False, 0.6, 0.05, 5e-4)
    assert carriage.joint.limits == (-0.05, 0.15)
    assert (strip.elements, strip.modes, strip.section.height_m, strip.damping.beta_s) == (
        4,
        3,
        0.001,
        2e-4,
    )
    assert (robot.payload.mass_kg, robot.gravity_m_s2, robot.stiffening, robot.sliding) == (
        0.02,
        (0.0, 0.0),
        True,
        "continuous",
    )
    assert np.allclose(strip.mass_per_length([0.0, 0.3]), 7850 * 0.02 * 0.001)
    assert np.allclose(strip.bending_stiffness(0.1), 2e11 * 0.02 * 0.001**3 / 12)
    assert np.allclose(strip.axial_stiffness(0.1), 2e11 * 0.02 * 0.001)


EVERY_KEY = {
    "name": "x",
    "gravity_m_s2": [0.0, -9.81],
    "stiffening": False,
    "sliding": "nodal",
    "link.1.name": "x",
    "link.1.length_m": 0.0,
    "link.1.elements": 0,
    "link.1.mass_kg": 0.0,
    "link.1.centre_of_mass_m": -0.01,
    "link.1.inertia_kg_m2": 0.0,
    "link.1.joint.angle_rad": 1.5,
    "link.1.joint.hub_mass_kg": 0.1,
    "link.1.joint.hub_inertia_kg_m2": 0.1,
    "link.1.joint.rotor_mass_kg": 0.1,
    "link.1.joint.viscous_friction_N_s_m": 0.1,
    "link.1.joint.coulomb_friction_N": 0.1,
    "link.1.joint.limits_m": [-1, 1],
    "link.1.joint.start_m": 0.01,
    "link.1.joint.locked": True,
    "link.2.elements": 200,
    "link.2.modes": 8,
    "link.2.section": [
        {"at_m": 0.0, "width_m": 0.02, "height_m": 0.002},
        {"at_m": 0.3, "width_m": 0.01, "height_m": 0.001},
    ],
    "link.2.young_modulus_Pa": 7e10,
    "link.2.density_kg_m3": 2700,
    "link.2.damping": {"alpha_1_s": 0.1},
    "payload.mass_kg": 0.5,
    "payload.inertia_kg_m2": 0.1,
}


@pytest.mark.parametrize("path", EVERY_KEY)
def test_every_key_is_read_written_and_replaced(path, tmp_path):
    robot = fx.Robot.from_dict(changed({path: EVERY_KEY[path]}))
    assert robot == fx.Robot.from_dict(BASE).replace({path: EVERY_KEY[path]})
    value = robot
    for part in path.split("."):
        value = value[int(part) - 1] if isinstance(value, list) else getattr(value, part)
    plain = value.model_dump(exclude_defaults=True) if hasattr(value, "model_dump") else value
    plain = (
        [v.model_dump(exclude_none=True) for v in value]
        if isinstance(value, list)
        else list(value)
        if isinstance(value, tuple)
        else plain
    )
    assert plain == EVERY_KEY[path]
    fx.save(robot, tmp_path / "robot.toml")
    assert fx.load(tmp_path / "robot.toml") == robot


def test_a_link_may_be_given_by_numbers_or_by_lists_of_numbers():
    robot = fx.Robot.from_dict(changed(BY_NUMBER))
    taper = [{"at_m": 0.0, "value": 0.3}, {"at_m": 0.1, "value": 0.1}, {"at_m": 0.3, "value": 0.2}]
    lists = fx.Robot.from_dict(changed(BY_NUMBER | {STRIP + "mass_per_length_kg_m": taper}))
    assert (
        robot.links[1].mass_per_length(0.2) == 0.157 and robot.links[1].axial_stiffness(0.2) is None
    )
    assert np.allclose(lists.links[1].mass_per_length([0.05, 0.1, 0.2]), [0.2, 0.1, 0.15])
    assert lists.links[1].breaks() == [0.0, 0.1, 0.3]


def test_a_rigid_link_may_have_its_mass_from_a_section_and_a_density():
    spread = {
        "section": {"width_m": 0.02, "height_m": 0.01},
        "density_kg_m3": 2700.0,
        "mass_kg": ABSENT,
    }
    changes = {CART + key: value for key, value in spread.items()}
    changes |= {CART + "centre_of_mass_m": ABSENT, CART + "inertia_kg_m2": ABSENT}
    link = fx.Robot.from_dict(changed(changes)).links[0]
    assert not link.flexible and np.isclose(link.mass_per_length(0.05), 0.02 * 0.01 * 2700)


def test_whole_numbers_stand_for_numbers_and_a_byte_order_mark_is_skipped(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_bytes(
        b"\xef\xbb\xbf" + COMPLETE.replace("7850.0", "7850").replace("\n", "\r\n").encode()
    )
    assert fx.load(path) == fx.Robot.from_dict(BASE)


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_the_robots_that_come_along_load_and_assemble(path, tmp_path):
    robot = fx.load(path)
    system = fx.assemble(robot)
    assert robot.name and system.n >= len(robot.links)
    assert np.linalg.eigvalsh(system.mass(system.start())).min() > 0
    fx.save(robot, tmp_path / "again.toml")
    assert fx.load(tmp_path / "again.toml") == robot


@pytest.mark.parametrize("path", MANOEUVRES, ids=lambda path: path.stem)
def test_the_manoeuvres_that_come_along_load_for_a_robot_that_comes_along(path):
    joints = len(tomllib.loads(path.read_text())["joint"])
    fitting = [
        robot
        for robot in ROBOTS
        if path.stem.startswith(robot.stem) or robot.stem.startswith(path.stem)
    ]
    fitting = [robot for robot in fitting if len(fx.load(robot).links) == joints]
    for robot in fitting or [r for r in ROBOTS if len(fx.load(r).links) == joints]:
        manoeuvre = fx.load_manoeuvre(path, len(fx.load(robot).links))
        assert manoeuvre.name and manoeuvre.t[-1] == manoeuvre.duration_s
        break
    else:
        pytest.fail(f"no robot with {joints} joints")


def test_a_robot_is_frozen():
    robot = fx.Robot.from_dict(BASE)
    with pytest.raises(Exception, match="frozen"):
        robot.name = "another"
    with pytest.raises(Exception, match="frozen"):
        robot.links[1].length_m = 1.0
    with pytest.raises(Exception, match="frozen"):
        robot.payload.mass_kg = 1.0


def test_replacing_leaves_the_robot_as_it_was_and_checks_the_new_one():
    robot = fx.Robot.from_dict(BASE)
    heavier = robot.replace(
        {"payload.mass_kg": 0.1, "link.2.length_m": 0.4, "link.2.section.height_m": 0.002}
    )
    assert robot == fx.Robot.from_dict(BASE)
    assert (
        heavier.payload.mass_kg,
        heavier.links[1].length_m,
        heavier.links[1].section.height_m,
    ) == (0.1, 0.4, 0.002)
    assert heavier.replace({"link.2.modes": None}).links[1].modes is None
    with pytest.raises(fx.InputError, match=r"payload\.mass_kg = -1"):
        robot.replace({"payload.mass_kg": -1.0})
    with pytest.raises(fx.InputError, match="did you mean length_m"):
        robot.replace({"link.2.lenght_m": 1.0})


@pytest.mark.parametrize(
    "path",
    [
        "link.0.length_m",
        "link.3.length_m",
        "link.-1.length_m",
        "link.x.length_m",
        "link.0",
        "link.9" + "9" * 30,
    ],
)
def test_replacing_counts_links_from_1(path):
    with pytest.raises(fx.InputError, match="expected a number from 1 to 2") as caught:
        fx.Robot.from_dict(BASE).replace({path: 0.1})
    assert caught.value.key == path


def test_replacing_in_a_list_without_entries_is_refused():
    with pytest.raises(fx.InputError, match="there are no entries to count") as caught:
        fx.Robot.from_dict(BASE).replace({"link.2.mass.1.mass_kg": 0.1})
    assert caught.value.key == "link.2.mass.1.mass_kg"


@pytest.mark.parametrize("path", ["name.x", "link.2.name.x", "payload.mass_kg.x"])
def test_replacing_inside_a_value_is_refused(path):
    with pytest.raises(fx.InputError, match="isn't a table"):
        fx.Robot.from_dict(BASE).replace({path: 0.1})


def test_a_robot_file_that_is_there_is_replaced_only_if_that_is_asked_for(tmp_path):
    robot, path = fx.Robot.from_dict(BASE), tmp_path / "robot.toml"
    path.write_text("# mine\n")
    with pytest.raises(fx.InputError, match=r"robot\.toml: a file is there.*overwrite=True"):
        fx.save(robot, path)
    assert path.read_text() == "# mine\n"
    fx.save(robot, path, overwrite=True)
    assert fx.load(path) == robot


@pytest.mark.parametrize("name", ["robot.csv", "robot", "robot.toml.txt"])
def test_a_robot_file_ends_with_toml(name, tmp_path):
    with pytest.raises(fx.InputError, match=r"path = .*: expected a name that ends with \.toml"):
        fx.save(fx.load("rig"), tmp_path / name)
    with pytest.raises(fx.InputError, match=r"ends with \.toml"):
        load_gains("rig").write(tmp_path / name)
    assert not any(tmp_path.iterdir())


def test_saving_writes_the_whole_file_or_leaves_the_old_one(tmp_path, monkeypatch):
    robot, path = fx.Robot.from_dict(BASE), tmp_path / "new" / "robot.toml"
    fx.save(robot, path)
    before = path.read_bytes()

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(fx.InputError, match="disk full"):
        fx.save(robot.replace({"name": "another"}), path, overwrite=True)
    assert path.read_bytes() == before and [p.name for p in path.parent.iterdir()] == ["robot.toml"]
