"""An emulated ATmega2560: simavr in lockstep with a plant."""
