"""Items of the four tasks and their truth, made once for each split from its seeds."""

from __future__ import annotations

import json
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from . import cells, films
from .table import SETTLE_S, Table, final, goal_holds

TASKS = ("see", "learn", "predict", "plan")
SPLITS = {"dev": range(1, 9), "test": range(101, 117), "tiny": range(1, 2)}
"""Seeds of the cells.  `tiny` is the first cell of `dev`, for trying things out."""
FILMS, PILES = 2, 3
"""Films and piles of each cell."""
TRACK_HZ = 120.0
TRACK_STD_M = 1e-4
TRACK_STD_RAD = 2e-3
LEAST_PATH_M = 0.001
"""Displacement of every object of a track: a strike that misses is drawn again, up to so many times."""
MOST_DRAWS = 20
REPEATS = 5
"""Executions of a planned strike."""
SPEED_ERROR, HEADING_ERROR_RAD, POSITION_ERROR_M = 0.02, np.radians(0.5), 0.0005
"""Standard deviations of an execution."""
DATA_VERSION = 3


@dataclass(frozen=True)
class Split:
    """Items, which adapters are given, and the cells behind them, which they are not."""

    name: str
    items: list[dict[str, Any]]
    truth: dict[str, Any]
    cells: dict[int, dict[str, Any]]
    chance: dict[str, Any] = field(default_factory=dict)
    """Losses of chance by task, once they are known."""


def split(name: str, folder: str | Path | None = None) -> Split:
    """The items and the truth of a split; made on first use, in `folder` or a cache of the user."""
    if name not in SPLITS:
        raise ValueError(f"the split is `{name}`; needed: one of {', '.join(SPLITS)}")
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    root = Path(folder) if folder else cache / "scatterbench"
    with ProcessPoolExecutor(max_workers=os.cpu_count()) as pool:
        parts = list(pool.map(_cell_data, SPLITS[name], [root / f"v{DATA_VERSION}"] * len(SPLITS[name])))
    items = [item for part in parts for item in part["items"]]
    items.sort(key=lambda item: (TASKS.index(item["task"]), item["cell_seed"]))
    truth = {key: value for part in parts for key, value in part["truth"].items()}
    return Split(name, items, truth, dict(zip(SPLITS[name], (part["cell"] for part in parts), strict=True)))


def _cell_data(seed: int, root: Path) -> dict[str, Any]:
    """The data of one cell, from its file or made."""
    path = root / f"cell_{seed}.json"
    if path.exists():
        return _with_films(json.loads(path.read_text()), root)
    root.mkdir(parents=True, exist_ok=True)
    drawn = cells.cell(seed)
    made: dict[str, Any] = {"cell": drawn, "items": [], "truth": {}}
    for task, makers in {"see": [_see] * FILMS, "learn": [_learn], "predict": [_predict] * PILES, "plan": [_plan] * PILES}.items():
        for number, make in enumerate(makers):
            item = {"id": f"{task}-{seed}-{number}", "task": task, "cell_seed": seed, "cell": cells.known(drawn)}
            rng = np.random.default_rng([seed, 1 + TASKS.index(task), number])
            given, truth = make(drawn, rng, root / f"{item['id']}.y4m")
            made["items"].append(item | given)
            made["truth"][item["id"]] = truth
    unfinished = path.with_suffix(f".{os.getpid()}.part")
    unfinished.write_text(json.dumps(made))
    unfinished.replace(path)
    return _with_films(made, root)


def _with_films(made: dict[str, Any], root: Path) -> dict[str, Any]:
    """The data with the paths of its films, which are stored without their folder."""
    for item in made["items"]:
        if "film" in item:
            film = root / item["film"]
            if not film.exists():
                raise ValueError(f"{film} is not there; needed: the films beside the data; remove {root} to make both again")
            item["film"] = str(film)
    return made


def _see(drawn: dict[str, Any], rng: np.random.Generator, film: Path) -> tuple[dict[str, Any], Any]:
    """A film of one object that runs into another one; its truth are the positions in every frame."""
    names = [str(name) for name in rng.permutation(list(cells.OBJECTS))[:2]]
    place, strike = cells.learning_strike(drawn, names, rng)
    # Away from the middle, where a mirrored axis would not show.
    shift = np.where(rng.random(2) < 0.5, -1.0, 1.0) * rng.uniform([0.05, 0.06], [0.12, 0.1])
    place = {name: [*(np.array(pose[:2]) + shift).tolist(), pose[2]] for name, pose in place.items()}
    strike["start_m"] = (np.array(strike["start_m"]) + shift).tolist()
    table = Table(drawn, place, strike)
    motion = table.run(SETTLE_S)
    matrix = films.camera(rng)
    pictures = films.frames(drawn, names, matrix, motion, rng)
    films.write_y4m(film, pictures)
    times = np.arange(len(pictures)) / films.RATE_HZ
    positions = {
        name: np.stack([np.interp(times, motion[0], motion[1][:, k, axis]) for axis in (0, 1)], axis=1).tolist()
        for k, name in enumerate(names)
    }
    camera = {
        "image_size_px": list(films.SIZE_PX),
        "focal_px": [films.FOCAL_PX] * 2,
        "center_px": [(side - 1) / 2 for side in films.SIZE_PX],
        "points": films.reference_points(matrix, rng),
    }
    given = {"film": film.name, "frames": len(pictures), "rate_hz": films.RATE_HZ, "camera": camera}
    return given | {"place": place, "strike": strike}, positions


