"""Reading and writing a robot file are each other's inverse."""

from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.io import is_name
from flexura.robot import renamed


def number(low, high, **options):
    return st.floats(low, high, allow_nan=False, **options)


def zero_or(low, high):
    return st.one_of(st.just(0.0), number(low, high))


def optional(**keys):
    return st.fixed_dictionaries({}, optional=keys)


@st.composite
def joints(draw):
    joint = draw(
        optional(
            hub_mass_kg=zero_or(1e-9, 100),
            hub_inertia_kg_m2=zero_or(1e-9, 100),
            rotor_inertia=zero_or(1e-9, 100),
            viscous_friction=zero_or(1e-9, 100),
            coulomb_friction=zero_or(1e-9, 100),
            locked=st.booleans(),
        )
    )
    joint["type"] = draw(st.sampled_from(["R", "Pa", "Pb"]))
    if joint["type"] != "R":
        joint["angle_rad"] = draw(number(-7, 7))
    return joint


@st.composite
def chains(draw):
    """Links whose joints start, and have their limits, on what they slide along."""
    chain = draw(st.lists(links(), min_size=1, max_size=5))
    for i, link in enumerate(chain):
        joint, (low, high) = link["joint"], (-1e4, 1e4)
        if i and joint["type"] == "Pa":
            before = chain[i - 1]
            low, high = 0.0, before["length_m"]
            if before["joint"]["type"] == "Pb":
                low = high - before["joint"]["start"]
            if high == 0:
                joint["type"], (low, high) = "R", (-1e4, 1e4)
                joint.pop("angle_rad")
        elif joint["type"] == "Pb":
            high = link["length_m"]
            low = 0.02 * high if link.get("elements") else 0.0
        if draw(st.booleans()) or joint["type"] != "R":
            start = low + (high - low) * draw(st.floats(0.25, 0.75))
            joint["start"] = start
            if draw(st.booleans()) and low < high:
                joint["limits"] = [(low + start) / 2, (start + high) / 2]
    return renamed({"link": chain})[0]["link"]


@st.composite
def along(draw, length, entry):
    """A list of entries with at_m from 0 to the length."""
    inner = draw(st.lists(st.floats(0.01, 0.99), max_size=4, unique=True))
    return [
        {"at_m": at} | draw(entry)
        for at in [0.0, *(length * part for part in sorted(inner)), length]
    ]


@st.composite
def links(draw):
    link = {"name": draw(st.text(max_size=20).filter(is_name)), "joint": draw(joints())}
    link["length_m"] = length = draw(number(1e-3, 1000))
    section = st.fixed_dictionaries({"width_m": number(1e-6, 10), "height_m": number(1e-7, 9e-4)})
    value = st.fixed_dictionaries({"value": number(1e-9, 1e6)})
    if draw(st.booleans()):
        link |= {
            "elements": 0,
            "length_m": draw(st.sampled_from([0.0, length])),
            "mass_kg": draw(zero_or(1e-9, 1e3)),
        }
        return link | draw(
            optional(centre_of_mass_m=number(-10, 10), inertia_kg_m2=zero_or(1e-9, 10))
        )
    link["elements"] = draw(st.integers(1, 200))
    if draw(st.booleans()):
        link["modes"] = draw(st.integers(1, min(14, 2 * link["elements"])))
    if draw(st.booleans()):
        link["section"] = draw(st.one_of(section, along(length, section)))
        link |= {
            "young_modulus_Pa": draw(number(1e3, 2e12)),
            "density_kg_m3": draw(number(10, 25000)),
        }
    else:
        for key in ("mass_per_length_kg_m", "bending_stiffness_N_m2"):
            link[key] = draw(st.one_of(number(1e-9, 1e6), along(length, value)))
    return link | draw(
        st.fixed_dictionaries(
            {},
            optional={"damping": optional(alpha_1_s=zero_or(1e-9, 1e6), beta_s=zero_or(1e-9, 10))},
        )
    )


def whole_meshes(tables):
    """What slides node by node keeps all nodes."""
    if tables.get("sliding") == "nodal":
        for link in tables["link"]:
            link.pop("modes", None)
    return tables


def suited(tables):
    """The robot, unless the weight that a link carries would stretch it."""
    try:
        return fx.Robot.from_dict(tables)
    except fx.InputError as error:
        if "inextensible" not in str(error):
            raise
        reject()


robots = (
    st.fixed_dictionaries(
        {"link": chains()},
        optional={
            "name": st.text(max_size=50).filter(is_name),
            "gravity_m_s2": st.lists(number(-1e3, 1e3), min_size=2, max_size=2),
            "stiffening": st.booleans(),
            "sliding": st.sampled_from(["continuous", "nodal"]),
            "payload": optional(mass_kg=zero_or(1e-9, 1e3), inertia_kg_m2=zero_or(1e-9, 1e3)),
        },
    )
    .map(whole_meshes)
    .map(suited)
)


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(robots)
def test_a_robot_is_read_back_as_it_was_written(tmp_path_factory, robot):
    path = tmp_path_factory.getbasetemp() / "round.toml"
    fx.save(robot, path, overwrite=True)
    assert fx.load(path) == robot
    assert fx.Robot.from_dict(robot.to_dict()) == robot
    assert fx.Robot.from_dict(robot.model_dump(mode="json")) == robot
    assert robot.replace({}) == robot
