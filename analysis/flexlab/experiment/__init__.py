"""Experiments on the rig, real or emulated.

`plan` says what is asked of the rig, `selftest` checks the board, `stream` executes the plan, and
`run_experiment` has all steps in order. `flash` loads and configures the firmware, `excitation` is
the plan for an identification, `lead_in` starts and ends motions smoothly.
"""
