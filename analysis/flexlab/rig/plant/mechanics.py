"""The mechanics of the emulated rig in Exudyn: carriage, hub, strip and payload, step by step.

The strip consists of the twin's cable elements, without joints. The carriage does not turn, so that
its mass and the hub sit on the strip's first node; one constraint holds that node on the rail. Two
linear springs, implicit in Exudyn's step, drive carriage and hub. Their zeros are set before every
step. Backlash, friction and the stepper's magnetic spring are made of them.

Exudyn runs step by step (`MainSolverImplicitSecondOrder`: generalised alpha, spectral radius 0.9,
modified Newton) with its structures made once. The strip's axial stiffness is reduced to EA L^2 /
EI = 1e4 at most. Axial strains are then 1e-5, iterations fewer, and a few cable elements lock less.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

import flexura as fx
from flexura.errors import FlexuraError
from flexura.optional import Optional
from flexura.twin.links import CableLink, Frame, Ground, PointMass, beam_values, link_inertia

exu = Optional("exudyn")
eii = Optional("exudyn.itemInterface")

STEP_S = 5e-4
ELEMENTS = 3
AXIAL_RATIO = 1e4  # EA L^2 / EI
TOLERANCE = 3e-4  # of Newton's residual; at 1e-2 a free vibration no longer decays as it should
FOREVER_S = 1e7


class Mechanics:
    """Carriage and strip of a robot of type IV.

    `x_m`: carriage position along the rail, from its origin [m]. `angle_rad`: the strip's angle to
    the carriage [rad].
    """

    def __init__(
        self,
        robot: fx.Robot,
        position: tuple[float, float] = (0.0, 0.0),
        step_s: float = STEP_S,
        elements: int = ELEMENTS,
        sensor_m: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Build the robot at rest, the strip straight.

        Args:
            robot: a robot of type IV.
            position: carriage [m] and strip [rad] at the start.
            step_s: Exudyn's step [s].
            elements: cables of the strip.
            sensor_m: the part of the strip over which `bend_rad` integrates the curvature [m].
        """

        self.step_s, self.x_m, self.angle_rad = step_s, *position
        self._start, self._turned = position[0], robot.links[0].joint.angle_rad
        self._container = exu.SystemContainer()
        self._mbs = self._container.AddSystem()
        self._build(robot, position, elements)
        self._settings = _settings(step_s)
        solver: Any = exu.MainSolverImplicitSecondOrder()
        if not solver.InitializeSolver(self._mbs, self._settings):
            raise FlexuraError("Exudyn could not initialise the mechanics of the emulated rig")
        solver.it.currentStepSize = step_s
        self._solver = solver
        self._data = self._mbs.systemData
        self._reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        self._root_m = float(self._reference[0])
        self._sensor_ends = [
            _slope_at(s, robot.links[1].length_m / elements, elements) for s in sensor_m
        ]
        self._carriage_values = self._joint_values = 0.0, 0.0
        self._read()

    def _build(self, robot: fx.Robot, position: tuple[float, float], elements: int) -> None:

        mbs = self._mbs
        (carriage, strip), payload = robot.links, robot.payload
        rail = Frame(position[0], 0.0, carriage.joint.angle_rad)
        frame = rail.along(carriage.length_m, turn=position[1])
        values = beam_values(strip, elements)
        soft = AXIAL_RATIO * values.bending.mean() / strip.length_m**2
        values = dataclasses.replace(values, axial=np.minimum(values.axial, soft))
        joint = strip.joint
        hub = PointMass(_carriage_mass(robot), joint.hub_inertia_kg_m2 + joint.rotor_inertia)
        tip = PointMass(payload.mass_kg, payload.inertia_kg_m2)
        self.strip = CableLink(mbs, values, hub, tip, frame, robot.gravity_m_s2)
        root = self.strip.nodes[0]
        fixed = mbs.AddMarker(
            eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0)
        )
        along, across = (
            mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=root, coordinate=k)) for k in (0, 1)
        )
        mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=[fixed, across]))
        turns = mbs.AddNode(
            eii.NodeGenericData(initialCoordinates=[frame.angle], numberOfDataCoordinates=1)
        )
        self._carriage_spring = mbs.AddObject(
            eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=[fixed, along])
        )
        markers = [Ground.add(mbs).tip.marker, self.strip.origin.marker]
        self._joint_spring = mbs.AddObject(
            eii.ObjectConnectorTorsionalSpringDamper(markerNumbers=markers, nodeNumber=turns)
        )
        mbs.Assemble()

    def hold_carriage(self, stiffness: float, damping: float) -> None:
        """Set the carriage's spring [N/m, N s/m]; Exudyn renews its Jacobian if they change."""
        if (stiffness, damping) != self._carriage_values:
            self._carriage_values = stiffness, damping
            self._set(self._carriage_spring, stiffness, damping)

    def hold_joint(self, stiffness: float, damping: float) -> None:
        """Set the joint's spring [N m/rad, N m s/rad]."""
        if (stiffness, damping) != self._joint_values:
            self._joint_values = stiffness, damping
            self._set(self._joint_spring, stiffness, damping)

    def _set(self, spring: Any, stiffness: float, damping: float) -> None:
        self._mbs.SetObjectParameter(spring, "stiffness", stiffness)
        self._mbs.SetObjectParameter(spring, "damping", damping)

    def step(self, carriage_m: float, joint_rad: float) -> None:
        """Take one step.

        Args:
            carriage_m: zero of the carriage's spring [m].
            joint_rad: zero of the joint's spring [rad].

        Raises:
            FlexuraError: Exudyn's Newton iteration fails.
        """
        mbs, solver, settings = self._mbs, self._solver, self._settings
        mbs.SetObjectParameter(self._carriage_spring, "offset", carriage_m - self._start)
        mbs.SetObjectParameter(self._joint_spring, "offset", joint_rad + self._turned)
        solver.UpdateCurrentTime(mbs, settings)
        solver.InitializeStep(mbs, settings)
        if not solver.DiscontinuousIteration(mbs, settings):
            raise FlexuraError(
                f"Exudyn's solver gave up on a step of {self.step_s:g} s of the emulated rig's "
                f"mechanics"
            )
        solver.FinishStep(mbs, settings)
        self._read()

    def _read(self) -> None:
        q = self._values = (self._data.GetODE2Coordinates() + self._reference).tolist()
        self.x_m = q[0] - self._root_m + self._start
        angle = math.atan2(q[3], q[2]) - self._turned
        turns = (self.angle_rad - angle) / (2 * math.pi)
        self.angle_rad = angle if abs(turns) < 0.5 else angle + 2 * math.pi * round(turns)

    @property
    def bend_rad(self) -> float:
        """The strip's bend under the sensor: the angle between the tangents at its ends [rad]."""
        q, ((i, a, b, c, d), (j, e, f, g, h)) = self._values, self._sensor_ends
        x, y = (
            a * q[i] + b * q[i + 2] + c * q[i + 4] + d * q[i + 6],
            a * q[i + 1] + b * q[i + 3] + c * q[i + 5] + d * q[i + 7],
        )
        u, v = (
            e * q[j] + f * q[j + 2] + g * q[j + 4] + h * q[j + 6],
            e * q[j + 1] + f * q[j + 3] + g * q[j + 5] + h * q[j + 7],
        )
        return math.atan2(x * v - y * u, x * u + y * v)

    @property
    def tip_deflection_m(self) -> float:
        """Deflection of the strip's tip, across the hub's axis [m]."""
        q = self._values
        angle = math.atan2(q[3], q[2])
        return math.cos(angle) * (q[-3] - q[1]) - math.sin(angle) * (q[-4] - q[0])

    @property
    def tip_m(self) -> tuple[float, float]:
        """Position of the strip's tip in the base frame [m]."""
        return self._values[-4], self._values[-3]

    @property
    def energy_J(self) -> float:
        """Kinetic and strain energy [J], without gravity and springs."""
        q, v = np.array(self._values)[None, :], np.array(self._data.GetODE2Coordinates_t())[None, :]
        return float((self.strip.kinetic(q, v) + self.strip.strain(q))[0])


def _slope_at(x: float, size: float, elements: int) -> tuple[int, float, float, float, float]:
    """The slope vector r' at x [m] from the root, by Hermite's cubics.

    Returns:
        The index of its element's coordinates, and the weights of r, r', r, r'.
    """
    k = min(int(x / size), elements - 1)
    s = x / size - k
    # Hermite's cubics
    return (
        4 * k,
        6 * (s**2 - s) / size,
        1 - 4 * s + 3 * s**2,
        6 * (s - s**2) / size,
        3 * s**2 - 2 * s,
    )


def _carriage_mass(robot: fx.Robot) -> float:
    """Mass of the carriage with the hubs on it [kg].

    A rotor of joint 1 belongs to the motor, beyond the nut.
    """
    carriage, strip = robot.links
    return link_inertia(carriage).mass + carriage.joint.hub_mass_kg + strip.joint.hub_mass_kg


def _settings(step_s: float) -> Any:

    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.numberOfSteps = round(FOREVER_S / step_s)
    integration.endTime = integration.numberOfSteps * step_s
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = integration.newton.absoluteTolerance = TOLERANCE
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.adaptiveStep = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
    settings.solution.file.write = False
    settings.solution.solverInformationFileName = ""
    settings.solution.sensors.active = False
    return settings
