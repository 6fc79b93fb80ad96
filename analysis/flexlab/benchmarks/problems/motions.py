"""The benchmark's motions: typical motions of planar robots with flexible links."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import flexura as fx

from .problem import Problem, Work
from .robots import (
    beam,
    boom,
    chain,
    damped,
    meshed,
    published_arm,
    rig,
    robot,
    sleeve,
    slider,
    strip,
    tokhi_arm,
    turning,
    two_strips,
    type_4,
    upright_arm,
    wrist,
)
from .signals import bang_bang, cycloid, harmonic, piecewise, spin_up


def times(end: float, steps: int) -> np.ndarray:
    """Output times from 0 to `end` [s], (steps + 1,)."""
    return np.linspace(0.0, end, steps + 1)


def rig_swing() -> list[fx.Signal]:
    """The rig's inverse manoeuvre: both joints along sines."""
    return [harmonic(0.012, 1.0, -np.pi / 2), harmonic(np.pi / 6, 1.0, -np.pi / 2)]


def one_link() -> list[Problem]:
    """Problems with one flexible link."""
    pulse = Work(force=[bang_bang(2.0, 1.0, 0.01), bang_bang(0.05, 1.0, 0.01)])
    swing = rig_swing()
    sampled = Work(motion=swing, kp=[900.0, 6.0], kd=[50.0, 0.15], rate_Hz=1000.0)
    jumps = Work(force=[piecewise([0.0, 0.2, 0.6, 1.0], [0.0, 0.3, -0.3, 0.0])])
    heavy = robot(
        [beam(0.6, 0.5, 0.2355, 8, turning(hub_inertia_kg_m2=2e-3), modes=4, **damped(1e-4))], 0.7
    )
    stiff = robot([strip(0.4, (0.025, 0.003), 4, turning(hub_inertia_kg_m2=1e-3))])
    falling = lambda stiffness, **keys: robot(
        [beam(1.0, stiffness, 0.3, 8, turning(), **keys)], gravity=True
    )
    friction = tokhi_arm(8, {"coulomb_friction_N_m": 0.05, "viscous_friction_N_m_s_rad": 0.01})
    cable = robot([beam(10.0, 1.4e4, 1.2, 8, turning())])
    return [
        Problem(
            "type4",
            "type IV (PaR), 2 modes, smooth bang-bang, undamped, 2 s",
            type_4(12, 2),
            times(2, 200),
            pulse,
            5,
            finer=type_4(12),
            finer_elements=16,
            exact=("explicit", 1e-9),
            required_ratio=550,
        ),
        Problem(
            "type4-mesh",
            "the same with all unknowns of 5 elements",
            type_4(5),
            times(2, 200),
            pulse,
            5,
            finer=type_4(12),
            finer_elements=16,
            exact=("explicit", 1e-9),
            required_ratio=500,
        ),
        Problem(
            "rig-pd",
            "the rig (PaR) under stiff PD, damped, 2 s",
            rig(5.4e-6),
            times(2, 200),
            Work(motion=swing, kp=[900.0, 6.0], kd=[50.0, 0.25]),
            4,
        ),
        Problem(
            "rig-sampled",
            "the rig, larger hub, controller sampled at 1 kHz",
            rig(1e-3),
            times(2, 200),
            sampled,
            4,
        ),
        Problem(
            "tokhi",
            "Tokhi's arm, torques that jump, lightly damped, 2 s",
            tokhi_arm(),
            times(2, 200),
            jumps,
            8,
        ),
        Problem(
            "resonance",
            "Tokhi's arm shaken near its first mode, 5 s",
            tokhi_arm(),
            times(5, 500),
            Work(force=[harmonic(0.02, 9.0, -np.pi / 2)]),
            8,
        ),
        Problem(
            "friction",
            "Tokhi's arm with Coulomb friction, 3 s",
            friction,
            times(3, 300),
            Work(force=[harmonic(0.2, 0.8, -np.pi / 2)]),
            8,
        ),
        Problem(
            "strip-jumps",
            "a stiff strip that rings after jumps, undamped, 1 s",
            stiff,
            times(1, 500),
            Work(force=[piecewise([0.0, 0.1, 0.2], [0.5, -0.5, 0.0])]),
            4,
            exact=("explicit", 1e-9),
            undamped=True,
        ),
        Problem(
            "payload",
            "soft arm, payload of 5 link masses, 4 modes, jumps, 4 s",
            heavy,
            times(4, 200),
            Work(force=[piecewise([0.0, 0.75, 1.5], [0.1, -0.1, 0.0])]),
            4,
            finer=meshed(heavy, 8),
            finer_elements=12,
        ),
        Problem(
            "pendulum",
            "flexible pendulum let go level, undamped, 3 s",
            falling(1.8),
            times(3, 300),
            Work(),
            8,
            exact=("explicit", 1e-9),
        ),
        Problem(
            "pendulum-long",
            "a stiffer, damped pendulum, 10 s",
            falling(9.0, **damped(1e-3)),
            times(10, 500),
            Work(),
            4,
            exact=("exponential", 1e-9),
        ),
        Problem(
            "spin-up",
            "Kane's spin-up, prescribed rotation, undamped, 20 s",
            cable,
            times(20, 200),
            Work(prescribed=[spin_up(6.0, 15.0)]),
            8,
            exact=("explicit", 1e-9),
        ),
    ]


