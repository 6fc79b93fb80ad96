"""Experiments on the rig, real or emulated: the dissertation's steps in order, and everything
received kept as it arrives.

`plan` says what is asked of the rig, `selftest` looks whether it may, `execute` does it, `conduct`
has all of it in order. `recording` keeps what arrives, `rebuild` makes the Run of it, with
`measure` for the conversions, `align` for the time between command and response and `calibrate` for
the flex sensor. `command` is what the terminal sees.
"""
