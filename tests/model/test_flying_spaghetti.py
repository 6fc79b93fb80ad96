"""B13: the flying spaghetti of Simo and Vu-Quoc (1986), a free beam of large strains, in the twin's
geometrically exact links.

Outside the reach of the native model, whose links are inextensible; it holds the twin's own parts
to a published problem.
"""

from __future__ import annotations

import numpy as np
import pytest

from flexura.twin.links.geometrically_exact import GeometricallyExactLink
from flexura.twin.links.part import Frame, PointMass
from flexura.twin.links.properties import BeamValues
from flexura.twin.solve import _settings

LENGTH, ELEMENTS, END_S, STEP_S = 10.0, 20, 5.0, 0.005
TABLE = {
    2.5: ((-1.569, -0.786), (5.946, 0.971)),
    5.0: ((-0.377, 4.767), (15.41, -3.741)),
}  # loaded end, free end


@pytest.fixture(scope="module")
def flight():
    """The free beam from (6, 0), the loaded end, to (0, 8): force 8 in x and torque -80 for 2.5 s;
    link, times, coordinates."""
    import exudyn as exu
    from exudyn import itemInterface as eii

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    same = lambda value: np.full(ELEMENTS, value)
    values = BeamValues(
        LENGTH / ELEMENTS, same(1.0), same(500.0), same(1e4), same(1e4), same(10.0), 0.0
    )
    link = GeometricallyExactLink(
        mbs,
        values,
        PointMass(),
        PointMass(),
        Frame(6.0, 0.0, float(np.arctan2(8.0, -6.0))),
        (0.0, 0.0),
    )
    marker = mbs.AddMarker(eii.MarkerNodeRigid(nodeNumber=link.nodes[0]))
    on = lambda mbs, t, load: load if t <= 2.5 else [0.0, 0.0, 0.0]
    mbs.AddLoad(
        eii.LoadForceVector(markerNumber=marker, loadVector=[8.0, 0, 0], loadVectorUserFunction=on)
    )
    mbs.AddLoad(
        eii.LoadTorqueVector(
            markerNumber=marker, loadVector=[0, 0, -80.0], loadVectorUserFunction=on
        )
    )
    mbs.Assemble()
    kept = {}

    def after(mbs, t):
        kept[round(t, 6)] = np.array(mbs.systemData.GetODE2Coordinates())
        return True

    mbs.SetPostStepUserFunction(after)
    reference = np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Reference))
    settings = _settings(END_S, round(END_S / STEP_S), LENGTH, coordinates=len(reference))
    assert mbs.SolveDynamic(settings)
    t = np.array(sorted(kept))
    return link, t, np.array([kept[s] for s in t]) + reference, reference


@pytest.mark.parametrize("time_s", TABLE)
def test_both_ends_fly_as_published(flight, time_s):
    """Displacements to 0.5 % of the length."""
    link, t, q, reference = flight
    row, start = q[[np.abs(t - time_s).argmin()]], reference[None]
    for x, expected in zip((0.0, LENGTH - 1e-9), TABLE[time_s], strict=True):
        moved = link.point(row, x)[0] - link.point(start, x)[0]
        assert moved == pytest.approx(expected, abs=5e-3 * LENGTH)


def test_the_centre_of_mass_obeys_the_force(flight):
    """x = 3 + 0.4 t^2 while the force acts, y = 4: exact."""
    link, t, q, _ = flight
    centre = link.moment(q) / LENGTH
    pushed = t <= 2.5
    assert centre[pushed, 0] == pytest.approx(3 + 0.4 * t[pushed] ** 2, abs=2e-3)
    assert centre[~pushed, 0] == pytest.approx(5.5 + 2 * (t[~pushed] - 2.5), abs=1e-2)
    assert centre[:, 1] == pytest.approx(4.0, abs=1e-6)
