"""Iterative learning on the rig: a manoeuvre is repeated, and its references get better.

`task` says what the tip is asked and plans a trial, `knowledge` and `model` are what is known of
the rig, `drives` makes references of joint motions, `tip` is where the tip was, `learn` has the
trials in order, `board_trials` does them, `output` tells.
"""
