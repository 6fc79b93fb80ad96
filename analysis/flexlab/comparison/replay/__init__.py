"""Simulation of an experiment from its commands or measurements, through the rig's drives."""
