"""The environments: Gymnasium's own check, seeds, many at once, pictures."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

import breakshot  # noqa: E402
import breakshot.gym as games  # noqa: E402

NAMES = ["Singulate", "SingulateDiscrete", "Strikes", "PushTarget"]
MOST_STRIKES = {"Strikes": 3, "PushTarget": 10}


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
        assert len(seen) <= 1 + 3 * MOST_STRIKES.get(name, 1)
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


def pushed(positions_m: list[tuple[float, float]], action: int) -> tuple[float, bool, dict, np.ndarray]:
    """Reward, end, information and final positions of a push where equal discs of 40 mm radius lie here, the target first."""
    env = games.PushTargetEnv(objects=len(positions_m))
    env.reset(seed=1)
    episode = env._episode
    kind = episode.scene.objects[0].name
    names = [kind] + [f"{kind}#{k}" for k in range(2, len(positions_m) + 1)]
    placed = [{"object": n, "position_m": p, "yaw_rad": 0.0} for n, p in zip(names, positions_m, strict=True)]
    env._game.names[:] = names
    episode.scene = episode.scene.replace(placed=placed)
    episode.poses = np.array([[*p, 0.0] for p in positions_m])
    observed, reward, terminated, _, info = env.step(action)
    return reward, terminated, info, observed[:, :2]


def test_a_push_has_the_reward_of_what_it_does():
    apart = 0.085
    # Pushed to the right, away from its only neighbour.
    reward, over, info, after = pushed([(0.0, 0.0), (0.0, apart)], 0)
    assert (reward, over, info["success"]) == (10.0, True, True)
    assert after[0, 0] > 0.1 and abs(after[1] - [0.0, apart]).max() < 0.01
    # Pushed into its neighbour: both move, and stay together or near.
    reward, over, info, after = pushed([(0.0, 0.0), (0.081, 0.0)], 0)
    assert after[1, 0] > 0.1 and (reward, over) == ((10.0, True) if info["margin_m"] >= 0 else (-1.0, False))
    # The neighbour lies where the striker has to start.
    reward, over, info, after = pushed([(0.0, 0.0), (-apart, 0.0)], 0)
    assert (reward, over, info["success"]) == (-10.0, True, False)
    np.testing.assert_allclose(after, [(0.0, 0.0), (-apart, 0.0)], atol=1e-6)
    # A pass on the left of the target that meets nothing: the neighbour is on its right.
    reward, over, info, _ = pushed([(0.0, 0.0), (0.0, -apart)], 4)
    assert (reward, over, info["success"]) == (-10.0, True, False)
    # A pass on the left that moves the neighbour there out of the way: 112 mm from the x axis, or ahead of the striker.
    reward, over, info, after = pushed([(0.0, 0.0), (0.0, apart)], 4)
    assert (reward, over, info["success"]) == (10.0, True, True)
    assert (after[1, 1] > 0.105 or after[1, 0] > 0.1) and abs(after[0]).max() < 0.02
    # Near the edge of the workspace, which ends at 0.27 m, and across it: the target ends 155 mm ahead.
    reward, over, info, after = pushed([(-0.3, 0.1), (-0.219, 0.1), (-0.381, 0.1)], 1)
    assert 0.22 < after[0, 1] < 0.27 and reward in (-5.0, 10.0) and (reward > 0) == info["success"]
    reward, over, info, after = pushed([(-0.3, 0.22), (-0.219, 0.22)], 1)
    assert after[0, 1] > 0.27 and (reward, over, info["success"]) == (-10.0, True, False)


def test_the_pushes_of_an_episode_end():
    env = one("PushTarget")
    env.action_space.seed(5)
    rewards = []
    for seed in range(30):
        env.reset(seed=seed)
        over, count = False, 0
        while not over:
            _, reward, terminated, truncated, info = env.step(env.action_space.sample())
            count += 1
            over = terminated or truncated
            assert terminated == (abs(reward) == 10.0) and info["success"] == (reward == 10.0)
            rewards.append(reward)
        assert count <= 10
    assert {10.0, -10.0, -1.0} <= set(rewards), set(rewards)


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


def test_a_strike_is_an_action():
    env = one("Singulate").unwrapped
    action = np.array([0.2, -0.1, 0.4, 0.0], dtype=np.float32)
    by_numbers, by_strike = [], []
    for seen, taken in ((by_numbers, lambda: action), (by_strike, lambda: env.strike(action))):
        env.reset(seed=5)
        seen += [observed.tobytes() if hasattr(observed, "tobytes") else observed for observed in env.step(taken())]
    assert by_numbers == by_strike
    env.reset(seed=5)
    plan = breakshot.plan(env.scene, env.properties)
    assert env.strike(plan.strike) == plan.strike.replace(object=None)


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
    with pytest.raises(breakshot.Error, match="objects is 1; needed: at least 2"):
        games.PushTargetEnv(objects=1)
    with pytest.raises(breakshot.Error, match="scene before reset"):
        _ = games.SingulateEnv().scene
    with pytest.raises(breakshot.Error, match="step before reset"):
        games.SingulateEnv().step(np.zeros(4))
