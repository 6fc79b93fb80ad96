"""A controller's settings by their firmware names, shared by model, board and tuning."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...errors import InputError
from ...io import write_toml
from ...signals import Signal
from ..controller import Controller
from ..pid import PID, Force, Motor, Output, Stepper
from .names import BOARD, BOARDS, ENDS, NAMES, SHARED

_MOTORS = ("motor", "turning motor")
FITTING = {  # outputs of a joint that turns, and of one that slides; "": any
    True: {"turning motor", "stepper", "torque", ""},
    False: {"motor", "stepper", "force", ""},
}
OUTPUTS = {
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

    def check_joints(self, turns: Sequence[bool]) -> None:
        """Refuse settings whose units do not fit a robot's joints.

        Args:
            turns: whether each joint turns.

        Raises:
            InputError: a setting of a joint that turns is in m, or one of a joint that slides in
                rad.
        """
        for name, value in self.settings.items():
            if name in SHARED or name in BOARDS:
                continue
            i, kinds = NAMES[name][0][0], {kind for _, kind, _ in NAMES[name]}
            if i < len(turns) and not kinds & FITTING[turns[i]]:
                expected = f"expected the unit of a joint that {'turns' if turns[i] else 'slides'}"
                raise InputError(expected, key=f"controller.{name}", value=value, file=self.file)

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
            expected = f"gains of {len(kinds)} joints: expected those of {len(references)}, one "
            expected += "for each reference"
            raise InputError(expected, key="controller", file=self.file)
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
        if i < len(have) and isinstance(have[i], OUTPUTS[kind]):
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
    """The gains among all settings of a board.

    Args:
        values: settings by their names in the firmware. One that is missing, in a run of an older
            firmware, is off.

    Returns:
        The Gains of the drives that the board has.
    """
    first = "turning motor" if values.get("drive_1", 1.0) > 1.5 else "motor"
    second = ("", "stepper", "turning motor")[round(values.get("drive_2", 1.0))]

    def has(name: str) -> bool:
        if name in SHARED or name in BOARDS:
            return True
        here = (first, second)
        return any(here[i] and kind in ("", here[i]) for i, kind, _ in NAMES[name] if i < 2)

    return Gains({name: float(values[name]) for name in BOARD if name in values and has(name)})
