"""Scenes and properties that several tests use."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import breakshot

DEMO = Path(__file__).resolve().parents[3] / "fixtures" / "demo"


def estimate(mean: float, error: float = 0.0) -> dict[str, object]:
    """A property with this standard error."""
    return {"mean": mean, "std": 0.0, "standard_error": error, "interval_95": [mean - 2 * error, mean + 2 * error], "n": 9}


def discs(
    radii_m: list[float], positions_m: list[tuple[float, float]], error: float = 0.01
) -> tuple[breakshot.Scene, breakshot.Properties]:
    """Discs on a table, and their properties with this standard error."""
    names = "abcdefgh"[: len(radii_m)]
    cell = {
        "version": 1,
        "camera": {},
        "scale_px_per_m": 1000.0,
        "workspace": {"min_m": [-1.0, -1.0], "max_m": [1.0, 1.0]},
        "striker": {"shape": {"disc": {"radius_m": 0.015}}, "height_m": 0.1, "speed_range_m_s": [0.05, 1.0]},
    }
    scene = {
        "cell": cell,
        "objects": [{"name": n, "shape": {"disc": {"radius_m": r}}, "height_m": 0.03} for n, r in zip(names, radii_m, strict=True)],
        "observed_unix_s": None,
        "placed": [{"object": n, "position_m": p, "yaw_rad": 0.0} for n, p in zip(names, positions_m, strict=True)],
        "walls": [],
        "keep_out": [],
        "goal": {},
    }
    pairs = [f"{a}/{b}" for a in names for b in names if a < b]
    properties = {
        "version": 1,
        "reference": "a",
        "friction": {n: estimate(0.25 + 0.05 * k, error) for k, n in enumerate(names)},
        "striker_restitution": {n: estimate(0.6, error) for n in names},
        "restitution": {pair: estimate(0.5, error) for pair in pairs},
        "mass_ratio": {n: estimate(0.8**k, error if k else 0.0) for k, n in enumerate(names)},
        "pair_mass_ratio": {},
        "contact_friction": {"objects": estimate(0.1), "striker": estimate(0.1)},
    }
    return value(breakshot.Scene, scene), value(breakshot.Properties, properties)


def value(kind, fields):
    """A value of nested dictionaries and lists."""
    return kind.from_json(json.dumps(fields))


@pytest.fixture(scope="session")
def pile() -> tuple[breakshot.Scene, breakshot.Properties]:
    """Four discs side by side."""
    return discs([0.05, 0.045, 0.038, 0.03], [(0.0, 0.0), (0.09, 0.04), (0.08, -0.05), (0.16, 0.0)])


@pytest.fixture(scope="session")
def world(pile) -> breakshot.World:
    return breakshot.World(*pile)


@pytest.fixture(scope="session")
def uncertain_world(pile) -> breakshot.World:
    return breakshot.World(*pile, uncertain=True)


@pytest.fixture(scope="session")
def demo_scene() -> breakshot.Scene:
    return breakshot.load_scene(DEMO / "pile.scene.toml")


@pytest.fixture(scope="session")
def demo_properties() -> breakshot.Properties:
    return breakshot.estimate(DEMO / "campaign.toml")


@pytest.fixture(scope="session")
def program() -> str:
    """The command line of the same sources."""
    path = os.environ.get("BREAKSHOT_PROGRAM")
    if path is None:
        pytest.skip("BREAKSHOT_PROGRAM names no program to compare with; `cargo xtask python` sets it")
    return path
