"""The simulation of an experiment: what was commanded or measured, through the rig's drives."""
