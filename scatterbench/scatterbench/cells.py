"""Drawn cells: objects, their true properties, piles, and strikes, each from a seed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .table import PAIR_OFFSET_M, STRIKE_OFFSET_M, measured_restitution, placed_outline

OBJECTS = "abcd"
WORKSPACE_M = [[-0.48, -0.3], [0.48, 0.3]]
STRIKER = {"radius_m": 0.015, "height_m": 0.06}
SPEED_RANGE_M_S = [0.05, 1.0]
GOAL = {"min_distance_m": 0.09, "mean_distance_m": [0.15, 0.9]}
RUN_UP_M = 0.03
"""Distance from a pile at which strikes start."""
PROPERTY_ERROR = 0.03
"""Relative standard error of given properties."""
CONTACT_ERROR = 0.03
"""Standard error of given contact friction."""
FRICTION_VARIATION = 0.03
"""Relative standard deviation of friction from strike to strike."""


def _shape(rng: np.random.Generator) -> dict[str, Any]:
    """A disc (half of them), a rectangle or a regular polygon."""
    kind, radius_m = rng.random(), float(rng.uniform(0.024, 0.04))
    if kind < 0.5:
        return {"disc": {"radius_m": round(radius_m, 4)}}
    if kind < 0.75:
        corner = rng.uniform(0.6, 0.9) * math.pi / 4.0
        x, y = radius_m * math.cos(corner), radius_m * math.sin(corner)
        return {"polygon": {"points_m": [[-x, -y], [x, -y], [x, y], [-x, y]]}}
    corners = int(rng.integers(3, 7))
    angles = 2.0 * np.pi * np.arange(corners) / corners
    return {"polygon": {"points_m": (radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)).tolist()}}


def _area_m2(shape: dict[str, Any]) -> float:
    if "disc" in shape:
        return math.pi * float(shape["disc"]["radius_m"]) ** 2
    x, y = np.array(shape["polygon"]["points_m"]).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def cell(seed: int) -> dict[str, Any]:
    """A cell: what its user knows, and under `truth` what nobody does."""
    rng = np.random.default_rng([seed, 0])
    objects, truth = {}, {"mass_kg": {}, "friction": {}, "nominal_restitution": {}}
    for name in OBJECTS:
        shape, height_m = _shape(rng), round(float(rng.uniform(0.018, 0.03)), 4)
        objects[name] = {"shape": shape, "height_m": height_m, "marker_radius_m": 0.008}
        truth["mass_kg"][name] = float(rng.uniform(500.0, 1500.0)) * _area_m2(shape) * height_m
        truth["friction"][name] = float(rng.uniform(0.2, 0.4))
    for a, b in pairs():
        truth["nominal_restitution"][f"{a}/{b}"] = float(rng.uniform(0.4, 0.8))
    for name in OBJECTS:
        truth["nominal_restitution"]["striker/" + name] = float(rng.uniform(0.4, 0.8))
    truth["contact_friction"] = {"objects": float(rng.uniform(0.05, 0.2)), "striker": float(rng.uniform(0.05, 0.2))}
    made = {"workspace": WORKSPACE_M, "striker": STRIKER, "speed_range_m_s": SPEED_RANGE_M_S, "objects": objects, "truth": truth}
    truth["restitution"] = {f"{a}/{b}": measured_restitution(made, a, b) for a, b in pairs()}
    truth["striker_restitution"] = {name: measured_restitution(made, "striker", name) for name in OBJECTS}
    truth["mass_ratio"] = {name: truth["mass_kg"][name] / truth["mass_kg"][OBJECTS[0]] for name in OBJECTS[1:]}
    return made


def pairs() -> list[tuple[str, str]]:
    """All pairs of objects."""
    return [(a, b) for k, a in enumerate(OBJECTS) for b in OBJECTS[k + 1 :]]


def known(drawn: dict[str, Any]) -> dict[str, Any]:
    """The part of a cell that its user knows."""
    return {key: value for key, value in drawn.items() if key != "truth"}


def measured_properties(drawn: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Properties as a careful user would have measured them: a value and its standard error each."""

    def near(value: float, most: float = math.inf) -> dict[str, float]:
        mean = min(value * (1.0 + PROPERTY_ERROR * float(rng.normal())), most)
        return {"mean": mean, "standard_error": PROPERTY_ERROR * mean}

    truth = drawn["truth"]
    contact = {kind: max(0.0, mu + CONTACT_ERROR * float(rng.normal())) for kind, mu in truth["contact_friction"].items()}
    return {
        "friction": {name: near(value) for name, value in truth["friction"].items()},
        "friction_variation": FRICTION_VARIATION,
        "striker_restitution": {name: near(value, 1.0) for name, value in truth["striker_restitution"].items()},
        "restitution": {pair: near(value, 1.0) for pair, value in truth["restitution"].items()},
        "mass_kg": {name: near(value) for name, value in truth["mass_kg"].items()},
        "contact_friction": {kind: {"mean": mean, "standard_error": CONTACT_ERROR} for kind, mean in contact.items()},
    }


