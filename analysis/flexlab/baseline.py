"""The fastest Exudyn model of the benchmark manoeuvre that we could find: what the native solver is measured against.

Type IV: a carriage on a rail, a rotor, a flexible strip, a payload, driven by smoothed bang-bang forces for 1 s and left alone
for another. Tuned by hand, unlike the twin: no joints (all inertias sit on the beam's end nodes), 5 ANCF elements, the longest
step that gives 0.1 % of the tip deflection, modified Newton, dense solver, drives set once a step.
"""

from __future__ import annotations

import time
from functools import cache, partial
from typing import Any

import numpy as np

import flexura as fx
from flexura.signal import bang_bang

from .sidebyside import Case, Result, native

CARRIAGE_KG, ROTOR_KG_M2, PAYLOAD_KG, LENGTH_M = 1.0, 1e-3, 0.05, 0.3
WIDTH_M, HEIGHT_M, YOUNG_PA, DENSITY_KG_M3 = 0.02, 0.001, 2e11, 7850.0
DURATION_S = 2.0
T = np.linspace(0.0, DURATION_S, 201)
FORCE, TORQUE = bang_bang(2.0, 1.0, 0.01), bang_bang(0.05, 1.0, 0.01)


def robot(elements: int, modes: int | None = None) -> fx.Robot:
    """The same robot as a robot file has it."""
    strip: dict[str, Any] = {
        "length_m": LENGTH_M, "elements": elements, "section": {"width_m": WIDTH_M, "height_m": HEIGHT_M},
        "young_modulus_Pa": YOUNG_PA, "density_kg_m3": DENSITY_KG_M3, "joint": {"type": "R", "hub_inertia_kg_m2": ROTOR_KG_M2},
    }  # fmt: skip
    carriage = {"length_m": 0.0, "mass_kg": CARRIAGE_KG, "inertia_kg_m2": 0.0, "joint": {"type": "Pa"}}
    if modes is not None:
        strip["modes"] = modes
    return fx.Robot.from_dict({"name": "benchmark, type IV", "link": [carriage, strip], "payload": {"mass_kg": PAYLOAD_KG}})


def settings(duration_s: float, step_s: float, period_s: float) -> Any:
    """What is fastest in Exudyn for thin strips at this accuracy; sensors are read every `period_s`."""
    import exudyn as exu

    chosen = exu.SimulationSettings()
    integration = chosen.timeIntegration
    integration.endTime, integration.numberOfSteps = duration_s, round(duration_s / step_s)
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = integration.newton.absoluteTolerance = 1e-6
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.adaptiveStep = False
    integration.verboseMode = 0
    chosen.linearSolver.solverType = exu.LinearSolverType.EigenDense
    chosen.solution.file.write = False
    chosen.solution.solverInformationFileName = ""
    chosen.solution.sensors.writePeriod = period_s
    return chosen


def exudyn(elements: int = 5, step_s: float = 2.0 / 6400) -> Result:
    """2 s of the manoeuvre in Exudyn; the default step is 3.1e-4 s."""
    import exudyn as exu
    from exudyn import beams
    from exudyn import itemInterface as item

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    exu.SetWriteToConsole(False)
    area = WIDTH_M * HEIGHT_M
    cable = item.ObjectANCFCable2D(
        massPerLength=DENSITY_KG_M3 * area, bendingStiffness=YOUNG_PA * WIDTH_M * HEIGHT_M**3 / 12, axialStiffness=YOUNG_PA * area
    )
    made = beams.GenerateBeamElementsAlongLine(mbs, [0, 0, 0], [LENGTH_M, 0, 0], elements, cable)
    root, tip = made["nodes"][0], made["nodes"][-1]
    mbs.AddObject(
        item.ObjectGenericODE2(nodeNumbers=[root], massMatrix=np.diag([CARRIAGE_KG, CARRIAGE_KG, ROTOR_KG_M2, ROTOR_KG_M2]))
    )
    mbs.AddObject(item.ObjectGenericODE2(nodeNumbers=[tip], massMatrix=np.diag([PAYLOAD_KG, PAYLOAD_KG, 0, 0])))
    ground = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
    x, y = (mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=root, coordinate=k)) for k in (0, 1))
    mbs.AddObject(item.ObjectConnectorCoordinate(markerNumbers=[ground, y]))
    force = mbs.AddLoad(item.LoadCoordinate(markerNumber=x, load=0.0))
    torque = mbs.AddLoad(
        item.LoadTorqueVector(markerNumber=mbs.AddMarker(item.MarkerNodeRigid(nodeNumber=root)), loadVector=[0, 0, 0])
    )

    def drives(mbs: object, t: float) -> bool:
        mbs.SetLoadParameter(force, "load", FORCE(t)[0])  # type: ignore[attr-defined]
        mbs.SetLoadParameter(torque, "loadVector", [0, 0, TORQUE(t)[0]])  # type: ignore[attr-defined]
        return True

    mbs.SetPreStepUserFunction(drives)
    kinds, memory = exu.OutputVariableType, {"storeInternal": True, "writeToFile": False}
    at_root = mbs.AddSensor(item.SensorNode(nodeNumber=root, outputVariableType=kinds.CoordinatesTotal, **memory))
    at_tip = mbs.AddSensor(item.SensorNode(nodeNumber=tip, outputVariableType=kinds.Position, **memory))
    mbs.Assemble()
    chosen = settings(DURATION_S, step_s, T[1])
    begun = time.perf_counter()
    mbs.SolveDynamic(chosen)
    wall = time.perf_counter() - begun
    a, b = np.asarray(mbs.GetSensorStoredData(at_root)), np.asarray(mbs.GetSensorStoredData(at_tip))
    angle = np.arctan2(a[:, 4], a[:, 3])
    return Result(wall, np.array([-np.sin(angle) * (b[:, 1] - a[:, 1]) + np.cos(angle) * (b[:, 2] - a[:, 2])]))


def cases() -> list[Case]:
    """Exudyn, and the native solver with reduced links and with all unknowns of a mesh like Exudyn's."""
    drive = fx.Drive.force(FORCE, TORQUE)
    converged = cache(lambda: native(fx.assemble(robot(12)), T, drive, 1e-10).deflections)
    out = [Case("Exudyn, 5 ANCF elements, tuned", exudyn, lambda: exudyn(16, 1e-4).deflections)]
    for name, elements, modes, rtol, asked in (
        ("native, 2 modes", 12, 2, 2e-3, 400.0),
        ("native, 3 modes, accurate", 12, 3, 1e-4, None),
        ("native, all unknowns of 5 elements", 5, None, 1.5e-3, 200.0),
    ):
        system = fx.assemble(robot(elements, modes))
        out.append(Case(name, partial(native, system, T, drive, rtol), converged, asked))
    return out