def more_links() -> list[Problem]:
    """Problems with two to twelve flexible links, joints R."""
    steps = Work(
        force=[
            piecewise([0, 0.5, 1.0], [0.2, -0.2, 0.0]),
            piecewise([0, 0.5, 1.0], [0.1, -0.1, 0.0]),
        ]
    )
    reach = [cycloid(0.8, 1.0), cycloid(-0.6, 1.0)]
    follow = Work(motion=reach, kp=[40.0, 15.0], kd=[6.0, 2.0])
    raised = [cycloid(0.8, 1.0), cycloid(-1.0, 1.0), cycloid(0.6, 1.0)]
    upright = Work(motion=raised, kp=[3000.0, 1200.0, 400.0], kd=[60.0, 20.0, 5.0])
    bangs = lambda links: Work(
        force=[bang_bang(0.3 * (1 - k / links) ** 2, 1.0, 0.05) for k in range(links)]
    )
    slow = Work(motion=[cycloid(0.9, 40.0), cycloid(-1.2, 40.0)], kp=[6e4, 2e4], kd=[3e4, 1e4])
    return [
        Problem(
            "rr",
            "RR, 2 and 4 modes, smooth bang-bang, undamped, 2 s",
            two_strips(8, (2, 4)),
            times(2, 200),
            Work(force=[bang_bang(0.4, 1.5, 0.02), bang_bang(0.1, 1.5, 0.02)]),
            4,
            finer=two_strips(8),
            finer_elements=12,
            exact=("explicit", 1e-9),
        ),
        Problem(
            "arm-steps",
            "the published arm, 6+6 elements, jumps, undamped, 3 s",
            published_arm(6),
            times(3, 300),
            steps,
            6,
            exact=("explicit", 1e-9),
            undamped=True,
        ),
        Problem(
            "arm-pd",
            "the published arm, damped, under PD, 2 s",
            published_arm(4, 1e-3),
            times(2, 200),
            follow,
            4,
        ),
        Problem(
            "arm-inverse",
            "inverse dynamics of the published arm, damped, 2 s",
            published_arm(4, 1e-3),
            times(2, 200),
            Work(prescribed=reach),
            4,
            inverse=True,
        ),
        Problem(
            "rrr-gravity",
            "three links under gravity, stiff PD, damped, 2 s",
            upright_arm(4),
            times(2, 200),
            upright,
            4,
        ),
        Problem(
            "six-links",
            "six links, smooth bang-bang, damped, 2 s",
            chain(6, 3),
            times(2, 200),
            bangs(6),
            3,
        ),
        Problem(
            "twelve-links",
            "twelve links, smooth bang-bang, damped, 2 s",
            chain(12, 2),
            times(2, 200),
            bangs(12),
            2,
        ),
        Problem(
            "minute",
            "a 13 m boom of two links, slow PD, damped, 60 s",
            boom(),
            times(60, 600),
            slow,
            4,
        ),
    ]


