"""Environments for Gymnasium: a pile, strikes, a goal.

``import breakshot.gym`` registers

- ``breakshot/Singulate-v0``: one strike, four continuous numbers,
- ``breakshot/SingulateDiscrete-v0``: one strike of the planner's grid,
- ``breakshot/Strikes-v0``: up to three strikes, observed in between,
- ``breakshot/PushTarget-v0``: up to ten slow pushes that free one object, the target.

Every episode has another pile, drawn from the seed, in another scenario: friction, restitution, masses and contacts are drawn
from the uncertainty of learned properties, poses and strikes have the noise of observation and execution.  The scene and properties
are those of the example in the repository, or the ones given::

    env = gymnasium.make("breakshot/Singulate-v0", scene=scene, properties=properties, objects=4)
    envs = gymnasium.make_vec("breakshot/Singulate-v0", num_envs=256)          # one call of the simulator a step

Observation: an array of shape ``(objects, 4)`` with x (m), y (m), cosine and sine of the yaw of each object in the table frame.

Continuous action: four numbers from -1 to 1.  The heading (times pi, rad); the offset of the line of the strike from the centre of the
pile, to the left (times the radius of the pile); the speed, from the striker's slowest to its fastest; the end of the strike, from the
front edge of the pile to its back edge.  The striker starts 30 mm before the pile.

A `breakshot.Strike`, such as that of a plan for `env.unwrapped.scene` and `env.unwrapped.properties`, is an action too, and
`env.unwrapped.strike(action)` is the strike of an action.

Discrete action: the number of a strike in the planner's grid of the pile, thinned to `GRID_STRIKES` strikes (`breakshot.survey`).

In ``PushTarget-v0`` (after Kiatos and Malassiotis, "Robust object grasping in clutter via singulation", ICRA 2019) the first of six
objects is the target.  Actions 0 to 3 push it, from beside it, along its x axis and in the directions 90, 180 and 270 degrees to the left,
until the striker is 0.1 m behind its first position; actions 4 to 7 are pushes of these directions that start outside the pile and pass the
target on its left.  (The second primitive of the paper passes above the target, which motion in the plane does not have.)  The striker has
its slowest speed.

Reward of ``PushTarget-v0``: 10 if the target is free, with 30 mm to every other object; -10 for a push that cannot start because an object
is in its place, one that moves nothing by more than 5 mm, a target that leaves the workspace or an object that falls; each of these ends
the episode.  Otherwise -5 if the target is within 50 mm of the edge of the workspace, else -1.  Of the goal of the scene nothing is used.

Reward of the others: 1 if the goal of the scene is fulfilled, else 0; in ``Strikes-v0`` less 0.1 a strike.

``info`` has `success`, `margin_m` (slack of the tightest condition of the goal, m) and `singulated` (number of objects that are free of all
others).
"""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

from ._envs import (
    PushTargetEnv,
    PushTargetVectorEnv,
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
    "PushTargetEnv",
    "PushTargetVectorEnv",
    "SingulateDiscreteEnv",
    "SingulateDiscreteVectorEnv",
    "SingulateEnv",
    "SingulateVectorEnv",
    "StrikesEnv",
    "StrikesVectorEnv",
    "example",
    "random_pile",
]

for _name in ("Singulate", "SingulateDiscrete", "Strikes", "PushTarget"):
    if f"breakshot/{_name}-v0" not in registry:
        register(
            f"breakshot/{_name}-v0",
            entry_point=f"breakshot.gym:{_name}Env",
            vector_entry_point=f"breakshot.gym:{_name}VectorEnv",
        )
