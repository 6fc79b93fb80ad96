"""The emulated board: the firmware's own binary on a simulated ATmega2560, in lockstep with a
plant.

Time is the processor's cycles. For each window the plant is given what the board did during the
window before and returns what the rig's sensors say at the end of this one; between the two ends
shafts move evenly, so that every encoder edge comes at a cycle of its own. A plant may go one
window behind and draw its sensors on (`rig.plant`), or take what the board did a window late.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ..protocol.declaration import BAUD_BIT_S, PINS
from .simulator import CLOCK_HZ, ROLES, Simulator

LABEL = "emulated ATmega2560"
WINDOW_S = 250e-6
_OUTPUTS = {  # pin, role for the plant, level without the firmware
    "motor_forward": ("forward", False),
    "motor_reverse": ("reverse", False),
    "motor_enable": ("enable", False),
    "motor_2_forward": ("forward_2", False),
    "motor_2_reverse": ("reverse_2", False),
    "motor_2_enable": ("enable_2", False),
    "step": ("step", False),
    "step_direction": ("step_up", False),
    "step_disable": ("step_disable", True),
}
_WEAK = ("flex", "supply")  # read by the converter
_SWITCHES = ("limit_low", "limit_high", "emergency_stop")


@dataclass(slots=True)
class Outputs:
    """What the board did to the rig during a window."""

    # mean voltage at each motor / supply, -1 to 1; 0 while its bridge is off
    duty: tuple[float, float] = (0.0, 0.0)
    # mean of the microsteps since the start, up minus down, those that found the driver enabled
    steps: float = 0.0
    motor_on: tuple[bool, bool] = (False, False)  # bridges enabled at the window's end
    stepper_on: bool = False  # stepper driver enabled at the window's end


@dataclass(slots=True)
class Sensors:
    """What the rig's wires say at the end of a window."""

    encoder_1: float = 0.0  # encoder of joint 1, counts (x4), fractions too
    encoder_2: float = 0.0  # encoder of joint 2
    flex_V: float = 2.5  # at pin flex
    supply_V: float = 2.45  # at pin supply, behind the divider
    limit_low: bool = False  # hit
    limit_high: bool = False
    emergency_stop: bool = False  # pressed


class Plant(Protocol):
    """The rig behind the wires."""

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        """Let time pass with these drives; the same object may be returned every time."""


class EmulatedBoard:
    """A board (see `base.Board`) without hardware. `simulator` and `plant` may be touched, which is
    how faults are injected."""

    emulated = True

    def __init__(
        self, elf: Path, plant: Plant, window_s: float | None = None, slice_cycles: int = 1000
    ) -> None:
        """`window_s`: None for the plant's own `window_s`, or 250 us where it has none."""
        self.label = LABEL
        self.plant = plant
        self.simulator = Simulator(elf, BAUD_BIT_S, slice_cycles)
        self.outputs, self.sensors = Outputs(), Sensors()
        self._window = round(
            CLOCK_HZ * (getattr(plant, "window_s", WINDOW_S) if window_s is None else window_s)
        )
        self._until = 0
        self.lines = {
            name: self.simulator.line(PINS[name].port, PINS[name].bit, ROLES[role], rest=rest)
            for name, (role, rest) in _OUTPUTS.items()
            if name in PINS
        }
        self.lines["busy"] = self.simulator.line(PINS["busy"].port, PINS["busy"].bit)
        self._swapped = {1: False, 2: False}
        for number in self._swapped:
            self.wire_encoder(number)
        self._volts = [-1.0, -1.0]
        self._broken: set[str] = set()
        self._stop_pressed = False
        self._switches: tuple[bool, ...] | None = None

    # ---- a board

    def write(self, data: bytes) -> None:
        """Send bytes to the board.

        Args:
            data: the bytes.
        """
        self.simulator.send(data)

    def read(self) -> bytes:
        """The bytes that have come from the board.

        Returns:
            The bytes since the last call.
        """
        return self.simulator.receive()

    def wait(self, seconds: float) -> None:
        """Let emulated time pass.

        Args:
            seconds: at least so much [s].
        """
        target = self.simulator.cycle + seconds * CLOCK_HZ
        while self._until < target:
            self.step()

    def now(self) -> float:
        """The emulated time since the start [s]."""
        return self.simulator.cycle / CLOCK_HZ

    def reset(self) -> None:
        """Reset the board, as the button or DTR does."""
        self.simulator.reset("external")

    def close(self) -> None:
        """End the emulation."""
        self.simulator.close()

    # ---- in lockstep

    def step(self) -> None:
        """One window: the plant first, then the processor."""
        sensors = self.plant.advance(self._window / CLOCK_HZ, self.outputs)
        simulator = self.simulator
        window = simulator.window
        window.encoder[0], window.encoder[1] = sensors.encoder_1, sensors.encoder_2
        for k, (name, value) in enumerate((("flex", sensors.flex_V), ("supply", sensors.supply_V))):
            if name in self._broken:
                value = 0.0
            if self._volts[k] != value:
                self._volts[k] = value
                simulator.adc(PINS[name].bit, round(1000 * min(max(value, 0.0), 5.0)))
        stop = sensors.emergency_stop or self._stop_pressed
        if self._switches != (switches := (sensors.limit_low, sensors.limit_high, stop)):
            self._switches = switches
            for name, opened in zip(
                _SWITCHES, switches, strict=True
            ):  # closed to ground unless hit or pressed
                simulator.pin(PINS[name].port, PINS[name].bit, opened)
        self._until += self._window
        simulator.run(self._until)
        out = self.outputs
        one, two = window.duty
        out.duty, out.steps = (one, two), window.steps_mean
        on, on_2 = window.motor_on
        out.motor_on, out.stepper_on = (on != 0, on_2 != 0), window.stepper_on != 0
        self.sensors = sensors

    # ---- wiring, right and wrong

    def wire_encoder(self, number: int, swapped: bool = False) -> None:
        """Connect encoder 1 or 2, with A and B exchanged if they are to be swapped."""
        self._swapped[number] = swapped
        a, b = (
            (PINS[f"encoder_{number}_{letter}"].port, PINS[f"encoder_{number}_{letter}"].bit)
            for letter in "ab"
        )
        self.simulator.encoder(number - 1, *((b, a) if swapped else (a, b)))

    def press_stop(self, pressed: bool) -> None:
        """Press or release the emergency stop at the board, whatever the plant says."""
        self._stop_pressed = pressed

    def cut(self, pin: str) -> None:
        """Cut the wire at a pin.

        An input's pull-up makes it high; what the converter reads falls to 0 V; a driver's input
        rests where its resistor pulls it.
        """
        self._broken.add(pin)
        if pin in self.lines:
            self.simulator.cut(self.lines[pin], True)
        elif pin not in _WEAK:
            self.simulator.stick(PINS[pin].port, PINS[pin].bit, True)

    def mend(self, pin: str) -> None:
        """Mend a cut wire: the pin follows the plant again, or the plant the pin."""
        self._broken.discard(pin)
        if pin in self.lines:
            self.simulator.cut(self.lines[pin], False)
            return
        if pin in _WEAK:
            return
        self.simulator.stick(PINS[pin].port, PINS[pin].bit, None)
        self._switches = None
        for number, swapped in self._swapped.items():
            self.wire_encoder(number, swapped)
