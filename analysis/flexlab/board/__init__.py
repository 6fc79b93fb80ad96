"""The board, seen from its host: something with bytes and a clock, at a serial port or emulated.

`base` says what a board is; `serialport` and `emulated` are the two kinds, `pty` offers one as a
serial port to other programs. `link` holds the session, `player` streams trajectories, `messages`
and `frames` are what goes over the line; `declaration` is generated from firmware/protocol.toml.
`simulator` and shim/ are simavr behind ctypes; `load` measures how busy the processor is.
"""
