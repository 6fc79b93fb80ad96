"""A chain of flexible links in Exudyn, built for speed from a robot file's tables.

ANCF cables; inertias of hubs and payload sit on the beams' end nodes, so that there are no bodies
and no joints but the hinges; sensors stay in memory. A chain is one carriage on a rail or none,
then flexible links with joints R.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from flexura.optional import Optional

from ..problems.problem import Tables

exu = Optional("exudyn")
item = Optional("exudyn.itemInterface")
beams = Optional("exudyn.beams")

AXIAL = 1e5  # EA L^2 / EI of links that are given by their EI


def exudyn() -> Any:
    """Exudyn's module, without messages."""

    exu.SetWriteToConsole(False)
    exu.config.suppressWarnings = True
    return exu


def line(link: Tables) -> tuple[float, float, float]:
    """Mass per length [kg/m], EI [N m^2] and EA [N] of a link's tables."""
    if "section" not in link:
        stiffness = link["bending_stiffness_N_m2"]
        return link["mass_per_length_kg_m"], stiffness, AXIAL * stiffness / link["length_m"] ** 2
    width, height = link["section"]["width_m"], link["section"]["height_m"]
    area, modulus = width * height, link["young_modulus_Pa"]
    return link["density_kg_m3"] * area, modulus * width * height**3 / 12, modulus * area


class Joint(NamedTuple):
    """Markers of a joint's loads and of its coordinate, and the nodes between which it turns."""

    loads: list[int]
    coordinate: int  # marker of the joint's coordinate [m or rad]
    root: int  # node
    before: int | None  # node of the tip that carries it; None: the base


