"""Runs whose answers are known: every link bends like a cantilever loaded at its tip. What stands
in the file of a review."""

from pathlib import Path

import numpy as np

from flexura.io import Run
from flexura.robot import Robot, load

RIG = load(Path(__file__).parents[2] / "model" / "robots" / "rig.toml")
STRIP = RIG.to_dict()["link"][1]
DURATION, RAISED = 2.5, 1.0  # s; the rig's arm is horizontal at 0 and highest at RAISED


def synthetic(
    robot: Robot, source: str = "simulation", *, rate: float = 200.0, late: float = 0.0, **meta
) -> Run:
    """A motion that is consistent in all channels; `late` [s] shifts it, `rate` is in samples a
    second."""
    t = np.arange(round(DURATION * rate) + 1) / rate
    channels, units = {}, {}

    def put(name, values, unit):
        channels[name], units[name] = np.broadcast_to(values, t.shape).astype(float), unit

    x, y, angle = np.zeros((3, len(t)))
    length, bend = 0.0, np.zeros(len(t))  # of the previous link; the base has none
    for i, link in enumerate(robot.links, 1):
        turns, swing = link.joint.type == "R", 0.5 * (1 - np.cos(np.pi * (t - late) / RAISED))
        q = (0.9 / i) * swing if turns else 0.04 + 0.06 * swing
        for part, values, unit in (
            ("position", q, ""),
            ("velocity", np.gradient(q, t), "/s"),
            ("drive", -q, ""),
        ):
            put(
                f"joint/{i}/{part}",
                values,
                {"drive": "N m" if turns else "N"}.get(part, ("rad" if turns else "m") + unit),
            )
        along = q if link.joint.type == "Pa" else np.full(len(t), length)
        px, pw, slope = cantilever(along, length, bend)
        x, y = (
            x + px * np.cos(angle) - pw * np.sin(angle),
            y + px * np.sin(angle) + pw * np.cos(angle),
        )
        angle = angle + slope + (q if turns else link.joint.angle_rad)
        length, bend = (
            link.length_m,
            0.02 * link.length_m * np.sin(4 * np.pi * (t - late)) * (link.elements > 0),
        )
        for part, values in (("x", x), ("y", y), ("angle", angle)):
            put(f"link/{i}/{part}", values, "rad" if part == "angle" else "m")
        if link.flexible:
            put(f"link/{i}/tip_deflection", bend, "m")
            put(f"link/{i}/tip_slope", np.arcsin(1.5 * bend / length), "rad")
            for k in range(9):
                put(
                    f"link/{i}/deflection/{k}",
                    cantilever(np.full(len(t), k * length / 8), length, bend)[1],
                    "m",
                )
    px, pw, _ = cantilever(np.full(len(t), length), length, bend)
    put("tip/x", x + px * np.cos(angle) - pw * np.sin(angle), "m")
    put("tip/y", y + px * np.sin(angle) + pw * np.cos(angle), "m")
    put("energy/kinetic", np.sin(t) ** 2, "J")
    put("energy/potential", 0.0, "J")
    events = [{"t": RAISED, "text": "raised", "level": "WARN"}, {"t": 0.0, "text": "start"}]
    about = {
        "source": source,
        "program": "test",
        "robot": robot.to_dict(),
        "complete": True,
        "events": events,
    }
    return Run(t, channels, units, about | meta)


def cantilever(x, length, tip):
    """Place, deflection and angle at the arc length x of an inextensible link whose deflection is
    that of a cantilever loaded at its tip: sin(angle) = w'."""
    if not length:
        return x, 0 * x, 0 * x
    sine = lambda xi: tip / length * (3 * xi - 1.5 * xi**2)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    ahead = sum(
        w / 2 * x * np.sqrt(1 - sine(x / length * (1 + node) / 2) ** 2)
        for node, w in zip(nodes, weights)
    )
    xi = x / length
    return ahead, tip * (3 * xi**2 - xi**3) / 2, np.arcsin(sine(xi))


def chain(joints: str, **changes) -> Robot:
    """A robot of strips with these joints, such as "R R Pa"; a Pb starts a third of its strip
    out."""
    start = {"R": 0.0, "Pa": 0.0, "Pb": STRIP["length_m"] / 3}
    links = [STRIP | {"joint": {"type": j, "start": start[j]}} for j in joints.split()]
    return Robot.from_dict({"name": f"chain {joints}", "link": links} | changes)


def chunks(rrd, content="/**"):
    from rerun.chunk import RrdReader

    return [c for c in RrdReader(rrd).stream().filter(content=content)]


def entities(rrd):
    return {c.entity_path for c in chunks(rrd) if not c.entity_path.startswith("/__")}


def column(rrd, entity, component, timeline="time"):
    """Index (int64) and the cells of one component, in order."""
    import pyarrow as pa

    index, cells = [], []
    for chunk in chunks(rrd, entity):
        batch = chunk.to_record_batch()
        if component in batch.schema.names and timeline in batch.schema.names:
            index += batch.column(timeline).cast(pa.int64()).to_pylist()
            cells += batch.column(component).to_pylist()
    order = np.argsort(index, kind="stable")
    return np.array(index)[order], [cells[k] for k in order]


def scalars(rrd, entity):
    index, cells = column(rrd, entity, "Scalars:scalars")
    return index, np.array([cell[0] for cell in cells])


def text(rrd, entity="/about", component="TextDocument:text"):
    (cells,) = [
        b.column(component).to_pylist()
        for c in chunks(rrd, entity)
        if component in (b := c.to_record_batch()).schema.names
    ]
    return cells[0][0]
