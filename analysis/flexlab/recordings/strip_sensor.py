"""The sensor of an experiment, from what the rig file and the session say of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..rig.configuration import calibration as calibration_of
from ..rig.configuration import configuration
from ..rig.description import RigSetup
from ..rig.sensors import Accelerometer, Calibration
from .unit_conversion import Sensor


def sensor_of(setup: RigSetup, measured: Calibration | None = None) -> Sensor:
    """The sensor of a rig, its straight strip's reading as calibrated.

    Args:
        setup: the rig.
        measured: a calibration that takes the place of the rig file's.
    """
    rig = setup.rig
    found = measured or calibration_of(setup)
    if found is None:  # readings that are no deflection
        zero = configuration(setup)["flex_zero"]
        found = Calibration(zero=min(max(zero, 1e-6), 1 - 1e-6), c1_m=0.0)
    kind = next(
        (name for name in ("flex", "strain_gauge", "accelerometer") if getattr(rig, name)), ""
    )
    scale = rig.sensor.V_s2_per_m if isinstance(rig.sensor, Accelerometer) else 1.0
    return Sensor(found, found.zero, kind=kind, strip=setup.strip, V_s2_per_m=scale)


def sensor_spec(sensor: Sensor) -> dict[str, Any]:
    """Entries of session.json: calibration and kind of the sensor."""
    return {
        "calibration": sensor.calibration.model_dump(mode="json"),
        "sensor": {
            "kind": sensor.kind,
            "strip": sensor.strip,
            "V_s2_per_m": sensor.V_s2_per_m,
        },
    }


def sensor_of_session(session: Mapping[str, Any]) -> Sensor:
    """The sensor of a recording; one without an entry has a flex sensor on link 2."""
    calibration = Calibration.model_validate(session["calibration"])
    rest = session.get("rest") or {"zero": calibration.zero}
    return Sensor(calibration, **rest, **session.get("sensor", {}))
