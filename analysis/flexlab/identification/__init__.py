"""Identification: parameters of robot and rig from one experiment, with their intervals.

A second experiment validates them.
"""
