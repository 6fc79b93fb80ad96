"""The dissertation's studies, on any robot file: payload, ratio of link lengths, boundary
conditions.

Each makes cases of a robot, simulates them all (`sweep`), and says whether the dissertation's
qualitative finding is reproduced, with its number (`payload`, `length_ratio`, `boundary`); `output`
has the table, the figure and the Parquet file.
"""

from .output import numbers, save, table
from .run_study import KINDS, run
from .sweep import Study

__all__ = ["KINDS", "Study", "numbers", "run", "save", "table"]
