"""Classical mistakes, one in each task, that the score has to find; see `scatterbench/README.md`."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np

from ..films import read_y4m
from . import random


def answer(item: dict[str, Any]) -> Any:
    """The mirrored table, the wrong frame rate, an overconfident forecast, degrees for radians."""
    return {"see": _mirrored, "learn": _slow_motion, "predict": _overconfident, "plan": _degrees}[item["task"]](item)


def _mirrored(item: dict[str, Any]) -> Any:
    """Rows of the picture, which grow downwards, are taken as y: here the starts, seen in a picture, turned over."""
    count = len(read_y4m(item["film"]))
    return {name: [[pose[0], -pose[1]]] * count for name, pose in item["place"].items()}


def _slow_motion(item: dict[str, Any]) -> Any:
    """Times are taken as twice as long, which makes friction a quarter; the rest is chance.  The intervals are narrow all the same."""
    answered = copy.deepcopy(random.answer(item))
    friction = {name: 0.25 * _deceleration(item, name) / 9.81 for name in item["cell"]["objects"]}
    answered["friction"] = {name: [0.99 * value, value, 1.01 * value] for name, value in friction.items()}
    for kind in ("striker_restitution", "restitution", "mass_ratio"):
        answered[kind] = {name: [0.99 * best, best, 1.01 * best] for name, (_, best, _) in answered[kind].items()}
    return answered


def _deceleration(item: dict[str, Any], name: str) -> float:
    """From the path after the largest speed, in one clip (m/s^2)."""
    rows = np.array(next(clip["tracks"][name] for clip in item["clips"] if clip["objects"] == [name]))
    speed_m_s = np.hypot(*np.diff(rows[::4, 1:3], axis=0).T) / np.diff(rows[::4, 0])
    first = int(np.argmax(speed_m_s))
    path_m = math.dist(rows[4 * first, 1:3], rows[-1, 1:3])
    return float(speed_m_s[first] ** 2 / (2.0 * max(path_m, 1e-3)))


def _overconfident(item: dict[str, Any]) -> Any:
    """Nothing moves, and that is certain to a millimetre."""
    place = {name: np.array(pose[:2]) for name, pose in item["place"].items()}
    pairs = [(a, b) for k, a in enumerate(sorted(place)) for b in sorted(place)[k + 1 :]]
    starts_m = {f"{a}/{b}": float(np.hypot(*(place[a] - place[b]))) for a, b in pairs}
    return {pair: [start_m - 0.001, start_m, start_m + 0.001] for pair, start_m in starts_m.items()}


def _degrees(item: dict[str, Any]) -> Any:
    """The heading in degrees."""
    strike = random.answer(item)
    return strike | {"heading_rad": math.degrees(strike["heading_rad"])}