def _learn(drawn: dict[str, Any], rng: np.random.Generator, _: Path) -> tuple[dict[str, Any], Any]:
    """Tracks of two strikes on each object and two on each pair; the truth are the properties."""
    groups = [[name] for name in cells.OBJECTS] * 2
    groups += [list(pair) for pair in cells.pairs()] + [list(pair)[::-1] for pair in cells.pairs()]
    clips = []
    for names in groups:
        for _draw in range(MOST_DRAWS):
            place, strike = cells.learning_strike(drawn, names, rng)
            times, poses, _ = Table(drawn, place, strike, 1.0 + cells.FRICTION_VARIATION * float(rng.normal())).run(SETTLE_S)
            if np.linalg.norm(poses[-1, :, :2] - poses[0, :, :2], axis=1).min() >= LEAST_PATH_M:
                break
        at = np.arange(0.0, times[-1], 1.0 / TRACK_HZ)
        tracks = {}
        for k, name in enumerate(names):
            columns = [np.interp(at, times, np.unwrap(poses[:, k, axis]) if axis == 2 else poses[:, k, axis]) for axis in range(3)]
            noise = rng.normal(0.0, [TRACK_STD_M, TRACK_STD_M, TRACK_STD_RAD], (len(at), 3))
            tracks[name] = np.column_stack([at, np.stack(columns, axis=1) + noise]).round(7).tolist()
        clips.append({"objects": names, "strike": strike, "tracks": tracks})
    truth = drawn["truth"]
    return (
        {"clips": clips, "position_std_m": TRACK_STD_M},
        {key: truth[key] for key in ("friction", "striker_restitution", "restitution", "mass_ratio")},
    )


def _predict(drawn: dict[str, Any], rng: np.random.Generator, _: Path) -> tuple[dict[str, Any], Any]:
    """A pile and a strike; the truth are the final distances of all pairs."""
    place = cells.pile(drawn, list(cells.OBJECTS), rng)
    strike = cells.strike_through(drawn, place, rng)
    poses, _ = final(drawn, place, strike, 1.0 + cells.FRICTION_VARIATION * float(rng.normal()))
    at = dict(zip(place, poses[:, :2], strict=True))
    truth = {f"{a}/{b}": float(np.hypot(*(at[a] - at[b]))) for a, b in cells.pairs()}
    return {"place": place, "strike": strike, "properties": cells.measured_properties(drawn, rng)}, truth


def _plan(drawn: dict[str, Any], rng: np.random.Generator, _: Path) -> tuple[dict[str, Any], Any]:
    """A pile to be singulated by one strike; the truth is that strikes are carried out."""
    count = int(rng.integers(3, len(cells.OBJECTS) + 1))
    place = cells.pile(drawn, [str(name) for name in rng.permutation(list(cells.OBJECTS))[:count]], rng)
    return {"place": place, "goal": cells.GOAL, "properties": cells.measured_properties(drawn, rng)}, None


def executed(drawn: dict[str, Any], item: dict[str, Any], strike: dict[str, Any]) -> float:
    """The fraction of executions of a strike, each with errors of its own, that reach the goal."""
    successes = 0
    for repeat in range(REPEATS):
        rng = np.random.default_rng([item["cell_seed"], 9, int(item["id"].rsplit("-", 1)[1]), repeat])
        place = {}
        for name, (x, y, yaw) in item["place"].items():
            dx, dy = rng.normal(0.0, POSITION_ERROR_M, 2)
            place[name] = [x + float(dx), y + float(dy), yaw]
        done = strike | {
            "heading_rad": strike["heading_rad"] + float(rng.normal(0.0, HEADING_ERROR_RAD)),
            "speed_m_s": strike["speed_m_s"] * (1.0 + float(rng.normal(0.0, SPEED_ERROR))),
        }
        poses, upright = final(drawn, place, done, 1.0 + cells.FRICTION_VARIATION * float(rng.normal()))
        successes += upright and goal_holds(drawn, item["goal"], poses)
    return successes / REPEATS
