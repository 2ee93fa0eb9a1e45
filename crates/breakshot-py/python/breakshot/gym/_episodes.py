"""Episodes: draw a pile and a world, strike, judge.  The environments for one pile and for many are views of this."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import breakshot

from ._piles import names_of, outer_radius_m, random_pile, shapes_of
from ._pushes import FREE_M, push_numbers, push_result

GRID_STRIKES = 200
"""Strikes of the planner's grid among which a discrete action chooses."""
STRIKE_COST = 0.1
"""Loss of reward a strike, where there may be several."""
RUN_UP_M = 0.03
"""Distance from the pile at which a striker starts (m)."""

Array = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]


@dataclass(frozen=True)
class Game:
    """What all episodes have in common."""

    scene: breakshot.Scene
    properties: breakshot.Properties
    names: list[str]
    strikes: int = 1
    discrete: bool = False
    pushes: bool = False

    @staticmethod
    def of(
        scene: breakshot.Scene | None,
        properties: breakshot.Properties | None,
        objects: int | None,
        strikes: int,
        discrete: bool,
        pushes: bool = False,
    ) -> Game:
        """The game of these settings; the example's scene and properties where none are given."""
        if (scene is None) != (properties is None):
            raise breakshot.Error("gym: one of scene and properties is None; needed: both, or neither for the example")
        if scene is None or properties is None:
            from ._piles import example

            scene, properties = example()
        count = len(scene.objects) if objects is None else int(objects)
        if not 1 <= count <= 50:
            raise breakshot.Error(f"gym: objects is {count}; needed: from 1 to 50")
        names = names_of(scene, count)
        if pushes:
            if count < 2:
                raise breakshot.Error(f"gym: objects is {count}; needed: at least 2, a target and another one")
            # Of the scene's goal nothing is used.
            scene = scene.replace(goal={"target": names[0], "min_distance_m": 0.0, "min_gap_m": FREE_M, "inside_workspace": False})
        return Game(scene, properties, names, strikes, discrete, pushes)


@dataclass
class Episode:
    """One pile in one scenario."""

    scene: breakshot.Scene
    """What is observed."""
    properties: breakshot.Properties
    """The properties of this world; in a game of one strike those that were learned."""
    poses: Array
    """x (m), y (m), yaw (rad) of each object."""
    rng: np.random.Generator
    strikes: int = 0
    last_strike: Array | None = None
    grid: Array | None = None

    def observation(self) -> npt.NDArray[np.float32]:
        """x (m), y (m), cosine and sine of the yaw of each object."""
        x_m, y_m, yaw_rad = self.poses.T
        return np.stack([x_m, y_m, np.cos(yaw_rad), np.sin(yaw_rad)], axis=1).astype(np.float32)


@dataclass(frozen=True)
class Step:
    """The result of a strike."""

    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(2**63))


def begun(game: Game, rng: np.random.Generator) -> Episode:
    """A new episode."""
    scene = random_pile(game.scene, game.names, rng)
    properties = game.properties
    if game.strikes > 1:
        # Several strikes are made in one world.
        properties = properties.sample(1, _seed(rng))[0]
    episode = Episode(scene, properties, _poses(scene), rng)
    if game.discrete:
        episode.grid = _grid(episode, game)
    return episode


def _poses(scene: breakshot.Scene) -> Array:
    return np.array([[*placed.position_m, placed.yaw_rad] for placed in scene.placed])


def _grid(episode: Episode, game: Game) -> Array:
    """The numbers of the strikes in the planner's grid, repeated where the pile has fewer."""
    survey = breakshot.survey(episode.scene, game.properties, strikes=GRID_STRIKES, samples=1)
    strikes = [entry.strike for entry in survey.strikes]
    if not strikes:
        # The striker reaches no object: every action strikes past the pile.
        strikes = [breakshot.Strike([1e3, 1e3], 0.0, game.scene.cell.striker["speed_range_m_s"][1], 0.01)]
    numbers = np.array([[*s.start_m, s.heading_rad, s.speed_m_s, s.travel_m] for s in strikes])
    return np.resize(numbers, (GRID_STRIKES, 5))


