"""Chance: the reference of all skills."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from ..cells import strike_through

PRIOR = {"friction": [0.05, 0.6], "striker_restitution": [0.05, 0.95], "restitution": [0.05, 0.95], "mass_ratio": [0.1, 10.0]}
"""What somebody who sees neither films nor tracks may assume: 95 % intervals."""


def answer(item: dict[str, Any]) -> Any:
    """Positions anywhere in the workspace after the first frame, draws from wide priors, a strike through a random object."""
    rng = np.random.default_rng(zlib.crc32(item["id"].encode()))
    if item["task"] == "see":
        low, high = np.array(item["cell"]["workspace"])
        frames = {name: rng.uniform(low, high, (item["frames"], 2)).tolist() for name in item["place"]}
        return {name: [item["place"][name][:2], *positions[1:]] for name, positions in frames.items()}
    if item["task"] == "learn":
        objects = list(item["cell"]["objects"])
        pairs = [f"{a}/{b}" for k, a in enumerate(objects) for b in objects[k + 1 :]]
        names = {"friction": objects, "striker_restitution": objects, "restitution": pairs, "mass_ratio": objects[1:]}
        return {kind: {name: _drawn(PRIOR[kind], rng) for name in names[kind]} for kind in PRIOR}
    if item["task"] == "predict":
        place = item["place"]
        pairs = [(a, b) for k, a in enumerate(sorted(place)) for b in sorted(place)[k + 1 :]]
        starts_m = {f"{a}/{b}": float(np.hypot(*np.subtract(place[a][:2], place[b][:2]))) for a, b in pairs}
        # Objects move apart rather than together, by less than half a metre.
        drawn = {pair: _drawn([start_m, start_m + 0.4], rng) for pair, start_m in starts_m.items()}
        return {pair: [0.9 * low, best, high] for pair, (low, best, high) in drawn.items()}
    return random_strike(item, rng)


def random_strike(item: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A strike that starts clear of all objects."""
    return strike_through(item["cell"], item["place"], rng)


def _drawn(interval: list[float], rng: np.random.Generator) -> list[float]:
    low, high = interval
    return [low, float(np.exp(rng.uniform(np.log(low), np.log(high)))), high]
