"""A Run as the tables of other packages: pandas and xarray."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..optional import Optional

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
else:
    pd = Optional("pandas")
    xr = Optional("xarray")


def pandas_frame(
    t: np.ndarray,
    channels: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    meta: Mapping[str, Any],
) -> pd.DataFrame:
    """Channels (T,) as columns over the index `t` [s]; `attrs` has "units" by name, and "meta".

    Raises:
        Missing: pandas is not installed.
    """
    frame = pd.DataFrame(
        {name: np.array(values, dtype=float) for name, values in channels.items()},
        index=pd.Index(np.array(t, dtype=float), name="t"),
    )
    frame.attrs = {"units": {"t": "s"} | dict(units), "meta": dict(meta)}
    return frame


def xarray_dataset(
    t: np.ndarray,
    channels: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    meta: Mapping[str, Any],
) -> xr.Dataset:
    """Channels (T,) as variables over the dimension `t`, each with its unit in attrs["units"].

    Raises:
        Missing: xarray is not installed.
    """
    variables = {
        name: ("t", np.array(values, dtype=float), {"units": units[name]})
        for name, values in channels.items()
    }
    clock = ("t", np.array(t, dtype=float), {"units": "s"})
    return xr.Dataset(variables, coords={"t": clock}, attrs=dict(meta))
