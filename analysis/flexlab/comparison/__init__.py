"""Simulation against experiment: the simulation of what was commanded or measured, deviations,
report and review."""
