"""Run in a checkout with pins of its own: everything that has a pin is used, on the emulated board.

Prints what was measured, as JSON.
"""

from __future__ import annotations

import json

from boards import CLOCK_HZ, TICK, Rigged
from faults import measure
from flexlab.board.protocol.declaration import PINS, State

# Switches, encoder wires, readings: broken one at a time, each found by its own fault.
CASES = (
    "emergency stop",
    "emergency wire",
    "limit low",
    "limit high",
    "cut A",
    "cut B",
    "cut A 2",
    "cut B 2",
    "swapped encoder",
    "swapped encoder 2",
    "flex open",
    "supply low",
)


def level(r: Rigged, name: str) -> bool:
    return r.board.simulator.level(PINS[name].port, PINS[name].bit)


def motion() -> dict[str, object]:
    """Both joints forth and back: the drivers, the step and direction lines, both encoders, both
    readings, the lamp."""
    with Rigged(trace=("busy",)) as r:
        dark = level(r, "lamp")
        r.go(r.back_and_forth(), 0.0)
        carriage, joint = [], []
        for _ in range(100):
            r.run(0.01)
            carriage.append(r.plant.positions[0])
            joint.append(r.plant.positions[1])
        newest, lit = r.link.newest, level(r, "lamp")
        assert r.state is State.running
        busy = r.board.simulator.edges()
        counts = (r.settings["motor_counts_per_m"], r.settings["stepper_counts_per_rad"])
        return {
            "carriage_m": [max(carriage), carriage[-1]],
            "joint_rad": [max(joint), joint[-1]],
            "encoders": [
                newest["position_1"] / counts[0] - carriage[-1],
                newest["position_2"] / counts[1] - joint[-1],
            ],
            "flex_V": newest["flex"] / 4 / 1024 * 5 - r.plant.flex_V,
            "supply_V": newest["supply"] / 1000 - r.plant.supply_V,
            "lamp": [dark, lit],
            "busy_1_s": sum(up for *_, up in busy) / r.board.now(),
        }


def duty(voltage: float) -> float:
    """The motor's mean voltage / supply with a constant voltage asked for."""
    with Rigged(speed_max_1_m_s=1.0, position_min_1_m=-1.0) as r:
        r.go(r.open_loop(voltage, 0.0), 0.05)
        windows = []
        for _ in range(200):
            r.board.step()
            r.link.poll()
            windows.append(r.board.outputs.duty[0])
        return sum(windows) / len(windows)


if __name__ == "__main__":
    rows = {name: measure(name, "debian") for name in CASES}
    found = {
        name: {"fault": row.fault.name, "ticks": row.after_cause / TICK}
        for name, row in rows.items()
    }
    print(
        json.dumps(
            {
                "clock_Hz": CLOCK_HZ,
                "motion": motion(),
                "duty": [duty(6.0), duty(-6.0)],
                "broken": found,
            }
        )
    )
