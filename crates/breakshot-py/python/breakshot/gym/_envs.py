"""The environments: one pile, and many at once."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

import breakshot

from ._episodes import GRID_STRIKES, Episode, Game, begun, strike_numbers, struck
from ._picture import picture
from ._pushes import DIRECTIONS, PRIMITIVES, PUSHES

Observation = np.ndarray[tuple[Any, ...], np.dtype[np.float32]]
Frame = np.ndarray[tuple[Any, ...], np.dtype[np.uint8]]

TARGET_OBJECTS = 6
"""Objects where a target is freed, if not given."""
_MOST_M = 20.0
"""No object slides farther (m)."""


def _spaces(game: Game) -> tuple[spaces.Space[Observation], spaces.Space[Any]]:
    """The spaces of observations and of actions."""
    most = np.tile(np.array([_MOST_M, _MOST_M, 1.0, 1.0], dtype=np.float32), (len(game.names), 1))
    action: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (4,), np.float32)
    if game.discrete:
        action = spaces.Discrete(GRID_STRIKES)
    if game.pushes:
        action = spaces.Discrete(DIRECTIONS * PRIMITIVES)
    observation: spaces.Space[Any] = spaces.Box(-most, most, dtype=np.float32)
    return observation, action


class SingulateEnv(gymnasium.Env[Observation, Any]):
    """One strike on a random pile in a scenario; see `breakshot.gym`."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}
    _strikes = 1
    _discrete = False
    _pushes = False
    _objects: int | None = None

    def __init__(
        self,
        scene: breakshot.Scene | None = None,
        properties: breakshot.Properties | None = None,
        objects: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Args:
        scene: The cell, the kinds of objects and the goal; its placed objects are not used.
        properties: Their learned properties.
        objects: Number of objects; more than the kinds are copies.  By default each kind once; six in `PushTargetEnv`.
        render_mode: `rgb_array`, or none.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise breakshot.Error(f"gym: render_mode is `{render_mode}`; needed: `rgb_array` or None")
        self.render_mode = render_mode
        self._game = Game.of(scene, properties, self._objects if objects is None else objects, self._strikes, self._discrete, self._pushes)
        self.observation_space, self.action_space = _spaces(self._game)
        self._episode: Episode | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """A new pile in a new world."""
        super().reset(seed=seed, options=options)
        self._episode = begun(self._game, self.np_random)
        return self._episode.observation(), {}

    @property
    def scene(self) -> breakshot.Scene:
        """The pile as it is observed."""
        return self._begun("scene").scene

    @property
    def properties(self) -> breakshot.Properties:
        """The learned properties, those that a planner is given."""
        return self._game.properties

    def strike(self, action: Any) -> breakshot.Strike:
        """The strike of an action."""
        x_m, y_m, *others = strike_numbers(self._game, self._begun("strike"), action).tolist()
        return breakshot.Strike([x_m, y_m], *others)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Strikes the pile by an action, or by a `breakshot.Strike` such as that of a plan."""
        episode = self._begun("step")
        [result] = struck(self._game, [episode], [action], 1)
        return episode.observation(), result.reward, result.terminated, result.truncated, result.info

    def _begun(self, what: str) -> Episode:
        if self._episode is None:
            raise breakshot.Error(f"gym: {what} before reset; needed: a call of reset first")
        return self._episode

    def render(self) -> Frame | None:
        """The table from above with the objects and the last strike: (height, width, 3)."""
        if self.render_mode is None or self._episode is None:
            return None
        return picture(self._episode.scene, self._episode.last_strike)


class SingulateDiscreteEnv(SingulateEnv):
    """One strike of the planner's grid on a random pile in a scenario; see `breakshot.gym`."""

    _discrete = True


class StrikesEnv(SingulateEnv):
    """Up to three strikes on a random pile in a scenario; see `breakshot.gym`."""

    _strikes = 3


class PushTargetEnv(SingulateEnv):
    """Up to ten slow pushes that free a target in a random pile in a scenario; see `breakshot.gym`."""

    _strikes = PUSHES
    _pushes = True
    _objects = TARGET_OBJECTS


class SingulateVectorEnv(VectorEnv[Observation, Any, npt.NDArray[Any]]):
    """Many piles, struck in one call of the simulator; environment `k` is the single one with the seed `seed + k`.

    A pile that is done is replaced in the same step: ``infos["final_obs"]`` and ``infos["final_info"]`` are those of the old one.
    """

    metadata: dict[str, Any] = {
        "render_modes": ["rgb_array"],
        "render_fps": 1,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }
    _strikes = 1
    _discrete = False
    _pushes = False
    _objects: int | None = None

    def __init__(
        self,
        num_envs: int = 1,
        scene: breakshot.Scene | None = None,
        properties: breakshot.Properties | None = None,
        objects: int | None = None,
        render_mode: str | None = None,
        threads: int | None = None,
    ) -> None:
        """Args:
        num_envs: Number of piles.
        scene, properties, objects, render_mode: As those of the single environment.
        threads: Threads of the simulator; by default one for each core.
        """
        self._game = Game.of(scene, properties, self._objects if objects is None else objects, self._strikes, self._discrete, self._pushes)
        self.num_envs = num_envs
        self.render_mode = render_mode
        self._threads = threads
        self.single_observation_space, self.single_action_space = _spaces(self._game)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs = [np.random.default_rng() for _ in range(num_envs)]
        self._episodes: list[Episode] = []

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """New piles in new worlds."""
        seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed
        for k, one in enumerate(seeds or []):
            if one is not None:
                self._rngs[k] = gymnasium.utils.seeding.np_random(one)[0]
        self._episodes = [begun(self._game, rng) for rng in self._rngs]
        return self._observations(), {}

    @property
    def scenes(self) -> list[breakshot.Scene]:
        """The piles as they are observed."""
        return [episode.scene for episode in self._episodes]

    def step(self, actions: Any) -> tuple[Observation, npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], dict[str, Any]]:
        """Strikes every pile; an action is also a `breakshot.Strike`."""
        if not self._episodes:
            raise breakshot.Error("gym: step before reset; needed: a call of reset first")
        steps = struck(self._game, self._episodes, actions, self._threads)
        infos: dict[str, Any] = {}
        for k, step in enumerate(steps):
            infos = self._add_info(infos, step.info, k)
            if step.terminated or step.truncated:
                final = {"final_obs": self._episodes[k].observation(), "final_info": step.info}
                infos = self._add_info(infos, final, k)
                self._episodes[k] = begun(self._game, self._rngs[k])
        rewards, terminated, truncated = (
            np.array([getattr(step, name) for step in steps]) for name in ("reward", "terminated", "truncated")
        )
        return self._observations(), rewards, terminated, truncated, infos

    def render(self) -> tuple[Frame, ...] | None:
        """A picture of each table."""
        if self.render_mode is None:
            return None
        return tuple(picture(episode.scene, episode.last_strike) for episode in self._episodes)

    def _observations(self) -> Observation:
        return np.stack([episode.observation() for episode in self._episodes])


class SingulateDiscreteVectorEnv(SingulateVectorEnv):
    """Many piles for `SingulateDiscreteEnv`."""

    _discrete = True


class StrikesVectorEnv(SingulateVectorEnv):
    """Many piles for `StrikesEnv`."""

    _strikes = 3


class PushTargetVectorEnv(SingulateVectorEnv):
    """Many piles for `PushTargetEnv`."""

    _strikes = PUSHES
    _pushes = True
    _objects = TARGET_OBJECTS
