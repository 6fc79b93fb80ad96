"""The names of a gains file: each has the number of its joint, and by its units the output: V,
rad/s, and in the model only N or N m (`kp_1_N_m_rad`). The terms are those of (70).
"""

from collections.abc import Iterable

MAX_JOINTS = 9
# names of PID's fields, {} the joint's number, by output
ENDS = {
    "motor": {
        "kp": "kp_{}_V_m",
        "ki": "ki_{}_V_m_s",
        "kd": "kd_{}_V_s_m",
        "kf": "kf_{}_V_m",
        "kg": "kg_{}_V_s_m",
        "ks": "ks_{}_V_rad",
        "kt": "kt_{}_V_s_rad",
        "kv": "kv_{}_V_s_m",
        "kc": "kc_{}_V",
        "jo": "jo_{}_V_s2_m",
        "bo": "bo_{}_V_s_m",
        "limit": "voltage_max_{}_V",
        "slew": "voltage_slew_{}_V_s",
    },
    "turning motor": {  # its joint turns, and positions are in radians
        "kp": "kp_{}_V_rad",
        "ki": "ki_{}_V_rad_s",
        "kd": "kd_{}_V_s_rad",
        "kf": "kf_{}_V_m",
        "kg": "kg_{}_V_s_m",
        "ks": "ks_{}_V_rad",
        "kt": "kt_{}_V_s_rad",
        "kv": "kv_{}_V_s_rad",
        "kc": "kc_{}_V",
        "jo": "jo_{}_V_s2_rad",
        "bo": "bo_{}_V_s_rad",
        "limit": "voltage_max_{}_V",
        "slew": "voltage_slew_{}_V_s",
    },
    "stepper": {
        "kp": "kp_{}_1_s",
        "ki": "ki_{}_1_s2",
        "kd": "kd_{}",
        "kf": "kf_{}_rad_s_m",
        "kg": "kg_{}_rad_m",
        "ks": "ks_{}_1_s",
        "kt": "kt_{}",
        "kv": "kv_{}",
        "limit": "rate_max_{}_rad_s",
        "slew": "acceleration_max_{}_rad_s2",
    },
    "force": {
        "kp": "kp_{}_N_m",
        "ki": "ki_{}_N_m_s",
        "kd": "kd_{}_N_s_m",
        "kf": "kf_{}_N_m",
        "kg": "kg_{}_N_s_m",
        "ks": "ks_{}_N_rad",
        "kt": "kt_{}_N_s_rad",
        "kv": "kv_{}_N_s_m",
        "kc": "kc_{}_N",
        "jo": "jo_{}_N_s2_m",
        "bo": "bo_{}_N_s_m",
        "limit": "force_max_{}_N",
        "slew": "force_slew_{}_N_s",
    },
    "torque": {
        "kp": "kp_{}_N_m_rad",
        "ki": "ki_{}_N_m_rad_s",
        "kd": "kd_{}_N_m_s_rad",
        "kf": "kf_{}_N_m_m",
        "kg": "kg_{}_N_m_s_m",
        "ks": "ks_{}_N_m_rad",
        "kt": "kt_{}_N_m_s_rad",
        "kv": "kv_{}_N_m_s_rad",
        "kc": "kc_{}_N_m",
        "jo": "jo_{}_N_m_s2_rad",
        "bo": "bo_{}_N_m_s_rad",
        "limit": "torque_max_{}_N_m",
        "slew": "torque_slew_{}_N_m_s",
    },
}
_ANY = {
    "setpoint_Hz": "setpoint_{}_Hz",
    "observer_Hz": "observer_{}_Hz",
    "delay_s": "delay_{}_s",
}
# the board's motors share these
BOARDS = {
    "voltage_max_V": "voltage_max_1_V",
    "voltage_slew_V_s": "voltage_slew_1_V_s",
}
SHARED = ("rate_Hz", "derivative_Hz", "deflection_Hz")
BOARD = (  # the settings of the board that are a controller's, in its order
    "voltage_max_V",
    "voltage_slew_V_s",
    "rate_max_2_rad_s",
    "acceleration_max_2_rad_s2",
    "kp_1_V_m",
    "ki_1_V_m_s",
    "kd_1_V_s_m",
    "kf_1_V_m",
    "kg_1_V_s_m",
    "kv_1_V_s_m",
    "kc_1_V",
    "kp_2_1_s",
    "ki_2_1_s2",
    "kd_2",
    "kf_2_rad_s_m",
    "kg_2_rad_m",
    "kv_2",
    "kp_1_V_rad",
    "ki_1_V_rad_s",
    "kd_1_V_s_rad",
    "kv_1_V_s_rad",
    "kp_2_V_rad",
    "ki_2_V_rad_s",
    "kd_2_V_s_rad",
    "kf_2_V_m",
    "kg_2_V_s_m",
    "kv_2_V_s_rad",
    "kc_2_V",
    "derivative_Hz",
    "deflection_Hz",
    "setpoint_1_Hz",
    "setpoint_2_Hz",
    "feedback_2",
    "observer_1_Hz",
    "jo_1_V_s2_m",
    "bo_1_V_s_m",
    "jo_1_V_s2_rad",
    "bo_1_V_s_rad",
    "observer_2_Hz",
    "jo_2_V_s2_rad",
    "bo_2_V_s_rad",
)


def _names() -> dict[str, list[tuple[int, str, str]]]:
    """Known names: joint (from 0), output ("" any) and PID's field of each; `ks_1_N_m_rad` is a
    torque's alone."""
    out: dict[str, list[tuple[int, str, str]]] = {}
    for i in range(MAX_JOINTS):
        for kind, ends in ENDS.items():
            for field, name in ends.items():
                out.setdefault(name.format(i + 1), []).append((i, kind, field))
        for field, name in _ANY.items():
            out[name.format(i + 1)] = [(i, "", field)]
        out[f"feedback_{i + 1}"] = [(i, "stepper", "encoder")]
    return out | {board: out[name] for board, name in BOARDS.items()}


NAMES = _names()


def fitting(given: Iterable[str]) -> list[str]:
    """The names that may stand beside others: their joint has the same output.

    Args:
        given: names; unknown ones do not count.

    Returns:
        The names, without those that are given.
    """
    outputs: dict[int, set[str]] = {}
    for name in given:
        for i in {joint for joint, _, _ in NAMES.get(name, [])}:
            own = {kind for joint, kind, _ in NAMES[name] if joint == i}
            outputs[i] = outputs.get(i, set(ENDS)) & (own if "" not in own else set(ENDS))
    fits = lambda i, kind: kind == "" or kind in outputs.get(i, ENDS)
    known = [name for name, uses in NAMES.items() if any(fits(i, kind) for i, kind, _ in uses)]
    return [name for name in (*known, *SHARED) if name not in set(given)]
