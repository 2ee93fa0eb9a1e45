"""Random piles of known objects."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import numpy as np

import breakshot

LEAST_GAP_M = 0.001
MOST_GAP_M = 0.006
_MOST_TRIALS = 1000


def example() -> tuple[breakshot.Scene, breakshot.Properties]:
    """The scene and the learned properties of the example in the repository: three objects."""
    text = (resources.files(__package__) / "example.json").read_text()
    parts = json.loads(text)
    scene = breakshot.Scene.from_json(json.dumps(parts["scene"]))
    return scene, breakshot.Properties.from_json(json.dumps(parts["properties"]))


def outer_radius_m(shape: Any) -> float:
    """The distance from the centroid of a shape to its farthest point (m)."""
    if "disc" in shape:
        return float(shape["disc"]["radius_m"])
    if "rectangle" in shape:
        return float(0.5 * np.hypot(*shape["rectangle"]["size_m"]))
    return float(np.linalg.norm(shape["polygon"]["points_m"], axis=-1).max())


def shapes_of(scene: breakshot.Scene, names: list[str]) -> list[Any]:
    """The shape of each object, by name; `a#2` is a second `a`."""
    known = {entry["name"]: entry["shape"] for entry in scene.objects}
    return [known[name.split("#")[0]] for name in names]


def names_of(scene: breakshot.Scene, count: int) -> list[str]:
    """So many objects of a scene: each kind once, then second copies, and so on."""
    kinds = [entry["name"] for entry in scene.objects]
    copies = [f"#{k // len(kinds) + 1}" if k >= len(kinds) else "" for k in range(count)]
    return [kinds[k % len(kinds)] + copy for k, copy in enumerate(copies)]


def random_pile(scene: breakshot.Scene, names: list[str], rng: np.random.Generator) -> breakshot.Scene:
    """The scene with these objects side by side about the middle of the workspace, in a random arrangement.

    Gaps between the circles about neighbours are 1 to 6 mm.
    """
    radii_m = [outer_radius_m(shape) for shape in shapes_of(scene, names)]
    order = rng.permutation(len(names))
    positions_m = np.full((len(names), 2), np.nan)
    for rank, k in enumerate(order):
        positions_m[k] = _beside(positions_m, radii_m, order[:rank], k, rng)
    low, high = (np.array(scene.cell.workspace[end]) for end in ("min_m", "max_m"))
    positions_m += 0.5 * (low + high) + rng.uniform(-0.1, 0.1, 2) * (high - low) - positions_m.mean(axis=0)
    yaws_rad = rng.uniform(-np.pi, np.pi, len(names))
    placed = [
        {"object": name, "position_m": position_m, "yaw_rad": yaw_rad}
        for name, position_m, yaw_rad in zip(names, positions_m, yaws_rad, strict=True)
    ]
    return scene.replace(placed=placed, observed_unix_s=None)


def _beside(
    positions_m: np.ndarray[Any, Any],
    radii_m: list[float],
    others: np.ndarray[Any, Any],
    k: int,
    rng: np.random.Generator,
) -> np.ndarray[Any, Any]:
    """A position beside one of the other objects and clear of all."""
    if len(others) == 0:
        return np.zeros(2)
    reach_m = np.array([radii_m[other] + radii_m[k] for other in others])
    for _ in range(_MOST_TRIALS):
        neighbour = rng.integers(len(others))
        angle_rad = rng.uniform(0.0, 2.0 * np.pi)
        distance_m = reach_m[neighbour] + rng.uniform(LEAST_GAP_M, MOST_GAP_M)
        at_m = positions_m[others[neighbour]] + distance_m * np.array([np.cos(angle_rad), np.sin(angle_rad)])
        if (np.linalg.norm(positions_m[others] - at_m, axis=1) >= reach_m + LEAST_GAP_M).all():
            return np.asarray(at_m)
    raise breakshot.Error(f"random_pile: no room beside {len(others)} objects; needed: fewer objects")
