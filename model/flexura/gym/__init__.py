"""Environments for learning (Gymnasium): `import flexura.gym` registers `flexura/Reach-v0`.

import gymnasium
import flexura.gym

env = gymnasium.make("flexura/Reach-v0")
many = gymnasium.make_vec("flexura/Reach-v0", num_envs=4096)
"""

from ..optional import load
from .motion import Motion
from .reach import Reach, ReachVector
from .task import EPISODE_STEPS, Task

__all__ = ["Motion", "Reach", "ReachVector", "Task"]

ID = "flexura/Reach-v0"
gymnasium = load("gymnasium")
if ID not in gymnasium.registry:
    gymnasium.register(
        ID,
        entry_point=Reach,
        vector_entry_point=ReachVector,
        max_episode_steps=EPISODE_STEPS,
    )
