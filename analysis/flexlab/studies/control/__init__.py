"""What each method of control achieves: one motion, all methods, two robots.

`tasks` has the robots and their motions, `methods` the list of methods, `judgement` what is
measured, `output` the table, JSON, the Parquet file and the figure.
"""

from .judgement import Figures, Judged, compare
from .methods import METHODS, Method, Motion
from .output import numbers, save, table
from .tasks import TASKS, Task

__all__ = [
    "METHODS",
    "TASKS",
    "Figures",
    "Judged",
    "Method",
    "Motion",
    "Task",
    "compare",
    "numbers",
    "save",
    "table",
]
