"""The twin: the same Robot built in Exudyn, an independent program, as a check of the solver.

It shares the robot file, `Run` and the drives (pure input data) with the native solver, but no
mechanics. Its links are beams with axial unknowns and exact rotations, so that it always contains
geometric stiffening.

    from flexura import twin
    run = twin.simulate(robot, t_eval, drive)

Exudyn is imported when a robot is simulated, not before.
"""

from .solve import simulate

__all__ = ["simulate"]
