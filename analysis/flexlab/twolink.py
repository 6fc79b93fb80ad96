"""Benchmark RR: two flexible links, in Exudyn and natively.

Two aluminium strips joined by motors, torques bang-bang for 1.5 s. In Exudyn 8 ANCF elements a link between rigid hubs, clamped
and jointed as its users do it, with the settings of `baseline` and drives set once a step.
"""

from __future__ import annotations

import time
from functools import cache, partial
from typing import Any

import numpy as np

import flexura as fx
from flexura.signal import bang_bang

from .baseline import settings
from .sidebyside import Case, Result, native

LENGTHS_M, WIDTH_M, HEIGHTS_M = (0.9, 0.8), 0.03, (0.006, 0.004)
YOUNG_PA, DENSITY_KG_M3 = 7e10, 2700.0
HUB_KG, HUBS_KG_M2, PAYLOAD_KG = 0.5, (0.05, 0.005), 0.2
DURATION_S, ELEMENTS, STEP_S = 2.0, 8, 1.25e-4
T = np.linspace(0.0, DURATION_S, 201)
TORQUES = bang_bang(0.4, 1.5, 0.02), bang_bang(0.1, 1.5, 0.02)


def robot(elements: int, modes: tuple[int, int] | None = None) -> fx.Robot:
    """The same robot as a robot file has it."""
    links = []
    for k in (0, 1):
        joint = {"type": "R", "hub_inertia_kg_m2": HUBS_KG_M2[k], "hub_mass_kg": k * HUB_KG}
        link: dict[str, Any] = {
            "length_m": LENGTHS_M[k], "elements": elements, "section": {"width_m": WIDTH_M, "height_m": HEIGHTS_M[k]},
            "young_modulus_Pa": YOUNG_PA, "density_kg_m3": DENSITY_KG_M3, "joint": joint,
        }  # fmt: skip
        links.append(link if modes is None else link | {"modes": modes[k]})
    return fx.Robot.from_dict({"name": "benchmark, type I", "link": links, "payload": {"mass_kg": PAYLOAD_KG}})


def exudyn(elements: int = ELEMENTS, step_s: float = STEP_S) -> Result:
    """2 s of the manoeuvre in Exudyn."""
    import exudyn as exu
    from exudyn import beams
    from exudyn import itemInterface as item

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    exu.SetWriteToConsole(False)
    at = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=mbs.AddObject(item.ObjectGround())))  # where the next joint sits
    kinds, memory = exu.OutputVariableType, {"storeInternal": True, "writeToFile": False}
    x, motors, sensors = 0.0, [], []
    for k, length in enumerate(LENGTHS_M):
        area = WIDTH_M * HEIGHTS_M[k]
        cable = item.ObjectANCFCable2D(
            massPerLength=DENSITY_KG_M3 * area, bendingStiffness=YOUNG_PA * WIDTH_M * HEIGHTS_M[k] ** 3 / 12,
            axialStiffness=YOUNG_PA * area,
        )  # fmt: skip
        nodes = beams.GenerateBeamElementsAlongLine(mbs, [x, 0, 0], [x + length, 0, 0], elements, cable)["nodes"]
        place = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=[x, 0, 0]))
        body = mbs.AddObject(item.ObjectRigidBody2D(mass=(1e-9, HUB_KG)[k], inertia=HUBS_KG_M2[k], nodeNumber=place))
        hub = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body))
        root, tip = (mbs.AddMarker(item.MarkerNodeRigid(nodeNumber=nodes[end])) for end in (0, -1))
        mbs.AddObject(item.ObjectJointGeneric(markerNumbers=[hub, root], constrainedAxes=[1, 1, 0, 0, 0, 1]))
        mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=[at, hub]))
        motors.append([mbs.AddLoad(item.LoadTorqueVector(markerNumber=on, loadVector=[0, 0, 0])) for on in (hub, at)[: k + 1]])
        sensors.append(
            [mbs.AddSensor(item.SensorNode(nodeNumber=n, outputVariableType=v, **memory))
             for n, v in ((place, kinds.Coordinates), (nodes[0], kinds.Position), (nodes[-1], kinds.Position))]
        )  # fmt: skip
        at, x = tip, x + length
    mbs.AddObject(item.ObjectGenericODE2(nodeNumbers=[nodes[-1]], massMatrix=np.diag([PAYLOAD_KG, PAYLOAD_KG, 0, 0])))

    def drives(mbs: Any, t: float) -> bool:
        for torque, motor in zip(TORQUES, motors, strict=True):
            for load, sign in zip(motor, (1.0, -1.0), strict=False):  # on the hub, and back on what it stands on
                mbs.SetLoadParameter(load, "loadVector", [0, 0, sign * torque(t)[0]])
        return True

    mbs.SetPreStepUserFunction(drives)
    mbs.Assemble()
    chosen = settings(DURATION_S, step_s, T[1])
    begun = time.perf_counter()
    mbs.SolveDynamic(chosen)
    wall = time.perf_counter() - begun
    bent = []
    for mine in sensors:
        coordinates, root, tip = (np.asarray(mbs.GetSensorStoredData(each)) for each in mine)
        angle = coordinates[:, 3]
        bent.append(-np.sin(angle) * (tip[:, 1] - root[:, 1]) + np.cos(angle) * (tip[:, 2] - root[:, 2]))
    return Result(wall, np.array(bent))


def cases() -> list[Case]:
    """Exudyn, and the native solver with reduced links; each error is that from its own converged model."""
    drive = fx.Drive.force(*TORQUES)
    converged = cache(lambda: native(fx.assemble(robot(8)), T, drive, 1e-9).deflections)
    reduced = fx.assemble(robot(8, (2, 4)))  # each link's modes beside the shapes of what its tip carries
    return [
        Case("Exudyn, 8 ANCF elements a link", exudyn, lambda: exudyn(12, STEP_S / 2).deflections, repeats=2),
        Case("native, 2 and 4 modes", partial(native, reduced, T, drive, 6e-4), converged, 400.0),
    ]
