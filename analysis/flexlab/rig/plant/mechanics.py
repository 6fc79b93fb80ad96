"""The mechanics of the emulated rig in Exudyn: its links, hubs and payload, step by step.

The flexible links consist of the twin's cable elements, without joints. A rigid carriage does not
turn, so that its mass and the hub sit on the strip's first node; one constraint holds that node on
the rail. Links that turn on each other share a point (a revolute joint). One linear spring a joint,
implicit in Exudyn's step, drives it. Its zero is set before every step. Backlash, friction and the
stepper's magnetic spring are made of these springs.

Exudyn runs step by step (`MainSolverImplicitSecondOrder`: generalised alpha, spectral radius 0.9)
with its structures made once. The links' axial stiffness is reduced to EA L^2 /
EI = 1e4 at most. Axial strains are then 1e-5, iterations fewer, and a few cable elements lock less.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

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
    """The links of a robot PaR (its carriage rigid), RR or R (flexible links).

    `positions`: of the joints [m, rad].
    """

    def __init__(
        self,
        robot: fx.Robot,
        position: Sequence[float] = (0.0, 0.0),
        step_s: float = STEP_S,
        elements: int = ELEMENTS,
        sensor_m: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Build the robot at rest, its links straight.

        Args:
            robot: a robot PaR, RR or R.
            position: of the joints at the start [m, rad].
            step_s: Exudyn's step [s].
            elements: cables of a link.
            sensor_m: the part of the last link over which `bend_rad` integrates the curvature [m].
        """

        self.step_s = step_s
        self._start = list(position[: len(robot.links)])
        self.positions = list(self._start)
        self._container = exu.SystemContainer()
        self._mbs = self._container.AddSystem()
        self._springs: list[Any] = []
        self._held = [(0.0, 0.0)] * len(robot.links)
        self._offsets = [link.joint.angle_rad for link in robot.links]
        self._slides = robot.links[0].joint.type == "Pa"
        self.links: list[CableLink] = []
        if self._slides:
            self._build_on_a_rail(robot, elements)
        else:
            self._build_arm(robot, elements)
        self._mbs.Assemble()
        self._settings = _settings(step_s, modified=self._slides)
        solver: Any = exu.MainSolverImplicitSecondOrder()
        if not solver.InitializeSolver(self._mbs, self._settings):
            raise FlexuraError("Exudyn could not initialise the mechanics of the emulated rig")
        solver.it.currentStepSize = step_s
        self._solver = solver
        self._data = self._mbs.systemData
        self._reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        # of each link the first coordinate and the one after the last
        self._rows = [
            (
                self._mbs.GetNodeODE2Index(link.nodes[0]),
                self._mbs.GetNodeODE2Index(link.nodes[-1]) + 4,
            )
            for link in self.links
        ]
        self._root_m = float(self._reference[0])
        strip = robot.links[-1]
        self._length_m, self._elements = strip.length_m, elements
        self._sensor_ends = [self._place(s) for s in sensor_m]
        self._read()

    def _build_on_a_rail(self, robot: fx.Robot, elements: int) -> None:

        mbs = self._mbs
        carriage, strip = robot.links
        rail = Frame(self._start[0], 0.0, carriage.joint.angle_rad)
        frame = rail.along(carriage.length_m, turn=self._start[1])
        joint = strip.joint
        hub = PointMass(_carriage_mass(robot), joint.hub_inertia_kg_m2 + joint.rotor_inertia)
        link = self._add_link(robot, 1, elements, hub, frame)
        fixed, along, across = self._markers(link)
        mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=[fixed, across]))
        self._springs.append(
            mbs.AddObject(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=[fixed, along]))
        )
        self._add_torsion(Ground.add(mbs).tip.marker, link, frame.angle)

    def _build_arm(self, robot: fx.Robot, elements: int) -> None:

        mbs = self._mbs
        frame = Frame(0.0, 0.0, 0.0)
        before = Ground.add(mbs).tip.marker
        for i, link in enumerate(robot.links):
            turned = self._start[i] + link.joint.angle_rad
            frame = frame.along(robot.links[i - 1].length_m if i else 0.0, turn=turned)
            joint = link.joint
            # the rotor belongs to the motor, beyond the gear
            made = self._add_link(
                robot, i, elements, PointMass(joint.hub_mass_kg, joint.hub_inertia_kg_m2), frame
            )
            if i == 0:
                fixed, *both = self._markers(made)
                for marker in both:
                    mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=[fixed, marker]))
            else:
                mbs.AddObject(eii.ObjectJointRevolute2D(markerNumbers=[before, made.origin.marker]))
            self._add_torsion(before, made, turned)
            before = made.tip.marker

    def _add_link(
        self, robot: fx.Robot, i: int, elements: int, hub: PointMass, frame: Frame
    ) -> CableLink:
        link, payload = robot.links[i], robot.payload
        values = beam_values(link, elements, robot.rayleigh(i)[1])
        soft = AXIAL_RATIO * values.bending.mean() / link.length_m**2
        values = dataclasses.replace(values, axial=np.minimum(values.axial, soft))
        last = i == len(robot.links) - 1
        tip = PointMass(payload.mass_kg, payload.inertia_kg_m2) if last else PointMass(0.0, 0.0)
        made = CableLink(self._mbs, values, hub, tip, frame, robot.gravity_m_s2)
        self.links.append(made)
        return made

    def _markers(self, link: CableLink) -> list[Any]:
        """Markers of a fixed coordinate, and of the link's root along x and y."""
        mbs, root = self._mbs, link.nodes[0]
        ground = mbs.AddNode(eii.NodePointGround())
        nodes = ((ground, 0), (root, 0), (root, 1))
        return [
            mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))
            for node, k in nodes
        ]

    def _add_torsion(self, before: Any, link: CableLink, angle_rad: float) -> None:
        mbs = self._mbs
        turns = mbs.AddNode(
            eii.NodeGenericData(initialCoordinates=[angle_rad], numberOfDataCoordinates=1)
        )
        self._springs.append(
            mbs.AddObject(
                eii.ObjectConnectorTorsionalSpringDamper(
                    markerNumbers=[before, link.origin.marker], nodeNumber=turns
                )
            )
        )

    def hold(self, joint: int, stiffness: float, damping: float) -> None:
        """Set a joint's spring; Exudyn renews its Jacobian if it changes.

        Args:
            joint: from 0.
            stiffness: [N/m] or [N m/rad].
            damping: [N s/m] or [N m s/rad].
        """
        if (stiffness, damping) != self._held[joint]:
            self._held[joint] = stiffness, damping
            self._mbs.SetObjectParameter(self._springs[joint], "stiffness", stiffness)
            self._mbs.SetObjectParameter(self._springs[joint], "damping", damping)

    def step(self, *zeros: float) -> None:
        """Take one step.

        Args:
            zeros: of the joints' springs [m, rad].

        Raises:
            FlexuraError: Exudyn's Newton iteration fails.
        """
        mbs, solver, settings = self._mbs, self._solver, self._settings
        for joint, zero in enumerate(zeros):
            slides = joint == 0 and self._slides
            offset = zero - self._start[0] if slides else zero + self._turned(joint)
            mbs.SetObjectParameter(self._springs[joint], "offset", offset)
        solver.UpdateCurrentTime(mbs, settings)
        solver.InitializeStep(mbs, settings)
        if not solver.DiscontinuousIteration(mbs, settings):
            raise FlexuraError(
                f"Exudyn's solver gave up on a step of {self.step_s:g} s of the emulated rig's "
                f"mechanics"
            )
        solver.FinishStep(mbs, settings)
        self._read()

    def _turned(self, joint: int) -> float:
        """What a spring's angle has beyond the joint's own [rad]."""
        return self._offsets[0] if self._slides else self._offsets[joint]

    def _read(self) -> None:
        q = self._values = (self._data.GetODE2Coordinates() + self._reference).tolist()
        before = 0.0
        for k, (first, end) in enumerate(self._rows):
            joint = k + 1 if self._slides else k
            root = math.atan2(q[first + 3], q[first + 2])
            angle = root - before - self._turned(joint)
            turns = round((self.positions[joint] - angle) / (2 * math.pi))
            self.positions[joint] = angle + 2 * math.pi * turns
            before = math.atan2(q[end - 1], q[end - 2])
        if self._slides:
            self.positions[0] = q[0] - self._root_m + self._start[0]

    # ---- what its sensors and an onlooker see

    def _place(self, x: float) -> Place:
        """The element at x [m] from the last link's root: its first coordinate, and the share."""
        size = self._length_m / self._elements
        k = min(int(x / size), self._elements - 1)
        return Place(self._rows[-1][0] + 4 * k, x / size - k, size)

    def _derivative(self, at: Place, weights: Sequence[float]) -> tuple[float, float]:
        q, i = self._values, at.row
        x = sum(w * q[i + 2 * k] for k, w in enumerate(weights))
        y = sum(w * q[i + 2 * k + 1] for k, w in enumerate(weights))
        return x, y

    @property
    def bend_rad(self) -> float:
        """The strip's bend under the sensor: the angle between the tangents at its ends [rad]."""
        (x, y), (u, v) = (self._derivative(at, at.first) for at in self._sensor_ends)
        return math.atan2(x * v - y * u, x * u + y * v)

    def curvature(self, x: float) -> float:
        """The curvature of the last link at x [m] from its root [1/m]."""
        at = self._place(x)
        (a, b), (c, d) = self._derivative(at, at.first), self._derivative(at, at.second)
        return (a * d - b * c) / (a * a + b * b) ** 1.5

    @property
    def tip_acceleration(self) -> float:
        """Acceleration of the tip across its tangent [m/s^2]."""
        end = self._rows[-1][1]
        a = self._data.GetODE2Coordinates_tt()
        x, y = self._values[end - 2], self._values[end - 1]
        return float((x * a[end - 3] - y * a[end - 4]) / math.hypot(x, y))

    @property
    def tip_deflection_m(self) -> float:
        """Deflection of the last link's tip, across its hub's axis [m]."""
        q, (first, end) = self._values, self._rows[-1]
        angle = math.atan2(q[first + 3], q[first + 2])
        return math.cos(angle) * (q[end - 3] - q[first + 1]) - math.sin(angle) * (
            q[end - 4] - q[first]
        )

    @property
    def tip_m(self) -> tuple[float, float]:
        """Position of the last link's tip in the base frame [m]."""
        end = self._rows[-1][1]
        return self._values[end - 4], self._values[end - 3]

    @property
    def energy_J(self) -> float:
        """Kinetic and strain energy [J], without gravity and springs."""
        q, v = np.array(self._values), np.array(self._data.GetODE2Coordinates_t())
        total = 0.0
        for link, (first, end) in zip(self.links, self._rows, strict=True):
            here, speed = q[None, first:end], v[None, first:end]
            total += float((link.kinetic(here, speed) + link.strain(here))[0])
        return total


