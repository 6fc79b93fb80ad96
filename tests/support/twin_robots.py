"""Robots for the twin's tests, and what they are compared with."""

from scipy.integrate import solve_ivp

from flexura.robot import Robot, renamed

STEEL = {
    "section": {"width_m": 0.03, "height_m": 0.001},
    "young_modulus_Pa": 2.0e11,
    "density_kg_m3": 7850.0,
}
G = 9.81


def robot(*links, gravity=(0.0, 0.0), payload=0.0, payload_inertia=0.0, **keys):
    data = {
        "link": list(links),
        "gravity_m_s2": gravity,
        "payload": {"mass_kg": payload, "inertia_kg_m2": payload_inertia},
    } | keys
    return Robot.from_dict(renamed(data)[0])  # joints may have keys without a unit


def rigid(length, mass, centre, inertia, type="R", **joint):
    body = {"mass_kg": mass, "centre_of_mass_m": centre, "inertia_kg_m2": inertia}
    return {"length_m": length, "joint": {"type": type} | joint} | body


def beam(length, mass, stiffness, type="R", elements=4, beta=0.0, **joint):
    return {
        "length_m": length,
        "elements": elements,
        "mass_per_length_kg_m": mass,
        "bending_stiffness_N_m2": stiffness,
        "damping": {"beta_s": beta},
        "joint": {"type": type} | joint,
    }


def bench_arm(**joint):
    return robot(beam(0.6, 0.2355, 0.5, hub_inertia_kg_m2=2e-3, **joint), payload=0.05)


def rig():
    return robot(
        rigid(0.10, 0.60, 0.05, 5e-4, "Pa"),
        {
            "length_m": 0.3,
            "elements": 4,
            **STEEL,
            "section": {"width_m": 0.02, "height_m": 0.001},
            "damping": {"beta_s": 2e-4},
            "joint": {"type": "R", "rotor_inertia_kg_m2": 5.4e-6},
        },
        payload=0.02,
    )


def total_energy(run):
    return run["energy/kinetic"] + run["energy/strain"] + run["energy/potential"]


def integrate(rates, y0, t):
    return solve_ivp(rates, (0.0, t[-1]), y0, method="DOP853", t_eval=t, rtol=1e-11, atol=1e-12).y
