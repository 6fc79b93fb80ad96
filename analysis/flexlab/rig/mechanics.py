"""The mechanics of the emulated rig in Exudyn: carriage, hub, strip and payload, stepped from outside.

The twin's own cable elements, without joints: the carriage doesn't turn, so that its mass and the hub stand on the strip's first
node, which is held on the rail by one constraint. What drives carriage and hub are two linear springs, implicit in Exudyn's step,
whose zeros are set before every step; the nut's play, friction and the stepper's magnetic spring are made of them.

Exudyn runs step by step (`MainSolverImplicitSecondOrder`: generalised alpha, spectral radius 0.9, modified Newton), its structures
made once. The strip is softer along its axis than steel, EA L^2 / EI = 1e5 at most: an axial strain of 1e-6, fewer iterations, and
less of the locking that cable elements have when they are few.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

import flexura as fx
from flexura.errors import FlexuraError

ELEMENTS = 4
TOLERANCE = 1e-4  # of Newton's residual; a tenth of it changes the tip deflection by 5e-5 of its peak
FOREVER_S = 1e7


class Mechanics:
    """Carriage (coordinate x along the rail, from its origin) and strip (angle to the carriage) of a robot of type IV.

    `position`: x [m] and angle [rad] at the start, the strip straight, all at rest. `sensor_m`: from where to where
    on the strip `bend_rad` integrates its curvature.
    """

    def __init__(
        self, robot: fx.Robot, position: tuple[float, float] = (0.0, 0.0), step_s: float = 5e-4, elements: int = ELEMENTS,
        sensor_m: tuple[float, float] = (0.0, 0.0),
    ) -> None:  # fmt: skip
        import exudyn as exu

        self.step_s, self.x_m, self.angle_rad = step_s, *position
        self._start, self._turned = position[0], robot.links[0].joint.angle_rad
        self._container = exu.SystemContainer()
        self._mbs = self._container.AddSystem()
        self._build(robot, position, elements)
        self._settings = _settings(step_s)
        self._solver = exu.MainSolverImplicitSecondOrder()
        if not self._solver.InitializeSolver(self._mbs, self._settings):
            raise FlexuraError("Exudyn could not initialise the mechanics of the emulated rig")
        self._solver.it.currentStepSize = step_s
        self._data = self._mbs.systemData
        self._reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        self._ends = [self._slope_at(s, robot.links[1].length_m / elements, elements) for s in sensor_m]
        self._gains: dict[str, tuple[float, float]] = {}
        self._read()

    def _build(self, robot: fx.Robot, position: tuple[float, float], elements: int) -> None:
        from exudyn import itemInterface as eii

        from flexura.twin.ancf import CableLink
        from flexura.twin.part import Frame, Ground, Lump
        from flexura.twin.properties import AXIAL_RATIO, beam_values

        mbs = self._mbs
        (carriage, strip), payload = robot.links, robot.payload
        rail = Frame(position[0], 0.0, carriage.joint.angle_rad)
        frame = rail.along(carriage.length_m, turn=position[1])
        values = beam_values(strip, elements)
        soft = AXIAL_RATIO * values.bending.mean() / strip.length_m**2
        values = dataclasses.replace(values, axial=np.minimum(values.axial, soft))
        joint = strip.joint
        hub = Lump(_carried(robot), joint.hub_inertia_kg_m2 + joint.rotor_inertia)
        tip = Lump(payload.mass_kg, payload.inertia_kg_m2)
        self.strip = CableLink(mbs, values, hub, tip, frame, robot.gravity_m_s2)
        root = self.strip.nodes[0]
        fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
        along, across = (mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=root, coordinate=k)) for k in (0, 1))
        mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=[fixed, across]))
        turns = mbs.AddNode(eii.NodeGenericData(initialCoordinates=[frame.angle], numberOfDataCoordinates=1))
        self._springs = {
            "carriage": mbs.AddObject(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=[fixed, along])),
            "joint": mbs.AddObject(
                eii.ObjectConnectorTorsionalSpringDamper(
                    markerNumbers=[Ground.add(mbs).tip.marker, self.strip.origin.marker], nodeNumber=turns
                )
            ),
        }
        mbs.Assemble()

    def hold(self, which: str, stiffness: float, damping: float = 0.0) -> None:
        """Set the spring of "carriage" [N/m, N s/m] or "joint" [N m/rad, N m s/rad]; Exudyn makes a new Jacobian if need be."""
        if self._gains.get(which) != (stiffness, damping):
            self._gains[which] = stiffness, damping
            self._mbs.SetObjectParameter(self._springs[which], "stiffness", stiffness)
            self._mbs.SetObjectParameter(self._springs[which], "damping", damping)

    def step(self, carriage_m: float, joint_rad: float) -> None:
        """One step with the springs' zeros here. Raises FlexuraError where Exudyn's Newton iteration fails."""
        mbs, solver, settings = self._mbs, self._solver, self._settings
        mbs.SetObjectParameter(self._springs["carriage"], "offset", carriage_m - self._start)
        mbs.SetObjectParameter(self._springs["joint"], "offset", joint_rad + self._turned)
        solver.UpdateCurrentTime(mbs, settings)
        solver.InitializeStep(mbs, settings)
        if not solver.DiscontinuousIteration(mbs, settings):
            raise FlexuraError(f"Exudyn's solver gave up on a step of {self.step_s:g} s of the emulated rig's mechanics")
        solver.FinishStep(mbs, settings)
        self._read()

    def _read(self) -> None:
        self._q = self._data.GetODE2Coordinates() + self._reference
        q = self._q.tolist()
        self.x_m = q[0] - self._reference[0] + self._start
        angle = math.atan2(q[3], q[2]) - self._turned
        self.angle_rad = angle + 2 * math.pi * round((self.angle_rad - angle) / (2 * math.pi))

    @property
    def bend_rad(self) -> float:
        """The integral of the strip's curvature under the sensor: how far the tangent turns from one end of it to the other."""
        one, two = (weights @ self._q for weights in self._ends)
        return math.atan2(one[0] * two[1] - one[1] * two[0], one[0] * two[0] + one[1] * two[1])

    @property
    def tip_deflection_m(self) -> float:
        """Of the strip's tip, across the hub's axis."""
        q = self._q
        angle = math.atan2(q[3], q[2])
        return float(math.cos(angle) * (q[-3] - q[1]) - math.sin(angle) * (q[-4] - q[0]))

    @property
    def tip_m(self) -> tuple[float, float]:
        """The strip's tip in the base frame."""
        return float(self._q[-4]), float(self._q[-3])

    @property
    def energy_J(self) -> float:
        """Kinetic and strain energy, gravity and springs left out."""
        q, v = self._q[None, :], np.array(self._data.GetODE2Coordinates_t())[None, :]
        return float((self.strip.kinetic(q, v) + self.strip.strain(q))[0])

    def _slope_at(self, x: float, size: float, elements: int) -> np.ndarray:
        """Weights (2, coordinates) of the coordinates in the slope vector r' at x [m] from the strip's root."""
        k = min(int(x / size), elements - 1)
        s = x / size - k
        shapes = 6 * (s**2 - s) / size, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / size, 3 * s**2 - 2 * s  # of Hermite's cubics
        weights = np.zeros((2, len(self._reference)))
        for n, shape in enumerate(shapes):
            for axis in range(2):
                weights[axis, 4 * k + 2 * n + axis] = shape
        return weights


def _carried(robot: fx.Robot) -> float:
    """Mass of the carriage with the hubs on it [kg]; a rotor of joint 1 stands beyond the nut, with the motor."""
    from flexura.twin.properties import link_inertia

    carriage, strip = robot.links
    return link_inertia(carriage).mass + carriage.joint.hub_mass_kg + strip.joint.hub_mass_kg


def _settings(step_s: float) -> Any:
    import exudyn as exu

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