class Place(NamedTuple):
    """A place on a cable element: row of its first coordinate, share s of its size [m]."""

    row: int
    s: float
    size: float

    @property
    def first(self) -> tuple[float, float, float, float]:
        """Weights of r, r', r, r' for the slope vector, by Hermite's cubics."""
        s, size = self.s, self.size
        return 6 * (s**2 - s) / size, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / size, 3 * s**2 - 2 * s

    @property
    def second(self) -> tuple[float, float, float, float]:
        """The same for its derivative."""
        s, size = self.s, self.size
        return (
            (12 * s - 6) / size**2,
            (6 * s - 4) / size,
            (6 - 12 * s) / size**2,
            (6 * s - 2) / size,
        )


def _carriage_mass(robot: fx.Robot) -> float:
    """Mass of the carriage with the hubs on it [kg].

    A rotor of joint 1 belongs to the motor, beyond the nut.
    """
    carriage, strip = robot.links
    return link_inertia(carriage).mass + carriage.joint.hub_mass_kg + strip.joint.hub_mass_kg


def _settings(step_s: float, modified: bool) -> Any:
    """Settings of Exudyn's solver.

    Modified Newton is half as dear; with the constraint between two links it diverges when the
    contact in a gear begins.
    """
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.numberOfSteps = round(FOREVER_S / step_s)
    integration.endTime = integration.numberOfSteps * step_s
    integration.newton.useModifiedNewton = modified
    integration.newton.relativeTolerance = integration.newton.absoluteTolerance = TOLERANCE
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.adaptiveStep = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
    settings.solution.file.write = False
    settings.solution.solverInformationFileName = ""
    settings.solution.sensors.active = False
    return settings
