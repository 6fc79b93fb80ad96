"""Logs as other programs' libraries write them, and numbers that any of them must read back."""

from __future__ import annotations

import csv
import io
import json

import numpy as np

ROWS = 240


def numbers(seed=1):
    """Times and three columns of doubles with all their digits."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(1e-3, 3e-3, ROWS))
    return t, rng.normal(size=ROWS), rng.normal(scale=1e-3, size=ROWS), rng.normal(size=ROWS)


MAP = """
[time]
column = {time}
unit = "s"
[channel."joint/1/position"]
column = {position}
unit = "rad"
[channel."link/1/tip_deflection"]
column = {deflection}
unit = "m"
[channel."sensor/force"]
column = {force}
unit = "N"
"""


def mapped(time, position, deflection, force):
    """map.toml for four columns, by name or number."""
    spelt = {"time": time, "position": position, "deflection": deflection, "force": force}
    text = MAP.format(**{key: json.dumps(value) for key, value in spelt.items()})
    return (
        text if time is not None else text.replace('column = null\nunit = "s"\n', "rate_Hz = 500\n")
    )


def text_file(path, columns, heads, separator=",", comma=False, encoding="utf-8", above=""):
    """A CSV written by Python's csv module; numbers with all digits."""
    out = io.StringIO(newline="")
    out.write(above)
    rows = csv.writer(out, delimiter=separator, lineterminator="\n")
    rows.writerows(heads)
    for row in np.column_stack(columns).tolist():
        rows.writerow([repr(x).replace(".", ",") if comma else repr(x) for x in row])
    path.write_bytes(out.getvalue().encode(encoding))
    return path


def tdms_file(path, columns, names, units, **properties):
    import nptdms

    made = [
        nptdms.ChannelObject("Data", n, c, {"unit_string": u, **properties})
        for n, c, u in zip(names, columns, units)
    ]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.RootObject({"rig": "ours"}), *made])
    return path


def lvm_file(path, t, columns, separator="\t", comma=False, layout="One"):
    """As LabVIEW's Write to Measurement File leaves it."""
    word = {"\t": "Tab", ",": "Comma", ";": "Semicolon"}[separator]
    n, sign = len(columns), "," if comma else "."
    spell = lambda x: repr(float(x)).replace(".", sign)
    row = lambda key, values: separator.join([key, *values])
    lines = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        f"Separator\t{word}",
    ]
    lines += [f"Decimal_Separator\t{sign}", "Multi_Headings\tYes", f"X_Columns\t{layout}"]
    lines += [
        "Time_Pref\tRelative",
        "Date\t2026/03/02",
        "Time\t10:20:30",
        "***End_of_Header***\t",
        "",
    ]
    step = 0.002
    lines += [row("Channels", [str(n)]), row("Samples", [str(len(t))] * n)]
    lines += [row("Date", ["2026/03/02"] * n), row("Time", ["10:20:30.5"] * n)]
    lines += [row("Y_Unit_Label", ["rad", "m", "N"][:n]), row("X_Dimension", ["Time"] * n)]
    lines += [row("X0", [spell(0.0)] * n), row("Delta_X", [spell(step)] * n), "***End_of_Header***"]
    names = ["Angle", "Deflection", "Force"][:n]
    if layout == "Multi":
        lines.append(
            separator.join(f"X_Value{separator}{name}" for name in names) + f"{separator}Comment"
        )
        body = [
            separator.join(f"{spell(t[k])}{separator}{spell(c[k])}" for c in columns)
            for k in range(len(t))
        ]
    else:
        lines.append(row("X_Value", [*names, "Comment"]))
        first = [""] * len(t) if layout == "No" else [spell(x) for x in t]
        body = [row(first[k], [spell(c[k]) for c in columns]) for k in range(len(t))]
    path.write_text("\n".join([*lines, *body]) + "\n")
    return path


def hdf5_file(path, names, columns, matlab):
    """MATLAB's version 7.3 keeps columns as rows, with its class as an attribute; plain HDF5."""
    import h5py

    with h5py.File(path, "w", userblock_size=512 if matlab else 0) as stored:
        for name, column in zip(names, columns):
            data = stored.create_dataset(name, data=column[None] if matlab else column)
            if matlab:
                data.attrs["MATLAB_class"] = np.bytes_("double")
    if matlab:
        with open(path, "r+b") as stream:
            stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM")
    return path


def json_mcap(path, t, columns, names):
    from mcap.writer import Writer

    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("state", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/rig/state", "json", schema)
        for k, x in enumerate(t.tolist()):
            data = {"clock": x} | {name: c[k] for name, c in zip(names, columns)}
            at = 1_700_000_000_000_000_000 + round(x * 1e9)
            writer.add_message(channel, at, json.dumps(data).encode(), at)
        writer.finish()
    return path


def bag(path, t, columns, storage="sqlite3", stamped=True):
    """A bag of ROS 2 with sensor_msgs/msg/JointState."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    state, header, time = (
        types[name]
        for name in (
            "sensor_msgs/msg/JointState",
            "std_msgs/msg/Header",
            "builtin_interfaces/msg/Time",
        )
    )
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        for k, x in enumerate(t.tolist()):
            stamp = 1_700_000_000_000_000_000 + round(x * 1e9)
            head = (
                header(time(*divmod(stamp, 10**9)), "base") if stamped else header(time(0, 0), "")
            )
            message = state(
                header=head,
                name=["hub", "tip", "load"],
                position=np.array([c[k] for c in columns]),
                velocity=np.zeros(3),
                effort=np.zeros(0),
            )
            writer.write(connection, stamp, store.serialize_cdr(message, state.__msgtype__))
    return path


def klipper(path, t, columns):
    """As Klipper's accelerometer logs are: a comment names the columns."""
    lines = ["#time,accel_x,accel_y,accel_z"]
    lines += [",".join(map(repr, row)) for row in np.column_stack([t, *columns]).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path
