"""breakshot: `track`, `estimate`, rollouts in drawn scenarios, the robust planner."""

from __future__ import annotations

import json
import tempfile
import warnings
from pathlib import Path
from typing import Any

import breakshot
import numpy as np

UNMEASURED = [0.05, 0.5, 0.95]  # the restitution of a pair without a clean impact


def answer(item: dict[str, Any]) -> Any:
    """All four tasks."""
    with warnings.catch_warnings(action="ignore"):
        return {"see": _see, "learn": _learn, "predict": _predict, "plan": _plan}[item["task"]](item)


def _cell(item: dict[str, Any]) -> dict[str, Any]:
    (low, high), rod, speeds = (item["cell"][key] for key in ("workspace", "striker", "speed_range_m_s"))
    striker = {"shape": {"disc": {"radius_m": rod["radius_m"]}}, "height_m": rod["height_m"], "speed_range_m_s": speeds}
    return {"camera": {}, "workspace": {"min_m": low, "max_m": high}, "striker": striker}


def _objects(item: dict[str, Any]) -> list[dict[str, Any]]:
    known = {name: dict(one) for name, one in item["cell"]["objects"].items()}
    marker = {name: {"shape": {"disc": {"radius_m": one.pop("marker_radius_m")}}, "at_m": [0.0, 0.0]} for name, one in known.items()}
    return [{"name": name, "marker": marker[name]} | one for name, one in known.items()]


def _scene(item: dict[str, Any], cell: dict[str, Any]) -> breakshot.Scene:
    placed = [{"object": name, "position_m": pose[:2], "yaw_rad": pose[2]} for name, pose in item["place"].items()]
    fields = {"cell": cell, "objects": _objects(item), "placed": placed, "goal": item.get("goal", {})}
    return breakshot.Scene.from_json(json.dumps(fields | {"observed_unix_s": None, "walls": [], "keep_out": []}))


def _see(item: dict[str, Any]) -> Any:
    scene = _scene(item, _cell(item) | {"points": (camera := dict(item["camera"])).pop("points"), "camera": camera})
    tracks = breakshot.track(item["film"], scene.cell, _objects(item), list(item["place"]), scene=scene).to_numpy()
    frames: dict[str, list[Any]] = {name: [None] * item["frames"] for name in item["place"]}
    for name, row in ((name, row) for name, rows in tracks.items() for row in rows):
        frames[name][round(float(row["time_s"]) * item["rate_hz"])] = [float(row["x_m"]), float(row["y_m"])]
    return frames


def _learn(item: dict[str, Any]) -> Any:
    columns = {"object": "object", "time": "time_s", "x": "x_m", "y": "y_m", "yaw": "yaw_rad", "std_m": item["position_std_m"]}
    with tempfile.TemporaryDirectory() as folder:
        clips = []
        for k, clip in enumerate(item["clips"]):
            rows = [f"{name},{','.join(map(str, row))}" for name, track in clip["tracks"].items() for row in track]
            Path(folder, f"{k}.csv").write_text("\n".join(["object,time_s,x_m,y_m,yaw_rad", *rows]))
            clips.append({"tracks": f"{k}.csv", "objects": clip["objects"], "strike": clip["strike"]})
        campaign = {"cell": "cell.toml", "objects": "objects.toml", "columns": columns, "clips": clips}
        for name, fields in ("cell", _cell(item)), ("objects", {"objects": _objects(item)}), ("campaign", campaign):
            Path(folder, f"{name}.toml").write_text("\n".join(f"{key} = {_toml(value)}" for key, value in fields.items()))
        learned = breakshot.estimate(Path(folder, "campaign.toml"), reference="a")
    rows: dict[str, Any] = {"restitution": {f"{a}/{b}": UNMEASURED for a in learned.friction for b in learned.friction if a < b}}
    for kind in ("friction", "striker_restitution", "restitution", "mass_ratio"):
        for name, v in getattr(learned, kind).items():
            rows.setdefault(kind, {})[name] = [v.interval_95[0], v.mean, v.interval_95[1]]
    return rows | {"mass_ratio": {name: row for name, row in rows["mass_ratio"].items() if name != "a"}}


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    return f"[{', '.join(map(_toml, value))}]" if isinstance(value, (list, tuple)) else json.dumps(value)


def _properties(item: dict[str, Any]) -> breakshot.Properties:
    given = item["properties"]

    def value(one: dict[str, float], std: float = 0.0) -> dict[str, Any]:
        mean, error = one["mean"], one["standard_error"]
        return {"mean": mean, "std": std, "standard_error": error, "interval_95": [mean - 2 * error, mean + 2 * error], "n": 1}

    kinds = [kind for kind in given if kind.endswith(("restitution", "contact_friction"))]
    fields: dict[str, Any] = {kind: {name: value(one) for name, one in given[kind].items()} for kind in kinds}
    fields["friction"] = {name: value(one, given["friction_variation"] * one["mean"]) for name, one in given["friction"].items()}
    ratios = {name: {key: part / given["mass_kg"]["a"]["mean"] for key, part in one.items()} for name, one in given["mass_kg"].items()}
    fields["mass_ratio"] = {name: value(one) for name, one in ratios.items()}
    return breakshot.Properties.from_json(json.dumps(fields | {"version": 1, "reference": "a", "pair_mass_ratio": {}}))


def _predict(item: dict[str, Any]) -> Any:
    world = breakshot.World(_scene(item, _cell(item)), _properties(item), uncertain=True)
    rollouts = breakshot.Simulator().rollout(world, [breakshot.Strike(**item["strike"])] * 1000, seed=1, threads=1)
    at = dict(zip(world.names, rollouts.poses[..., :2].transpose(1, 0, 2), strict=True))
    pairs = {f"{a}/{b}": np.linalg.norm(at[a] - at[b], axis=1) for a in sorted(at) for b in sorted(at) if a < b}
    return {pair: np.quantile(values, [0.025, 0.5, 0.975]).tolist() for pair, values in pairs.items()}


def _plan(item: dict[str, Any]) -> Any:
    strike = breakshot.plan(_scene(item, _cell(item)), _properties(item), seed=1).strike
    return strike and {key: v for key, v in json.loads(strike.to_json()).items() if key != "object"}
