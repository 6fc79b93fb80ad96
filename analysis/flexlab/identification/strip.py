"""The strip as the flex sensor and the encoder of joint 2 see it, for given values of what is
unknown.

The carriage follows the motor behind the play, which the nut's give under the rail's friction
widens by 2 F/k; joint 2 hangs in the stepper's field about the angle of the pulses; the native
simulation of both gives the sensor's voltage,

    alpha = angle(s_0 + l) - angle(s_0),   sin angle = w'(s);   U = U_cc R_f / (R_0 + g k alpha (1 +
    n alpha) + R_f)

taken tau late (the mean of conversions, the board's ticks), its offset and slow drift projected
out: a polynomial of third degree over time. Both residuals are in units of their noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import flexura as fx
from flexura import signals
from flexura.signals import JointDrive

from ..comparison.replay import lead_screw
from ..comparison.replay.simulate_experiment import given
from ..comparison.replay.smoothing import from_rest, known, rest, smoothed
from ..comparison.replay.stepper_relaxation import Guess, held_by_field
from ..rig.description import Rig
from ..rig.emulation import Emulated
from ..rig.plant.flex_sensor import LOGIC_V
from ..rig.plant.stepper import MagneticSpring

DRIFT = 3  # degree of the polynomial that offset and drift may follow
MODES = 3
# what is left of the relaxation, of the holding torque: derivatives are differences of such
# simulations
STILL = 5e-5
METHOD, RTOL = "implicit", 1e-3  # the cheapest where data break the drives every 2 ms
FINE_S = 2e-3  # between two values of the stepper's torque that the relaxation corrects


class Strip:
    """One experiment's data and their simulation; `until_s` cuts them off. `friction`: of the rail,
    as a factor on its file's."""

    def __init__(
        self,
        experiment: fx.Run,
        rig: Rig,
        more: Emulated,
        robot: fx.Robot,
        friction: float = 1.0,
        until_s: float = np.inf,
    ) -> None:
        part = experiment.t <= experiment.t[0] + until_s
        self.t = experiment.t[part]
        self.rig, self.more, self.robot = rig, more, robot
        self._times = np.concatenate([rest(self.t), self.t])
        nut = smoothed(
            *from_rest(*known(self.t, experiment["joint/1/position"][part], "joint/1/position"))
        )
        self._nut_m = np.array([nut(at)[0] for at in self._times])
        self._friction = friction
        self.pulses, _ = given(experiment)
        self.flex_V, self.joint_rad = (
            experiment["link/2/flex_voltage"][part],
            experiment["joint/2/position"][part],
        )
        still = self.t < self.t[0] + 0.3
        self.flex_noise_V = max(float(np.nanstd(self.flex_V[still])), 1e-4)
        self.joint_noise_rad = 2 * np.pi / (4 * rig.stepper.encoder_pulses) / np.sqrt(12)
        self._guess = Guess(MagneticSpring(rig.stepper, more.stepper).on_N_m)

    def residuals(self, values: dict[str, float], elements: int | None = None) -> np.ndarray:
        """(2, T): flex voltage and joint 2, 0 where a sample is missing; `elements` of the strip
        instead of its file's."""
        run = self.simulate(values, elements)
        flex = (self.voltage(run, values) - self.flex_V) / self.flex_noise_V
        joint = (run["joint/2/position"] - self.joint_rad) / self.joint_noise_rad
        return np.stack([_without_drift(self.t, flex, DRIFT), _without_drift(self.t, joint, 0)])

    def simulate(
        self, values: dict[str, float], elements: int | None = None, rtol: float = RTOL
    ) -> fx.Run:
        """The native simulation at the experiment's times; `values`: factors on the files' figures,
        play [m], delays [s]."""
        times = self._times
        nut = self.more.carriage.model_copy(update={"backlash_m": values["backlash_m"]})
        x = lead_screw.behind(
            self._nut_m, lead_screw.play(nut, self._friction * values.get("give", 1.0))
        )
        moved = JointDrive(
            motion=signals.Signal(signals.table(times, x).segments[:-1]), prescribed=True
        )
        stepper = self.rig.stepper.model_copy(
            update={"holding_torque_N_m": self.rig.stepper.holding_torque_N_m * values["holding"]}
        )
        system = fx.assemble(driven(changed(self.robot, values), self.more, elements))
        q0 = system.start()
        q0[system.joint_rows] = x[0], self.pulses(times[0])[0]
        spring = MagneticSpring(stepper, self.more.stepper)
        run = held_by_field(
            (system, q0),
            times,
            moved,
            self.pulses,
            spring,
            rtol,
            guess=self._guess,
            fine_s=FINE_S,
            method=METHOD,
            still=STILL,
        )
        kept = slice(len(times) - len(self.t), None)
        channels = run.channels | {"link/2/bend": self._bend(system, run)}
        return fx.Run(
            self.t,
            {n: v[kept] for n, v in channels.items()},
            run.units | {"link/2/bend": "rad"},
            run.meta,
        )

    def _bend(self, system: fx.System, run: fx.Run) -> np.ndarray:
        """The bend under the sensor [rad] of a run that holds its states."""
        assert run.states is not None
        ends = np.array([self.more.flex.from_m, self.more.flex.from_m + self.rig.flex.length_m])
        low, high = system.angles(2, ends) @ run.states[:, : system.n].T
        return np.asarray(high - low)

    def voltage(self, run: fx.Run, values: dict[str, float]) -> np.ndarray:
        """The sensor's voltage (T,) without offset and noise."""
        from scipy.interpolate import CubicSpline

        flex, more = self.rig.flex, self.more.flex
        a = run["link/2/bend"]
        ohm = flex.straight_ohm + values["flex_gain"] * flex.ohm_per_rad * a * (
            1 + more.nonlinearity_1_rad * a
        )
        volts = LOGIC_V * flex.divider_ohm / (ohm + flex.divider_ohm)
        return CubicSpline(self.t, volts)(self.t - values["delay_s"])


