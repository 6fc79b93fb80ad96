"""Loads on the links of the twin: forces and moments of Exudyn on markers of its bodies.

Their values are set once a step. Exudyn itself turns a force that is fixed to its section, and
finds the generalised forces from its own shapes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..optional import Optional
from ..signals import Loads
from .links.part import Part

eii = Optional("exudyn.itemInterface")


class LinkLoads:
    """Loads on links in Exudyn's system, with the values they have at its time 0.

    Args:
        mbs: Exudyn's system.
        parts: the links.
        loads: what acts on them.
        since: the loads' time at Exudyn's time 0 [s].
    """

    def __init__(self, mbs: Any, parts: list[Part], loads: Loads, since: float = 0.0) -> None:
        self.mbs, self.loads, self.since, self.items = mbs, loads, since, []
        self.applied = self.values(0.0)
        for load, value in zip(loads.each, self.applied, strict=True):
            assert load.at_m is not None
            marker = parts[load.link - 1].marker_at(mbs, load.at_m)
            force = eii.LoadForceVector(
                markerNumber=marker,
                loadVector=[value[0], value[1], 0.0],
                bodyFixed=load.frame == "link",
            )
            moment = eii.LoadTorqueVector(markerNumber=marker, loadVector=[0.0, 0.0, value[2]])
            self.items.append((mbs.AddLoad(force), mbs.AddLoad(moment)))

    def values(self, t: float) -> np.ndarray:
        """Forces [N] and moments [N m] at Exudyn's time t [s], (L, 3)."""
        return self.loads.values(t + self.since)

    @property
    def breaks(self) -> np.ndarray:
        """Instants of Exudyn's time at which a load isn't smooth [s]."""
        return self.loads.breaks - self.since

    def apply(self, values: np.ndarray) -> None:
        """Set forces [N] and moments [N m], (L, 3)."""
        for items, now, before in zip(self.items, values, self.applied, strict=True):
            if np.any(now[:2] != before[:2]):
                self.mbs.SetLoadParameter(items[0], "loadVector", [now[0], now[1], 0.0])
            if now[2] != before[2]:
                self.mbs.SetLoadParameter(items[1], "loadVector", [0.0, 0.0, now[2]])
        self.applied = values