class Chain:
    """The system `mbs`, its joints, and sensors at the links' ends."""

    def __init__(self, robot: Tables, elements: int, reduced: int = 0) -> None:
        """Build the chain, straight at its start; it is not assembled yet.

        Args:
            robot: tables of a robot file.
            elements: cables a flexible link.
            reduced: order of the cables' reduced quadrature; 0: full.
        """

        self.robot, self.item, self.exu = robot, item, exudyn()
        self.container = self.exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.gravity = robot.get("gravity_m_s2", [0.0, 0.0])
        self.ground = self.mbs.AddObject(item.ObjectGround())
        self.origin = self._marker(
            "NodeCoordinate", nodeNumber=self.mbs.AddNode(item.NodePointGround()), coordinate=0
        )
        self.joints: list[Joint] = []
        self.ends: list[tuple[int, int]] = []  # nodes
        self.has_carriage = robot["link"][0]["elements"] == 0
        self._links([link for link in robot["link"] if link["elements"]], elements, reduced)
        self.sensors = [
            (self._sensor(root, "CoordinatesTotal"), self._sensor(tip, "Position"))
            for root, tip in self.ends
        ]

    def _links(self, links: list[Tables], elements: int, reduced: int) -> None:
        """Add all flexible links, straight at their start."""

        x, y, angle, payload = 0.0, 0.0, 0.0, self.robot.get("payload", {})
        carrier = self._marker("BodyRigid", bodyNumber=self.ground)
        body, place = self.ground, [0.0, 0.0, 0.0]
        for k, link in enumerate(links):
            mass, bending, axial = line(link)
            angle += link["joint"].get("start_rad", 0.0)
            to = [x + link["length_m"] * math.cos(angle), y + link["length_m"] * math.sin(angle), 0]
            cable = self.item.ObjectANCFCable2D(
                massPerLength=mass,
                bendingStiffness=bending,
                axialStiffness=axial,
                bendingDamping=link.get("damping", {}).get("beta_s", 0.0) * bending,
                useReducedOrderIntegration=reduced,
            )
            made = beams.GenerateBeamElementsAlongLine(
                self.mbs, [x, y, 0], to, elements, cable, gravity=[*self.gravity, 0.0]
            )
            root, tip = made["nodes"][0], made["nodes"][-1]
            joint, last = link["joint"], k == len(links) - 1
            riding = self.robot["link"][0]["mass_kg"] if self.has_carriage and k == 0 else 0.0
            self._point_mass(
                root, joint.get("hub_mass_kg", 0.0) + riding, joint.get("hub_inertia_kg_m2", 0.0)
            )
            self._point_mass(
                tip,
                *(
                    (payload.get(key, 0.0) for key in ("mass_kg", "inertia_kg_m2"))
                    if last
                    else (0.0, 0.0)
                ),
            )
            self._hinge(
                k, root, carrier, [body, made["elements"][0]], place, joint.get("start_rad", 0.0)
            )
            self.ends.append((root, tip))
            carrier, (x, y) = self._marker("NodeRigid", nodeNumber=tip), to[:2]
            body, place = made["elements"][-1], [link["length_m"] / elements, 0.0, 0.0]

    def _hinge(
        self, k: int, root: int, carrier: int, bodies: list[int], place: list[float], start: float
    ) -> None:
        """Add the joint R of flexible link k, and the rail before it."""
        hub, before = self._marker("NodeRigid", nodeNumber=root), self.ends[-1][1] if k else None
        held = [self._marker("NodeCoordinate", nodeNumber=root, coordinate=j) for j in (0, 1)]
        if k == 0 and self.has_carriage:
            self.joints.append(Joint([held[0]], held[0], root, None))
        if k == 0:
            for coordinate in held[1:] if self.has_carriage else held:
                self.mbs.AddObject(
                    self.item.ObjectConnectorCoordinate(markerNumbers=[self.origin, coordinate])
                )
        else:
            self.mbs.AddObject(self.item.ObjectJointRevolute2D(markerNumbers=[carrier, hub]))
        turns = self.mbs.AddNode(
            self.item.NodeGenericData(initialCoordinates=[start], numberOfDataCoordinates=1)
        )
        angle = self._marker(
            "BodiesRelativeRotationCoordinate",
            bodyNumbers=bodies,
            localPosition0=place,
            localPosition1=[0, 0, 0],
            axis0=[0, 0, 1],
            nodeNumber=turns,
        )
        self.joints.append(Joint([hub, carrier] if k else [hub], angle, root, before))

    def _point_mass(self, node: int, mass: float, inertia: float) -> None:
        """Add a mass and an inertia to a beam's end node, whose slope vector has length 1."""
        if mass or inertia:
            self.mbs.AddObject(
                self.item.ObjectGenericODE2(
                    nodeNumbers=[node], massMatrix=np.diag([mass, mass, inertia, inertia])
                )
            )
        if mass and any(self.gravity):
            weight = [mass * self.gravity[0], mass * self.gravity[1], 0]
            at = self._marker("NodePosition", nodeNumber=node)
            self.mbs.AddLoad(self.item.LoadForceVector(markerNumber=at, loadVector=weight))

    def _marker(self, kind: str, **keys: Any) -> int:
        return self.mbs.AddMarker(getattr(self.item, f"Marker{kind}")(**keys))

    def _sensor(self, node: int, variable: str) -> int:
        kind = getattr(self.exu.OutputVariableType, variable)
        sensor = self.item.SensorNode(
            nodeNumber=node, outputVariableType=kind, storeInternal=True, writeToFile=False
        )
        return self.mbs.AddSensor(sensor)

    def measured(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Positions and velocities of the joints now, (joints,), and the tip deflection [m]."""
        kind, get = self.exu.OutputVariableType, self.mbs.GetNodeOutput
        angle = lambda q: math.atan2(q[3], q[2])
        rate = lambda q, v: (q[2] * v[3] - q[3] * v[2]) / (q[2] ** 2 + q[3] ** 2)
        position, velocity = [], []
        for joint in self.joints:
            q, v = get(joint.root, kind.CoordinatesTotal), get(joint.root, kind.Coordinates_t)
            if len(joint.loads) == 1 and joint.coordinate == joint.loads[0]:
                position.append(q[0])
                velocity.append(v[0])
                continue
            below = (0.0, 0.0)
            if joint.before is not None:
                p, u = (
                    get(joint.before, kind.CoordinatesTotal),
                    get(joint.before, kind.Coordinates_t),
                )
                below = angle(p), rate(p, u)
            position.append(angle(q) - below[0])
            velocity.append(rate(q, v) - below[1])
        tip, turned = get(self.ends[-1][1], kind.Position), angle(q)
        bent = -math.sin(turned) * (tip[0] - q[0]) + math.cos(turned) * (tip[1] - q[1])
        return np.array(position), np.array(velocity), bent
