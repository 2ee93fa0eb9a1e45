"""Rollouts: shapes, bits, agreement with single simulations."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from conftest import discs

import breakshot

STRIKE = [-0.3, 0.0, 0.0, 0.6, 0.3]


def strikes(count: int) -> np.ndarray:
    """Strikes with different offsets and speeds."""
    numbers = np.tile(STRIKE, (count, 1))
    numbers[:, 1] = np.linspace(-0.03, 0.03, count)
    numbers[:, 3] = np.linspace(0.3, 0.9, count)
    return numbers


def assert_same_bits(one: breakshot.Rollouts, other: breakshot.Rollouts) -> None:
    for name, a, b in zip(one._fields, one, other, strict=True):
        assert a.tobytes() == b.tobytes(), name


def test_a_row_is_the_simulated_strike(pile, world):
    rollouts = breakshot.Simulator().rollout(world, strikes(5))
    for k, numbers in enumerate(strikes(5)):
        strike = breakshot.Strike(numbers[:2], *numbers[2:])
        trajectory = breakshot.simulate(*pile, strike)
        poses = [trajectory.final[name] for name in world.names]
        np.testing.assert_array_equal(rollouts.poses[k], poses)
        assert rollouts.energy[k] == trajectory.energy.striker_work_j > 0.0
        assert rollouts.duration_s[k] == trajectory.duration_s
        assert rollouts.impacts[k] == len(trajectory.events) > 0
    assert rollouts.complete.all() and not rollouts.fallen.any()


def test_worlds_and_strikes_are_broadcast_as_arrays_are(world):
    simulator = breakshot.Simulator()
    worlds = world.sample(3, seed=5)
    every = simulator.rollout(worlds, strikes(4)[:, None])
    assert every.poses.shape == (4, 3, 4, 3) and every.fallen.shape == (4, 3, 4) and every.impacts.shape == (4, 3)
    for k in range(3):
        assert_same_bits(simulator.rollout(worlds[k], strikes(4)), breakshot.Rollouts(*(a[:, k].copy() for a in every)))
    assert simulator.rollout(world, STRIKE).poses.shape == (4, 3)
    assert simulator.rollout(np.array(worlds, dtype=object)[:, None], strikes(4)).impacts.shape == (3, 4)
    assert simulator.rollout(world, np.empty((0, 5))).poses.shape == (0, 4, 3)
    one = breakshot.Strike(STRIKE[:2], *STRIKE[2:])
    assert_same_bits(simulator.rollout(world, [one, one]), simulator.rollout(world, np.array([STRIKE, STRIKE])))


def test_views_of_any_layout_are_read(world):
    simulator, whole = breakshot.Simulator(), strikes(6)
    for view in (whole[::-1], np.asfortranarray(whole), np.broadcast_to(whole[0], (6, 5)), whole[::2], whole.astype(">f8")):
        assert_same_bits(simulator.rollout(world, view), simulator.rollout(world, np.array(view, dtype=float)))


@pytest.mark.parametrize("threads", [2, 3, None])
def test_any_number_of_threads_gives_the_same_bits(uncertain_world, threads):
    simulator = breakshot.Simulator()
    one = simulator.rollout(uncertain_world, strikes(300), seed=7, threads=1)
    assert_same_bits(one, simulator.rollout(uncertain_world, strikes(300), seed=7, threads=threads))


def test_a_row_depends_on_the_seed_and_its_number_alone(uncertain_world):
    simulator = breakshot.Simulator()
    long = simulator.rollout(uncertain_world, np.tile(STRIKE, (50, 1)), seed=2)
    short = simulator.rollout(uncertain_world, np.tile(STRIKE, (20, 1)), seed=2)
    assert_same_bits(short, breakshot.Rollouts(*(array[:20].copy() for array in long)))
    assert len(np.unique(long.poses[:, 0, 0])) == 50
    other = simulator.rollout(uncertain_world, np.tile(STRIKE, (20, 1)), seed=3)
    assert not np.isin(other.poses[:, 0, 0], long.poses[:, 0, 0]).any()


def test_sampled_worlds_are_those_of_the_rows(uncertain_world):
    simulator = breakshot.Simulator()
    rows = simulator.rollout(uncertain_world, np.tile(STRIKE, (8, 1)), seed=11)
    worlds = uncertain_world.sample(8, seed=11)
    assert_same_bits(rows, simulator.rollout(worlds, STRIKE))
    restored = pickle.loads(pickle.dumps([uncertain_world, *worlds]))
    assert_same_bits(rows, simulator.rollout(restored[0], np.tile(STRIKE, (8, 1)), seed=11))
    assert_same_bits(rows, simulator.rollout(restored[1:], STRIKE))


def test_out_is_filled_and_returned(world):
    simulator = breakshot.Simulator()
    out = simulator.rollout(world, strikes(6))
    again = simulator.rollout(world, strikes(6)[::-1], out=out)
    assert again is out
    assert_same_bits(out, simulator.rollout(world, strikes(6)[::-1]))
    with pytest.raises(breakshot.Error, match="out.poses is float64 of shape .6, 4, 3.; needed"):
        simulator.rollout(world, strikes(7), out=out)
    out.energy.flags.writeable = False
    with pytest.raises(breakshot.Error, match="out.energy"):
        simulator.rollout(world, strikes(6), out=out)


def test_worlds_of_fewer_objects_are_filled_with_nan(world):
    pair = breakshot.World(*discs([0.05, 0.045], [(0.0, 0.0), (0.1, 0.0)]))
    rollouts = breakshot.Simulator().rollout([world, pair], STRIKE)
    assert np.isfinite(rollouts.poses[0]).all() and np.isfinite(rollouts.poses[1, :2]).all()
    assert np.isnan(rollouts.poses[1, 2:]).all()


def test_a_strike_that_starts_inside_an_object_is_not_simulated(world):
    inside = [0.0, 0.0, 0.0, 0.5, 0.1]
    rollouts = breakshot.Simulator().rollout(world, [inside, STRIKE])
    assert np.isnan(rollouts.poses[0]).all() and np.isnan(rollouts.energy[0]) and not rollouts.complete[0]
    assert np.isfinite(rollouts.poses[1]).all() and rollouts.complete[1]
    margins, singulated = world.goal(rollouts.poses, rollouts.fallen)
    assert margins[0] == -1.0 and singulated[0] == 0


def test_the_goal_is_that_of_the_plan(demo_scene, demo_properties):
    plan = breakshot.plan(demo_scene, demo_properties)
    world = breakshot.World(demo_scene, demo_properties)
    rollouts = breakshot.Simulator().rollout(world, plan.strike)
    margin_m, singulated = world.goal(rollouts.poses, rollouts.fallen)
    assert margin_m.shape == () and singulated == 3
    assert margin_m <= plan.prediction.min_distance_m - demo_scene.goal.min_distance_m + 1e-12 and margin_m > 0.0
    uncertain = breakshot.World(demo_scene, demo_properties, uncertain=True)
    rows = breakshot.Simulator().rollout(uncertain, [plan.strike] * 2000, seed=5)
    success = (uncertain.goal(rows.poses, rows.fallen)[0] >= 0.0).mean()
    stated = plan.prediction.success_probability
    assert abs(success - stated) < 4.0 * np.sqrt(stated * (1 - stated) / 400 + 1e-4), (success, stated)


def test_wrong_arguments_are_named(world):
    simulator = breakshot.Simulator()
    for arguments, message in [
        ((world, [[1.0, 2.0]]), r"the shape of strikes is \(1, 2\)"),
        ((world, [STRIKE, [*STRIKE[:3], np.nan, 0.1]]), r"strikes\[1\]: speed_m_s is NaN"),
        ((world, "strike"), r"the shape of strikes is \(\)"),
        ((world, ["strike"] * 5), "strikes is no array of numbers"),
        (([], STRIKE), "worlds is empty"),
        ((3, STRIKE), "worlds is int"),
        (([world] * 3, np.tile(STRIKE, (2, 1))), "can be broadcast"),
        ((world, np.broadcast_to(STRIKE, (10**12, 5))), "at most 100000000"),
    ]:
        with pytest.raises(breakshot.Error, match=message):
            simulator.rollout(*arguments)
    with pytest.raises(breakshot.Error, match="threads is 0"):
        simulator.rollout(world, STRIKE, threads=0)
    with pytest.raises(breakshot.Error, match="seed is -1"):
        simulator.rollout(world, STRIKE, seed=-1)
    with pytest.raises(breakshot.Error, match=r"the shape of poses is \[3, 2\]"):
        world.goal(np.zeros((3, 2)))
