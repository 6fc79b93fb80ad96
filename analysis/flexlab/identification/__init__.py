"""Identification: the figures of robot and rig from an experiment, with their intervals, judged on
another experiment."""
