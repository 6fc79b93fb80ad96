"""The twin: the same Robot built in Exudyn, an independent program, to check the native solver
against.

It shares the robot file, `Run` and the drives (pure input data) with the native solver, and no
mechanics. Its links are beams with axial unknowns and exact rotations, so it always contains
geometric stiffening.

    from flexura import twin
    run = twin.simulate(robot, t_eval, drive)

Exudyn is imported when a robot is simulated, not before.
"""

from .solve import simulate

__all__ = ["simulate"]
