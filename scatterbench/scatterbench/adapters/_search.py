"""What engines without a planner or intervals of their own need: drawn properties, intervals of samples, random search."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .random import random_strike

DRAWS = 16
"""Simulations behind an interval."""
STRIKES = 60
"""Strikes that a search tries."""


def drawn_properties(properties: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Properties drawn from their standard errors; friction also from its variation."""
    kinds = [kind for kind, values in properties.items() if isinstance(values, dict)]
    drawn = {
        kind: {name: max(0.0, value["mean"] + value["standard_error"] * float(rng.normal())) for name, value in properties[kind].items()}
        for kind in kinds
    }
    scale = 1.0 + properties["friction_variation"] * float(rng.normal())
    drawn["friction"] = {name: scale * value for name, value in drawn["friction"].items()}
    return drawn


def means(properties: dict[str, Any]) -> dict[str, Any]:
    """Properties at their means."""
    return {kind: {name: v["mean"] for name, v in values.items()} for kind, values in properties.items() if isinstance(values, dict)}


def pair_distances(names: list[str], positions: np.ndarray) -> dict[str, float]:
    """Distance of every pair, by names in alphabetical order."""
    at = dict(zip(names, np.asarray(positions)[:, :2], strict=True))
    return {f"{a}/{b}": float(np.hypot(*(at[a] - at[b]))) for a in sorted(at) for b in sorted(at) if a < b}


def intervals(samples: list[dict[str, float]]) -> dict[str, list[float]]:
    """Median and 95 % interval of samples; few of them are taken as normal."""
    answer = {}
    for name in samples[0]:
        values = np.array([sample[name] for sample in samples])
        best, spread = float(np.median(values)), 2.0 * float(values.std(ddof=1)) + 0.002
        answer[name] = [best - spread, best, best + spread]
    return answer


def margin_m(item: dict[str, Any], positions: np.ndarray) -> float:
    """Slack of the tightest condition of the goal; fulfilled from 0 on."""
    goal, (low, high) = item["goal"], np.array(item["cell"]["workspace"])
    distances = np.array(list(pair_distances([str(k) for k in range(len(positions))], positions).values()))
    least, most = goal["mean_distance_m"]
    inside = np.minimum(positions[:, :2] - low, high - positions[:, :2]).min()
    return float(min(distances.min() - goal["min_distance_m"], distances.mean() - least, most - distances.mean(), inside))


def predicted(item: dict[str, Any], final: Callable[..., np.ndarray]) -> Any:
    """Distances from simulations with drawn properties."""
    rng = np.random.default_rng(1)
    runs = [final(item, item["strike"], drawn_properties(item["properties"], rng)) for _ in range(DRAWS)]
    return intervals([pair_distances(list(item["place"]), run) for run in runs])


def searched(item: dict[str, Any], final: Callable[..., np.ndarray]) -> Any:
    """The random strike with the widest margin at the means of the properties."""
    rng, properties = np.random.default_rng(2), means(item["properties"])
    strikes = [random_strike(item, rng) for _ in range(STRIKES)]
    return max(strikes, key=lambda strike: margin_m(item, final(item, strike, properties)))
