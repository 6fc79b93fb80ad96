"""Pictures of runs: where the links are, how they are bent, figures over time, animations."""

from .bending import POINTS
from .film import animation
from .outline import Outline, outlines
from .over_time import COLOURS, FORMS, STYLE, figure, heading, saved
from .poses import with_poses
from .sampling import FRAME_RATE, MAX_FRAMES, MAX_SAMPLES, frames, thinned
from .shapes import Curves, bent, curves, extent, grid, has_shapes

__all__ = [
    "COLOURS",
    "FORMS",
    "FRAME_RATE",
    "MAX_FRAMES",
    "MAX_SAMPLES",
    "POINTS",
    "STYLE",
    "Curves",
    "Outline",
    "animation",
    "bent",
    "curves",
    "extent",
    "figure",
    "frames",
    "grid",
    "has_shapes",
    "heading",
    "outlines",
    "saved",
    "thinned",
    "with_poses",
]
