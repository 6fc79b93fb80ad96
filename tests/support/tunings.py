"""A small tuning for the tests: one flexible link turned by a torque, 1 s."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import flexura as fx
from flexlab.tuning.executor import ThreadExecutor
from flexlab.tuning.history import History
from flexlab.tuning.search import search
from flexlab.tuning.search_space import free_gain
from flexlab.tuning.task import Task
from flexura.control.gains import Gains
from flexura.signals import Drive, JointDrive, Manoeuvre, step

LINK = {
    "length_m": 0.3,
    "elements": 2,
    "section": {"width_m": 0.02, "height_m": 0.001},
    "young_modulus_Pa": 2e11,
    "density_kg_m3": 7850.0,
    "damping": {"beta_s": 2e-4},
    "joint": {"type": "R", "hub_inertia_kg_m2": 1e-3},
}
ROBOT = fx.Robot.from_dict({"name": "one link", "link": [LINK], "payload": {"mass_kg": 0.02}})
SWING = Manoeuvre("a quarter", 1.0, 0.005, Drive((JointDrive(motion=step(np.pi / 4)),)))
GAINS = Gains(
    {"kp_1_N_m_rad": 2.0, "kd_1_N_m_s_rad": 0.1, "torque_max_1_N_m": 0.5, "setpoint_1_Hz": 3.0}
)
FREE = (
    free_gain("kp_1_N_m_rad", 0.1, 20),
    free_gain("kd_1_N_m_s_rad", 0.01, 2),
    free_gain("kf_1_N_m_m", -20, 20),
)


def task(**changes) -> Task:
    return Task(
        **({"robots": (ROBOT,), "manoeuvre": SWING, "gains": GAINS, "free": FREE} | changes)
    )


def tuned(one, how, folder=None, make_executor=None, generations=None):
    history = History.open(folder, one.digest(how.identity())) if folder else History("")
    with ThreadExecutor(one, 1) as runs:
        done = search(
            one,
            replace(how, generations=generations or how.generations),
            make_executor or runs,
            history,
            lambda h: None,
        )
    return history, done
