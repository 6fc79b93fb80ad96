"""The gains file: a table `[controller]` of settings by their firmware names, with units, shared by
model, board and tuning.

    [controller]
    kp_1_V_m = 2000.0          # joint 1 on a motor: u in V; kp_1_V_rad where it turns
    ki_1_V_m_s = 4000.0
    voltage_max_V = 12.0
    kp_2_1_s = 20.0            # joint 2 on a stepper: u in rad/s
    rate_max_2_rad_s = 6.0

    [[output]]                 # of joint 1, for the model only; the board has it. One table a
    joint, or none at all kind = "motor" force_per_V = 13.1         # N damping = 1180.0           #
    N s/m

A name says its joint and, by its units, what the output is: V, rad/s, and in the model only N or N
m (`kp_1_N_m_rad`). The terms are those of `control.py`.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from ..errors import InputError
from ..io import Tables, find, read_toml, write_toml
from ..signals import PLAUSIBLE, Signal, constant, is_plausible
from .controller import Controller
from .designed import Designed, read_design
from .gain_names import BOARD, BOARDS, ENDS, NAMES, SHARED
from .pid import PID, Force, Motor, Output, Stepper

_MOTORS = ("motor", "turning motor")
_OUTPUTS = {
    "motor": Motor,
    "turning motor": Motor,
    "stepper": Stepper,
    "force": Force,
    "torque": Force,
}


@dataclass(frozen=True)
class Gains:
    """Settings of a controller by name, and what stands behind its joints, () where the file does
    not say."""

    settings: dict[str, float]
    outputs: tuple[Output, ...] = ()
    file: str = ""

    @property
    def kinds(self) -> list[str]:
        """Each joint's output: "motor", "turning motor", "stepper", "force" or "torque"."""
        found: dict[int, set[str]] = {}
        for name in self.settings:
            if name not in SHARED:
                kinds = {kind for _, kind, _ in NAMES[name]} - {""}
                i = NAMES[name][0][0]
                found[i] = found.get(i, set(ENDS)) & (kinds or set(ENDS))
        for i, kinds in found.items():
            if kinds == set(_MOTORS):  # no name tells them apart: no term in a position
                found[i] = {"motor"}
        for i in range(max(found, default=0) + 1):
            if len(found.get(i, ())) != 1:
                expected = (
                    f"expected names of joint {i + 1} with the units of one output: V, "
                    f"rad/s, N or N m"
                )
                raise InputError(expected, key="controller", file=self.file)
        return [found[i].copy().pop() for i in range(len(found))]

    def controller(
        self, references: Sequence[Signal], outputs: Sequence[Output] | None = None
    ) -> Controller:
        """The controller along references.

        Args:
            references: one Signal a joint [m or rad].
            outputs: one a joint; None: the file's. A force needs none. A stepper's joint follows
                its pulses, one tick late as on the board, unless `delay_2_s` says otherwise.

        Returns:
            The Controller.

        Raises:
            InputError: another number of references, or a motor or stepper without its output.
        """
        kinds, rate = self.kinds, self.settings.get("rate_Hz", 1000.0)
        if len(references) != len(kinds):
            expected = f"expected gains of {len(references)} joints, one for each reference"
            raise InputError(expected, key="controller", value=len(kinds), file=self.file)
        joints = []
        for i, (kind, reference) in enumerate(zip(kinds, references, strict=True)):
            given: dict[str, Any] = {"delay_s": 1 / rate} if kind == "stepper" and rate > 0 else {}
            given |= (
                {"derivative_Hz": self.settings["derivative_Hz"]}
                if "derivative_Hz" in self.settings
                else {}
            )
            for name, value in self.settings.items():
                if name not in SHARED:
                    given |= {
                        field: value
                        for j, own, field in NAMES[name]
                        if (j == i or name in BOARDS) and own in ("", kind)
                    }
            encoder = given.pop("encoder", 0.0) >= 0.5
            output = self._output(i, kind, outputs)
            joints.append(
                PID(reference, Stepper(output.stiffness, output.damping, encoder), **given)
                if isinstance(output, Stepper)
                else PID(reference, output, **given)
            )
        return Controller(tuple(joints), rate, self.settings.get("deflection_Hz", 50.0))

    def _output(self, i: int, kind: str, outputs: Sequence[Output] | None) -> Output:
        have = self.outputs if outputs is None else outputs
        if kind in ("force", "torque"):
            return Force()
        if i < len(have) and isinstance(have[i], _OUTPUTS[kind]):
            return have[i]
        if kind == "stepper" and i >= len(have):
            return Stepper()
        raise InputError(
            f'missing: expected a table with kind = "{kind.rpartition(" ")[2]}"',
            key=f"output[{i + 1}]",
            file=self.file,
        )

    def board(self) -> dict[str, float]:
        """The board's settings that these gains are.

        Returns:
            Settings by their names in the firmware.

        Raises:
            InputError: the board has no such term: terms in the slope, forces, another rate.
        """
        for name, value in self.settings.items():
            if name == "rate_Hz" and value == 1000.0:
                continue
            if name not in BOARD and value != 0.0:
                expected = "expected settings that the board has too"
                raise InputError(expected, key=f"controller.{name}", value=value, file=self.file)
        return {name: self.settings[name] for name in BOARD if name in self.settings}

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write a gains file.

        Args:
            path: where to; a file there is replaced as a whole.
        """
        tables = []
        for kind, output in zip(self.kinds, self.outputs, strict=False):
            given = {
                name: value
                for name, value in vars(output).items()
                if name != "encoder" and value is not None
            }
            tables.append({"kind": kind.rpartition(" ")[2], **given})
        write_toml(path, {"controller": self.settings} | ({"output": tables} if tables else {}))


def from_board(values: Mapping[str, float]) -> Gains:
    """The gains among the settings of a board, of the drives that it has.

    A setting that is missing, in a run of an older firmware, is off.
    """
    first = "turning motor" if values.get("drive_1", 1.0) > 1.5 else "motor"
    second = ("", "stepper", "turning motor")[round(values.get("drive_2", 1.0))]

    def has(name: str) -> bool:
        if name in SHARED or name in BOARDS:
            return True
        here = (first, second)
        return any(here[i] and kind in ("", here[i]) for i, kind, _ in NAMES[name] if i < 2)

    here = [name for name in BOARD if name in values and has(name)]
    return Gains({name: float(values[name]) for name in here})


def load(path: str | os.PathLike[str]) -> Gains:
    """Read a gains file of a PID.

    Args:
        path: the file's path, or the name of a controller that comes with flexura.

    Returns:
        The Gains.

    Raises:
        InputError: no such file, or a wrong value; it names file, key, value and what was expected.
    """
    found = load_controller(path)
    if isinstance(found, Designed):
        expected = "expected the gains of a PID: a controller that is designed runs in simulations"
        raise InputError(expected, key="controller.type", value=found.kind, file=found.file)
    return found


def load_controller(path: str | os.PathLike[str]) -> Gains | Designed:
    """Read a gains file of any type; see `load`.

    Args:
        path: the file's path, or the name of a controller that comes with flexura.

    Returns:
        The Gains of a PID, or with `type = "lqg"` or `"mpc"` the design.

    Raises:
        InputError: as `load`.
    """
    found = find(path, "controllers")
    name = os.fspath(found)
    data = read_toml(found)
    try:
        table = data.get("controller")
        if isinstance(table, dict) and "type" in table:
            return read_design(data, name)
        return _gains(data, name)
    except InputError as error:
        raise error if error.file else error.in_file(name) from None


def _gains(data: Tables, file: str) -> Gains:
    for key, value in data.items():
        if key not in ("controller", "output"):
            raise InputError("an unknown key; known here: controller, output", key=key, value=value)
    table = data.get("controller")
    if not isinstance(table, dict) or not table:
        raise InputError(
            "missing: expected a table [controller] of settings", key="controller", value=table
        )
    settings = {}
    for key, value in table.items():
        if key not in NAMES and key not in SHARED:
            near = difflib.get_close_matches(key, [*NAMES, *SHARED], 1, 0.6)
            hint = (
                f"; did you mean {near[0]}?" if near else "; see firmware/README.md, the controller"
            )
            raise InputError(f"an unknown setting{hint}", key=f"controller.{key}", value=value)
        if not is_plausible(value):
            raise InputError(f"expected {PLAUSIBLE}", key=f"controller.{key}", value=value)
        settings[key] = float(value)
    tables = data.get("output", [])
    if not isinstance(tables, list) or not all(isinstance(entry, dict) for entry in tables):
        raise InputError("expected tables [[output]], one a joint", key="output", value=tables)
    gains = Gains(
        settings,
        tuple(_read_output(entry, f"output[{i}]") for i, entry in enumerate(tables, 1)),
        file,
    )
    try:
        gains.controller([_REST] * len(gains.kinds), [o or _ANYTHING[k] for k, o in _padded(gains)])
    except InputError as error:
        if error.key.startswith(("output", "controller")):
            raise
        shown = next(
            (
                name
                for name in settings
                if any(field == error.key for _, _, field in NAMES.get(name, []))
            ),
            error.key,
        )
        raise InputError(error.expected, key=f"controller.{shown}", value=error.value) from None
    return gains


def _padded(gains: Gains) -> list[tuple[str, Output | None]]:
    """Kind and output of each joint, None where the file does not say."""
    kinds = gains.kinds
    return list(zip(kinds, [*gains.outputs, *[None] * len(kinds)], strict=False))


def _read_output(entry: dict[str, Any], key: str) -> Output:
    kind = entry.get("kind")
    known_kinds = [name for name in _OUTPUTS if " " not in name]
    if not isinstance(kind, str) or kind not in known_kinds:
        raise InputError(f"expected one of {', '.join(known_kinds)}", key=f"{key}.kind", value=kind)
    known = [f.name for f in fields(_OUTPUTS[kind]) if f.name != "encoder"]
    for name, value in entry.items():
        if name != "kind" and name not in known:
            raise InputError(
                f"an unknown key; known here: {', '.join(['kind', *known])}",
                key=f"{key}.{name}",
                value=value,
            )
        if name != "kind" and not (is_plausible(value) and value >= 0):
            raise InputError(
                "expected a finite number from 0 to 1e12", key=f"{key}.{name}", value=value
            )
    if kind == "motor" and not {"force_per_V", "damping"} <= set(entry):
        raise InputError(
            "missing: a motor has force_per_V [N or N m] and damping [N s/m or N m s/rad]", key=key
        )
    return _OUTPUTS[kind](**{name: float(value) for name, value in entry.items() if name != "kind"})


_REST = constant(0.0)
_ANYTHING: dict[str, Output] = {
    "motor": Motor(1.0, 0.0),
    "turning motor": Motor(1.0, 0.0),
    "stepper": Stepper(),
    "force": Force(),
    "torque": Force(),
}
