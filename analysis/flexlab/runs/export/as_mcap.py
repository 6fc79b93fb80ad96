"""MCAP, the container of ROS 2 and Foxglove: one topic a channel, std_msgs/msg/Float64 in CDR, so
that common viewers plot it; "joint/1/position" is the topic `/joint_1/position`, as ROS 2 allows
it."""

from __future__ import annotations

import io
import json
import struct
from datetime import datetime

import numpy as np

from flexura.errors import InputError
from flexura.io import EMULATED, Run, called, emulated
from flexura.optional import load

from .names import topics

CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
SCHEMA = "std_msgs/msg/Float64"


def write(run: Run) -> bytes:
    """Log times are the run's times after its start, to a nanosecond; `/time` has them exactly.

    The start is `started`, its clock's, or 1970.

    Names and units of the channels stand in their metadata, the run's in the metadata record
    `flexura`. Raises InputError for a start that is no time, or a time before 1970.
    """
    start = _start_ns(run)
    stamps = start + np.rint(run.t * 1e9).astype(np.int64)
    if len(stamps) and stamps[0] < 0:
        given = run.meta.get("started")
        raise InputError(
            "expected times that are not before 1970: MCAP has no others",
            key="started",
            value=given,
        )
    label = called(run)
    out = io.BytesIO()
    writing = load("mcap.writer")
    load("zstandard", "export")  # mcap does not say what is wrong with it
    writer = writing.Writer(out)
    writer.start(profile="ros2", library="flexura")
    schema = writer.register_schema(name=SCHEMA, encoding="ros2msg", data=b"float64 data\n")
    about = {"label": label, "start_ns": str(start), "meta": json.dumps(run.meta)}
    writer.add_metadata("flexura", about | ({"description": EMULATED} if emulated(run) else {}))
    named = topics(("time", *run))
    for name, values, unit in (("time", run.t, "s"), *((n, run[n], run.units[n]) for n in run)):
        channel = writer.register_channel(
            topic=named[name],
            message_encoding="cdr",
            schema_id=schema,
            metadata={"unit": unit, "label": label, "channel": name},
        )
        for k, (at, value) in enumerate(
            zip(stamps.tolist(), np.asarray(values, dtype=float).tolist(), strict=True)
        ):
            data = CDR_LITTLE_ENDIAN + struct.pack("<d", value)
            writer.add_message(
                channel_id=channel, log_time=at, publish_time=at, sequence=k, data=data
            )
    writer.finish()
    return out.getvalue()


def _start_ns(run: Run) -> int:
    started = run.meta.get("started")
    if started is None:
        return round(float(run.meta.get("clock_start_s", 0.0)) * 1e9)
    try:
        moment = datetime.fromisoformat(str(started))
        return round(moment.timestamp() * 1e6) * 1000
    except (ValueError, OverflowError, OSError):
        raise InputError(
            "expected a time in ISO form, such as 2026-11-24T11:00:00+00:00",
            key="started",
            value=started,
        ) from None