def strike_numbers(game: Game, episode: Episode, action: Any) -> Array:
    """Start x, y (m), heading (rad), speed (m/s) and travel (m) of an action."""
    if isinstance(action, breakshot.Strike):
        return np.array([*action.start_m, action.heading_rad, action.speed_m_s, action.travel_m])
    if episode.grid is not None:
        return np.asarray(episode.grid[int(action)])
    radii_m = np.array([outer_radius_m(shape) for shape in shapes_of(episode.scene, game.names)])
    striker = game.scene.cell.striker
    striker_m = outer_radius_m(striker["shape"])
    slowest_m_s, fastest_m_s = striker["speed_range_m_s"]
    if game.pushes:
        return push_numbers(episode.poses, radii_m, striker_m, RUN_UP_M, slowest_m_s, int(action))
    heading, offset, pace, end = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
    centre_m = episode.poses[:, :2].mean(axis=0)
    radius_m = float((np.linalg.norm(episode.poses[:, :2] - centre_m, axis=1) + radii_m).max())
    heading_rad = np.pi * heading
    along = np.array([np.cos(heading_rad), np.sin(heading_rad)])
    before_m = radius_m + striker_m + RUN_UP_M
    start_m = centre_m + offset * radius_m * np.array([-along[1], along[0]]) - before_m * along
    speed_m_s = slowest_m_s + 0.5 * (pace + 1.0) * (fastest_m_s - slowest_m_s)
    return np.array([*start_m, heading_rad, speed_m_s, before_m + end * radius_m])


def struck(game: Game, episodes: list[Episode], actions: Any, threads: int | None) -> list[Step]:
    """Strikes every pile once, in one rollout; the episodes have the new poses."""
    numbers = np.array([strike_numbers(game, e, action) for e, action in zip(episodes, actions, strict=True)])
    possible = [breakshot.World(e.scene, e.properties, uncertain=True) for e in episodes]
    worlds = [world.sample(1, _seed(e.rng))[0] for world, e in zip(possible, episodes, strict=True)]
    rollouts = breakshot.Simulator().rollout(worlds, numbers, threads=threads)
    steps = []
    for k, (episode, world) in enumerate(zip(episodes, worlds, strict=True)):
        episode.strikes += 1
        episode.last_strike = numbers[k]
        margin_m, singulated = world.goal(rollouts.poses[k], rollouts.fallen[k])
        result = _Result(float(margin_m), int(singulated), bool(rollouts.fallen[k].any()), rollouts.poses[k])
        steps.append(_judged(game, episode, result))
        if rollouts.complete[k]:
            _move(episode, rollouts.poses[k])
    return steps


@dataclass(frozen=True)
class _Result:
    """What a strike has done."""

    margin_m: float
    singulated: int
    fell: bool
    poses: Array


def _judged(game: Game, episode: Episode, result: _Result) -> Step:
    success = result.margin_m >= 0.0
    is_last = episode.strikes >= game.strikes
    if game.pushes:
        workspace = game.scene.cell.workspace
        reward, terminated = push_result(episode.poses, result.poses, result.fell, success, workspace)
        success = success and reward > 0.0
    else:
        reward = float(success) - (STRIKE_COST if game.strikes > 1 else 0.0)
        # A game of one strike ends with it; several strikes end early where there is nothing left to gain.
        terminated = success or result.fell or game.strikes == 1
    info = {"success": success, "margin_m": result.margin_m, "singulated": result.singulated}
    return Step(reward, terminated, is_last and not terminated, info)


def _move(episode: Episode, poses: Array) -> None:
    episode.poses = poses.copy()
    placed = [
        {"object": before.object, "position_m": pose[:2], "yaw_rad": pose[2]}
        for before, pose in zip(episode.scene.placed, poses, strict=True)
    ]
    episode.scene = episode.scene.replace(placed=placed)