def sliding() -> list[Problem]:
    """Problems in which a joint slides on a link."""
    pulses = lambda *size: Work(force=[bang_bang(a, 0.4, 0.02) for a in size])
    return [
        Problem(
            "rpa",
            "RPa: a slider along a flexible arm, damped, 0.8 s",
            slider(),
            times(0.8, 200),
            pulses(0.3, -0.1),
            8,
            hub_length_m=0.03,
            required_ratio=150,
        ),
        Problem(
            "rpb",
            "RPb: a strip through a turning sleeve, damped, 0.8 s",
            sleeve(),
            times(0.8, 200),
            pulses(0.1, 0.15),
            8,
            hub_length_m=0.06,
        ),
        Problem(
            "pbr",
            "PbR: an arm through a sleeve, a wrist, damped, 0.8 s",
            wrist(),
            times(0.8, 200),
            pulses(0.7, 0.016),
            4,
            hub_length_m=0.10,
            required_ratio=580,
        ),
    ]


def in_python() -> list[Problem]:
    """Problems driven by a Python function."""
    swing, kp, kd = rig_swing(), (900.0, 6.0), (50.0, 0.15)

    def open_loop(t: float) -> Any:
        return np.array([0.2 * math.sin(2 * math.pi * t), 0.08 * math.sin(3 * math.pi * t)])

    def feedback(t: float, position: Any, velocity: Any, tip_deflection: Any) -> Any:
        wanted, rate = 0.3 * math.sin(math.pi * t), 0.3 * math.pi * math.cos(math.pi * t)
        return np.array([2.0 * (wanted - position[0]) + 0.2 * (rate - velocity[0])])

    def controller() -> Any:
        last: list[Any] = []  # position and reference of the tick before

        def law(t: float, position: Any, velocity: Any, tip_deflection: Any) -> Any:
            wanted = np.array([signal(t)[0] for signal in swing])
            rate = 1000.0 * ((wanted - position) - (last[1] - last[0])) if last else np.zeros(2)
            last[:] = [np.array(position), wanted]
            return np.array(kp) * (wanted - position) + np.array(kd) * rate

        return law

    sines = Work(force=[harmonic(0.2, 1.0, -np.pi / 2), harmonic(0.08, 1.5, -np.pi / 2)])
    sine = Work(motion=[harmonic(0.3, 0.5, -np.pi / 2)], kp=[2.0], kd=[0.2])
    own = published_arm(4, 1e-3, 2)
    return [
        Problem(
            "python-time",
            "the published arm, a Python function f(t), 3 s",
            own,
            times(3, 300),
            Work(of_time=open_loop),
            4,
            finer=meshed(own, 8),
            finer_elements=12,
            same=sines,
        ),
        Problem(
            "python-law",
            "Tokhi's arm, a feedback law in Python, 2 s",
            tokhi_arm(4),
            times(2, 200),
            Work(of_state=feedback),
            4,
            same=sine,
        ),
        Problem(
            "python-tick",
            "rig-sampled with its law in Python",
            rig(1e-3),
            times(2, 200),
            Work(tick=controller, rate_Hz=1000.0),
            4,
            same=Work(motion=swing, kp=kp, kd=kd, rate_Hz=1000.0),
            needs="Sampled",
        ),
    ]


def all_motions() -> dict[str, Problem]:
    """The problems by their names."""
    return {p.name: p for p in one_link() + more_links() + sliding() + in_python()}
