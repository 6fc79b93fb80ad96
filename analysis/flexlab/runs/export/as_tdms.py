"""TDMS, the format of LabVIEW and DIAdem: one group `run`, the run's channels, NI's names for units
and times."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from flexura.io import EMULATED, Run, called, emulated
from flexura.io.logs import digest
from flexura.optional import load

GROUP = "run"


def write(run: Run) -> bytes:
    """Metadata as properties of the file (scalars each, everything as JSON in `flexura`), units as
    `unit_string` of the channels.

    Evenly sampled channels have a time base (`wf_start_offset`, `wf_increment`) besides the channel
    `time`.
    """
    nptdms = load("nptdms")
    label = called(run)
    about: dict[str, Any] = {"name": label, "label": label, "flexura": json.dumps(run.meta)}
    about |= {
        k: v
        for k, v in run.meta.items()
        if isinstance(v, bool | int | float | str) and k not in about
    }
    about["digest"] = digest(run)
    if emulated(run):
        about["description"] = EMULATED
    base = _time_base(run.t)
    channels = [
        nptdms.ChannelObject(
            GROUP, "time", np.asarray(run.t, dtype=np.float64), properties={"unit_string": "s"}
        )
    ]
    for name, values in run.channels.items():
        properties = {"unit_string": run.units[name], "description": label} | base
        channels.append(
            nptdms.ChannelObject(
                GROUP, name, np.asarray(values, dtype=np.float64), properties=properties
            )
        )
    out = io.BytesIO()
    with nptdms.TdmsWriter(out) as writer:
        writer.write_segment(
            [nptdms.RootObject(about), nptdms.GroupObject(GROUP, {"label": label}), *channels]
        )
    return out.getvalue()


def _time_base(t: np.ndarray) -> dict[str, Any]:
    step = (t[-1] - t[0]) / (len(t) - 1) if len(t) > 1 else 0.0
    if step <= 0 or np.abs(np.diff(t) - step).max() > 1e-6 * step:
        return {}
    return {"wf_start_offset": float(t[0]), "wf_increment": float(step), "wf_samples": len(t)}
