"""The board's settings that follow from a rig file, and the sensor's calibration."""

from __future__ import annotations

import math

from flexura.errors import InputError

from ..board.protocol.declaration import CONFIG
from .description import DERIVED_SETTINGS, RigSetup
from .sensors import LOGIC_V, Accelerometer, Calibration, Flex, StrainGauge

FULL_RANGE = (0.0, 1.0)  # readings that are no fault, where nothing is connected
E24 = (1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0) + (
    3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5, 8.2, 9.1,
)  # fmt: skip


def configuration(setup: RigSetup) -> dict[str, float]:
    """All settings of the board, by name, in the protocol's order.

    d = lead counts / (4 pulses ratio), theta = 2 pi steps / (full steps x microsteps).

    Args:
        setup: the rig.

    Returns:
        Settings in SI units.

    Raises:
        InputError: a derived setting is outside the board's range.
    """
    rig = setup.rig
    derived = _drives(setup) | {
        "supply_V": rig.driver.supply_V,
        "supply_divider": rig.driver.supply_divider,
    }
    found = calibration(setup)
    if found is not None:
        derived |= {
            f"flex_{key}": value for key, value in found.model_dump(exclude={"covariance"}).items()
        }
    else:
        derived["flex_zero"] = getattr(rig.sensor, "zero_V", 0.0) / LOGIC_V
    assert set(derived) <= set(DERIVED_SETTINGS)
    for name, value in derived.items():
        item = CONFIG[name]
        if not item.least <= value <= item.greatest:
            expected = (
                f"expected a rig whose {name} lies between {item.least:g} and {item.greatest:g} "
                f"({item.text}){_divider_advice(setup, name)}"
            )
            raise InputError(expected, key=name, value=value, file=setup.file)
    unread = {} if rig.sensor else dict(zip(("flex_min", "flex_max"), FULL_RANGE, strict=True))
    given = derived | rig.board | unread
    return {name: given.get(name, item.default) for name, item in CONFIG.items()}


def _drives(setup: RigSetup) -> dict[str, float]:
    """Settings of the drives: which there are, their counts and the joints' limits."""
    rig, turn = setup.rig, 2 * math.pi
    counts = 4 * rig.motor.encoder_pulses * rig.motor.gear_ratio
    low, high = setup.limits[0]
    out: dict[str, float] = {"drive_2": 0.0, "encoder_2": 0.0}
    if rig.screw:
        out |= {"drive_1": 1.0, "motor_counts_per_m": counts / rig.screw.lead_m}
        out |= {"position_min_1_m": low, "position_max_1_m": high}
    else:
        out |= {"drive_1": 2.0, "motor_1_counts_per_rad": counts / turn}
        out |= {"position_min_1_rad": low, "position_max_1_rad": high}
    if rig.stepper:
        stepper, pulses = rig.stepper, rig.stepper.encoder_pulses
        steps = stepper.full_steps_per_turn * stepper.microsteps / turn
        out |= {"drive_2": 1.0, "stepper_steps_per_rad": steps}
        out |= {"encoder_2": float(pulses is not None)}
        out["stepper_counts_per_rad"] = steps if pulses is None else 4 * pulses / turn
    if rig.motor_2:
        counts = 4 * rig.motor_2.encoder_pulses * rig.motor_2.gear_ratio
        out |= {"drive_2": 2.0, "encoder_2": 1.0, "motor_2_counts_per_rad": counts / turn}
    if rig.joints == 2:
        out["position_min_2_rad"], out["position_max_2_rad"] = setup.limits[1]
    return out


def tip_per_bend(setup: RigSetup) -> float:
    """Tip deflection for a radian of bend under the flex sensor [m/rad], a load at the tip.

    alpha = (P / EI)(L s - s^2 / 2) between the sensor's ends, w = P L^3 / (3 EI), so w / alpha =
    L^3 / (3 [L s - s^2 / 2]) (Euler-Bernoulli).

    Args:
        setup: the rig.
    """
    flex, length = setup.rig.flex, setup.robot.links[-1].length_m
    assert flex is not None
    ends = (flex.from_m, flex.from_m + flex.length_m)
    low, high = (length * s - s**2 / 2 for s in ends)
    return length**3 / (3 * (high - low))


def calibration(setup: RigSetup) -> Calibration | None:
    """The measured calibration, or that of the sensor's data; None without a deflection sensor.

    Flex sensor: with the reading r = R_f / (R_s + R_f), and z that of the straight strip, the bend
    is (R_f / k)(1 / r - 1 / z). Its expansion to third order in x = r - z, times the tip deflection
    for a radian, is the calibration. Strain gauge: strain = -distance x curvature, and w =
    curvature L^3 / (3 (L - s)) under a load at the tip.

    Args:
        setup: the rig.

    Returns:
        The calibration, or None.
    """
    sensor = setup.rig.sensor
    if sensor is None or isinstance(sensor, Accelerometer):
        return None
    if sensor.calibration is not None:
        return sensor.calibration
    if isinstance(sensor, Flex):
        z = sensor.divider_ohm / (sensor.straight_ohm + sensor.divider_ohm)
        scale = sensor.sign * tip_per_bend(setup) * sensor.divider_ohm / sensor.ohm_per_rad
        return Calibration(zero=z, c1_m=-scale / z**2, c2_m=scale / z**3, c3_m=-scale / z**4)
    return Calibration(
        zero=sensor.zero_V / LOGIC_V,
        c1_m=-LOGIC_V
        / (sensor.V_per_strain * sensor.distance_m)
        * tip_per_curvature(setup, sensor),
    )


def tip_per_curvature(setup: RigSetup, gauge: StrainGauge) -> float:
    """Tip deflection for a curvature of 1/m at the gauge [m^2], of a link loaded at its tip."""
    length = setup.robot.links[-1].length_m
    return length**3 / (3 * (length - gauge.at_m))


def _divider_advice(setup: RigSetup, name: str) -> str:
    """Which resistors the flex sensor could be read with instead, where its calibration is too
    steep for the board."""
    flex = setup.rig.flex
    if not name.startswith("flex_c") or flex is None or flex.calibration is not None:
        return ""
    scale = tip_per_bend(setup) / flex.ohm_per_rad

    def fits(divider: float) -> bool:
        z = divider / (flex.straight_ohm + divider)
        terms = {f"flex_c{n}_m": scale * divider / z ** (n + 1) for n in (1, 2, 3)}
        return all(value <= CONFIG[key].greatest for key, value in terms.items())

    series = [round(value * 10**decade) for decade in range(2, 7) for value in E24]
    fitting = [ohm for ohm in series if fits(ohm)]
    if not fitting:
        return "; no divider_ohm makes it fit: measure a calibration, or take a stiffer sensor"
    near = min(fitting, key=lambda ohm: abs(math.log(ohm / flex.divider_ohm)))
    return f"; flex.divider_ohm = {near} would fit"
