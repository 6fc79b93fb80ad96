"""`sliding = "nodal"`: simulations with the dissertation's own treatment of Pa on a flexible link
and of Pb, for comparison.

While every slider and every sleeve keeps its node, the robot is one of fixed structure
(`system.nodes`), and the dense equations take it. Where a node changes, the joints, the elastic
unknowns and their rates stay as they are, as in the dissertation's state vector; of a node that
enters its sleeve deflection and angle become 0, which the next element takes up. By how much the
energy jumps is logged. What this costs in accuracy is measured in `docs/theory/nodal-sliding.md`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..io import Tables
from ..system.nodes import Nodes, place, rest_node, rests_in_sleeve
from .dense import Integration
from .problem import Problem, Progress, Solution


def solve(problem: Problem, progress: Progress = None) -> Solution:
    """`dense.solve` for a robot that slides from node to node.

    Of q, qd (n,) what is given for nodes at rest is left out. `meta["energy_jumps"]` lists the
    changes, {t, text, J}, each is also an event, and `meta["energy_error"]` leaves them out.
    """
    return _Nodewise(problem, progress).run()


class _Nodewise(Integration):
    """A run under way, whose `system` has the nodes of the moment."""

    def __init__(self, problem: Problem, progress: Progress) -> None:
        system, q, qd = problem.system, problem.q.copy(), problem.qd.copy()
        fixed = system.fixed(q)
        rest = np.setdiff1d(np.arange(system.n), np.append(system.joint_rows, fixed.elastic_rows))
        q[rest], qd[rest] = 0.0, 0.0
        self.jumps: list[dict[str, Any]] = []
        super().__init__(replace(problem, system=fixed, q=q, qd=qd), progress)

    def bounds(self) -> np.ndarray:
        """Between which positions (N, 2) the joints have their present nodes."""
        out, links, nodes = self.system.limits.copy(), self.system.robot.links, self.system.nodes
        assert nodes is not None
        for i, link in enumerate(links):
            if rests_in_sleeve(link):
                cell = (
                    link.length_m - place(link, nodes[i] + 1),
                    link.length_m - place(link, nodes[i]),
                )
            elif self.system.robot.rides(i):
                cell = place(links[i - 1], nodes[i] - 1), place(links[i - 1], nodes[i])
            else:
                continue
            out[i] = max(out[i, 0], cell[0]), min(out[i, 1], cell[1])
        return out

    def crossed(self, joint: int, upwards: bool) -> bool:
        """Go on to the next node of a joint (from 0), unless it is at an end of its link or one of
        its limits."""
        end, bound = self.system.limits[joint, int(upwards)], self.bounds()[joint, int(upwards)]
        beyond = self.position(self.now, self.z)[joint] - bound
        if bound == end or abs(beyond) > 1e-6:  # there, or in a sleeve
            return super().crossed(joint, upwards)
        before, text = self.energy(), self._change(joint, 1 if upwards else -1)
        jump = self.energy() - before
        self.jumped += jump
        self.jumps.append({"t": self.now, "text": text, "J": jump})
        text = f"{text}: the energy jumps by {jump:.3g} J"
        self.events.append({"t": self.now, "level": "INFO", "name": "node", "text": text})
        return True

    def solution(self, meta: Tables) -> Solution:
        """What was computed, with the energy's jumps."""
        return super().solution(meta | {"energy_jumps": self.jumps})

    def _change(self, i: int, step: int) -> str:
        """Take the next node of joint i (from 0), upwards or downwards; says what happened."""
        links, n = self.system.robot.links, self.system.n
        structure = self.system.assembly.structure
        assert isinstance(structure, Nodes) and self.system.nodes is not None
        nodes = list(self.system.nodes)
        if rests_in_sleeve(links[i]):
            nodes[i] -= step
            said = (
                f"node {nodes[i] + 1 if step > 0 else nodes[i]} of link {i + 1} "
                f"{'left' if step > 0 else 'entered'} its sleeve"
            )
            if step < 0:
                for y in (self.z[:n], self.z[n : 2 * n]):
                    rest_node(structure, i, nodes[i], y)
            if i + 1 < len(links) and self.system.robot.rides(i + 1):
                nodes[i + 1] = max(nodes[i + 1], nodes[i] + 1)
        else:
            nodes[i] += step
            said = f"joint {i + 1} (Pa) went on to node {nodes[i]} of link {i}"
        self.use(replace(self.system, nodes=tuple(nodes)))
        return said