def overlap(p: np.ndarray, q: np.ndarray) -> bool:
    """Whether two convex outlines overlap (separating axes)."""
    for a, b in ((p, q), (q, p)):
        sides = np.roll(a, -1, axis=0) - a
        normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1)
        if any(((b - corner) @ normal).min() >= 0.0 for corner, normal in zip(a, normals, strict=True)):
            return False
    return True


def pile(drawn: dict[str, Any], names: list[str], rng: np.random.Generator) -> dict[str, Any]:
    """Objects that nearly touch: each slides towards the others from a random side, to a gap of 0.5 to 4 mm."""
    shapes = {name: drawn["objects"][name]["shape"] for name in names}
    place: dict[str, Any] = {}
    for name in names:
        yaw_rad = float(rng.uniform(-math.pi, math.pi))
        centre = np.mean([pose[:2] for pose in place.values()], axis=0) if place else rng.uniform(-0.03, 0.03, 2)
        side_rad = rng.uniform(-math.pi, math.pi)
        side, distance_m = np.array([math.cos(side_rad), math.sin(side_rad)]), 0.25 if place else 0.0
        others = [placed_outline(shapes[other], pose) for other, pose in place.items()]
        while others and distance_m > 0.0:
            own = placed_outline(shapes[name], [*(centre + distance_m * side), yaw_rad])
            if any(overlap(own, other) for other in others):
                break
            distance_m -= 0.0005
        gap_m = 0.0005 + rng.uniform(0.0005, 0.004) if others else 0.0
        place[name] = [*(centre + (distance_m + gap_m) * side).tolist(), yaw_rad]
    return place


def strike_through(drawn: dict[str, Any], place: dict[str, Any], rng: np.random.Generator, target: str | None = None) -> dict[str, Any]:
    """A strike from a random side at a random object, that starts clear of the pile and ends somewhere in it."""
    names = list(place)
    centre = np.array(place[target or names[int(rng.integers(len(names)))]][:2])
    heading_rad = float(rng.uniform(-math.pi, math.pi))
    along = np.array([math.cos(heading_rad), math.sin(heading_rad)])
    points = np.concatenate([placed_outline(drawn["objects"][name]["shape"], pose) for name, pose in place.items()])
    offset = float(rng.uniform(-0.015, 0.015)) * np.array([-along[1], along[0]])
    reach = (points - centre) @ along
    start = centre + offset + along * (reach.min() - drawn["striker"]["radius_m"] - RUN_UP_M)
    travel_m = RUN_UP_M + float(rng.uniform(0.2, 1.0)) * float(reach.max() - reach.min())
    return {"start_m": start.tolist(), "heading_rad": heading_rad, "speed_m_s": float(rng.uniform(0.3, 1.0)), "travel_m": travel_m}


def learning_strike(drawn: dict[str, Any], names: list[str], rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    """One object, or one that runs into another one, and a strike along a random heading near the middle of the first."""
    heading_rad = float(rng.uniform(-math.pi, math.pi))
    along = np.array([math.cos(heading_rad), math.sin(heading_rad)])
    across = np.array([-along[1], along[0]])
    first = drawn["objects"][names[0]]["shape"]
    place = {names[0]: [0.0, 0.0, float(rng.uniform(-math.pi, math.pi))]}
    ends = (placed_outline(first, place[names[0]]) @ along).min(), (placed_outline(first, place[names[0]]) @ along).max()
    if len(names) > 1:
        second = placed_outline(drawn["objects"][names[1]]["shape"], [0.0, 0.0, yaw := float(rng.uniform(-math.pi, math.pi))])
        distance_m = ends[1] - (second @ along).min() + float(rng.uniform(0.03, 0.05))
        place[names[1]] = [*(distance_m * along + float(rng.uniform(-PAIR_OFFSET_M, PAIR_OFFSET_M)) * across).tolist(), yaw]
    start = (ends[0] - drawn["striker"]["radius_m"] - RUN_UP_M) * along + float(rng.uniform(-STRIKE_OFFSET_M, STRIKE_OFFSET_M)) * across
    middle = -np.mean([pose[:2] for pose in place.values()], axis=0)
    place = {name: [*(np.array(pose[:2]) + middle).tolist(), pose[2]] for name, pose in place.items()}
    strike = {"start_m": (start + middle).tolist(), "heading_rad": heading_rad, "speed_m_s": float(rng.uniform(0.3, 0.6))}
    return place, strike | {"travel_m": RUN_UP_M + 0.012}
