"""Environments for Gymnasium: a pile, strikes, a goal.

``import breakshot.gym`` registers

- ``breakshot/Singulate-v0``: one strike, four continuous numbers,
- ``breakshot/SingulateDiscrete-v0``: one strike of the planner's grid,
- ``breakshot/Strikes-v0``: up to three strikes, observed in between.

Every episode has another pile, drawn from the seed, in another scenario: friction, restitution, masses and contacts are drawn
from the uncertainty of learned properties, poses and strikes have the noise of observation and execution.  The scene and properties
are those of the example in the repository, or the ones given::

    env = gymnasium.make("breakshot/Singulate-v0", scene=scene, properties=properties, objects=4)
    envs = gymnasium.make_vec("breakshot/Singulate-v0", num_envs=256)          # one call of the simulator a step

Observation: an array of shape ``(objects, 4)`` with x (m), y (m), cosine and sine of the yaw of each object in the table frame.

Continuous action: four numbers from -1 to 1.  The heading (times pi, rad); the offset of the line of the strike from the centre of the
pile, to the left (times the radius of the pile); the speed, from the striker's slowest to its fastest; the end of the strike, from the
front edge of the pile to its back edge.  The striker starts 30 mm before the pile.

Discrete action: the number of a strike in the planner's grid of the pile, thinned to `GRID_STRIKES` strikes (`breakshot.survey`).

Reward: 1 if the goal of the scene is fulfilled, else 0; in ``Strikes-v0`` less 0.1 a strike.  ``info`` has `success`, `margin_m` (slack of
the tightest condition of the goal, m) and `singulated` (number of objects that are free of all others).
"""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

from ._envs import (
    SingulateDiscreteEnv,
    SingulateDiscreteVectorEnv,
    SingulateEnv,
    SingulateVectorEnv,
    StrikesEnv,
    StrikesVectorEnv,
)
from ._episodes import GRID_STRIKES
from ._piles import example, random_pile

__all__ = [
    "GRID_STRIKES",
    "SingulateDiscreteEnv",
    "SingulateDiscreteVectorEnv",
    "SingulateEnv",
    "SingulateVectorEnv",
    "StrikesEnv",
    "StrikesVectorEnv",
    "example",
    "random_pile",
]

for _name in ("Singulate", "SingulateDiscrete", "Strikes"):
    if f"breakshot/{_name}-v0" not in registry:
        register(
            f"breakshot/{_name}-v0",
            entry_point=f"breakshot.gym:{_name}Env",
            vector_entry_point=f"breakshot.gym:{_name}VectorEnv",
        )
