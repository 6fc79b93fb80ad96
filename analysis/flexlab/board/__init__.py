"""The board, seen from its host: something with bytes and a clock, at a serial port or emulated.

`base` says what a board is; `serial_port` and `emulator` are the two kinds, `pty` offers one as a
serial port to other programs. `protocol` holds the session, the trajectories that it streams, and
what goes over the line, with its declaration made of firmware/protocol.toml. `commissioning` has
the emergency stop proven.
"""
