"""Which headings singulate a pile?  Up to 10^9 random strikes, on all machines of a Ray cluster.

    python ray_rollouts.py pile.scene.toml properties.json --strikes 1000000000 --address auto
    python ray_rollouts.py pile.scene.toml properties.json --strikes 1000000 --local       this process, without Ray

Every strike is simulated in a scenario of its own: properties, poses and execution are drawn from what is uncertain.  The strikes come in
blocks; strike k of block b depends on (seed, b, k) alone.  A task reduces its block to integers, in arrays that it uses again
and again, and integers are added in any order: the result has the same bits on any number of machines, also if some are lost and their
blocks are simulated again.  Prints the success rate by heading and a digest of all final poses.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import breakshot

BLOCK = 100_000
"""Strikes of a task, if not given."""
BINS = 36
"""Intervals of the heading, from -pi on."""
TASKS_PER_CORE = 2
"""Blocks that are under way or wait, for each core of the cluster."""

Counts = npt.NDArray[np.uint64]
"""Shape (BINS + 1, 3): strikes, successes and impacts of each interval of the heading; the last row is the digest."""


def strikes(scene: breakshot.Scene, rng: np.random.Generator, count: int) -> npt.NDArray[np.float64]:
    """Random strikes through the pile: start x, y (m), heading (rad), speed (m/s), travel (m)."""
    positions_m = np.array([placed.position_m for placed in scene.placed])
    centre_m = positions_m.mean(axis=0)
    radius_m = float(np.linalg.norm(positions_m - centre_m, axis=1).max()) + 0.1
    heading_rad = rng.uniform(-np.pi, np.pi, count)
    offset_m = rng.uniform(-0.5, 0.5, count) * radius_m
    along = np.stack([np.cos(heading_rad), np.sin(heading_rad)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    start_m = centre_m - 1.5 * radius_m * along + offset_m[:, None] * across
    slowest_m_s, fastest_m_s = scene.cell.striker["speed_range_m_s"]
    speed_m_s = rng.uniform(slowest_m_s, fastest_m_s, count)
    travel_m = rng.uniform(1.0, 2.0, count) * radius_m
    return np.column_stack([start_m, heading_rad, speed_m_s, travel_m])


_kept: dict[object, Any] = {}
"""What a process uses for every block: the pile by its files, the arrays by their length."""


def block(scene: str, properties: str, seed: int, number: int, count: int, threads: int | None) -> Counts:
    """Simulates one block and reduces it."""
    if (scene, properties) not in _kept:
        loaded = breakshot.load_scene(scene)
        world = breakshot.World(loaded, breakshot.load_properties(properties), uncertain=True)
        _kept[scene, properties] = loaded, world
    loaded, world = _kept[scene, properties]
    rng = np.random.default_rng([seed, number])
    numbers = strikes(loaded, rng, count)
    simulated = breakshot.Simulator().rollout(world, numbers, out=_kept.get(count), seed=int(rng.integers(2**63)), threads=threads)
    _kept[count] = simulated
    success = world.goal(simulated.poses, simulated.fallen)[0] >= 0.0
    intervals = np.minimum((numbers[:, 2] + np.pi) * (BINS / (2.0 * np.pi)), BINS - 1).astype(np.int64)
    counts = np.zeros((BINS + 1, 3), dtype=np.uint64)
    for column, values in enumerate((np.ones_like(intervals), success.astype(np.int64), simulated.impacts)):
        # Sums of integers below 2^53: exact.
        counts[:BINS, column] = np.bincount(intervals, weights=values, minlength=BINS).astype(np.uint64)
    # Bits of the poses, each multiplied by an odd number of its own; sums modulo 2^64.
    poses = simulated.poses.view(np.uint64).reshape(count, -1)
    counts[BINS] = [np.sum(poses * (2 * np.arange(poses.shape[1], dtype=np.uint64) + np.uint64(odd))) for odd in (1, 3, 5)]
    return counts


def on_cluster(address: str | None, tasks: Iterable[tuple[str, str, int, int, int, int | None]]) -> Iterator[Counts]:
    """The reduced blocks as they end; a task that is lost is run again."""
    ray: Any = importlib.import_module("ray")
    if not ray.is_initialized():
        ray.init(address=address, log_to_driver=False)
    task = ray.remote(max_retries=-1)(block)
    waiting = iter(tasks)
    running = []
    while True:
        most = TASKS_PER_CORE * max(1, int(ray.cluster_resources().get("CPU", 1)))
        for arguments in waiting:
            running.append(task.remote(*arguments))
            if len(running) >= most:
                break
        if not running:
            return
        [done, *_], running = ray.wait(running)
        yield ray.get(done)


def main() -> None:
    """Prints the success rate by heading."""
    parser = argparse.ArgumentParser(description="Random strikes on a pile, on all machines of a Ray cluster.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("properties", type=Path)
    parser.add_argument("--strikes", type=int, default=10_000_000)
    parser.add_argument("--block", type=int, default=BLOCK, help="strikes of a task; other blocks have other strikes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--address", help="the cluster; by default one of this machine alone")
    parser.add_argument("--local", action="store_true", help="this process, without Ray")
    options = parser.parse_args()
    if min(options.strikes, options.block) < 1:
        parser.error("--strikes, --block: needed: at least 1")
    scene, properties = str(options.scene.resolve()), str(options.properties.resolve())
    # A task has one core, this process all of them.
    threads = None if options.local else 1
    blocks = -(-options.strikes // options.block)
    numbered = ((number, min(options.block, options.strikes - number * options.block)) for number in range(blocks))
    tasks = ((scene, properties, options.seed, number, count, threads) for number, count in numbered)
    total = np.zeros((BINS + 1, 3), dtype=np.uint64)
    results = (block(*task) for task in tasks) if options.local else on_cluster(options.address, tasks)
    for done, counts in enumerate(results, 1):
        total += counts
        print(f"{done} of {blocks} blocks", file=sys.stderr, flush=True)
    for number, (count, success, impacts) in enumerate(total[:BINS].astype(float)):
        middle_deg = -180.0 + (number + 0.5) * 360.0 / BINS
        rate = success / count if count else np.nan
        print(f"heading {middle_deg:6.1f} deg: {rate:.4f} of {count:.0f} strikes succeed, {impacts / max(count, 1.0):.2f} impacts each")
    print("digest", " ".join(f"{part:016x}" for part in total[BINS]))


if __name__ == "__main__":
    main()
