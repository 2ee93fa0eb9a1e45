"""The environments: Gymnasium's own check, seeds, many at once, pictures."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

import breakshot  # noqa: E402
import breakshot.gym as games  # noqa: E402

NAMES = ["Singulate", "SingulateDiscrete", "Strikes"]


def one(name: str, **options):
    return gymnasium.make(f"breakshot/{name}-v0", **options)


@pytest.mark.parametrize("name", NAMES)
def test_the_check_of_gymnasium_is_silent(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(one(name, render_mode="rgb_array").unwrapped)


@pytest.mark.parametrize("name", NAMES)
def test_an_episode_depends_on_its_seed_alone(name):
    def episode(seed: int) -> list:
        env = one(name)
        env.action_space.seed(seed)
        observed, _ = env.reset(seed=seed)
        seen, over = [observed.tobytes()], False
        while not over:
            observed, reward, terminated, truncated, info = env.step(env.action_space.sample())
            seen += [observed.tobytes(), reward, info]
            over = terminated or truncated
        assert len(seen) <= 1 + 3 * (3 if name == "Strikes" else 1)
        return seen

    assert episode(3) == episode(3) and episode(3) != episode(4)


@pytest.mark.parametrize("name", NAMES)
def test_many_piles_are_the_single_ones(name):
    envs = gymnasium.make_vec(f"breakshot/{name}-v0", num_envs=4, vectorization_mode="vector_entry_point")
    singles = [one(name) for _ in range(4)]
    observed, _ = envs.reset(seed=8)
    alone = [single.reset(seed=8 + k)[0] for k, single in enumerate(singles)]
    np.testing.assert_array_equal(observed, alone)
    assert envs.observation_space.contains(observed)
    envs.action_space.seed(1)
    for _ in range(4):
        actions = envs.action_space.sample()
        observed, rewards, terminated, truncated, infos = envs.step(actions)
        for k, single in enumerate(singles):
            seen, reward, *over, info = single.step(actions[k])
            assert (rewards[k], terminated[k], truncated[k]) == (reward, *over)
            assert infos["margin_m"][k] == info["margin_m"]
            if any(over):
                np.testing.assert_array_equal(infos["final_obs"][k], seen)
                seen = single.reset()[0]
            np.testing.assert_array_equal(observed[k], seen)


def test_a_planned_strike_succeeds_as_often_as_the_plan_says():
    env = one("Singulate").unwrapped
    stated, succeeded = [], []
    for seed in range(12):
        env.reset(seed=seed)
        episode, game = env._episode, env._game
        plan = breakshot.plan(episode.scene, game.properties)
        worlds = breakshot.World(episode.scene, game.properties, uncertain=True).sample(100, seed)
        rollouts = breakshot.Simulator().rollout(worlds, plan.strike)
        succeeded.append((worlds[0].goal(rollouts.poses, rollouts.fallen)[0] >= 0.0).mean())
        stated.append(plan.prediction.success_probability)
    assert abs(np.mean(succeeded) - np.mean(stated)) < 0.05, (succeeded, stated)
    assert np.mean(succeeded) > 0.5


def test_random_piles_can_be_simulated():
    scene, properties = games.example()
    for seed in range(50):
        rng = np.random.default_rng(seed)
        names = [f"{kind}{copy}" for copy in ("", "#2", "#3")[: 1 + seed % 3] for kind in "ace"]
        pile = games.random_pile(scene, names, rng)
        assert breakshot.World(pile, properties).names == tuple(names)


def test_the_example_is_the_one_of_the_repository(demo_scene, demo_properties):
    scene, properties = games.example()
    assert scene == demo_scene
    for name, friction in demo_properties.friction.items():
        assert abs(properties.friction[name].mean - friction.mean) < friction.standard_error
    assert properties.mass_ratio.keys() == demo_properties.mass_ratio.keys()


def test_pictures_show_the_objects():
    env = one("Strikes", render_mode="rgb_array", objects=5)
    env.reset(seed=1)
    before = env.render()
    assert before.dtype == np.uint8 and before.ndim == 3 and before.shape[2] == 3
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 7
    env.step(np.array([0.1, 0.0, 0.5, 0.5], dtype=np.float32))
    assert (env.render() != before).any()


def test_wrong_settings_are_named():
    with pytest.raises(breakshot.Error, match="objects is 0"):
        games.SingulateEnv(objects=0)
    with pytest.raises(breakshot.Error, match="render_mode is `human`"):
        games.SingulateEnv(render_mode="human")
    with pytest.raises(breakshot.Error, match="step before reset"):
        games.SingulateEnv().step(np.zeros(4))