def changed(robot: fx.Robot, values: dict[str, float]) -> fx.Robot:
    """The robot with factors on stiffness, damping, payload and, where given, the strip's `mass`;
    `gyration_m` of the payload."""
    strip = robot.links[1]
    heavy = "density_kg_m3" if strip.density_kg_m3 is not None else "mass_per_length_kg_m"
    given = "young_modulus_Pa" if strip.young_modulus_Pa is not None else "bending_stiffness_N_m2"
    mass = values["payload"] * robot.payload.mass_kg
    times = lambda key, factor: _times(robot.to_dict()["link"][1][key], factor)
    return robot.replace(
        {
            f"link.2.{given}": times(given, values["stiffness"]),
            f"link.2.{heavy}": times(heavy, values.get("mass", 1.0)),
            "link.2.damping.beta_s": values["damping"] * strip.damping.beta_s,
            "payload.mass_kg": mass,
            "payload.inertia_kg_m2": values["payload"] * robot.payload.inertia_kg_m2
            + mass * values.get("gyration_m", 0.0) ** 2,
        }
    )


def _times(value: Any, factor: float) -> Any:
    """A number of a robot file, or its list along the link, by a factor."""
    return (
        [entry | {"value": factor * entry["value"]} for entry in value]
        if isinstance(value, list)
        else factor * value
    )


def driven(robot: fx.Robot, more: Emulated, elements: int | None = None) -> fx.Robot:
    """The robot as it is simulated here: the strip's lowest modes, the stepper's damping in joint
    2."""
    strip = robot.links[1]
    return robot.replace(
        {
            "link.2.modes": MODES,
            "link.2.elements": elements or strip.elements,
            "link.2.joint.viscous_friction_N_m_s_rad": strip.joint.viscous_friction
            + more.stepper.damping_N_m_s,
        }
    )


def _without_drift(t: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """y (T,) less the polynomial of that degree that fits it best; 0 where there is no sample."""
    there = np.isfinite(y)
    A = np.polynomial.legendre.legvander(2 * (t - t[0]) / (t[-1] - t[0]) - 1, degree)
    Q, _ = np.linalg.qr(A[there])
    out = np.zeros(len(y))
    out[there] = y[there] - Q @ (Q.T @ y[there])
    return out
