"""Pictures of runs: where the links are, how they are bent, figures over time, animations."""

from .bending import POINTS
from .film import animation
from .outline import Outline, outlines
from .over_time import COLOURS, STYLE, figure, heading
from .pictures import FORMS, LETTERS, NoPicture, attempted, plain, saved, told
from .poses import with_poses
from .sampling import FRAME_RATE, MAX_FRAMES, MAX_SAMPLES, frames, thinned
from .shapes import Curves, bent, curves, extent, grid, has_shapes

__all__ = [
    "COLOURS",
    "FORMS",
    "FRAME_RATE",
    "LETTERS",
    "MAX_FRAMES",
    "MAX_SAMPLES",
    "POINTS",
    "STYLE",
    "Curves",
    "NoPicture",
    "Outline",
    "animation",
    "attempted",
    "bent",
    "curves",
    "extent",
    "figure",
    "frames",
    "grid",
    "has_shapes",
    "heading",
    "outlines",
    "plain",
    "saved",
    "thinned",
    "told",
    "with_poses",
]
