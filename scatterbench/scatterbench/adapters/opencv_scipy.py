"""What a student writes in an afternoon: OpenCV for markers and camera pose, SciPy for smoothing and fits."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from scipy.signal import savgol_filter
from scipy.stats import t as student
from scipy.stats import theilslopes

from ..films import read_y4m

DARK = 90
"""Grey level below which a pixel belongs to a marker."""
WINDOW, SLIDE_SAMPLES, MOVING_M_S = 7, 10, 0.03
OBLIQUE = 0.1  # impacts after which the last object leaves at a larger slope to the strike are not used


def answer(item: dict[str, Any]) -> Any:
    """Positions and properties; there is neither a simulator nor a planner in these libraries."""
    return {"see": _see, "learn": _learn}.get(item["task"], lambda _: None)(item)


def _see(item: dict[str, Any]) -> Any:
    camera, objects = item["camera"], item["cell"]["objects"]
    matrix = np.column_stack([np.diag([*camera["focal_px"], 1.0])[:, :2], [*camera["center_px"], 1.0]])
    table = np.array([[*point["table_m"], 0.0] for point in camera["points"]])
    pixels = np.array([point["image_px"] for point in camera["points"]])
    _, turn, shift = cv2.solvePnP(table, pixels, matrix, None)
    turn = cv2.Rodrigues(turn)[0]
    last = {name: np.array(pose[:2]) for name, pose in item["place"].items()}
    frames: dict[str, list[Any]] = {name: [] for name in last}
    for picture in read_y4m(item["film"]):
        count, labels, sizes, _ = cv2.connectedComponentsWithStats((picture < DARK).astype(np.uint8))
        blobs = [np.argwhere(labels == k)[:, ::-1] for k in range(1, count) if 30 <= sizes[k, cv2.CC_STAT_AREA] <= 400]
        found = [np.average(blob, axis=0, weights=np.maximum(150.0 - picture[blob[:, 1], blob[:, 0]], 1.0)) for blob in blobs]
        for name, before in last.items():
            to_plane = np.linalg.inv(matrix @ np.column_stack([turn[:, :2], turn[:, 2] * objects[name]["height_m"] + shift[:, 0]]))
            at = [(to_plane @ [*pixel, 1.0])[:2] / (to_plane @ [*pixel, 1.0])[2] for pixel in found]
            nearest = min(at, key=lambda point: np.linalg.norm(point - before), default=None)
            is_near = nearest is not None and np.linalg.norm(nearest - before) < 0.03
            last[name] = nearest if is_near else before
            frames[name].append(nearest.tolist() if is_near else None)
    return frames


def _learn(item: dict[str, Any]) -> Any:
    found: dict[str, dict[str, list[float]]] = {kind: {} for kind in ("friction", "striker_restitution", "restitution", "mass_ratio")}
    for clip in item["clips"]:
        names, strike = clip["objects"], clip["strike"]
        along = np.array([np.cos(strike["heading_rad"]), np.sin(strike["heading_rad"])])
        rows = [np.array(clip["tracks"][name]) for name in names]
        motions = [(row[:, 0], savgol_filter(row[:, 1:3] @ along, WINDOW, 2, deriv=1, delta=row[1, 0] - row[0, 0])) for row in rows]
        for name, (times, speed) in zip(names, motions, strict=True):
            sliding = np.arange(int(np.argmax(speed)) + WINDOW, len(speed))
            sliding = sliding[speed[sliding] > MOVING_M_S]
            if len(sliding) >= SLIDE_SAMPLES and name == names[-1]:
                found["friction"].setdefault(name, []).append(-theilslopes(speed[sliding], times[sliding])[0] / 9.81)
        hit = [int(np.argmax(np.gradient(speed))) for _, speed in motions]
        went = rows[-1][-1, 1:3] - rows[-1][0, 1:3]
        if abs(went[0] * along[1] - went[1] * along[0]) > OBLIQUE * abs(went @ along):
            continue
        if len(names) == 1:
            found["striker_restitution"].setdefault(names[0], []).append(_at(motions[0], hit[0], 1) / strike["speed_m_s"] - 1.0)
            continue
        (before, after), pushed = (_at(motions[0], hit[1], side) for side in (-1, 1)), _at(motions[1], hit[1], 1)
        if min(before, before - after, pushed) > MOVING_M_S:
            pair, ratio = "/".join(sorted(names)), float(np.log((before - after) / pushed))
            found["restitution"].setdefault(pair, []).append((pushed - after) / before)
            found["mass_ratio"].setdefault(pair, []).append(ratio if names[0] < names[1] else -ratio)
    objects = list(item["cell"]["objects"])
    pairs = [f"{a}/{b}" for k, a in enumerate(objects) for b in objects[k + 1 :]]
    masses = {name: _interval(found["mass_ratio"].get(f"a/{name}", []), 0.0, 1.0) for name in objects[1:]}
    properties = {"mass_ratio": {name: np.exp(interval).tolist() for name, interval in masses.items()}}
    priors = {"friction": (objects, 0.3, 0.1), "striker_restitution": (objects, 0.5, 0.2), "restitution": (pairs, 0.5, 0.2)}
    for kind, (keys, prior, spread) in priors.items():
        ends = {key: _interval(found[kind].get(key, []), prior, spread) for key in keys}
        properties[kind] = {key: np.clip(interval, 0.01, 1.0).tolist() for key, interval in ends.items()}
    return properties


def _at(motion: tuple[np.ndarray, np.ndarray], hit: int, side: int) -> float:
    """The velocity just before (-1) or after (1) an impact, on the line through the samples beyond the reach of the filter."""
    times, speed = motion
    away = hit + side * np.arange(WINDOW // 2 + 1, WINDOW // 2 + 6)
    away = away[(away >= 0) & (away < len(speed))]
    away = away[speed[away] > MOVING_M_S]
    return 0.0 if len(away) < 2 else float(np.polyval(np.polyfit(times[away] - times[hit], speed[away], 1), 0.0))


def _interval(values: list[float], prior: float, spread: float) -> list[float]:
    """Mean and 95 % interval of few measurements, whose common error is half of the prior's spread: impacts are not central."""
    if not values:
        return [prior - 2.0 * spread, prior, prior + 2.0 * spread]
    mean, std = float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else spread
    half = float(np.hypot(std / np.sqrt(len(values)) * student.ppf(0.975, max(len(values) - 1, 2)), spread))
    return [mean - half, mean, mean + half]
