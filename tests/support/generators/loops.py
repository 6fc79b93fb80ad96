"""Generated robots under sampled laws with limits: what one method finds, others find too.

A drive that jumps a thousand times a second shakes modes that no step of "auto" would follow. What
the damping of such modes does to the motion is seen beside small explicit steps only.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.control import lqr
from flexura.signals import step

from .robots import robot
from .trial import SAME, Count, end_of, faults_of, kind_of

TICKS, END, TIMES = 100, 0.1, 21  # of a run: ticks, or the end [s] that comes first
RATES_HZ = (200.0, 1000.0, 1000.0, 5000.0)
METHODS = (("auto", 1e-6), ("exponential", 1e-6), ("implicit", 1e-6))
TIGHT = (("explicit", 1e-7), ("implicit", 1e-8))  # the first that gets to the end
STEPS = 8000  # of a run


def loop(rng: np.random.Generator, system: fx.System) -> fx.Controller:
    """A PID a joint, or an LQR: bandwidths of 0.3 to 10 Hz of the rigid robot, limits that are met
    in half of the cases."""
    q = system.start()
    inertia = np.diag(system.mass(q))[system.joint_rows]
    laws = []
    for i, (row, size) in enumerate(zip(system.joint_rows, inertia, strict=True)):
        omega = 2 * np.pi * float(10 ** rng.uniform(-0.5, 1))
        link = system.robot.links[i]
        reach = 0.1 if link.joint.type == "R" else 0.05 * link.length_m
        asked = size * omega**2 * reach
        laws.append(
            fx.PID(
                step(float(q[row] + reach * rng.choice([-1.0, 1.0]))),
                kp=size * omega**2,
                kd=size * omega * float(rng.uniform(0.5, 2)),
                ki=size * omega**3 * float(rng.choice([0.0, 0.1])),
                limit=asked * float(10 ** rng.uniform(-1, 1)),
                derivative_Hz=float(rng.choice([0.0, 50.0])),
            )
        )
    controller = fx.Controller(tuple(laws), rate_Hz=float(rng.choice(RATES_HZ)))
    if rng.random() < 0.4:
        efforts = [law.limit for law in laws]
        try:
            return lqr(system, controller, efforts, position=0.1, deflection=0.01)[0]
        except fx.FlexuraError:  # no stabilising law
            return controller
    return controller


def by_methods(seed: int) -> Count:
    """A closed loop by small explicit steps and by each other method.

    Where those are too many, implicit steps to 1e-8 take their place. The paths of the tip are
    apart by no more than SAME of the largest deflection or of a thousandth of the path, or by ten
    times what steps to a hundredfold tolerance miss.
    """
    rng, out = np.random.default_rng([seed, 9]), Count(robots=1)
    try:
        system = fx.assemble(fx.Robot.from_dict(robot(rng) | {"stiffening": True}))
        law = loop(rng, system)
        t = np.linspace(0, min(END, TICKS / law.rate_Hz), TIMES)
        run = lambda method, rtol: fx.simulate(
            system, t, law, method=method, rtol=rtol, start="straight", max_steps=STEPS
        )
        method, rtol = TIGHT[0]
        tight = run(method, rtol)
        if not tight.complete:
            method, rtol = TIGHT[1]
            tight = run(method, rtol)
        out.ends["beside " + (method if tight.complete else f"nothing: {end_of(tight)}")] += 1
        if not tight.complete:
            return out
        loose = run(method, 100 * rtol)
        found = {method: run(method, rtol) for method, rtol in METHODS}
    except fx.FlexuraError as error:
        out.refused[kind_of(error)] += 1
        return out
    allowed = max(SAME, 10 * apart(loose, tight))
    for method, other in found.items():
        out.wrong += [f"loop {seed}: {method}: {text}" for text in faults_of(other, 0.0)]
        if not other.complete:
            out.ends[f"{method}: {end_of(other)}"] += 1
        elif not (far := apart(other, tight)) <= allowed:
            out.wrong.append(f"loop {seed}: {method} is {far:.1e} off, {allowed:.1e} expected")
        else:
            out.ends[f"{method} alike"] += 1
    return out


def apart(one: fx.Run, other: fx.Run) -> float:
    """The largest distance of both tips, of the largest deflection or a thousandth of the path."""
    if not one.complete:
        return 0.0
    path = max(np.ptp(other["tip/x"]), np.ptp(other["tip/y"]))
    bent = [np.abs(other[n]).max() for n in other if n.endswith("tip_deflection")]
    scale = max([1e-3 * path, *bent, 1e-12])
    return float(max(np.abs(one[n] - other[n]).max() for n in ("tip/x", "tip/y")) / scale)
