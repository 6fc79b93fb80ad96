"""The gains file: the settings of a PID, or a controller that is designed from the robot."""

from .designed import Designed, design_setting
from .names import BOARD, NAMES
from .reading import load, load_controller
from .settings import Gains, from_board

__all__ = [
    "BOARD",
    "NAMES",
    "Designed",
    "Gains",
    "design_setting",
    "from_board",
    "load",
    "load_controller",
]
