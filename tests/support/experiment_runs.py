"""Runs of an experiment from a few channels."""

import numpy as np

from flexura.io import Run


def run(t, **channels):
    names = {
        name.replace("__", "/"): np.asarray(values, dtype=float)
        for name, values in channels.items()
    }
    return Run(
        np.asarray(t, dtype=float),
        names,
        {n: "rad" if n.startswith("joint/2") else "m" for n in names},
        {"source": "experiment"},
    )
